"""The times of a foreign table: from counts, texts or a constant rate to seconds that increase."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.base.errors import InputError
from gfimu.recording.importing.column_map import TimeSpec
from gfimu.recording.importing.dates import nanoseconds_of
from gfimu.recording.importing.raw_table import RawTable
from gfimu.recording.units import factor_of

__all__ = ["Times", "increasing_times", "parts_of", "times_of"]

_FAR = 100.0  # s: times beyond count from the first sample; they keep their digits, and pictures begin there
_MOST_DROPPED = 0.02  # of the rows, whose time does not increase
_LONGEST = 1e12  # s: a time beyond is none
_LEAST_PART = 20  # rows of a part after a restart


@dataclass(frozen=True)
class Times:
    """Times of the rows that are kept.

    Parameters
    ----------
    t_s : ndarray, shape (n,)
        Times, s, strictly increasing.
    rows : ndarray of bool, shape (m,)
        Rows of the table that are kept; n of them.
    origin_s : float
        Time on the file's own clock at which ``t_s`` is zero, s.
    notes : tuple of str
        What was left out.
    dropped : mapping of str to int
        How many rows were left out: ``duplicates``, ``unordered``, ``untimed``.
    """

    t_s: NDArray[np.float64]
    rows: NDArray[np.bool_]
    origin_s: float
    notes: tuple[str, ...]
    dropped: Mapping[str, int] = field(default_factory=dict)

    @property
    def rate_hz(self) -> float:
        """Sample rate, Hz: one by the median step; NaN of fewer than two samples."""
        return 1.0 / float(np.median(np.diff(self.t_s))) if len(self.t_s) > 1 else float("nan")


def times_of(table: RawTable, spec: TimeSpec, source: str, *, drop: Collection[str] = ()) -> Times:
    """Return the times of a table's rows.

    Parameters
    ----------
    table : RawTable
        The table.
    spec : TimeSpec
        Its column of times, or its rate.
    source : str
        The file, for messages.
    drop : collection of str
        Rows that are left out however many they are: ``duplicates``, ``unordered`` (see `increasing_times`).

    Raises
    ------
    InputError
        If there is no such column, it holds no times, or too many of them do not increase.
    """
    if spec.column is None:
        rate = float(spec.rate_hz or 0.0)
        return Times(np.arange(len(table)) / rate, np.ones(len(table), dtype=bool), 0.0, ())
    name = table.find(spec.column)
    if name is None:
        raise InputError(f"{source}: column {spec.column!r} of the time is missing; the file has {_listed(table)}")
    values = table.columns[name]
    if spec.unit == "datetime" or values.dtype.kind == "M":
        steps, origin = _dates(values, name, source)
    elif spec.rate_hz is not None:
        steps, origin = _counts(values, spec.scale / spec.rate_hz, spec.wrap, name, source)[0], 0.0
    else:
        factor = spec.scale * factor_of(spec.unit, "time", where=f"{source}: time")
        steps, origin = _counts(values, factor, spec.wrap, name, source)
    return _of_part(steps, origin, spec.part, f"{source}: column {name}", drop)


def parts_of(t: NDArray[np.float64]) -> list[slice]:
    """Return the rows of each part of a recording whose clock starts anew, as after a restart of the logger.

    A part begins where the time goes back by more than half of what the part before it lasted and goes on from there;
    both have at least 20 rows. A counter of a fixed number of bits is another case (``wrap``).

    Parameters
    ----------
    t : ndarray, shape (n,)
        Times, s; NaN where a row has none.
    """
    rows = np.flatnonzero(np.isfinite(t))
    back = np.flatnonzero(np.diff(t[rows]) < 0.0)
    if len(back) > len(rows) // _LEAST_PART:
        return [slice(0, len(t))]
    starts = [0]
    for place in back.tolist():
        before, after = t[rows[starts[-1] : place + 1]], t[rows[place + 1 : place + 1 + _LEAST_PART]]
        lasted = float(before.max() - before[0])
        goes_on = len(after) == _LEAST_PART and bool(np.all(np.diff(after) >= 0.0)) and after[-1] < before.max()
        if len(before) >= _LEAST_PART and goes_on and before[-1] - after[0] > 0.5 * lasted:
            starts.append(place + 1)
    edges = [0, *(int(rows[place]) for place in starts[1:]), len(t)]
    return [slice(first, last) for first, last in pairwise(edges)]


def _of_part(t: NDArray[np.float64], origin: float, part: int | None, where: str, drop: Collection[str]) -> Times:
    """Return the increasing times of the part that is asked for; of all where the clock starts only once."""
    parts = parts_of(t)
    if (len(parts) == 1 and part in {None, 1}) or (part is None and {"duplicates", "unordered"} & set(drop)):
        return increasing_times(t, origin, where, drop=drop)
    sizes = ", ".join(str(one.stop - one.start) for one in parts)
    if part is None:
        row = parts[1].start
        raise InputError(
            f"{where}: the clock starts anew in row {row + 1} ({t[row - 1]:.9g} s, then {t[row]:.9g} s), as after a "
            f"restart: {len(parts)} parts of {sizes} rows; time.part = 1 takes the first (--map-set time.part=1)"
        )
    if part > len(parts):
        raise InputError(f"{where}: time.part = {part}, but the clock starts {len(parts)} times; give a lower number")
    taken = parts[part - 1]
    found = increasing_times(t[taken], origin, where, drop=drop)
    rows = np.zeros(len(t), dtype=bool)
    rows[taken] = found.rows
    source = where.partition(": column ")[0]
    note = f"{source}: took part {part} of {len(parts)}, {taken.stop - taken.start} of {len(t)} rows"
    first = float(found.t_s[0]) if len(found.t_s) else 0.0
    return Times(found.t_s - first, rows, found.origin_s + first, (note, *found.notes), found.dropped)


def _counts(
    values: NDArray[Any], factor: float, wrap: float | None, name: str, source: str
) -> tuple[NDArray[np.float64], float]:
    """Return times from the first one on, s, and the first one; integers are subtracted before they lose digits."""
    if values.dtype == object:
        raise InputError(
            f"{source}: column {name} holds {str(values[0])[:40]!r}, no number; the unit datetime reads dates"
        )
    finite = np.flatnonzero(np.isfinite(np.asarray(values, dtype=float)))
    if not len(finite):
        raise InputError(f"{source}: column {name} holds no time; give another column, or rate_hz")
    first = values[finite[0]]
    steps = (values.astype(np.int64) - int(first) if values.dtype.kind in "iu" else values - first).astype(float)
    if wrap is not None:
        jumps = np.diff(steps, prepend=steps[:1])
        steps = steps + wrap * np.cumsum(np.where(jumps < -0.5 * wrap, 1.0, 0.0))
    origin = float(first) * factor
    if abs(origin) <= _FAR:
        return steps * factor + origin, 0.0
    return steps * factor, origin


def _dates(values: NDArray[Any], name: str, source: str) -> tuple[NDArray[np.float64], float]:
    """Return times of dates or times of day from the first one on, s, and the first one."""
    if values.dtype.kind == "M":
        stamps = values.astype("datetime64[ns]").astype(np.int64)
        known = ~np.isnat(values)
    else:
        stamps, known = nanoseconds_of(values)
    if not known.any():
        raise InputError(
            f"{source}: column {name} holds {str(values[0])[:40]!r}, no date as 2024-05-17 12:00:00.000 and no time of "
            "day as 12:00:00.000"
        )
    first = int(stamps[known][0])
    return np.where(known, (stamps - first) * 1e-9, np.nan), first * 1e-9


def increasing_times(t: NDArray[np.float64], origin: float, where: str, *, drop: Collection[str] = ()) -> Times:
    """Leave out as few rows as possible so that the times of the others increase.

    A row is a duplicate where another row that stays has its time, else it is unordered. So one wild time costs one
    row, and a block that was written twice costs its second copy.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Times from the first one on, s; NaN where a row has none.
    origin : float
        Time on the file's clock at which ``t`` is zero, s.
    where : str
        File and column, for messages.
    drop : collection of str
        ``duplicates`` or ``unordered``: such rows are left out however many they are. Without that more than 2 % of
        the rows are an error.

    Raises
    ------
    InputError
        If too many times do not increase.
    """
    known = np.isfinite(t) & (np.abs(t) <= _LONGEST)
    kept = known.copy()
    if np.any(np.diff(t[known]) <= 0.0):
        kept[known] = _longest_increasing(t[known])
    lost = known & ~kept
    repeated = lost & np.isin(t, t[kept])
    rows = {"duplicates": repeated, "unordered": lost & ~repeated, "untimed": ~known}
    refused = sum(int(found.sum()) for kind, found in rows.items() if kind not in {"untimed", *drop})
    if refused > max(_MOST_DROPPED * len(t), 1):
        row = int(np.flatnonzero(known)[1:][np.diff(t[known]) <= 0.0][0])
        raise InputError(
            f"{where}: {int(lost.sum())} of {len(t)} times do not increase, the first in row {row + 1} "
            f"({t[row]:.9g} s); a counter that starts anew needs wrap, rounded times rate_hz in place of the column; "
            f"drop = [{', '.join(repr(kind) for kind in ('duplicates', 'unordered') if rows[kind].any())}] leaves the "
            "rows out"
        )
    said = {
        "duplicates": "whose time does not increase (it repeats another row's)",
        "unordered": "whose time does not increase (out of order)",
        "untimed": "without a time",
    }
    counts = {kind: int(found.sum()) for kind, found in rows.items() if found.any()}
    source = where.partition(": column ")[0]
    notes = tuple(f"{source}: left out {count} rows {said[kind]}" for kind, count in counts.items())
    return Times(t[kept], kept, origin, notes, counts)


def _longest_increasing(t: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Mark the largest number of rows whose times increase strictly; of equal times the first."""
    ends: list[float] = []  # least last time of a chain, by its length
    places: list[int] = []  # where that chain ends
    before = np.full(len(t), -1)
    for place, time in enumerate(t.tolist()):
        length = bisect_left(ends, time)
        if length:
            before[place] = places[length - 1]
        if length == len(ends):
            ends.append(time)
            places.append(place)
        elif time < ends[length]:
            ends[length], places[length] = time, place
    kept = np.zeros(len(t), dtype=bool)
    place = places[-1] if places else -1
    while place >= 0:
        kept[place] = True
        place = int(before[place])
    return kept


def _listed(table: RawTable) -> str:
    return ", ".join(list(table.columns)[:12])
