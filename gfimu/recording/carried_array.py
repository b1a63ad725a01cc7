"""The array that a recording carries in its metadata: its whole geometry, so that no file is needed to read it.

``array_toml`` holds the text of the array file, ``parts_toml`` the texts of part files that are not in
``models/parts``. Recordings made before that carry the array's name alone, under ``array``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError, warn
from gfimu.base.files.model_files import list_models, parse_toml
from gfimu.recording.quantities import READING_UNITS

__all__ = [
    "array_difference",
    "array_metadata",
    "carried_array",
    "check_all_channels",
    "warn_of_other_array",
    "with_carried_array",
]

_SAME_PLACE = 1e-9  # m: far below what can be measured, far above rounding
_SAME_AXIS = 1e-9  # largest difference of a unit vector's component
_USUAL_CHANNEL = re.compile(r"a[0-9]{2}")
_LONGEST_REASON = 160


def array_metadata(array: AccelerometerArray) -> dict[str, Any]:
    """Return the metadata by which a recording carries its array: name, text of the array file, own part files."""
    metadata: dict[str, Any] = {"array": array.name, "array_toml": array.to_toml()}
    used = {chip.part: array.part_files[chip.part] for chip in array.chips if chip.part in array.part_files}
    return metadata | ({"parts_toml": used} if used else {})


def carried_array(
    metadata: Mapping[str, Any], *, source: str | Path = "the recording", beside: Path | None = None
) -> AccelerometerArray | None:
    """Return the array that a recording carries or, as older ones do, only names; None if it does neither.

    Parameters
    ----------
    metadata : mapping
        Metadata of the recording. Where its text and its name disagree, the text holds.
    source : str or Path
        The recording, for messages.
    beside : Path, optional
        Folder in which a file that is only named is looked for first.

    Raises
    ------
    InputError
        If the text is damaged, or the name is unknown; the message says how to go on.
    """
    text = metadata.get("array_toml")
    if text is not None:
        try:
            array = AccelerometerArray.from_dict(parse_toml(text, "array"), source="array")
        except (TypeError, ValueError, AttributeError) as error:
            raise _damaged(source, "array_toml", str(error)) from None
        parts = metadata.get("parts_toml") or {}
        if not isinstance(parts, Mapping) or not all(isinstance(part, str) for part in parts.values()):
            raise _damaged(source, "parts_toml", "not texts by the name of a part")
        return replace(array, part_files=dict(parts))
    name = metadata.get("array")
    if not isinstance(name, str):
        return None
    try:
        return AccelerometerArray.load(name, beside=beside)
    except InputError as error:
        raise InputError(f"{source}: names its array only, and {error}; or give it with --array") from None


def with_carried_array(metadata: Mapping[str, Any], channels: Iterable[str]) -> Mapping[str, Any]:
    """Return metadata that carry the array where they named only one of ``models/arrays`` with these channels."""
    name = metadata.get("array")
    if "array_toml" in metadata or not isinstance(name, str) or name not in list_models("arrays"):
        return metadata
    array = AccelerometerArray.load(name)
    return {**metadata, **array_metadata(array)} if set(array.channels) <= set(channels) else metadata


def check_all_channels(columns: Iterable[str], array: AccelerometerArray, source: str | Path) -> None:
    """Raise `InputError` for columns of readings that a recording's own array does not have."""
    stems = {chip.name for chip in array.chips}
    strangers = []
    for column in columns:
        unit = next((unit for unit in READING_UNITS if column.endswith(f"_{unit}")), None)
        channel = column.removesuffix(f"_{unit}")
        usual = _USUAL_CHANNEL.fullmatch(channel) or channel[:-1] in stems
        if usual and unit is not None and channel not in array.channels:
            strangers.append(column)
    if strangers:
        raise InputError(
            f"{source}: column {', '.join(strangers)} is no channel of the recording's own array {array.name!r}; "
            "give the array that has it with --array, or leave the column out"
        )


def array_difference(one: AccelerometerArray, other: AccelerometerArray) -> str:
    """Say in a few words what differs between the geometries of two arrays; empty if nothing does."""
    if one.channels != other.channels:
        apart = sorted(set(one.channels) ^ set(other.channels))
        return f"channels {', '.join(apart)} are in one only" if apart else "order of the channels"
    found = []
    distance = float(np.linalg.norm(one.positions - other.positions, axis=1).max())
    if distance > _SAME_PLACE:
        found.append(f"positions by up to {1e3 * distance:.3g} mm")
    if float(np.abs(one.axes - other.axes).max()) > _SAME_AXIS:
        chord = float(np.linalg.norm(one.axes - other.axes, axis=1).max())
        found.append(f"axes by up to {np.degrees(2 * np.arcsin(min(chord / 2, 1.0))):.3g}°")
    return ", ".join(found)


def warn_of_other_array(
    metadata: Mapping[str, Any], used: AccelerometerArray, name: str, *, whose: str = "the twin's"
) -> None:
    """Warn in one line where a recording carries another geometry than the one it is compared with."""
    try:
        own = carried_array(metadata, source=name)
    except InputError as error:
        if "array_toml" in metadata:
            text = str(error).partition(";")[0]
            warn(f"{text}; {whose} array {used.name!r} is used")
        return
    difference = "" if own is None else array_difference(own, used)
    if own is not None and difference:
        warn(f"{name}: recorded with array {own.name!r}, but {whose} {used.name!r} is used; they differ: {difference}")


def _damaged(source: str | Path, key: str, reason: str) -> InputError:
    short = " ".join(reason.split())[:_LONGEST_REASON]
    return InputError(f"{source}: metadata {key} is damaged ({short}); give the array with --array")
