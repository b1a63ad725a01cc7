"""The other ways to read a file: another unit of time or readings, order or sign of its columns, another array."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.files.model_files import list_models
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.recording.evidence.rigid import Evidence, Otherwise

__all__ = ["TIME_UNITS", "both_ways", "time_text", "unit_remedy", "ways_to_read"]

_ORDER = ("time", "unit", "chip_unit", "sign", "exchange", "array")

TIME_UNITS = {1e-3: "milliseconds", 1e-6: "microseconds"}
"""Units that a column of seconds may be in by mistake, by their size in s."""


def time_text(unit: str, factor: float, reason: str) -> str:
    """Say in which unit of time a column is, why, and what to do."""
    return f"column t_s is in {unit}: {reason}; multiply it by {factor:g}"


def unit_remedy(unit_from: str, unit: str, columns: str, *, some: bool = False) -> str:
    """Return how to state another unit of readings, where it was stated first; empty if it can't be stated there.

    Parameters
    ----------
    unit_from : str
        Which argument stated it; empty for the names of the columns (`gfimu.Recording`).
    unit : {"g", "mg", "lsb"}
        The unit.
    columns : str
        The columns by the names that they need.
    some : bool
        Whether other readings keep their unit.
    """
    if unit_from == "column_map":
        where = f"for {columns.replace(f'_{unit}', '')} " if some else ""
        return f'set unit = "{unit}" {where}in the column map' if unit != "lsb" else ""
    if unit_from == "unit":
        fits = not some and unit != "lsb"  # one unit for all, and counts stay counts
        return f'give unit="{unit}" to gfimu.Recording.from_arrays' if fits else ""
    if unit_from == "units" and not some:
        return f'give units="{unit}" to gfimu.Recording.from_table'
    return f"name the column{'s' if ',' in columns or '…' in columns else ''} {columns}"


def ways_to_read(evidence: Evidence) -> list[Otherwise]:
    """List the other ways to read the file."""
    array = evidence.array
    names, chip_of = array.channels, array.chip_of_channel
    count = len(names)
    identity = np.eye(count)
    ways = [
        Otherwise(
            "time",
            time_text(name, factor, "the turning that the channels show takes that much less time"),
            identity,
            time=factor,
        )
        for factor, name in TIME_UNITS.items()
    ]
    lsb = evidence.limits.lsb
    units = {
        "g": ("_g", np.full(count, STANDARD_GRAVITY)),
        "mg": ("_mg", np.full(count, STANDARD_GRAVITY / 1000.0)),
        "counts of the converter": ("_lsb", lsb),
        "cm/s²": ("", np.full(count, 0.01)),
        "mm/s²": ("", np.full(count, 0.001)),
    }
    for unit, (suffix, scale) in units.items():
        remedy = unit_remedy(evidence.unit_from, suffix[1:], f"{names[0]}{suffix} …") if suffix else ""
        remedy = remedy or f"multiply them by {scale[0]:g}"
        rest = evidence.gravity_at_rest(evidence.as_given())
        seen = f"gravity reads {np.median(rest):.4g} at rest" if len(rest) else "the motion fits no other unit"
        ways.append(Otherwise("unit", f"all readings are in {unit}, not in m/s²: {seen}; {remedy}", np.diag(scale)))
        for who, channels in _some_channels(array):
            columns = ", ".join(f"{name}{suffix}" for name in channels)
            cure = unit_remedy(evidence.unit_from, suffix[1:], columns, some=True) if suffix else ""
            cure = cure or f"multiply {'its columns' if len(channels) > 1 else 'it'} by {scale[0]:g}"
            text = f"{who} reads in {unit}, the others in m/s²; {cure}"
            mine = np.isin(names, channels)
            ways.append(Otherwise("chip_unit", text, np.diag(np.where(mine, scale, 1.0)), channels=channels))
    for channel, name in enumerate(names):
        sign = np.ones(count)
        sign[channel] = -1.0
        text = f"channel {name} is inverted; change the sign of its column, or of its axis in the array file"
        ways.append(Otherwise("sign", text, np.diag(sign), channels=(name,)))
    for index, chip in enumerate(array.chips):
        if len(chip.axes) > 1:
            text = (
                f"all channels of chip {chip.name} are inverted; "
                "change the sign of its columns, or of its axes in the array file"
            )
            ways.append(Otherwise("sign", text, np.diag(np.where(chip_of == index, -1.0, 1.0)), channels=chip.channels))
    ways.append(Otherwise("sign", "all channels are inverted; change the sign of all columns", -identity, channels=()))
    for one, two in combinations(range(count), 2):
        order = np.arange(count)
        order[[one, two]] = order[[two, one]]
        text = f"channels {names[one]} and {names[two]} are exchanged; exchange the names of their columns"
        ways.append(Otherwise("exchange", text, identity[order], channels=(names[one], names[two])))
    for one, two in combinations(range(len(array.chips)), 2):
        first, second = np.flatnonzero(chip_of == one), np.flatnonzero(chip_of == two)
        if len(first) == len(second) > 1:
            order = np.arange(count)
            order[np.concatenate([first, second])] = np.concatenate([second, first])
            chips = array.chips[one].name, array.chips[two].name
            text = f"chips {chips[0]} and {chips[1]} are exchanged; exchange the names of their columns"
            ways.append(Otherwise("exchange", text, identity[order], channels=chips))
    return ways + _every_chip_alike(array) + _other_arrays(array)


def _every_chip_alike(array: AccelerometerArray) -> list[Otherwise]:
    """List two exchanged axes, and an inverted axis, of every chip alike: as a drawing or a driver may have them.

    Some arrays have such a mirror image by two chips exchanged: the motion that fits is the mirrored one then.
    """
    if len(array.chips) < 2 or any(len(chip.axes) != 3 for chip in array.chips):
        return []
    ways = []
    for one, two in combinations(range(3), 2):
        order = np.arange(3)
        order[[one, two]] = order[[two, one]]
        brief = f"axes {one + 1} and {two + 1} of every chip"
        text = f"{brief} are exchanged; exchange the names of their columns, or the axes in the array file"
        columns = _on_every_chip(array, np.eye(3)[order])
        ways.append(Otherwise("exchange", text, columns, channels=array.channels, brief=brief))
    for axis in range(3):
        sign = np.ones(3)
        sign[axis] = -1.0
        brief = f"axis {axis + 1} of every chip"
        text = f"{brief} is inverted; change the sign of its columns, or of this axis in the array file"
        columns = _on_every_chip(array, np.diag(sign))
        names = tuple(chip.channels[axis] for chip in array.chips)
        ways.append(Otherwise("sign", text, columns, channels=names, brief=brief))
    return ways


def _on_every_chip(array: AccelerometerArray, axes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the matrix (c, c) that maps the three axes of every chip alike by ``axes`` (3, 3)."""
    return np.asarray(np.kron(np.eye(len(array.chips)), axes), dtype=np.float64)


def _some_channels(array: AccelerometerArray) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield each chip with several channels and each channel: in words, and the names of its channels."""
    for chip in array.chips:
        if len(chip.channels) > 1:
            yield f"chip {chip.name}", tuple(chip.channels)
    for name in array.channels:
        yield f"channel {name}", (name,)


def both_ways(one: Otherwise, two: Otherwise) -> Otherwise:
    """Return two ways at once: units and signs are those of the columns as they are named, before an exchange."""
    first, second = sorted((one, two), key=lambda way: _ORDER.index(way.kind))
    return Otherwise(
        first.kind,
        f"{first.text}; besides, {second.text}",
        second.columns @ first.columns,
        time=first.time * second.time,
        array=second.array or first.array,
        channels=(*first.channels, *second.channels),
        parts=(first, second),
    )


def _other_arrays(array: AccelerometerArray) -> list[Otherwise]:
    """List the shipped arrays that have the same channels."""
    ways = []
    for name in list_models("arrays"):
        other = AccelerometerArray.load(name)
        if set(other.channels) != set(array.channels) or other.name == array.name:
            continue
        same = other.channels == array.channels
        if same and np.allclose(other.positions, array.positions, atol=1e-9) and np.allclose(other.axes, array.axes):
            continue
        order = [array.index(channel) for channel in other.channels]
        text = f"the readings are not those of array {array.name!r} but fit {name!r}; give it with --array {name}"
        ways.append(Otherwise("array", text, np.eye(array.n_channels)[order], array=other))
    return ways
