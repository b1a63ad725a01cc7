"""The times of a foreign table: from counts, texts or a constant rate to seconds that increase."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.errors import InputError
from gfimu.importing.column_map import TimeSpec
from gfimu.importing.notation import factor_of
from gfimu.importing.raw_table import RawTable

__all__ = ["Times", "times_of"]

_FAR = 100.0  # s: times beyond count from the first sample; they keep their digits, and pictures begin there
_MOST_DROPPED = 0.02  # of the rows, whose time does not increase


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
    """

    t_s: NDArray[np.float64]
    rows: NDArray[np.bool_]
    origin_s: float
    notes: tuple[str, ...]


def times_of(table: RawTable, spec: TimeSpec, source: str) -> Times:
    """Return the times of a table's rows.

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
    if spec.unit == "datetime" or table.columns[name].dtype.kind == "M":
        steps, origin = _dates(table.columns[name], name, source)
    else:
        factor = spec.scale * factor_of(spec.unit, "time", where=f"{source}: time")
        steps, origin = _counts(table.columns[name], factor, spec.wrap, name, source)
    return _increasing(steps, origin, name, source)


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
    try:
        stamps = values.astype("datetime64[ns]")
    except (ValueError, TypeError):
        raise InputError(
            f"{source}: column {name} holds {str(values[0])[:40]!r}, no date as 2024-05-17 12:00:00.000"
        ) from None
    known = ~np.isnat(stamps)
    first = stamps[known][0] if known.any() else stamps[0]
    steps = np.where(known, (stamps - first).astype("int64") * 1e-9, np.nan)
    return steps, float(first.astype("int64")) * 1e-9


def _increasing(t: NDArray[np.float64], origin: float, name: str, source: str) -> Times:
    """Leave out rows without a time, or with one that was reached before; many of them are an error."""
    known = np.isfinite(t)
    highest = np.maximum.accumulate(np.where(known, t, -np.inf))
    kept = known & (t > np.concatenate([[-np.inf], highest[:-1]]))
    lost, notes = int(known.sum() - kept.sum()), []
    if lost > max(_MOST_DROPPED * len(t), 1):
        row = int(np.flatnonzero(known & ~kept)[0])
        raise InputError(
            f"{source}: column {name}: {lost} of {len(t)} times do not increase, the first in row {row + 1} "
            f"({t[row]:.9g} s); a counter that starts anew needs wrap, rounded times rate_hz in place of the column"
        )
    if lost:
        notes.append(f"{source}: left out {lost} rows whose time does not increase (repeated or out of order)")
    if not known.all():
        notes.append(f"{source}: left out {int((~known).sum())} rows without a time")
    return Times(t[kept], kept, origin, tuple(notes))


def _listed(table: RawTable) -> str:
    return ", ".join(list(table.columns)[:12])
