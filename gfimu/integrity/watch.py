"""The health of the channels of a whole recording."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import chdtri

from gfimu.errors import InputError
from gfimu.geometry.array import AccelerometerArray
from gfimu.integrity.fault import ChannelHealth
from gfimu.integrity.kinds import name_kinds
from gfimu.integrity.monitor import ChannelMonitor
from gfimu.integrity.policy import MonitorPolicy
from gfimu.integrity.recursion.blocks import Blocks, block_means
from gfimu.rate.rest_test import RestTest, constant_readings
from gfimu.rate.sensing import SensorErrors

__all__ = ["leading_rest_bias", "watch_channels", "watch_from_rest"]

_LEAST_SCALE = 1e-4  # numerical: a ratio, where gains and axes are stated as exact
_LEAST_PLACE = 2e-5  # numerical: m, the same of positions


def watch_channels(
    array: AccelerometerArray,
    t: ArrayLike,
    readings: ArrayLike,
    errors: SensorErrors,
    *,
    omega0: ArrayLike = (0.0, 0.0, 0.0),
    omega0_std: float = 1e-3,
    policy: MonitorPolicy | None = None,
) -> ChannelHealth:
    """Find the faulty channels of a recording.

    How well the channels agree is measured first: if their innovations are larger than the stated errors explain in
    three quarters of all seconds, then the errors of gains, axes and positions are larger than stated, and only faults
    that exceed those are excluded.

    Parameters
    ----------
    array : AccelerometerArray
        An array that sees all six motions, with c channels.
    t : array_like, shape (n,)
        Sample times, s.
    readings : array_like, shape (n, c)
        Specific force, m/s²; NaN where missing.
    errors : SensorErrors
        Errors of the channels.
    omega0, omega0_std : array_like, float
        Angular rate at the first sample and its standard deviation, rad/s.
    policy : MonitorPolicy, optional
        Thresholds.

    Raises
    ------
    InputError
        If the shapes don't fit or time does not increase.
    GeometryError
        If the array can't see all six motions.
    """
    times = np.asarray(t, dtype=float)
    rows = np.asarray(readings, dtype=float)
    if times.ndim != 1 or len(times) < 2 or rows.shape != (len(times), array.n_channels):
        raise InputError(
            f"times have shape {times.shape} and readings {rows.shape}; array {array.name!r} needs one "
            f"row of {array.n_channels} per time, two at least"
        )
    if not np.isfinite(times).all() or np.any(np.diff(times) <= 0):
        raise InputError("sample times must be finite and increase; drop repeated or reordered samples")
    period = float(np.median(np.diff(times)))
    settings = policy or MonitorPolicy()
    samples = settings.samples(period)
    blocks = block_means(times, rows, errors.limits, samples)
    factor, monitor = 0.5, None
    while monitor is None:
        factor *= 2.0
        trial = ChannelMonitor(
            array, _larger(errors, factor), period, omega0=omega0, omega0_std=omega0_std, policy=settings
        )
        if factor >= settings.largest_factor or _agrees(trial, blocks):
            monitor = trial
    monitor.extend(blocks)
    odd = monitor.unexplained
    rate = np.zeros((len(times), 3))
    if len(blocks):
        rate = np.column_stack([np.interp(times, blocks.t, column) for column in monitor.omega.T])
    faults = name_kinds(array, errors, times, rows, rate, monitor.faults, policy=settings)
    excluded = np.zeros(rows.shape, dtype=np.bool_)
    before = (settings.margin + 0.5) * monitor.block_s
    for fault in faults:
        inside = (times >= fault.onset_s - before) & (times < fault.end_s)
        for name in fault.channels:
            excluded[inside, array.channels.index(name)] = True
    unexplained = np.zeros(len(times), dtype=np.bool_)
    unexplained[: len(odd) * samples] = np.repeat(odd, samples)
    return ChannelHealth(
        tuple(array.channels), faults, excluded, unexplained, monitor.largest_statistic, monitor.threshold, factor
    )


def watch_from_rest(
    array: AccelerometerArray,
    t: ArrayLike,
    readings: ArrayLike,
    errors: SensorErrors,
    *,
    policy: MonitorPolicy | None = None,
) -> ChannelHealth | None:
    """Find the faulty channels of a recording that starts at rest, with the biases that this rest shows taken off.

    Parameters are those of `watch_channels`; errors of gains and positions are taken as at least those that a good
    calibration leaves. None where the recording doesn't begin with a rest, or the array has too few channels for a
    fault to be isolated.

    Raises
    ------
    InputError
        As `watch_channels`.
    """
    settings = policy or MonitorPolicy()
    if array.n_channels - 7 < settings.fewest_null:
        return None
    times = np.asarray(t, dtype=float)
    rows = np.asarray(readings, dtype=float)
    bias = leading_rest_bias(array, float(np.median(np.diff(times))), rows, errors, settings)
    if bias is None:
        return None
    left = replace(
        errors,
        bias_std=np.full(array.n_channels, settings.bias_std),
        scale_std=max(errors.scale_std, settings.gain_std),
        placement_std=max(errors.placement_std, settings.place_std),
    )
    return watch_channels(array, times, rows - bias, left, policy=settings)


def _larger(errors: SensorErrors, factor: float) -> SensorErrors:
    """Return the errors with those of gains, axes and positions larger by a factor."""
    if factor == 1.0:
        return errors
    return replace(
        errors,
        scale_std=factor * max(errors.scale_std, _LEAST_SCALE),
        placement_std=factor * max(errors.placement_std, _LEAST_PLACE),
    )


def _agrees(monitor: ChannelMonitor, blocks: Blocks) -> bool:
    """Whether a quarter of all seconds of motion, and of rest, have innovations that the stated errors explain."""
    per_second = max(1, round(1.0 / monitor.block_s))
    count = len(blocks) // per_second
    freedom = monitor.null_count * per_second
    if count == 0 or freedom == 0:
        return True
    whole = slice(0, count * per_second)
    nis = monitor.innovations(blocks)[whole].reshape(count, per_second).mean(axis=1)
    spread = np.ptp(blocks.means[whole].reshape(count, per_second, -1), axis=1) / monitor.noise_of_means
    policy = monitor.policy
    moving = spread.max(axis=1) > policy.moving
    limit = chdtri(freedom, policy.agreeing_share) / freedom
    parts = [nis[part] for part in (moving, ~moving) if part.sum() >= min(count, policy.fewest_seconds)]
    return all(bool(np.quantile(part, policy.agreeing_share) <= limit) for part in parts)


def leading_rest_bias(
    array: AccelerometerArray, period: float, readings: NDArray[np.float64], errors: SensorErrors, policy: MonitorPolicy
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
    if length * period < policy.least_rest_s:
        return None
    mean = np.mean(readings[:length], axis=0)
    gravity = array.regression_matrix[:, 3:]
    return np.asarray(mean - gravity @ np.linalg.lstsq(gravity, mean, rcond=None)[0])
