"""The least fault that the monitor of channels detects and isolates, per channel, in closed form.

A constant fault f on channel i puts f z_i, column i of the whitened null space Z (d, c), into the mean of N samples, on
top of white noise of covariance 1/N and of the biases of all channels. A bias is known to m before the onset, and its
variance grows by q per second; over T seconds that counts as a constant of variance m² + q T/2 on every channel. So

    C = Zᵀ (1/N + (m² + q T/2) Z Zᵀ)⁻¹ Z                                                                 (1)

is the information on constant faults, and the statistic of channel i is the square of a normal variable with the mean
f √C_ii. It exceeds the threshold h with a probability of 95 % from

    f_i = (√h + 1.65) / √C_ii                                                                            (2)

on. Channel j explains the share cos²_ij = C_ij²/(C_ii C_jj) of it; the fault is isolated where the part that no other
channel explains, C_ii (1 − max cos²) f², exceeds the margin m by its own spread,

    C_ii (1 − max cos²) f² ≥ m + 2 · 1.65 √m + 1.65².                                                    (3)

This is the limit of a test that knows the onset.

ω is taken as known: at rest, or carried by the filter. With ``unknown_rate`` the products of ω are unknown in every
sample, and only what of Z lies across M (z = M s(ω)) remains: that is all that a test of single samples (the parity
space) can use.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError
from gfimu.base.short_repr import short_repr
from gfimu.rate.channel_sets import ChannelSets
from gfimu.rate.health.policy import MonitorPolicy
from gfimu.rate.sensing import SensorErrors

__all__ = ["DetectableFaults", "detectable_faults", "least_fault"]

_QUANTILE = 1.65  # standard normal, one-sided 95 %
_EQUAL = 1e-6  # numerical: channels whose signatures differ by less than this share are one
_RANK = 1e-6  # numerical: of the products' strengths, below which one is not seen


@dataclass(frozen=True)
class DetectableFaults:
    """Least constant fault of each channel that can be found within a time, with 95 % probability.

    Parameters
    ----------
    channels : tuple of str
        Names of the c channels.
    detected, isolated : ndarray, shape (c,)
        Least fault that is seen, and that is also assigned to its channel, m/s²; infinite where there is none.
    rivals : tuple of str
        For each channel the one that is hardest to separate from it; empty where its faults are not seen.
    alpha_error : ndarray, shape (c,)
        Error of the angular acceleration that a fault of 1 m/s² on the channel makes, rad/s² per m/s².
    """

    channels: tuple[str, ...]
    detected: NDArray[np.float64]
    isolated: NDArray[np.float64]
    rivals: tuple[str, ...]
    alpha_error: NDArray[np.float64]

    __repr__ = short_repr


def detectable_faults(
    array: AccelerometerArray,
    errors: SensorErrors,
    sample_rate: float,
    *,
    duration: float = 1.0,
    unknown_rate: bool = False,
    policy: MonitorPolicy | None = None,
) -> DetectableFaults:
    """Return the least fault that is detected and isolated within a time.

    Parameters
    ----------
    array : AccelerometerArray
        An array that sees all six motions, with c channels.
    errors : SensorErrors
        Noise of its channels.
    sample_rate : float
        Samples per second, Hz.
    duration : float
        Time since the onset, s.
    unknown_rate : bool
        Whether the rate is unknown in every sample.
    policy : MonitorPolicy, optional
        Threshold and margin.

    Raises
    ------
    GeometryError
        If the array can't see all six motions.
    InputError
        If sample rate or duration are not positive.
    """
    if not (np.isfinite(sample_rate) and sample_rate > 0 and np.isfinite(duration) and duration > 0):
        raise InputError(f"sample rate {sample_rate} Hz and duration {duration} s must be positive")
    policy = policy or MonitorPolicy()
    full = ChannelSets(array, errors.noise_std).full
    null = full.null_rows  # (d, c)
    if unknown_rate and full.nulls:
        left, strengths, _ = np.linalg.svd(full.null_sensitivity / array.length_unit)
        rank = int(np.sum(strengths > _RANK * max(1e-300, strengths.max(initial=0.0))))
        null = left[:, rank:].T @ null
    samples = max(1.0, duration * sample_rate)
    bias = policy.bias_std**2 + 0.5 * policy.bias_walk * duration
    noise = np.eye(len(null)) / samples + bias * null @ null.T
    information = null.T @ np.linalg.solve(noise, null)  # C of (1), (c, c)
    own = np.diag(information)
    visible = np.sum(null**2, axis=0) > _EQUAL / np.max(errors.noise_std) ** 2
    block_s = policy.samples(1.0 / sample_rate) / sample_rate
    threshold = policy.threshold(array.n_channels, block_s)
    with np.errstate(divide="ignore", invalid="ignore"):
        detected = np.where(visible, (np.sqrt(threshold) + _QUANTILE) / np.sqrt(own), np.inf)  # (2)
        square = information**2 / np.outer(own, own)
    square[~np.outer(visible, visible)] = 0.0
    np.fill_diagonal(square, 0.0)
    closest = square.max(axis=0, initial=0.0)
    needed = policy.isolation + 2.0 * _QUANTILE * np.sqrt(policy.isolation) + _QUANTILE**2
    separate = visible & (closest < 1.0 - _EQUAL)
    with np.errstate(divide="ignore", invalid="ignore"):
        apart = np.sqrt(needed / (own * (1.0 - closest)))  # (3)
    isolated = np.where(separate, np.maximum(detected, apart), np.inf)
    rivals = tuple(array.channels[int(np.argmax(row))] if row.any() else "" for row in square)
    return DetectableFaults(
        tuple(array.channels), detected, isolated, rivals,
        np.linalg.norm(full.alpha_rows, axis=0),
    )  # fmt: skip


def least_fault(n_channels: int, noise_std: float, sample_rate: float, *, duration: float = 1.0) -> float:
    """Return the least fault that is detected on a channel that the others predict exactly, m/s².

    With equal white noise on all channels and a known rate, (2) is this over √(1 − h_i), with h_i the leverage of
    channel i, a diagonal element of J (JᵀJ)⁻¹ Jᵀ: |z_i|² = (1 − h_i)/σ² is all that an array changes.

    Parameters
    ----------
    n_channels : int
        Number of channels, which sets the threshold.
    noise_std : float
        White noise of every channel, m/s².
    sample_rate : float
        Samples per second, Hz.
    duration : float
        Time since the onset, s.
    """
    policy = MonitorPolicy()
    samples = max(1.0, duration * sample_rate)
    bias = policy.bias_std**2 + 0.5 * policy.bias_walk * duration
    threshold = policy.threshold(n_channels, policy.samples(1.0 / sample_rate) / sample_rate)
    return float((np.sqrt(threshold) + _QUANTILE) * np.sqrt(noise_std**2 / samples + bias))
