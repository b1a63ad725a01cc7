"""Temperature between the steps that its sensor is read in."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from gfimu.diagnosis.data.rounding import common_step

__all__ = ["between_steps"]

_MOST_CHANGES = 0.1  # to and fro, of the samples; where there are more the noise shows between the steps
_ONE_CHANGE = 0.5  # of the usual time from one value to the next, within which there and back is one change
_LEAST_CHANGES = 4


def between_steps(t: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return what passes through the steps of rounded readings of something slow; others are returned as they are.

    Where a reading changes from one value to the next, what it rounds is half way between them. A board's temperature
    in sixteenths of a degree would otherwise leave a strong dependence on it half a step off.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Times, s.
    values : ndarray, shape (n,)
        Readings.
    """
    step = common_step(values)
    after = np.flatnonzero(np.diff(values)) + 1
    if step is None:
        return values
    back = np.count_nonzero(np.diff(np.sign(values[after] - values[after - 1])))
    if back > _MOST_CHANGES * len(values):
        return values
    times, levels = 0.5 * (t[after - 1] + t[after]), 0.5 * (values[after - 1] + values[after])
    onward = np.diff(levels) != 0.0
    if onward.sum() < _LEAST_CHANGES:
        return values
    apart = np.diff(times)
    change = np.concatenate([[0], np.cumsum(onward | (apart > _ONE_CHANGE * np.median(apart[onward])))])
    count = np.bincount(change)
    times, levels = np.bincount(change, times) / count, np.bincount(change, levels) / count
    through = CubicSpline(times, levels, bc_type="natural")
    inside = np.clip(t, times[0], times[-1])
    straight_on = through(inside) + through(inside, 1) * (t - inside)
    return np.asarray(np.clip(straight_on, values - 0.5 * step, values + 0.5 * step))
