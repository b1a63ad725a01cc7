"""The biases that a rest at the start of a recording shows, so that the monitor starts from small ones."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gfimu.geometry.array import AccelerometerArray
from gfimu.rate.rest_test import RestTest, constant_readings
from gfimu.rate.sensing import SensorErrors

__all__ = ["LEAST_REST_S", "leading_rest_bias"]

LEAST_REST_S = 1.0
"""Shortest rest that shows the biases well enough, s."""


def leading_rest_bias(
    array: AccelerometerArray, period: float, readings: NDArray[np.float64], errors: SensorErrors
) -> NDArray[np.float64] | None:
    """Return what the mean readings at the start say of the biases, shape (c,), m/s²; None without a rest there.

    Of the mean reading, the specific force p that fits it best is taken off: that is gravity. What of a bias looks like
    a specific force stays unknown, and changes neither α nor the null space.

    Parameters
    ----------
    array : AccelerometerArray
        An array that sees all six motions, with c channels.
    period : float
        Sample period, s.
    readings : ndarray, shape (n, c)
        Specific force, m/s²; NaN where missing.
    errors : SensorErrors
        Noise of the channels.
    """
    constant = constant_readings(array, readings, errors.noise_std, period)
    length = len(constant) if constant.all() else int(np.argmin(constant))
    window = RestTest().window(period)
    if length < len(constant):
        length -= window  # the last block may be the start of a slow motion
    if length * period < LEAST_REST_S:
        return None
    mean = np.mean(readings[:length], axis=0)
    gravity = array.regression_matrix[:, 3:]
    return np.asarray(mean - gravity @ np.linalg.lstsq(gravity, mean, rcond=None)[0])
