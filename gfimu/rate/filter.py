"""Rate filter over a whole recording: the causal estimate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import GeometryError, InputError
from gfimu.rate.kalman import FilterSettings, join, plausible_start, spread_rest
from gfimu.rate.live import LiveRateFilter
from gfimu.rate.refinement import refined
from gfimu.rate.result import RateEstimate
from gfimu.rate.sensing import SensorErrors

__all__ = ["filter_rate", "increasing_times", "require_finite", "run_filter"]


def filter_rate(
    array: AccelerometerArray,
    t: ArrayLike,
    readings: ArrayLike,
    errors: SensorErrors,
    settings: FilterSettings | None = None,
    *,
    gyro: ArrayLike | None = None,
    progress: Callable[[float], object] | None = None,
) -> RateEstimate:
    """Filter a recording: the causal estimate of the angular rate.

    Parameters
    ----------
    array : AccelerometerArray
        An array that sees all six motions.
    t : array_like, shape (n,)
        Sample times, s.
    readings : array_like, shape (n, c)
        Specific force, m/s²; NaN where a channel is missing.
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
        With an unknown start the whole run of the hypothesis that won; ``sign`` states from when on that was certain.
        Until the rate exceeds what the biases allow it is zero, with a standard deviation that covers what they allow.

    Raises
    ------
    InputError
        If the shapes don't fit, time does not increase or there are fewer than two samples.
    GeometryError
        If the array can't see all six motions, or can't find an unknown start.
    """
    times, rows = np.asarray(t, dtype=float), np.asarray(readings, dtype=float)
    chosen = plausible_start(array, times, rows, errors, settings or FilterSettings())

    def run(with_settings: FilterSettings) -> RateEstimate:
        return run_filter(array, times, rows, errors, with_settings, gyro=gyro, progress=progress)[0]

    return refined(array, times, rows, errors, chosen, run, causal=True)


def increasing_times(t: ArrayLike, needed_by: str) -> tuple[NDArray[np.float64], float]:
    """Return sample times, shape (n,), s, and their median step, s.

    Raises
    ------
    InputError
        If there are fewer than two, or they do not increase.
    """
    times = np.asarray(t, dtype=float)
    if times.ndim != 1 or len(times) < 2:
        raise InputError(f"{needed_by} needs at least two samples; record longer")
    if not np.isfinite(times).all() or np.any(np.diff(times) <= 0):
        raise InputError("sample times must be finite and increase; drop repeated or reordered samples")
    return times, float(np.median(np.diff(times)))


def require_finite(array: AccelerometerArray, result: RateEstimate) -> None:
    """Refuse an estimate that ran away.

    Raises
    ------
    GeometryError
        If the rate is not finite everywhere: the array leaves products of ω in α that its null space doesn't see.
    """
    broken = ~np.isfinite(result.omega).all(axis=1) & (result.channels.samples_without_rate == 0)
    if broken.any():
        raise GeometryError(
            f"the rate ran away at t = {result.t_s[int(np.argmax(broken))]:.4g} s: array {array.name!r} leaves "
            "products of the rate in α, which feed back on themselves; turn slower, or use an array that sees them"
        )


def run_filter(
    array: AccelerometerArray,
    t: ArrayLike,
    readings: ArrayLike,
    errors: SensorErrors,
    settings: FilterSettings | None = None,
    *,
    gyro: ArrayLike | None = None,
    progress: Callable[[float], object] | None = None,
) -> tuple[RateEstimate, LiveRateFilter]:
    """Like `filter_rate`; also returns the filter as it is at the end."""
    times, period = increasing_times(t, "the filter")
    live = LiveRateFilter(array, errors, period, settings, gyro=gyro is not None, progress=progress)
    pushed, _ = live.push_raw(times, readings, gyro)
    if not live.hypotheses:  # never clear of the biases
        return live.describe(pushed[0]), live
    last, _ = live.finish_raw()
    rest = live.settings.rest
    window = rest.window(live.period) if rest else 0
    tracks = []
    for index, first in enumerate(pushed):
        # Once decided within the block, only the winner goes on.
        if len(last) == len(pushed):
            tracks.append(join([first, last[index]]))
        elif index == live.winner:
            tracks.append(join([first, last[0]]))
    if live.sign.state == "decided" and len(tracks) == 2:  # decided by the very last samples
        tracks = [tracks[live.winner]]
    for hypothesis, track in zip(live.hypotheses, tracks, strict=True):
        for begin, end in hypothesis.contradicted:
            rows = (track.t >= begin) & (track.t <= end)
            track.columns.omega[rows], track.columns.covariance[rows] = np.nan, np.nan
    results = [
        replace(hypothesis.estimate(track), sign=live.sign, rest=spread_rest(track.columns.rest, window))
        for hypothesis, track in zip(live.hypotheses, tracks, strict=True)
    ]
    for result in results:
        require_finite(array, result)
    return (results[0] if len(results) == 1 else replace(results[0], mirrored=results[1])), live
