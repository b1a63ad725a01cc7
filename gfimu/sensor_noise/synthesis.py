"""Noise with given coefficients: white (N), flicker (B), random walk (K).

Conventions of IEEE Std 952 and 1554 (two-sided spectral densities): N² for white noise, B²/(2πf) for flicker,
K²/(2πf)² for the random walk; their Allan deviations are N/√τ, about 0.664 B, and K√(τ/3).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import fftconvolve

from gfimu.base.errors import InputError

__all__ = ["flicker_noise", "random_walk", "synthesise_noise", "white_noise"]

Floats = NDArray[np.float64]


def white_noise(n: int, rate: float, N: float, rng: np.random.Generator) -> Floats:
    """Draw white noise.

    Parameters
    ----------
    n : int
        Number of samples.
    rate : float
        Sample rate, Hz.
    N : float
        Velocity random walk, m/s²/√Hz; the standard deviation of a sample is N √rate.
    rng : numpy.random.Generator
        Source of randomness.

    Returns
    -------
    ndarray, shape (n,)
    """
    _check(n, rate, N)
    return N * np.sqrt(rate) * rng.standard_normal(n)


def flicker_noise(n: int, rate: float, B: float, rng: np.random.Generator) -> Floats:
    """Draw flicker noise: white noise through the half-order integrator (1 − z⁻¹)^(−1/2).

    Its spectral density is B² / (rate · 2 sin(πf/rate)), which is B²/(2πf) below the sample rate (N. J. Kasdin,
    "Discrete simulation of colored noise and stochastic processes and 1/f^α power law noise generation", Proc. IEEE
    83(5):802-827, 1995, eq. 104-105).

    Parameters
    ----------
    n : int
        Number of samples.
    rate : float
        Sample rate, Hz; only its being positive matters, flicker looks alike at every rate.
    B : float
        Bias instability, m/s².
    rng : numpy.random.Generator
        Source of randomness.

    Returns
    -------
    ndarray, shape (n,)
    """
    _check(n, rate, B)
    k = np.arange(1, n)
    weights = np.concatenate([[1.0], np.cumprod((k - 0.5) / k)])
    return np.asarray(fftconvolve(B * rng.standard_normal(n), weights)[:n], dtype=np.float64)


def random_walk(n: int, rate: float, K: float, rng: np.random.Generator) -> Floats:
    """Draw a random walk from zero; its step is K/√rate.

    Parameters
    ----------
    n : int
        Number of samples.
    rate : float
        Sample rate, Hz.
    K : float
        Acceleration random walk, m/s²/√s.
    rng : numpy.random.Generator
        Source of randomness.

    Returns
    -------
    ndarray, shape (n,)
    """
    _check(n, rate, K)
    return np.cumsum(K / np.sqrt(rate) * rng.standard_normal(n))


def synthesise_noise(
    n: int, rate: float, *, N: float = 0.0, B: float = 0.0, K: float = 0.0, rng: np.random.Generator
) -> Floats:
    """Draw the sum of white noise, flicker and random walk, shape (n,), m/s²; terms of zero cost nothing."""
    _check(n, rate, 0.0)
    total = np.zeros(n)
    for draw, coefficient in ((white_noise, N), (flicker_noise, B), (random_walk, K)):
        if coefficient != 0.0:
            total += draw(n, rate, coefficient, rng)
    return total


def _check(n: int, rate: float, coefficient: float) -> None:
    if n < 1 or not rate > 0.0 or not coefficient >= 0.0:
        raise InputError("noise needs a positive number of samples and rate, and a coefficient that is not negative")
