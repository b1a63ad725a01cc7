"""A column map to start from, for a file of unknown layout: its times, chips, gyro and references."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import msgspec
import numpy as np
from numpy.typing import NDArray

from gfimu.errors import InputError
from gfimu.importing.clock import times_of
from gfimu.importing.column_map import REFERENCE_KINDS, ColumnMap, ColumnSpec, TextSpec, TimeSpec, load_map
from gfimu.importing.guessing.times import RATES, TimeGuess, find_time
from gfimu.importing.guessing.triads import Triad, find_triads
from gfimu.importing.guessing.units import TriadUnit, triad_values, unit_of_acceleration, unit_of_rate
from gfimu.importing.notation import factor_of, kind_of, unit_of_name
from gfimu.importing.raw_table import RawFile, RawTable
from gfimu.importing.splitting import find_split, split_file

__all__ = ["Suggestion", "suggest", "with_shipped"]

_GYRO = ("gyro_x_rad_s", "gyro_y_rad_s", "gyro_z_rad_s")
_TACHO = ("tacho", "rpm", "omega", "speed")
_ANGLE = ("angle", "theta", "encoder")
_TEMPERATURE = ("temperature", "temp_", "degc", "imu_temp")
_OTHER_QUANTITY = re.compile(r"gps|ground|wind|km/?h|mph|knots|[ _]?[xyz]$|steer")
_LEAST_ROWS = 0.2  # of the longest table: a table of another chip has as many samples
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


def suggest(raw: RawFile, *, table: str = "", name: str = "map", text: TextSpec = TextSpec()) -> Suggestion:
    """Return a map to start from.

    Parameters
    ----------
    raw : RawFile
        The file.
    table : str
        Table to begin with; by default the one with the most triads of accelerations.
    name : str
        Name of the map.
    text : TextSpec
        Layout of a text file, where it is known.
    """
    reasons: list[str] = []
    chosen = raw.table(table) if table else _most_promising(raw)
    time = find_time(chosen)
    split_by = find_split(chosen, time.columns[0] if time.columns else None)
    if split_by is not None:
        raw = split_file(RawFile(raw.source, raw.format, {chosen.name: chosen}), split_by, raw.source)
        chosen = _most_promising(raw)
        time = find_time(chosen)
        reasons.append(f"{split_by} says which chip a row is of: {', '.join(raw.tables)}")
    skipped, time = _leading_rows(chosen, time)
    if skipped:
        chosen = replace(chosen, columns={key: values[skipped:] for key, values in chosen.columns.items()})
        raw = RawFile(raw.source, raw.format, {**raw.tables, chosen.name: chosen})
        reasons.append(f"the first {skipped} rows are no readings: the time of the start and the sample rate")
    reasons.append(_line(time.why, time.sure))
    roles = dict.fromkeys(time.columns, "time or counter")
    roles |= {} if time.spec.column is None else {str(time.spec.column): "time"}
    triads = find_triads(chosen, time.columns)
    own = [(chosen, one) for one in triads if one.kind == "acceleration"]
    chips = [
        found
        for other in raw.tables.values()
        for found in (own if other is chosen else _alike(other, chosen, own) if own else [])
    ]
    units = [unit_of_acceleration(one, triad.columns) for one, triad in chips]
    parts = [
        _chip(number, chosen, one, triad, unit)
        for number, ((one, triad), unit) in enumerate(zip(chips, units, strict=True), start=1)
    ]
    channels = {key: spec for part in parts for key, spec in part.columns.items()}
    force = next((_force(*chip, unit) for chip, unit in zip(chips, units, strict=True) if chip[0] is chosen), None)
    gyro = _gyro(raw, chosen, [one for one in triads if one.kind == "rate"], force, _sample_rate(chosen, time))
    taken = {*roles, *(name for part in (*parts, gyro) for name in part.roles)}
    others = _other_references(chosen, taken)
    parts += [gyro, others]
    reference = {**gyro.columns, **others.columns}
    reasons += [line for part in parts for line in part.reasons]
    roles |= {name: role for part in parts for name, role in part.roles.items()}
    unused = [key for key, values in chosen.columns.items() if key not in roles and values.dtype != object]
    if not chosen.named and chips and unused:
        reasons.append(
            f"{', '.join(unused[:4])}: not used; a tachometer or an angle goes under [reference], as "
            f'tacho_rad_s = {{ column = "{unused[0]}", unit = "rad/s" }}'
        )
    if not chips:
        reasons.append(
            "no three columns look like accelerations; name them, as --map-set unit=g --map-set channels.a11=COLUMN"
        )
    suggested = None
    if channels or reference:
        suggested = ColumnMap(
            name,
            channels,
            time=time.spec,
            reference=reference,
            text=_layout(chosen, text),
            table=chosen.name if len(raw.tables) > 1 else "",
            format="" if raw.format == "text" else raw.format,
            split_by=split_by or "",
            skip_rows=skipped,
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
        if key not in shipped.reference and str(spec.column) not in used and key not in _GYRO
    }
    differences = []
    for key in found.sure:
        mine, theirs = _step(suggested, key), _step(shipped, key)
        if mine and theirs and abs(mine / theirs - 1.0) > _DIFFERENT:
            differences.append(f"{key}: the numbers are {mine / theirs:.3g} times what the map says (check this)")
    changed = msgspec.structs.replace(shipped, name=suggested.name, reference={**shipped.reference, **further})
    return changed, differences


def _step(column_map: ColumnMap, key: str) -> float:
    """Return what one step of a channel's or reference's number is, SI; 0 where the map does not have it."""
    spec = column_map.channels.get(key) or column_map.reference.get(key)
    kind = "acceleration" if key in column_map.channels else REFERENCE_KINDS.get(key, "")
    return spec.scale * factor_of(spec.unit, kind) if spec is not None else 0.0


def _line(why: str, sure: bool) -> str:
    return why if sure else f"{why} (check this)"


def _most_promising(raw: RawFile) -> RawTable:
    """Return the table with the most triads of accelerations that show gravity, the longest of those."""

    def worth(table: RawTable) -> tuple[int, int, int]:
        forces = [one.columns for one in find_triads(table) if one.kind == "acceleration"]
        gravity = sum(unit_of_acceleration(table, one).is_gravity for one in forces)
        return gravity, len(forces), len(table)

    return max(raw.tables.values(), key=worth)


def _leading_rows(table: RawTable, time: TimeGuess) -> tuple[int, TimeGuess]:
    """Return how many rows at the start are no readings, and the times: a start and a rate stand in all columns."""
    columns = [values for values in table.columns.values() if values.dtype != object and len(values) > 2]
    if time.is_rate_known or table.named or len(columns) != len(table.columns) or len(columns) < 3:
        return 0, time
    start, rate = float(columns[0][0]), float(columns[0][1])
    same = all(float(one[0]) == start and float(one[1]) == rate for one in columns)
    if not same or not _EPOCH[0] < start < _EPOCH[1] or not RATES[0] <= rate <= RATES[1]:
        return 0, time
    return 2, TimeGuess(TimeSpec(rate_hz=rate), f"the second row states {rate:g} Hz")


def _alike(other: RawTable, chosen: RawTable, chips: list[tuple[RawTable, Triad]]) -> list[tuple[RawTable, Triad]]:
    """Return the accelerations of another table that has the columns of the first one, so of another chip."""
    names = {one.columns for _, one in chips}
    if len(other) < _LEAST_ROWS * len(chosen) or not all(name in other.columns for one in names for name in one):
        return []
    return [
        (other, one)
        for one in find_triads(other)
        if one.kind == "acceleration" and one.columns in names and unit_of_acceleration(other, one.columns).is_gravity
    ]


@dataclass(frozen=True)
class _Part:
    """Columns of a map that belong together, and what they rest on."""

    columns: dict[str, ColumnSpec]
    roles: dict[str, str]
    reasons: tuple[str, ...]
    sure: tuple[str, ...] = ()


def _chip(number: int, chosen: RawTable, table: RawTable, triad: Triad, unit: TriadUnit) -> _Part:
    """Return the channels of a chip."""
    elsewhere = "" if table is chosen else table.name
    columns = {
        f"a{number}{axis}": msgspec.structs.replace(_spec(name, unit, axis - 1), table=elsewhere)
        for axis, name in enumerate(triad.columns, start=1)
    }
    roles = {name: f"{key}, {_scaled(unit)}" for key, name in zip(columns, triad.columns, strict=True)}
    where = f" of {elsewhere}" if elsewhere else ""
    why = _line(f"chip a{number} ({', '.join(triad.columns)}{where}): {unit.why}", unit.sure)
    return _Part(columns, {} if elsewhere else roles, (why,), (f"a{number}1",) if unit.sure else ())


def _force(table: RawTable, triad: Triad, unit: TriadUnit) -> NDArray[np.float64]:
    """Return the readings of a chip, (n, 3), m/s²."""
    factor = unit.scale * factor_of(unit.unit, "acceleration")
    return np.asarray((triad_values(table, triad.columns) - np.array(unit.offset)) * factor)


def _gyro(
    raw: RawFile, chosen: RawTable, own: list[Triad], force: NDArray[np.float64] | None, rate_hz: float | None
) -> _Part:
    """Return the first gyro as references: of the same table, else of another."""
    found = [(chosen, one) for one in own]
    if not found:
        found = [(other, one) for other in raw.tables.values() if other is not chosen for one in _rates(other, chosen)]
    if not found:
        return _Part({}, {}, ())
    table, triad = found[0]
    values = triad_values(table, triad.columns)
    unit = unit_of_rate(
        values, triad.columns[0], force if force is not None and len(force) == len(values) else None, rate_hz
    )
    elsewhere = "" if table is chosen else table.name
    columns = {
        key: msgspec.structs.replace(_spec(name, unit, 0), table=elsewhere)
        for key, name in zip(_GYRO, triad.columns, strict=True)
    }
    roles = {name: f"gyro {axis}, {_scaled(unit)}" for axis, name in zip("xyz", triad.columns, strict=True)}
    where = f" of {elsewhere}" if elsewhere else ""
    why = _line(f"gyro ({', '.join(triad.columns)}{where}): {unit.why}", unit.sure)
    return _Part(columns, {} if elsewhere else roles, (why,), (_GYRO[0],) if unit.sure else ())


def _rates(other: RawTable, chosen: RawTable) -> list[Triad]:
    """Return the gyros of another table: by name, as those of a phone."""
    if len(other) < _LEAST_ROWS * len(chosen):
        return []
    times = find_time(other)
    named = re.search(r"gyr|angular|rate", other.name, re.IGNORECASE)
    return [one for one in find_triads(other, times.columns) if one.kind == "rate" and (named or other.named)]


def _sample_rate(table: RawTable, time: TimeGuess) -> float | None:
    if not time.is_rate_known:
        return None
    try:
        t = times_of(table, time.spec, "").t_s
    except InputError:
        return None
    return 1.0 / float(np.median(np.diff(t))) if len(t) > 1 else None


def _other_references(table: RawTable, taken: Collection[str]) -> _Part:
    """Return a tachometer, an angle and a temperature by their names."""
    found: dict[str, ColumnSpec] = {}
    reasons = []
    for name in table.columns:
        known = _known_reference(name)
        if known is None or name in taken or known[0] in found or table.columns[name].dtype == object:
            continue
        key, unit = known
        found[key] = ColumnSpec(name, unit)
        reasons.append(_line(f"{key.partition('_')[0]} ({name}): {unit}, by its name", bool(unit_of_name(name)[1])))
    roles = {str(spec.column): f"{key.partition('_')[0]}, {spec.unit}" for key, spec in found.items()}
    return _Part(found, roles, tuple(reasons))


def _known_reference(name: str) -> tuple[str, str] | None:
    """Return the reference that a column is by its name, and its unit; None if it is none."""
    plain, unit = unit_of_name(name.lower())
    if _OTHER_QUANTITY.search(plain) or (not unit and re.search(r"[\[(].*[\])]\s*$", plain)):
        return None
    words = {"tacho_rad_s": _TACHO, "angle_rad": _ANGLE, "temperature_degC": _TEMPERATURE}
    for key, marks in words.items():
        if any(mark in name.lower() for mark in marks):
            if unit:
                return (key, unit) if kind_of(unit) == REFERENCE_KINDS[key] else None
            if key == "temperature_degC":
                return key, "degC"
            degrees = "deg" in plain
            usual = "rpm" if "rpm" in plain else "deg/s" if degrees else "rad/s"
            return key, usual if key == "tacho_rad_s" else "deg" if degrees else "rad"
    return None


def _spec(name: str, unit: TriadUnit, axis: int) -> ColumnSpec:
    return ColumnSpec(name, unit.unit, unit.scale, unit.offset[axis])


def _scaled(unit: TriadUnit) -> str:
    return unit.unit if unit.scale == 1.0 else f"1/{1.0 / unit.scale:.5g} {unit.unit}"


def _layout(table: RawTable, text: TextSpec) -> TextSpec:
    return text if table.named or text.columns else TextSpec(columns=tuple(table.columns))
