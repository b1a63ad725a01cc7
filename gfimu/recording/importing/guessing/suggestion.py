"""A column map to start from, for a file of unknown layout: its times, chips, gyro and references."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from gfimu.base.errors import InputError
from gfimu.recording.doubts.samples import sentinels_of
from gfimu.recording.importing.clock import times_of
from gfimu.recording.importing.column_map import REFERENCE_KINDS, ColumnMap, TextSpec, TimeSpec, load_map
from gfimu.recording.importing.guessing.parts import (
    GYRO,
    LEAST_ROWS,
    chip_part,
    force_of,
    gyro_part,
    other_references,
    reason,
    single_axes,
)
from gfimu.recording.importing.guessing.times import RATES, TimeGuess, find_time
from gfimu.recording.importing.guessing.triads import Triad, find_triads
from gfimu.recording.importing.guessing.units import are_poses, triad_values, unit_of_acceleration
from gfimu.recording.importing.raw_table import RawFile, RawTable
from gfimu.recording.importing.splitting import find_split, split_file
from gfimu.recording.units import factor_of

__all__ = ["Suggestion", "roles_by_map", "suggest", "with_shipped"]

_UNNAMED = {"text", "table"}  # formats that a map does not name: that of most files, and a table in memory
_DIFFERENT = 0.1  # relative, by which numbers and a map may differ: gains of parts
_EPOCH = (1e9, 4e9)  # s since 1970, from 2001 to 2096


@dataclass(frozen=True)
class Suggestion:
    """What a file seems to hold, as a map, and what that rests on.

    Parameters
    ----------
    raw : RawFile
        The file, split by chip where it has a row per chip.
    table : RawTable
        The table that the map begins with.
    time : TimeGuess
        Its times.
    column_map : ColumnMap, optional
        The map; None where no accelerations and no references were found.
    chips : tuple of (RawTable, Triad)
        The accelerations.
    reasons : tuple of str
        What the map rests on, one line each.
    roles : mapping of str to str
        What the columns of the table seem to be.
    sure : tuple of str
        Channels and references whose unit the numbers leave no doubt of.
    """

    raw: RawFile
    table: RawTable
    time: TimeGuess
    column_map: ColumnMap | None
    chips: tuple[tuple[RawTable, Triad], ...]
    reasons: tuple[str, ...]
    roles: Mapping[str, str]
    sure: tuple[str, ...] = ()


def suggest(raw: RawFile, *, table: str = "", name: str = "map") -> Suggestion:
    """Return a map to start from.

    Parameters
    ----------
    raw : RawFile
        The file.
    table : str
        Table to begin with; by default the one with the most triads of accelerations.
    name : str
        Name of the map.
    """
    reasons: list[str] = []
    chosen = raw.table(table) if table else _most_promising(raw)
    time = find_time(chosen)
    split = find_split(chosen, time.columns[0] if time.columns else None)
    if split is not None:
        raw = split_file(RawFile(raw.source, raw.format, {chosen.name: chosen}), split.column, raw.source)
        chosen = _most_promising(raw)
        time = find_time(chosen)
        listed = ", ".join(raw.tables)
        reasons.append(
            reason(f"{split.column} names parts of the recording: {listed}; table = {chosen.name!r} is taken", False)
            if split.is_part
            else f"{split.column} names the chip of each row: {listed}"
        )
    missing = _missing(raw)
    if missing:
        raw = _without(raw, missing)
        chosen = raw.table(chosen.name) if len(raw.tables) > 1 else next(iter(raw.tables.values()))
        reasons.append(f"{', '.join(f'{one:g}' for one in missing)} lies far from all other readings: taken as missing")
    skipped, time = _leading_rows(chosen, time)
    if skipped:
        chosen = replace(chosen, columns={key: values[skipped:] for key, values in chosen.columns.items()})
        raw = RawFile(raw.source, raw.format, {**raw.tables, chosen.name: chosen})
        reasons.append(f"the first {skipped} rows are no readings: the time of the start and the sample rate")
    reasons.append(reason(time.why, time.sure))
    roles = dict.fromkeys(time.columns, "time or counter")
    roles |= {} if time.spec.column is None else {str(time.spec.column): "time"}
    triads = find_triads(chosen, time.columns)
    own = [(chosen, one) for one in triads if one.kind == "acceleration"]
    chips = [
        found
        for other in raw.tables.values()
        if other is chosen or split is None or not split.is_part
        for found in (own if other is chosen else _alike(other, chosen, own) if own else [])
    ]
    units = [unit_of_acceleration(one, triad.columns) for one, triad in chips]
    if any(are_poses(triad_values(one, triad.columns)) for one, triad in chips):
        reasons.append("each row seems to be a pose at rest and no sample: gfimu calibrate takes a table of poses")
    singles = [] if chips else single_axes(chosen, {*roles, *(name for one in triads for name in one.columns)})
    parts = [
        chip_part(number, chosen, one, triad, unit)
        for number, ((one, triad), unit) in enumerate(zip(chips, units, strict=True), start=1)
    ]
    parts += singles
    channels = {key: spec for part in parts for key, spec in part.columns.items()}
    force = next((force_of(*chip, unit) for chip, unit in zip(chips, units, strict=True) if chip[0] is chosen), None)
    gyro = gyro_part(raw, chosen, [one for one in triads if one.kind == "rate"], force, _sample_rate(chosen, time))
    taken = {*roles, *(name for part in (*parts, gyro) for name in part.roles)}
    taken |= {name for one in triads if one.kind for name in one.columns}
    others = other_references(chosen, taken)
    parts += [gyro, others]
    reference = {**gyro.columns, **others.columns}
    reasons += [line for part in parts for line in part.reasons]
    roles |= {name: role for part in parts for name, role in part.roles.items()}
    unused = [key for key, values in chosen.columns.items() if key not in roles and values.dtype != object]
    if chips and unused and not (chosen.named and reference):
        reasons.append(
            f"{', '.join(unused[:4])}: not used; a tachometer or an angle goes under [reference], as "
            f'tacho_rad_s = {{ column = "{unused[0]}", unit = "rad/s" }}'
        )
    if not chips and not singles:
        reasons.append(
            "no three columns look like accelerations; name them, as --map-set unit=g --map-set channels.a11=COLUMN"
            + ("; as a reference (gfimu join, --reference-map) the map stands" if reference else "")
        )
    suggested = None
    if channels or reference:
        suggested = ColumnMap(
            name,
            channels,
            time=time.spec,
            reference=reference,
            text=TextSpec() if chosen.named else TextSpec(columns=tuple(chosen.columns)),
            table=chosen.name if len(raw.tables) > 1 else "",
            format="" if raw.format in _UNNAMED else raw.format,
            split_by=split.column if split is not None else "",
            skip_rows=skipped,
            missing=missing,
        )
    sure = tuple(key for part in parts for key in part.sure)
    return Suggestion(raw, chosen, time, suggested, tuple(chips), tuple(reasons), roles, sure)


def with_shipped(found: Suggestion, suggested: ColumnMap, fitting: str) -> tuple[ColumnMap, list[str]]:
    """Return the map of gfimu's that fits a file, with further references of it, and where the numbers differ."""
    shipped = load_map(fitting)
    used = {str(spec.column) for spec in shipped.reference.values()}
    further = {
        key: spec
        for key, spec in suggested.reference.items()
        if key not in shipped.reference and str(spec.column) not in used and key not in GYRO
    }
    differences = []
    for key in found.sure:
        mine, theirs = _step(suggested, key), _step(shipped, key)
        if mine and theirs and abs(mine / theirs - 1.0) > _DIFFERENT:
            differences.append(f"{key}: the numbers are {mine / theirs:.3g} times what the map says (check this)")
    changed = msgspec.structs.replace(shipped, name=suggested.name, reference={**shipped.reference, **further})
    return changed, differences


def roles_by_map(column_map: ColumnMap, table: RawTable) -> dict[str, str]:
    """Return what the columns of a table are by a map."""
    names = dict(zip(column_map.text.columns, table.columns, strict=False)) if not table.named else {}
    roles = {}
    for key, spec in {**column_map.channels, **column_map.reference}.items():
        column = names.get(str(spec.column)) or table.find(spec.column)
        if column is not None and not spec.table:
            per_unit = "" if spec.scale == 1.0 else f"1/{1.0 / spec.scale:.5g} "
            roles[column] = f"{key.removesuffix('_rad_s').replace('_', ' ')}, {per_unit}{spec.unit}"
    if column_map.time.column is not None:
        roles |= {column: "time" for column in [table.find(column_map.time.column)] if column}
    return roles


def _step(column_map: ColumnMap, key: str) -> float:
    """Return what one step of a channel's or reference's number is, SI; 0 where the map does not have it."""
    spec = column_map.channels.get(key) or column_map.reference.get(key)
    kind = "acceleration" if key in column_map.channels else REFERENCE_KINDS.get(key, "")
    return spec.scale * factor_of(spec.unit, kind) if spec is not None else 0.0


def _missing(raw: RawFile) -> tuple[float, ...]:
    """Return the numbers that stand for a missing reading in triads of a file."""
    found: dict[float, None] = {}
    for table in raw.tables.values():
        for triad in find_triads(table):
            for name in triad.columns:
                found |= dict.fromkeys(sentinels_of(table.numbers(name)))
    return tuple(found)


def _without(raw: RawFile, missing: Collection[float]) -> RawFile:
    """Return a file in which numbers that stand for a missing one are missing."""

    def cleared(values: NDArray[Any]) -> NDArray[Any]:
        if values.dtype.kind not in "iuf" or not np.isin(values, list(missing)).any():
            return values
        numbers = values.astype(float)
        numbers[np.isin(values, list(missing))] = np.nan
        return numbers

    tables = {
        key: replace(table, columns={name: cleared(values) for name, values in table.columns.items()})
        for key, table in raw.tables.items()
    }
    return RawFile(raw.source, raw.format, tables)


def _most_promising(raw: RawFile) -> RawTable:
    """Return the table with the most triads of accelerations that show gravity, the longest of those."""

    def worth(table: RawTable) -> tuple[int, int, int, int]:
        forces = [one for one in find_triads(table) if one.kind == "acceleration"]
        raw = sum(one.shows_gravity and not one.is_processed for one in forces)
        return raw, sum(one.shows_gravity for one in forces), len(forces), len(table)

    return max(raw.tables.values(), key=worth)


def _leading_rows(table: RawTable, time: TimeGuess) -> tuple[int, TimeGuess]:
    """Return how many rows at the start are no readings, and the times: a start and a rate stand in all columns."""
    columns = [values for values in table.columns.values() if values.dtype != object and len(values) > 2]
    if time.is_rate_known or table.named or len(columns) != len(table.columns) or len(columns) < 3:
        return 0, time
    start, rate = float(columns[0][0]), float(columns[0][1])
    same = all(float(column[0]) == start and float(column[1]) == rate for column in columns)
    if not same or not _EPOCH[0] < start < _EPOCH[1] or not RATES[0] <= rate <= RATES[1]:
        return 0, time
    return 2, TimeGuess(TimeSpec(rate_hz=rate), f"the second row states {rate:g} Hz")


def _alike(other: RawTable, chosen: RawTable, chips: list[tuple[RawTable, Triad]]) -> list[tuple[RawTable, Triad]]:
    """Return the accelerations of another table that has the columns of the first one, so of another chip."""
    names = {one.columns for _, one in chips}
    if len(other) < LEAST_ROWS * len(chosen) or not all(name in other.columns for one in names for name in one):
        return []
    return [
        (other, one)
        for one in find_triads(other)
        if one.kind == "acceleration" and one.columns in names and one.shows_gravity and not one.is_processed
    ]


def _sample_rate(table: RawTable, time: TimeGuess) -> float | None:
    if not time.is_rate_known:
        return None
    try:
        rate = times_of(table, time.spec, "").rate_hz
    except InputError:
        return None
    return rate if np.isfinite(rate) else None
