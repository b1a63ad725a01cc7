"""What the start of a run shows of the channels: their noise, and in a rest their biases."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from gfimu.array.array import AccelerometerArray
from gfimu.rate.health.policy import MonitorPolicy
from gfimu.rate.health.recursion.blocks import block_means, detrended_variance
from gfimu.rate.rest_test import RestTest, constant_readings
from gfimu.rate.sensing import SensorErrors
from gfimu.rate.start import start_of_still

__all__ = ["leading_rest", "leading_rest_bias", "rest_bias", "with_measured_noise"]


def with_measured_noise(
    period: float, readings: NDArray[np.float64], errors: SensorErrors, policy: MonitorPolicy
) -> SensorErrors:
    """Return the errors with the white noise of each channel as it is, where that is more than stated.

    A data sheet states typical noise. The variance of each channel is measured within blocks, without what a motion
    adds to them, as the median over the blocks: neither an impact nor a motion in less than half of them shows. Its
    logarithm is drawn to the stated one by the spread of it from part to part (``noise_spread``), and it is at most
    ``largest_noise`` times the stated standard deviation.

    Parameters
    ----------
    period : float
        Sample period, s.
    readings : ndarray, shape (n, c)
        Specific force, m/s²; NaN where missing. The last ``noise_span_s`` of it are used.
    errors : SensorErrors
        Stated errors.
    policy : MonitorPolicy
        Length of the blocks, spread and limit.
    """
    samples = policy.samples(period)
    part = readings[-max(samples, round(policy.noise_span_s / period)) :]
    blocks = block_means(np.arange(float(len(part))), part, errors.limits, samples)
    variance, freedom = detrended_variance(blocks)  # (m, c)
    if not len(blocks):
        return errors
    # A channel without any reading has zeros, and stays as stated.
    absent = blocks.missing & ~blocks.missing.all(axis=0)
    count = np.maximum((~blocks.missing).sum(axis=0), 1)
    shown = np.nanmedian(np.where(absent, np.nan, variance), axis=0)
    ratio = shown / (chdtri(freedom, 0.5) / freedom) / errors.noise_std**2
    doubt = np.pi / (freedom * count)  # variance of ln ratio: that of a median is π/2 times a mean's, 2/(ν m)
    drawn = policy.noise_spread**2 / (policy.noise_spread**2 + doubt)
    factor = np.clip(ratio, 1.0, policy.largest_noise**2) ** (0.5 * drawn)
    return replace(errors, noise_std=errors.noise_std * factor)


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
    if start_of_still(array, readings[:length], errors).kind == "spin":
        return None
    return rest_bias(array, readings[:length])
