"""References at times of their own: beside a column of a recording stands when each of its values was read.

A reference that comes less often than the channels, or between them, has a value in some rows only. A column
``tacho_t_s`` (``angle_t_s``, ``command_t_s``, ``gyro_t_s``) gives the time at which the value of that row was read, on
the clock of ``t_s``. Without such a column it is the time of the row.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gfimu.recording.quantities import TIME_COLUMNS
from gfimu.recording.recording import Recording

__all__ = ["reference_on_rows", "reference_series", "reference_times"]

_SLOW = 1.5  # sample periods between the values of a reference from which it is a slow one
_BRIDGED = 1.5  # of these distances, across which a slow reference is interpolated
_FEWEST = 4  # values of a cubic


def reference_times(recording: Recording, name: str) -> NDArray[np.float64]:
    """Return the times (n,), s, at which the values of a reference were read; by default those of the rows."""
    own = recording.reference.get(TIME_COLUMNS.get(name, ""))
    return recording.t_s if own is None else np.where(np.isfinite(own), own, recording.t_s)


def reference_series(recording: Recording, name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the times (k,), s, strictly increasing, and the values (k,) of a reference, without its blank cells."""
    values, times = recording.reference[name], reference_times(recording, name)
    known = np.flatnonzero(np.isfinite(values))
    known = known[np.argsort(times[known], kind="stable")]
    later = np.diff(times[known], prepend=-np.inf) > 0.0
    return times[known][later], values[known][later]


def reference_on_rows(recording: Recording) -> Recording:
    """Return a recording whose references have their values at the times of the rows, and no times of their own.

    A cubic spline goes through the values of a reference that is slow or has its own times. It does not cross gaps, in
    which cells stay blank. The recording itself where nothing is to be done.
    """
    columns = dict(recording.reference)
    for name in TIME_COLUMNS:
        if name not in columns:
            continue
        t, values = reference_series(recording, name)
        if len(t) < _FEWEST:
            continue
        spacing = float(np.median(np.diff(t)))
        if TIME_COLUMNS[name] not in columns and spacing < _SLOW * recording.sample_period:
            continue
        rows = recording.t_s
        after = np.clip(np.searchsorted(t, rows), 1, len(t) - 1)
        near = (t[after] - t[after - 1] <= _BRIDGED * spacing) | (
            np.abs(rows - t[after - 1]) <= recording.sample_period
        )
        near &= (rows >= t[0] - recording.sample_period) & (rows <= t[-1] + recording.sample_period)
        from scipy.interpolate import CubicSpline  # takes a while, and few recordings need it

        columns[name] = np.where(near, CubicSpline(t, values)(rows), np.nan)
    kept = {name: one for name, one in columns.items() if name not in TIME_COLUMNS.values()}
    changed = len(kept) < len(columns) or any(kept[name] is not recording.reference[name] for name in kept)
    return replace(recording, reference=kept) if changed else recording
