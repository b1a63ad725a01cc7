"""Whiteness: whether what a prediction leaves over looks like the sensors' noise and nothing else.

The noise is white plus bias instability, so residuals are first divided by that spectrum in the cosine basis; what is
left must be white with unit variance. Two classical tests see a departure: Ljung and Box's on the first correlations
(Biometrika 65, 1978, eq. 1.3) and Bartlett's on the cumulative periodogram.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.fft import idct, rfft
from scipy.stats import chi2, kstwobign

from gfimu.diagnosis.data.cosine_basis import CosineBasis

__all__ = ["cumulative_periodogram", "ljung_box", "standardise", "whitening_gain"]

_LAGS = 20  # numerical: correlations that are tested


def whitening_gain(n: int, period: float, white: NDArray[np.float64], bias_instability: float) -> NDArray[np.float64]:
    """Return what divides each cosine coefficient by the noise's spectrum, shape (n, c).

    Parameters
    ----------
    n : int
        Number of samples.
    period : float
        Sample period, s.
    white : ndarray, shape (c,)
        White noise per channel, m/s².
    bias_instability : float
        Rms of the bias instability, m/s².
    """
    basis = CosineBasis(n, period)
    gain = np.tile(1.0 / white, (n, 1))
    slow = white**2 + np.outer(basis.flicker_spectrum, np.full(len(white), bias_instability**2))
    gain[: len(slow)] = 1.0 / np.sqrt(slow)
    return gain


def standardise(coefficients: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the time series of whitened cosine coefficients, shape (n, c), for tests over time and frequency."""
    return np.asarray(idct(coefficients, type=2, norm="ortho", axis=0))


def ljung_box(series: NDArray[np.float64], *, lags: int = _LAGS) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Test the first correlations of each column against none.

    Parameters
    ----------
    series : ndarray, shape (n, c)
        Standardised residuals; zero where invalid.
    lags : int
        Number of correlations.

    Returns
    -------
    p_value : ndarray, shape (c,)
        Probability of as much correlation by chance.
    largest : ndarray, shape (c,)
        Correlation with the largest magnitude, signed.
    """
    n = len(series)
    lags = min(lags, n // 5)
    power = np.maximum(np.sum(series**2, axis=0), 1e-300)
    rho = np.array([np.sum(series[lag:] * series[:-lag], axis=0) / power for lag in range(1, lags + 1)])  # (lags, c)
    statistic = n * (n + 2) * np.sum(rho**2 / (n - np.arange(1, lags + 1))[:, None], axis=0)  # eq. 1.3
    largest = rho[np.argmax(np.abs(rho), axis=0), np.arange(series.shape[1])]
    return np.asarray(chi2.sf(statistic, lags)), largest


def cumulative_periodogram(series: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Test the cumulative periodogram of each column against a straight line (Bartlett).

    Parameters
    ----------
    series : ndarray, shape (n, c)
        Standardised residuals.

    Returns
    -------
    p_value : ndarray, shape (c,)
        Probability of as large a departure by chance.
    cumulative : ndarray, shape (m, c)
        The cumulative periodogram from 0 to 1, over m equal steps of frequency up to half the sample rate.
    """
    power = np.abs(rfft(series, axis=0)[1:]) ** 2  # (m, c)
    total = np.maximum(power.sum(axis=0), 1e-300)
    cumulative = np.cumsum(power, axis=0) / total
    steps = len(power)
    line = np.arange(1, steps + 1)[:, None] / steps
    departure = np.abs(cumulative - line).max(axis=0)
    return np.asarray(kstwobign.sf(departure * np.sqrt(steps))), cumulative
