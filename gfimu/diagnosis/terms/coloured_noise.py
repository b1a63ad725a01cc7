"""Levels of noise from residuals: white noise and bias instability per channel, in a cosine basis."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.data.cosine_basis import CosineBasis
from gfimu.diagnosis.policy import Policy

__all__ = ["FLICKER_GRID", "estimate_flicker", "likeliest_flicker", "white_level"]

FLICKER_GRID = 9.80665e-3 * np.geomspace(0.02, 3.0, 22)  # numerical: grid of bias instability, m/s²


def white_level(coefficients: NDArray[np.float64], slowest: float, period: float) -> NDArray[np.float64]:
    """White-noise standard deviation per column from cosine coefficients above ``slowest`` Hz (robust: median)."""
    first = min(int(2 * len(coefficients) * period * slowest), len(coefficients) // 2)
    fast = coefficients[first:]
    return np.asarray(np.sqrt(np.median(fast**2, axis=0) / 0.4549))


def estimate_flicker(
    coefficients: NDArray[np.float64], white: NDArray[np.float64], basis: CosineBasis, walk: float = 0.0
) -> NDArray[np.float64]:
    """Bias instability per channel by Whittle likelihood of the slow coefficients.

    Parameters
    ----------
    coefficients : ndarray, shape (n, c)
        Cosine coefficients of the residual.
    white : ndarray, shape (c,)
        White noise per channel.
    basis : CosineBasis
        The basis.
    walk : float
        Random walk that is in the model already, m/s² per √s.

    Returns
    -------
    ndarray, shape (c,)
        Rms of the bias instability per channel, m/s².
    """
    slow = coefficients[1 : len(basis.frequency)] ** 2  # (K, c): the mean itself may be a bias
    fixed = basis.walk_spectrum[1:] * walk**2
    return likeliest_flicker(slow, white, basis.flicker_spectrum[1:, None], fixed[:, None])


def likeliest_flicker(
    power: NDArray[np.float64],
    white: NDArray[np.float64],
    shape: NDArray[np.float64],
    fixed: NDArray[np.float64] | float = 0.0,
) -> NDArray[np.float64]:
    """Bias instability per channel from independent sizes of slow modes.

    Channels share a common level with a log-normal prior, and each may differ from it by a factor of about two.

    Parameters
    ----------
    power : ndarray, shape (K, c)
        Squared sizes.
    white : ndarray, shape (c,)
        White noise per channel.
    shape : ndarray, shape (K, c) or (K, 1)
        Variances that bias instability of unit size gives them.
    fixed : ndarray, shape (K, c) or (K, 1), or float
        Variances that they have besides.
    """
    likelihood = np.empty((len(FLICKER_GRID), power.shape[1]))
    for row, level in enumerate(FLICKER_GRID):
        spectrum = white**2 + (shape * level**2 + fixed)
        likelihood[row] = -0.5 * np.sum(np.log(spectrum) + power / spectrum, axis=0)
    grid = np.log(FLICKER_GRID)
    tie = -0.5 * ((grid[:, None] - grid[None, :]) / Policy.channel_spread) ** 2  # channel level against common level
    joint = likelihood[:, None, :] + tie[:, :, None]  # (channel level, common level, c)
    top = joint.max(axis=0)
    common = (top + np.log(np.exp(joint - top).mean(axis=0))).sum(axis=1)
    common += -0.5 * ((grid - np.log(Policy.usual_flicker)) / Policy.flicker_spread) ** 2
    best = int(np.argmax(common))
    weight = joint[:, best, :] - joint[:, best, :].max(axis=0)
    weight = np.exp(weight) / np.exp(weight).sum(axis=0)
    return np.asarray(np.sqrt(weight.T @ FLICKER_GRID**2))
