"""What the columns of an unknown table seem to be: time, triads of acceleration and rate, their units by gravity."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.importing.column_map import TimeSpec
from gfimu.importing.notation import TIME, bracketed_unit, factor_of, kind_of
from gfimu.importing.raw_table import RawTable
from gfimu.units import STANDARD_GRAVITY

__all__ = [
    "NEAR",
    "RATES",
    "Triad",
    "TriadUnit",
    "find_time",
    "find_triads",
    "rest_windows",
    "unit_of_acceleration",
    "unit_of_rate",
]

RATES = (5.0, 8000.0)  # Hz, of a recording of motion
_TIME_WORDS = ("time", "stamp", "sec", "clock", "tick", "sampletimefine", "t_", "timestamp")
_FORCE = re.compile(r"acc|force|^a[xyz_\d\[ ]|_a_|^a_|lin|adxl|mma|lis|bma|kx", re.IGNORECASE)
_GYRO = re.compile(r"gyr|omega|angular|^w[xyz_\d\[ ]|^w_|rate|rot|itg", re.IGNORECASE)
_NEITHER = re.compile(r"mag|euler|quat|orient|field|angle|roll|pitch|yaw|pos|vel_|std|cov|free|temp", re.IGNORECASE)
_GRAVITY = {"m/s^2": 1.0, "g": STANDARD_GRAVITY, "mg": STANDARD_GRAVITY / 1e3, "mm/s^2": 1e-3, "cm/s^2": 1e-2}
NEAR = 0.08  # relative, of gravity at rest: gains of parts lie within
_LOW_COUNTS = 20.0  # below that counts per g would be too coarse for any part
_FASTEST_RAD_S = 40.0  # rad/s: beyond the range of nearly all gyros (2000 °/s is 35 rad/s)
_ROUND = 0.03  # relative scatter of the poses about a sphere: gains of the axes differ by less
_LEAST_WRAP = 256.0  # a counter of one byte
_NEAR_WRAP = 0.02  # of the wrap, by which a step back may miss it: samples lost there
_POSES = 9  # rest poses from which offset and scale of raw counts follow


@dataclass(frozen=True)
class Triad:
    """Three columns that belong together.

    Parameters
    ----------
    columns : tuple of str
        Names along x, y and z.
    kind : str
        ``acceleration``, ``rate``, or empty.
    """

    columns: tuple[str, str, str]
    kind: str


@dataclass(frozen=True)
class TriadUnit:
    """Unit of a triad: (number − offset) · scale in a unit.

    Parameters
    ----------
    unit : str
        As in a column map.
    scale : float
        One step of the numbers in that unit.
    offset : tuple of float
        Numbers at zero, per axis.
    why : str
        What the guess rests on.
    sure : bool
        Whether the data leave no other reading.
    is_gravity : bool
        Whether gravity at rest is that of a usual unit, a usual number of counts, or of a sphere of poses.
    """

    unit: str
    scale: float
    offset: tuple[float, float, float]
    why: str
    sure: bool
    is_gravity: bool = True


def find_time(table: RawTable) -> tuple[TimeSpec, str] | None:
    """Return the column of times with its unit, and what that rests on; None if no column can be it."""
    found: list[tuple[float, TimeSpec, str]] = []
    for place, (name, values) in enumerate(table.columns.items()):
        if values.dtype.kind == "M":
            found.append((5.0, TimeSpec(name, "datetime"), f"{name} holds dates"))
        elif values.dtype == object:
            if re.match(r"\d{4}-\d\d-\d\d[ T]\d\d:\d\d", str(values[0])):
                found.append((2.0, TimeSpec(name, "datetime"), f"{name} holds dates"))
        else:
            one = _as_time(name, values)
            if one is not None:
                spec, score, why = one
                found.append((score - 0.01 * place, spec, why))
    if not found:
        return None
    _, spec, why = max(found, key=lambda one: one[0])
    return spec, why


def _as_time(name: str, values: NDArray[Any]) -> tuple[TimeSpec, float, str] | None:
    """Return how a column could be the time, if it could, and how likely that is."""
    steps = np.diff(values[np.isfinite(np.asarray(values, dtype=float))].astype(float))
    if len(steps) < 3 or not (steps > 0).any():
        return None
    forward = float(np.mean(steps > 0))
    usual = float(np.median(steps[steps > 0]))
    wrap = _wrap(steps, usual)
    if forward < 0.9 or float(np.mean(steps < 0)) > 0.01:
        return None
    plain, unit = bracketed_unit(name)
    word = any(mark in plain.lower() for mark in _TIME_WORDS) or plain.lower() in {"t", "ts"}
    if unit and kind_of(unit) == "time":
        rate = 1.0 / (usual * factor_of(unit, "time"))
        return TimeSpec(name, unit, wrap=wrap), 6.0, f"the name of {name} has its unit; {rate:.4g} Hz"
    counter = bool(np.all(steps[steps > 0] == 1.0)) and not word
    hints = {"ns": ("ns", "nano"), "us": ("us", "micro", "fine"), "ms": ("ms", "milli")}
    order = [unit for unit, marks in hints.items() if any(plain.lower().endswith(mark) for mark in marks)]
    for candidate in [*order, *(one for one in ("s", "ms", "us", "ns") if one not in order)]:
        rate = 1.0 / (usual * TIME[candidate])
        if RATES[0] <= rate <= RATES[1]:
            score = (4.0 if word else 1.0) - (2.0 if counter else 0.0)
            why = f"{name} increases by {usual:.6g} per row, which in {candidate} is {rate:.4g} Hz"
            return TimeSpec(name, candidate, wrap=wrap), score, why
    return None


def _wrap(steps: NDArray[np.float64], usual: float) -> float | None:
    """Return the number at which a counter starts anew, a power of two; None where times merely go back."""
    back = steps[steps < 0]
    if not 0 < len(back) <= 0.01 * len(steps) or np.any(steps != np.round(steps)):
        return None
    wrap = float(2.0 ** math.ceil(math.log2(-back.min())))
    near = wrap + back <= max(3.0 * usual, _NEAR_WRAP * wrap)
    return wrap if wrap >= _LEAST_WRAP and near.all() else None


def find_triads(table: RawTable, taken: Sequence[str] = ()) -> list[Triad]:
    """Return columns whose names differ in x, y, z (or 0, 1, 2 or 1, 2, 3) alone, of acceleration or rate."""
    free = {_short(name): name for name in table.columns if name not in taken and table.columns[name].dtype != object}
    if not table.named:
        names = list(free.values())
        groups = [tuple(names[first : first + 3]) for first in range(0, len(names) - 2, 3)]
        return _without_names(table, [(one[0], one[1], one[2]) for one in groups])
    found: list[Triad] = []
    used: set[str] = set()
    for short, name in free.items():
        for axes in (("x", "y", "z"), ("0", "1", "2"), ("1", "2", "3")):
            for place in (spot for spot, letter in enumerate(short) if letter == axes[0]):
                three = [short[:place] + axis + short[place + 1 :] for axis in axes]
                if all(one in free for one in three) and not used & set(three):
                    used |= set(three)
                    columns = (name, free[three[1]], free[three[2]])
                    found.append(Triad(columns, _kind(table, columns)))
    return found


def _without_names(table: RawTable, groups: Sequence[tuple[str, str, str]]) -> list[Triad]:
    """Return triads of columns without names: of those alike in all poses only what gravity fits is acceleration."""
    kinds = [_kind_by_numbers(table, one) for one in groups]
    gravity = [
        kind == "acceleration" and unit_of_acceleration(table, one).is_gravity
        for kind, one in zip(kinds, groups, strict=True)
    ]
    if any(gravity):
        kinds = ["acceleration" if fits else kind and "rate" for kind, fits in zip(kinds, gravity, strict=True)]
    return [Triad(one, kind) for one, kind in zip(groups, kinds, strict=True)]


def _short(name: str) -> str:
    return bracketed_unit(name)[0].lower()


def _kind(table: RawTable, columns: tuple[str, str, str]) -> str:
    """Return what three columns measure, by the unit in their names, by their names, or by their numbers."""
    plain, unit = bracketed_unit(columns[0])
    if unit:
        kind = kind_of(unit)
        free = re.search(r"free|linear acc|without g", plain, re.IGNORECASE)
        return kind if kind in {"acceleration", "rate"} and not free else ""
    if _NEITHER.search(plain):
        return ""
    if _GYRO.search(plain):
        return "rate"
    return "acceleration" if _FORCE.search(plain) else _kind_by_numbers(table, columns)


def _kind_by_numbers(table: RawTable, columns: Sequence[str]) -> str:
    """Return acceleration where the length of the vector at rest is the same in all poses, else rate near zero."""
    values = np.column_stack([table.numbers(name) for name in columns])
    windows = rest_windows(values)
    if not len(windows):
        return ""
    lengths = np.linalg.norm(windows, axis=1)
    spread = float(np.std(lengths) / max(np.median(lengths), 1e-12))
    largest = float(np.nanmax(np.abs(values)))
    if spread < 0.1 and np.median(lengths) > 0.02 * largest:
        return "acceleration"
    return "acceleration" if _sphere(windows) is not None else "rate"


def rest_windows(values: NDArray[np.float64], windows: int = 400) -> NDArray[np.float64]:
    """Return the means of the quietest fifth of equal pieces of a triad, (k, 3)."""
    rows = values[np.isfinite(values).all(axis=1)]
    size = max(len(rows) // windows, 8)
    count = len(rows) // size
    if count < 5:
        return rows.mean(axis=0, keepdims=True) if len(rows) else np.empty((0, 3))
    pieces = rows[: count * size].reshape(count, size, 3)
    means, scatter = pieces.mean(axis=1), pieces.std(axis=1).max(axis=1)
    return np.asarray(means[scatter <= np.quantile(scatter, 0.2)])


def unit_of_acceleration(table: RawTable, columns: Sequence[str]) -> TriadUnit:
    """Return the unit of a triad of accelerations: from its names, or from gravity at rest."""
    zero = (0.0, 0.0, 0.0)
    values = np.column_stack([table.numbers(name) for name in columns])
    windows = rest_windows(values)
    length = float(np.median(np.linalg.norm(windows, axis=1))) if len(windows) else float("nan")
    unit = bracketed_unit(columns[0])[1]
    if unit:
        said = length * factor_of(unit, "acceleration")
        agrees = abs(said / STANDARD_GRAVITY - 1.0) < NEAR
        why = f"the name has {unit}; at rest {said:.3g} m/s²" + ("" if agrees else ", which is not gravity")
        return TriadUnit(unit, 1.0, zero, why, agrees)
    for name, factor in _GRAVITY.items():
        if abs(length * factor / STANDARD_GRAVITY - 1.0) < NEAR:
            counts = name == "mg" and _whole(values)
            other = "; 1024 counts per g is as likely" if counts else ""
            return TriadUnit(
                name, 1.0, zero, f"at rest its length is {length:.4g}: gravity in {name}{other}", not counts
            )
    sphere = _sphere(windows)
    if sphere is not None:
        centre, radius = sphere
        # Raw counts with an offset: their length alone means nothing.
        if np.linalg.norm(centre) > 0.2 * radius:
            offset = (float(centre[0]), float(centre[1]), float(centre[2]))
            where = ", ".join(f"{one:.6g}" for one in centre)
            why = f"rest poses lie on a sphere about {where} of radius {radius:.6g} counts"
            return TriadUnit("g", 1.0 / radius, offset, why, True)
    if length > _LOW_COUNTS:
        power = 2.0 ** round(math.log2(length))
        if abs(length / power - 1.0) < NEAR:
            return TriadUnit(
                "g", 1.0 / power, zero, f"at rest its length is {length:.5g}: {power:g} counts per g", True
            )
        why = f"at rest its length is {length:.5g}, taken as 1 g; the data sheet has the exact scale"
        return TriadUnit("g", 1.0 / length, zero, why, False, False)
    return TriadUnit(
        "m/s^2", 1.0, zero, f"at rest its length is {length:.4g}: no unit of gravity; is it without g?", False, False
    )


def _whole(values: NDArray[np.float64]) -> bool:
    """Tell whether all numbers are whole ones, as counts are."""
    known = values[np.isfinite(values)]
    return bool(np.all(known == np.round(known)))


def _sphere(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], float] | None:
    """Fit a sphere to rest poses by linear least squares; None where they do not determine one."""
    if len(points) < _POSES:
        return None
    middle, size = points.mean(axis=0), float(np.abs(points - points.mean(axis=0)).max()) or 1.0
    scaled = (points - middle) / size
    matrix = np.column_stack([2.0 * scaled, np.ones(len(points))])
    if np.linalg.cond(matrix) > 30.0:
        return None
    solution = np.linalg.lstsq(matrix, (scaled**2).sum(axis=1), rcond=None)[0]
    radius = math.sqrt(max(float(solution[3] + solution[:3] @ solution[:3]), 0.0))
    scatter = float(np.std(np.linalg.norm(scaled - solution[:3], axis=1)))
    return (middle + size * solution[:3], size * radius) if radius > 0.0 and scatter < _ROUND * radius else None


def unit_of_rate(table: RawTable, columns: Sequence[str]) -> TriadUnit:
    """Return the unit of a triad of rates: from its names, or from the largest value."""
    zero = (0.0, 0.0, 0.0)
    unit = bracketed_unit(columns[0])[1]
    if unit:
        return TriadUnit(unit, 1.0, zero, f"the name has {unit}", True)
    largest = max(float(np.nanmax(np.abs(table.numbers(name)))) for name in columns)
    if largest > 2500.0:
        why = f"up to {largest:.4g}: counts; 16.4 per °/s (±2000 °/s) is a guess, the data sheet has the scale"
        return TriadUnit("deg/s", 1.0 / 16.4, zero, why, False)
    if largest > _FASTEST_RAD_S:
        return TriadUnit("deg/s", 1.0, zero, f"up to {largest:.4g}: too fast for rad/s", True)
    return TriadUnit("rad/s", 1.0, zero, f"up to {largest:.4g}: rad/s, or slow motion in deg/s", False)
