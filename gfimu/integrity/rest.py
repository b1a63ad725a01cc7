"""What a rest at the start shows of the biases."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gfimu.geometry.array import AccelerometerArray
from gfimu.integrity.policy import MonitorPolicy
from gfimu.rate.rest_test import RestTest, constant_readings
from gfimu.rate.sensing import SensorErrors

__all__ = ["leading_rest", "leading_rest_bias", "rest_bias"]


def leading_rest(
    array: AccelerometerArray, period: float, readings: NDArray[np.float64], errors: SensorErrors
) -> tuple[int, bool]:
    """Return how many samples at the start are at rest, and whether that rest is over.

    Parameters
    ----------
    array : AccelerometerArray
        The array.
    period : float
        Sample period, s.
    readings : ndarray, shape (n, c)
        Specific force, m/s²; NaN where missing.
    errors : SensorErrors
        Noise of its channels.
    """
    window = RestTest().window(period)
    constant = constant_readings(array, readings, errors.noise_std, period)
    whole = len(constant) // window * window
    moving = np.flatnonzero(~constant[:whole])
    if not moving.size:
        return whole, False
    return max(0, int(moving[0]) - window), True  # the last block may be the start of a slow motion


def rest_bias(array: AccelerometerArray, readings: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return what the mean of readings at rest (n, c), m/s², says of the biases, shape (c,), m/s².

    Of the mean reading, the specific force p that fits it best is taken off: that is gravity. What of a bias looks like
    a specific force stays unknown, and changes neither α nor the null space.
    """
    mean = np.mean(readings, axis=0)
    gravity = array.regression_matrix[:, 3:]
    return np.asarray(mean - gravity @ np.linalg.lstsq(gravity, mean, rcond=None)[0])


def leading_rest_bias(
    array: AccelerometerArray,
    period: float,
    readings: NDArray[np.float64],
    errors: SensorErrors,
    policy: MonitorPolicy,
) -> NDArray[np.float64] | None:
    """Return the biases that a rest at the start shows, shape (c,), m/s²; None without one that is long enough."""
    length, _ = leading_rest(array, period, readings, errors)
    if length == 0 or length * period < policy.least_rest_s:
        return None
    return rest_bias(array, readings[:length])
