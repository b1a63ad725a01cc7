"""Coarse rounding: what a reading tells when one count is larger than the noise.

A reading y in steps of q says only that the value before rounding lay within y ± q/2. Its likelihood

    p(y | x) = Φ((y + q/2 − x)/σ) − Φ((y − q/2 − x)/σ)

is log-concave in the prediction x; score and curvature give each sample a working residual and a weight, so that the
same least squares serves (iteratively reweighted, McCullagh and Nelder 1989, §2.5). In the middle of a step a sample
says next to nothing, at the edges nearly as much as an unrounded one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr

__all__ = ["COARSE", "WorkingResidual", "rounded_likelihood", "rounding_noise"]

COARSE = 1.5
"""Steps per standard deviation of the noise from which rounding is no longer like noise."""
_LEAST_WEIGHT = 0.02
_FAR = 1e4  # standard deviations
_NOISE_FACTORS = np.geomspace(0.5, 6.0, 26)
_LOG_ROOT_TWO_PI = 0.5 * np.log(2 * np.pi)


@dataclass(frozen=True)
class WorkingResidual:
    """Least-squares equivalent of rounded readings about a prediction.

    Parameters
    ----------
    residual : ndarray, shape (n, c)
        Weighted working residual, m/s²: weight × (working response − prediction).
    weight : ndarray, shape (n, c)
        Share of an unrounded sample's amplitude, 0 to 1; derivatives are multiplied by it.
    deviance : ndarray, shape (n, c)
        −2 log p(y | x).
    """

    residual: NDArray[np.float64]
    weight: NDArray[np.float64]
    deviance: NDArray[np.float64]


def rounded_likelihood(
    error: NDArray[np.float64], quantum: float, sigma: NDArray[np.float64] | float
) -> WorkingResidual:
    """Expand the likelihood of rounded readings about a prediction.

    Parameters
    ----------
    error : ndarray, shape (n, c)
        Reading minus prediction, m/s².
    quantum : float
        Rounding step q, m/s².
    sigma : ndarray, shape (c,), or float
        White noise before rounding, m/s².
    """
    # By symmetry the prediction lies below the reading: both limits are then well inside the range of Φ's logarithm.
    side = np.where(error < 0, -1.0, 1.0)
    true_lower = (np.abs(error) - 0.5 * quantum) / sigma
    # Farther off, the squares of the limits lose all digits of their difference; there only the nearer limit counts.
    lower = np.minimum(true_lower, _FAR)
    upper = lower + quantum / sigma
    log_outer, log_inner = log_ndtr(-upper), log_ndtr(-lower)
    log_p = log_inner + np.log1p(-np.exp(log_outer - log_inner))
    density_upper = np.exp(-0.5 * upper**2 - _LOG_ROOT_TWO_PI - log_p)
    density_lower = np.exp(-0.5 * lower**2 - _LOG_ROOT_TWO_PI - log_p)
    beyond = true_lower - lower
    score = density_lower - density_upper + beyond  # σ d log p/dx
    curvature = (score - beyond) ** 2 - (lower * density_lower - upper * density_upper)  # −σ² d² log p/dx²
    weight = np.sqrt(np.clip(curvature, _LEAST_WEIGHT**2, 1.0))
    return WorkingResidual(side * sigma * score / weight, weight, beyond * (true_lower + lower) - 2.0 * log_p)


def rounding_noise(error: NDArray[np.float64], quantum: float, sigma: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the white noise before rounding that makes rounded readings most likely, shape (c,).

    Parameters
    ----------
    error : ndarray, shape (n, c)
        Reading minus prediction, m/s²; NaN where invalid.
    quantum : float
        Rounding step, m/s².
    sigma : ndarray, shape (c,)
        Noise to search around, m/s².
    """
    values = [np.nansum(rounded_likelihood(error, quantum, factor * sigma).deviance) for factor in _NOISE_FACTORS]
    return np.asarray(_NOISE_FACTORS[int(np.argmin(values))] * sigma)
