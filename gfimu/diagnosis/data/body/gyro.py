"""The rate and angular acceleration behind a noisy gyro, by a smoother whose stiffness is fitted to the gyro itself.

The derivative of a noisy gyro is mostly noise when the body turns slowly, and a residual that holds minus that noise
depends on it: errors in variables. A smoother's posterior mean is uncorrelated with its error, so that neither the
prediction nor a function of the motion carries the noise that is in the residual.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import comb

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded
from scipy.optimize import minimize_scalar

__all__ = ["SmoothGyro", "smooth_gyro"]

_ORDERS = (2, 3, 4)
_CUTS = (0.12, 16.0)
_MISSING = 1e-3
_LOUDER = 1.5  # times the noise of the quieter half: no louder is the noise of a run
_ROUGHNESS = 4  # order of the differences that show the noise


@dataclass(frozen=True)
class SmoothGyro:
    """A gyro smoothed.

    Parameters
    ----------
    rate : ndarray, shape (n, 3)
        Angular rate, rad/s.
    noise : ndarray, shape (3,)
        White noise of the gyro's samples, rad/s.
    acceleration_error : float
        Error of the angular acceleration, rad/s²: white noise of the density that the error has where it is largest.
    cuts, orders : ndarray, shape (3,)
        Cut-off (as 2 sin πfT) and order of the smoother of each axis.
    """

    rate: NDArray[np.float64]
    noise: NDArray[np.float64]
    acceleration_error: float
    cuts: NDArray[np.float64]
    orders: NDArray[np.float64]

    def error_power(self, phase: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the spectrum of the error of the rate, shape (f, 3), rad²/s²; white noise of std σ has σ².

        ``phase``, shape (f,), is πfT with the sample period T.
        """
        passed = 1.0 / (1.0 + (2.0 * np.sin(phase)[:, None] / self.cuts) ** (2.0 * self.orders))
        return np.asarray(self.noise**2 * passed)


def smooth_gyro(gyro: NDArray[np.float64], missing: NDArray[np.bool_], period: float) -> SmoothGyro:
    """Smooth each axis of a gyro, the order and cut-off of the smoother those of greatest marginal likelihood.

    The rate is a random walk integrated k − 1 times, the gyro that with white noise; its posterior mean x minimises
    Σ w (y − x)² + λ Σ (Δᵏx)² (Whittaker 1923) and passes a frequency f by 1/(1 + (2 sin πfT)²ᵏ λ).

    Parameters
    ----------
    gyro : ndarray, shape (n, 3)
        Rate, rad/s, at every sample of a uniform grid; filled in where missing.
    missing : ndarray of bool, shape (n,)
        Samples that have been filled in.
    period : float
        Sample period, s.
    """
    weight = np.where(missing, _MISSING, 1.0)
    rate, noise, densities = np.empty_like(gyro), np.empty(3), []
    cuts, orders = np.ones(3), np.ones(3)
    phase = 2.0 * np.sin(np.pi * np.linspace(0.0, 0.5, 513))
    for axis, values in enumerate(gyro.T):
        if not np.ptp(values):  # of an axis about which a wheel doesn't turn
            rate[:, axis], noise[axis] = values, 0.0
            continue
        most = _LOUDER * _noise_where_quiet(values)
        fits = [_fit(values, weight, order, most) for order in _ORDERS]
        _, order, cut, noise[axis] = max(fits)
        cuts[axis], orders[axis] = cut, order
        stiffness = cut ** (-2.0 * order)
        rate[:, axis] = cho_solve_banded((_factor(weight, order, stiffness), False), weight * values)
        passed = 1.0 / (1.0 + (phase / cut) ** (2 * order))
        # The posterior's spectrum is the noise's times what is passed.
        slope = np.linspace(0.0, np.pi, 513) / period
        densities.append(noise[axis] ** 2 * np.max(slope**2 * passed))
    return SmoothGyro(rate, noise, float(np.sqrt(sum(densities) / 3.0)), cuts, orders)


def _noise_where_quiet(values: NDArray[np.float64]) -> float:
    """Return the white noise of the quieter half of a run, rad/s.

    It bounds the noise of the fit, so that the violent part of a motion is not smoothed as if it were noise.
    """
    rough = np.diff(values, _ROUGHNESS) / np.sqrt(comb(2 * _ROUGHNESS, _ROUGHNESS))
    return float(np.median(np.abs(rough)) / 0.6745)


def _fit(
    values: NDArray[np.float64], weight: NDArray[np.float64], order: int, most: float
) -> tuple[float, int, float, float]:
    """Return the log likelihood, order, cut-off (as 2 sin πfT) and noise, rad/s, that fit best."""
    found = minimize_scalar(
        lambda log_cut: -_likelihood(values, weight, order, float(np.exp(log_cut)), most)[0],
        bounds=np.log(_CUTS),
        method="bounded",
        options={"xatol": 0.05},
    )
    cut = float(np.exp(found.x))
    likelihood, noise = _likelihood(values, weight, order, cut, most)
    return likelihood, order, cut, noise


def _likelihood(
    values: NDArray[np.float64], weight: NDArray[np.float64], order: int, cut: float, most: float
) -> tuple[float, float]:
    """Return the marginal log likelihood, the noise profiled out as far as its bound, and the noise, rad/s."""
    free, stiffness = len(values) - order, cut ** (-2.0 * order)
    try:
        factor = _factor(weight, order, stiffness)
    except LinAlgError:
        return -np.inf, 0.0
    smooth = cho_solve_banded((factor, False), weight * values)
    squares = float(np.sum(weight * (values - smooth) ** 2) + stiffness * np.sum(np.diff(smooth, order) ** 2))
    variance = max(min(squares / free, most**2), 1e-30)
    likelihood = -0.5 * (squares / variance + free * (np.log(variance) - np.log(stiffness)))
    likelihood -= float(np.sum(np.log(factor[-1])))
    return likelihood, float(np.sqrt(variance))


def _factor(weight: NDArray[np.float64], order: int, stiffness: float) -> NDArray[np.float64]:
    """Return the banded Cholesky factor of W + λ DᵀD, D the k-th differences."""
    n = len(weight)
    step = np.array([(-1.0) ** k * comb(order, k) for k in range(order + 1)])
    band = np.zeros((order + 1, n))  # band[order − j, i + j] is entry (i, i + j)
    for offset in range(order + 1):
        for index in range(order + 1 - offset):
            start = index + offset
            band[order - offset, start : start + n - order] += stiffness * step[index] * step[start]
    band[-1] += weight
    return np.asarray(cholesky_banded(band))
