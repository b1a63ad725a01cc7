"""The health of the channels of a whole recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError
from gfimu.rate.health.fault import ChannelFault, ChannelHealth
from gfimu.rate.health.kinds import name_kinds
from gfimu.rate.health.monitor import ChannelMonitor
from gfimu.rate.health.policy import MonitorPolicy
from gfimu.rate.health.recursion.blocks import block_means
from gfimu.rate.health.residue import agree, larger_errors, with_residue, without_noisy_channel
from gfimu.rate.health.rest import leading_rest_bias, with_measured_noise
from gfimu.rate.health.start import Settling
from gfimu.rate.live import LiveRateFilter
from gfimu.rate.sensing import SensorErrors
from gfimu.rate.settings import FilterSettings

__all__ = ["watch_channels", "watch_from_rest", "watch_in_motion"]


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
    factor, monitor, judged = 0.5, None, None
    everything = np.ones(array.n_channels, dtype=np.bool_)
    while monitor is None:
        factor *= 2.0
        trial = ChannelMonitor(
            array, larger_errors(errors, factor), period, omega0=omega0, omega0_std=omega0_std, policy=settings
        )
        if judged is None:
            judged = without_noisy_channel(trial.follower, blocks, everything, settings)
        agrees = agree(trial.follower, blocks, trial.innovations(blocks), settings, judged=judged)
        if agrees or factor >= settings.largest_factor:
            trial.refuse(not agrees)
            monitor = trial
    monitor.extend(blocks)
    odd = monitor.unexplained
    rate = np.zeros((len(times), 3))
    if len(blocks):
        rate = np.column_stack([np.interp(times, blocks.t, column) for column in monitor.omega.T])
    faults = name_kinds(array, errors, times, rows, rate, monitor.faults, policy=settings)
    doubts = tuple(monitor.doubtful)
    before = (settings.margin + 0.5) * monitor.block_s
    excluded = _concerned(array, times, faults, before)
    unexplained = np.zeros(len(times), dtype=np.bool_)
    unexplained[: len(odd) * samples] = np.repeat(odd, samples)
    return ChannelHealth(
        tuple(array.channels), (*faults, *doubts), excluded, _concerned(array, times, doubts, 0.0), unexplained,
        monitor.largest_statistic, monitor.threshold, factor,
    )  # fmt: skip


def watch_in_motion(
    array: AccelerometerArray,
    t: ArrayLike,
    readings: ArrayLike,
    errors: SensorErrors,
    *,
    omega0: ArrayLike | None,
) -> ChannelHealth | None:
    """Find the faulty channels of a recording that begins in motion, from when the rate filter has settled on.

    Parameters are those of `watch_channels`; ``omega0`` is the rate at the first sample, or None where it is not known.
    None where the filter never settles: the sign of the rate stays undecided, or the motion does not show the biases;
    or where the array has too few channels for a fault to be isolated.

    Raises
    ------
    InputError
        As `watch_channels`.
    """
    settings = MonitorPolicy()
    if array.n_channels - 7 < settings.fewest_null:
        return None
    times, rows = np.asarray(t, dtype=float), np.asarray(readings, dtype=float)
    period = float(np.median(np.diff(times)))
    start_omega = None if omega0 is None else np.asarray(omega0, dtype=float)
    live = LiveRateFilter(array, errors, period, FilterSettings(start_omega=start_omega))
    second = max(1, round(1.0 / period))
    settling, done, start = Settling(period, settings), 0, None
    for first in range(0, len(times), second):
        part = slice(first, first + second)
        estimates = live.push(times[part], rows[part])
        settling.add(estimates)
        done += len(estimates)
        start = settling.start(live)
        if start is not None:
            break
    if start is None or len(times) - done < 2:
        return None
    left = with_residue(array, with_measured_noise(period, rows[:done], errors, settings), settings)
    left = replace(left, bias_std=np.maximum(left.bias_std, start.bias_std))
    found = watch_channels(
        array, times[done:], rows[done:] - start.bias, left,
        omega0=start.omega, omega0_std=max(start.omega_std, 1e-3), policy=settings,
    )  # fmt: skip
    return found.behind(done)


def _concerned(
    array: AccelerometerArray, times: NDArray[np.float64], faults: Sequence[ChannelFault], before: float
) -> NDArray[np.bool_]:
    """Return which readings the faults concern, shape (n, c), from some seconds before their onsets on."""
    concerned = np.zeros((len(times), array.n_channels), dtype=np.bool_)
    for fault in faults:
        inside = (times >= fault.onset_s - before) & (times < fault.end_s)
        for name in fault.channels:
            concerned[inside, array.channels.index(name)] = True
    return concerned


def watch_from_rest(
    array: AccelerometerArray, t: ArrayLike, readings: ArrayLike, errors: SensorErrors
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
    settings = MonitorPolicy()
    if array.n_channels - 7 < settings.fewest_null:
        return None
    times = np.asarray(t, dtype=float)
    rows = np.asarray(readings, dtype=float)
    period = float(np.median(np.diff(times)))
    errors = with_measured_noise(period, rows[: round(settings.live_rest_s / period)], errors, settings)
    bias = leading_rest_bias(array, period, rows, errors, settings)
    if bias is None:
        return None
    left = with_residue(array, errors, settings)
    return watch_channels(array, times, rows - bias, left, policy=settings)
