"""Rate smoother: the best estimate of each sample from the whole recording.

The filter runs forward, then the corrections of all later samples are carried back: Rauch–Tung–Striebel in the form of
Bryson & Frazier, which needs no inverse of a covariance (G. J. Bierman, Automatica 9, 1973). The filter's states are
kept once per block and each block is filtered again on the way back, so memory does not grow with a full covariance
per sample.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from gfimu.array import AccelerometerArray
from gfimu.errors import InputError
from gfimu.rate.filter import FilterSettings, RateFilter, spread_rest
from gfimu.rate.result import RateEstimate
from gfimu.rate.sensing import SensorErrors

__all__ = ["smooth_rate"]


def smooth_rate(
    array: AccelerometerArray,
    t: ArrayLike,
    readings: ArrayLike,
    errors: SensorErrors,
    settings: FilterSettings | None = None,
    *,
    gyro: ArrayLike | None = None,
) -> RateEstimate:
    """Smooth a recording: the estimate of the angular rate from all its samples.

    Parameters
    ----------
    array : AccelerometerArray
        An array that sees all six motions.
    t : array_like, shape (n,)
        Sample times, s.
    readings : array_like, shape (n, c)
        Specific force, m/s².
    errors : SensorErrors
        Errors of the sensors.
    settings : FilterSettings, optional
        Start, quadrature, rest.
    gyro : array_like, shape (n, 3), optional
        Gyro to fuse, rad/s; NaN where saturated.

    Returns
    -------
    RateEstimate
        ``nis`` are the innovations of the filter; ``bias`` is the estimate from the whole recording.

    Raises
    ------
    InputError
        If the shapes don't fit, time does not increase or there are fewer than two samples.
    """
    times = np.asarray(t, dtype=float)
    if times.ndim != 1 or len(times) < 2:
        raise InputError("the smoother needs at least two samples; record longer")
    period = float(np.median(np.diff(times)))
    process = RateFilter(array, errors, period, settings, gyro=gyro is not None, capacity=len(times))
    forward = process.record_run(times, readings, gyro)
    omega, covariance = process.run_back()
    return RateEstimate(
        "smoother",
        times,
        omega,
        covariance,
        forward.nis,
        forward.nis_dof,
        spread_rest(forward.rest, process),
        bias=forward.bias,
        bias_covariance=forward.bias_covariance,
        channels=forward.channels,
    )
