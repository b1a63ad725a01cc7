"""Parts of a suggested column map: the channels of a chip, single axes, a gyro, other references."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from gfimu.recording.importing.column_map import REFERENCE_KINDS, ColumnSpec
from gfimu.recording.importing.guessing.names import is_acceleration, words_of
from gfimu.recording.importing.guessing.times import find_time
from gfimu.recording.importing.guessing.triads import Triad, find_triads
from gfimu.recording.importing.guessing.units import TriadUnit, triad_values, unit_of_rate
from gfimu.recording.importing.raw_table import RawFile, RawTable
from gfimu.recording.units import factor_of, kind_of, unit_of_name

__all__ = [
    "GYRO",
    "LEAST_ROWS",
    "Part",
    "chip_part",
    "force_of",
    "gyro_part",
    "known_reference",
    "other_references",
    "reason",
    "single_axes",
    "varies",
]

LEAST_ROWS = 0.2  # of the longest table: a table of another chip has as many samples
GYRO = ("gyro_x_rad_s", "gyro_y_rad_s", "gyro_z_rad_s")
_AXIS = re.compile(r"(?<![b-z])[xyz](?![a-z])")
_TACHO = re.compile(r"tacho|\brpm|omega|speed|ang\w* ?(vel|rate)|rotation(al)? (vel|rate)|\bspin\b|turntable")
_ANGLE = re.compile(r"angle|theta|\bphi\b|encoder|rotation$|\bwinkel|angular pos|ang pos")
_CARRIAGE = re.compile(r"carriage|stage\b|slide|toolhead|travel|position$|\bpos$|linear encoder")
_TEMPERATURE = re.compile(r"temp(erature)?\b|\bdegc|imu temp")
_OTHER_QUANTITY = re.compile(
    r"gps|cov\w*|\bstd|alpha$|beta$|gamma$|ground|wind|km ?h\b|mph|knots|steer|stamp"
    r"|\b(\w*(gyr|rate|omega)\w*|w)?[xyz]$"
)


def reason(why: str, sure: bool) -> str:
    """Return a reason for a message, marked where it is to be checked."""
    return why if sure else f"{why} (check this)"


@dataclass(frozen=True)
class Part:
    """Columns of a map that belong together, and what they rest on."""

    columns: dict[str, ColumnSpec]
    roles: dict[str, str]
    reasons: tuple[str, ...]
    sure: tuple[str, ...] = ()


def chip_part(number: int, chosen: RawTable, table: RawTable, triad: Triad, unit: TriadUnit) -> Part:
    """Return the channels of a chip."""
    elsewhere = "" if table is chosen else table.name
    columns = {
        f"a{number}{axis}": msgspec.structs.replace(_spec(name, unit, axis - 1), table=elsewhere)
        for axis, name in enumerate(triad.columns, start=1)
    }
    roles = {name: f"{key}, {_scaled(unit)}" for key, name in zip(columns, triad.columns, strict=True)}
    where = f" of {elsewhere}" if elsewhere else ""
    is_estimate = triad.is_processed and "grav" in f"{triad.columns[0]} {table.name}".lower()
    doubt = "; by its name a program has computed it from others" if is_estimate else triad.why_not
    why = reason(f"chip a{number} ({', '.join(triad.columns)}{where}): {unit.why}{doubt}", unit.sure and not doubt)
    return Part(columns, {} if elsewhere else roles, (why,), (f"a{number}1",) if unit.sure else ())


def single_axes(table: RawTable, taken: Collection[str]) -> list[Part]:
    """Return columns that are accelerations by name or unit as chips of one axis, or of two."""
    names = [
        name
        for name, values in table.columns.items()
        if name not in taken and values.dtype != object and is_acceleration(name)
    ]
    chips: dict[str, list[str]] = {}
    for name in names:
        chips.setdefault(_AXIS.sub("", unit_of_name(name)[0].lower(), count=1), []).append(name)
    parts = []
    for number, axes in enumerate(chips.values(), start=1):
        unit = unit_of_name(axes[0])[1]
        why = f"the name has {unit}" if unit else "m/s² holds the place, give the unit"
        number_of = "one axis" if len(axes) == 1 else f"{len(axes)} axes"
        line = reason(f"chip a{number} of {number_of} ({', '.join(axes)}): {why}", bool(unit))
        keys = {f"a{number}{axis}": name for axis, name in enumerate(axes, start=1)}
        columns = {key: ColumnSpec(name, unit or "m/s^2") for key, name in keys.items()}
        parts.append(Part(columns, {name: f"{key}, {unit or 'unit?'}" for key, name in keys.items()}, (line,)))
    return parts


def force_of(table: RawTable, triad: Triad, unit: TriadUnit) -> NDArray[np.float64]:
    """Return the readings of a chip, (n, 3), m/s²."""
    factor = unit.scale * factor_of(unit.unit, "acceleration")
    return np.asarray((triad_values(table, triad.columns) - np.array(unit.offset)) * factor)


def gyro_part(
    raw: RawFile, chosen: RawTable, own: list[Triad], force: NDArray[np.float64] | None, rate_hz: float | None
) -> Part:
    """Return the first gyro as references: of the same table, else of another."""
    found = [(chosen, one) for one in own]
    if not found:
        found = [(other, one) for other in raw.tables.values() if other is not chosen for one in _rates(other, chosen)]
    if not found:
        return Part({}, {}, ())
    tried = []
    for table, triad in found:
        values = triad_values(table, triad.columns)
        alike = force if force is not None and len(force) == len(values) else None
        tried.append((table, triad, unit_of_rate(values, triad.columns[0], alike, rate_hz)))
    # Without names that show a rate, the one is the gyro by which gravity turns.
    table, triad, unit = max(tried, key=lambda one: (one[1].by_name, one[2].agreement))
    elsewhere = "" if table is chosen else table.name
    columns = {
        key: msgspec.structs.replace(_spec(name, unit, 0), table=elsewhere)
        for key, name in zip(GYRO, triad.columns, strict=True)
    }
    roles = {name: f"gyro {axis}, {_scaled(unit)}" for axis, name in zip("xyz", triad.columns, strict=True)}
    where = f" of {elsewhere}" if elsewhere else ""
    why = reason(
        f"gyro ({', '.join(triad.columns)}{where}): {unit.why}{triad.why_not}", unit.sure and not triad.why_not
    )
    return Part(columns, {} if elsewhere else roles, (why,), (GYRO[0],) if unit.sure else ())


def _rates(other: RawTable, chosen: RawTable) -> list[Triad]:
    """Return the gyros of another table: by name, as those of a phone."""
    if len(other) < LEAST_ROWS * len(chosen):
        return []
    times = find_time(other)
    named = re.search(r"gyr|angular|rate", other.name, re.IGNORECASE)
    return [one for one in find_triads(other, times.columns) if one.kind == "rate" and (named or other.named)]


def other_references(table: RawTable, taken: Collection[str]) -> Part:
    """Return a tachometer, an angle and a temperature by their names."""
    found: dict[str, ColumnSpec] = {}
    reasons = []
    for name in table.columns:
        known = known_reference(name)
        if known is None or name in taken or known[0] in found or table.columns[name].dtype == object:
            continue
        if known[0] != "temperature_degC" and not varies(table.columns[name]):
            continue
        key, unit = known
        found[key] = ColumnSpec(name, unit)
        is_sure = bool(unit_of_name(name)[1] or kind_of(name))
        reasons.append(reason(f"{key.partition('_')[0]} ({name}): {unit}, by its name", is_sure))
    roles = {str(spec.column): f"{key.partition('_')[0]}, {spec.unit}" for key, spec in found.items()}
    return Part(found, roles, tuple(reasons))


def varies(values: NDArray[Any]) -> bool:
    """Whether a column holds numbers that are not all the same."""
    if values.dtype.kind not in "iuf":
        return False
    known = values[np.isfinite(values)]
    return bool(len(known)) and bool((known != known[0]).any())


def known_reference(name: str) -> tuple[str, str] | None:
    """Return the reference that a column is by its name, and its unit or the usual one; None if it is none."""
    words, (plain, unit) = words_of(name), unit_of_name(name.lower())
    if _OTHER_QUANTITY.search(words) or (not unit and re.search(r"[\[(].*[\])]\s*$", plain)):
        return None
    if kind_of(unit) == "length":
        return ("carriage_m", unit) if _CARRIAGE.search(words) else None
    for key, mark in (("temperature_degC", _TEMPERATURE), ("angle_rad", _ANGLE), ("tacho_rad_s", _TACHO)):
        sure = unit == "rpm" or key == "temperature_degC"
        if kind_of(unit) == REFERENCE_KINDS[key] and (mark.search(words) or sure):
            return key, unit
        if not unit and mark.search(words):
            degrees = "deg" in plain
            rate = "rpm" if "rpm" in plain else "deg/s" if degrees else "rad/s"
            return key, {"temperature_degC": "degC", "tacho_rad_s": rate, "angle_rad": "deg" if degrees else "rad"}[key]
    return None


def _spec(name: str, unit: TriadUnit, axis: int) -> ColumnSpec:
    return ColumnSpec(name, unit.unit, unit.scale, unit.offset[axis])


def _scaled(unit: TriadUnit) -> str:
    return unit.unit if unit.scale == 1.0 else f"1/{1.0 / unit.scale:.5g} {unit.unit}"
