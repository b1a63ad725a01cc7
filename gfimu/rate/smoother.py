"""Rate smoother: the best estimate of each sample from the whole recording.

The filter runs forward, then the corrections of all later samples are carried back: Rauch–Tung–Striebel in the form of
Bryson & Frazier, which needs no inverse of a covariance (G. J. Bierman, Automatica 9, 1973). The filter's states are
kept once per block and each block is filtered again on the way back, so memory does not grow with a full covariance
per sample.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.rate.filter import increasing_times, require_finite, run_filter
from gfimu.rate.kalman import FilterSettings, KalmanRateFilter, plausible_start, spread_rest
from gfimu.rate.refinement import refined
from gfimu.rate.result import RateEstimate, SignDecision
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
    progress: Callable[[float], object] | None = None,
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
    progress : callable, optional
        Called with the share of the work done so far, 0 to 1.

    Returns
    -------
    RateEstimate
        ``nis`` are the innovations of the filter; ``bias`` is the estimate from the whole recording.

    Raises
    ------
    InputError
        If the shapes don't fit, time does not increase or there are fewer than two samples.
    """
    times, period = increasing_times(t, "the smoother")
    rows = np.asarray(readings, dtype=float)
    turning = None if gyro is None else np.asarray(gyro, dtype=float)

    def run(with_settings: FilterSettings) -> RateEstimate:
        return _smoothed(array, times, rows, errors, with_settings, turning, period, progress)

    chosen = plausible_start(array, times, rows, errors, settings or FilterSettings())
    return refined(array, times, rows, errors, chosen, run, causal=False)


def _smoothed(
    array: AccelerometerArray,
    times: NDArray[np.float64],
    rows: NDArray[np.float64],
    errors: SensorErrors,
    chosen: FilterSettings,
    turning: NDArray[np.float64] | None,
    period: float,
    progress: Callable[[float], object] | None,
) -> RateEstimate:
    """Smooth with a known or an unknown start."""
    if chosen.start_omega is not None:
        smoothed_run = _smooth(array, times, rows, errors, chosen, turning, period, progress)
        window = chosen.rest.window(period) if chosen.rest else 0
        doubtful = 0 < window <= len(times) and not np.any(chosen.start_omega) and not smoothed_run.rest[:window].any()
        return replace(smoothed_run, sign=SignDecision("undecided", 0.0)) if doubtful else smoothed_run
    # Unknown start: the filter judges the hypotheses by the whole run, then those that remain are smoothed.
    filtered, live = run_filter(array, times, rows, errors, chosen, gyro=turning)
    if not live.hypotheses:
        return replace(filtered, method="smoother")
    first = int(np.argmax(filtered.t_s >= live.started_at_s))
    tail = None if turning is None else turning[first:]
    smoothed = [
        _smooth(array, times[first:], rows[first:], errors, hypothesis.settings, tail, period, progress)
        for hypothesis in live.hypotheses
    ]
    smoothed = [replace(_prepend(filtered, first, result), sign=live.sign) for result in smoothed]
    return smoothed[0] if len(smoothed) == 1 else replace(smoothed[0], mirrored=smoothed[1])


def _prepend(waiting: RateEstimate, count: int, result: RateEstimate) -> RateEstimate:
    """Put the first ``count`` samples of ``waiting``, from before the start, before a result."""
    columns: dict[str, Any] = {
        name: np.concatenate([getattr(waiting, name)[:count], getattr(result, name)])
        for name in ("t_s", "omega", "covariance", "nis", "nis_dof", "rest")
    }
    return replace(result, **columns)


def _smooth(
    array: AccelerometerArray,
    t: NDArray[np.float64],
    readings: NDArray[np.float64],
    errors: SensorErrors,
    settings: FilterSettings,
    gyro: NDArray[np.float64] | None,
    period: float,
    progress: Callable[[float], object] | None = None,
) -> RateEstimate:
    """Smooth with a known start."""
    process = KalmanRateFilter(array, errors, period, settings, gyro=gyro is not None, capacity=len(t))
    process.progress = progress
    forward = process.record_run(t, readings, gyro)
    require_finite(array, process.estimate(forward))
    omega, covariance = process.run_back()
    window = settings.rest.window(period) if settings.rest else 0
    return replace(
        process.estimate(forward, "smoother"),
        omega=omega,
        covariance=covariance,
        rest=spread_rest(forward.columns.rest, window),
    )
