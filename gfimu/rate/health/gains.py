"""Gains and axes of a recording that was not calibrated, learnt by the rate filter before its channels are watched."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.rate.health.fault import ChannelHealth
from gfimu.rate.live import LiveRateFilter
from gfimu.rate.reduction import equal_since
from gfimu.rate.sensing import SensorErrors

__all__ = ["gross_faults", "with_learnt_gains"]

_GROSS = 3.0  # standard deviations of what errors of gains make of the largest reading, that a gross fault exceeds


def with_learnt_gains(
    array: AccelerometerArray,
    t: NDArray[np.float64],
    readings: NDArray[np.float64],
    errors: SensorErrors,
    faulty: NDArray[np.bool_],
) -> tuple[NDArray[np.float64], SensorErrors]:
    """Return readings (n, c), m/s², without the errors of gains and axes that their motion shows, and what is left.

    A fault is a change of one channel at some moment, which the errors of gains, constant over the run, hardly follow.
    Readings that are ``faulty`` (n, c) teach nothing. Readings and errors stay where the run doesn't begin at rest, or
    its motion shows nothing of the errors.
    """
    if errors.gain_std == 0.0:
        return readings, errors
    live = LiveRateFilter(array, errors, float(np.median(np.diff(t))))
    live.run_recording(t, np.where(faulty, np.nan, readings), smooth=False)
    if live.start is None or live.start.sign_open:
        return readings, errors
    shown, left = live.channel_errors(readings)
    if not left < errors.gain_std:
        return readings, errors
    held = np.take_along_axis(shown, equal_since(readings), axis=0)  # a channel that is stuck stays so
    return readings - held, replace(errors, scale_std=left, axis_std=0.0)


def gross_faults(
    health: ChannelHealth,
    array: AccelerometerArray,
    t: NDArray[np.float64],
    readings: NDArray[np.float64],
    errors: SensorErrors,
) -> NDArray[np.bool_]:
    """Mark the readings (n, c) of channels during faults that are larger than errors of gains can be.

    Where it is not known which channels are at fault, those of all are marked.
    """
    marked = np.zeros(readings.shape, dtype=np.bool_)
    limits = _GROSS * errors.gain_std * np.abs(np.nan_to_num(readings)).max(axis=0)
    for fault in health.faults:
        columns = np.array([array.channels.index(name) for name in fault.channels])
        if np.any(np.abs(fault.sizes) > limits[columns]):
            rows = np.flatnonzero((t >= fault.onset_s) & (t < fault.end_s))
            marked[np.ix_(rows, columns if fault.isolated else np.arange(array.n_channels))] = True
    return marked
