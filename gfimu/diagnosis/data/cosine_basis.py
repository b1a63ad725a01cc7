"""Slow cosines of a stretch, and noise on them: white noise plus bias instability and a random walk, per channel.

Bias instability (1/f noise) is a sum of first-order processes with time constants a factor 3.2 apart. In the cosine
basis of a run its covariance is nearly diagonal, so whitening is white scaling plus a low-rank correction.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct, idct

__all__ = ["WEAKEST_CORRECTION", "CosineBasis", "NoiseLevels"]

_TIMES = 0.25 * 3.2 ** np.arange(7)  # numerical: s, time constants of the sum that is 1/f from 0.6 mHz to 0.6 Hz
_TOP_FREQUENCY = 2.5  # numerical: Hz, above which bias instability is below any white noise
WEAKEST_CORRECTION = 0.05
"""Numerical: share of slow noise in a mode below which it is white."""


@dataclass(frozen=True)
class NoiseLevels:
    """Noise of the channels and of the reference (last entry of each array).

    Parameters
    ----------
    white : ndarray, shape (c + 1,)
        Standard deviation of white noise, m/s² (rad/s for the reference).
    flicker : ndarray, shape (c + 1,)
        Rms of the bias instability.
    walk : float
        Random walk of the biases, m/s² per √s.
    """

    white: NDArray[np.float64]
    flicker: NDArray[np.float64]
    walk: float = 0.0


class CosineBasis:
    """Lowest cosines of a stretch of a run and the spectrum of bias instability and of a random walk on them.

    Parameters
    ----------
    n : int
        Samples.
    period : float
        Sample period, s.
    elapsed : float
        Time since the run began, for which the random walk of biases has lasted already, s.
    stretches : int
        How many such stretches the run is cut into. Their means are taken for independent though a bias is much the
        same in neighbouring ones; so each is as uncertain as makes the mean of all as uncertain as it is.
    """

    def __init__(self, n: int, period: float, elapsed: float = 0.0, *, stretches: int = 1) -> None:
        self.n, self.period, self._elapsed, self._stretches = n, period, elapsed, stretches
        self._duration = n * period
        count = max(2, min(int(2 * self._duration * _TOP_FREQUENCY), n // 4))
        self.frequency = np.arange(count) / (2 * self._duration)
        self.flicker_spectrum, self.walk_spectrum = self._spectra(count)

    def _spectra(self, count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the spectra of bias instability and of a random walk, of unit size, on the first cosines."""
        duration, period = self._duration, self.period
        omega = np.pi * np.arange(count) / duration
        flicker = sum(2 * tau / (1 + (omega * tau) ** 2) for tau in _TIMES) / (len(_TIMES) * period)
        whole = self._stretches * duration
        ratio = _TIMES / whole
        flicker[0] = whole / period * np.mean(2 * ratio * (1 + ratio * np.expm1(-1 / ratio)))
        # Random walk from the start of the run: 1/(ω²) above, and its mean's variance at zero.
        walk = np.empty(count)
        walk[1:] = 1.0 / (omega[1:] ** 2 * period)
        walk[0] = whole / period * (whole / 3.0 if self._stretches > 1 else self._elapsed + duration / 3.0)
        return flicker, walk

    def matrix(self, count: int) -> NDArray[np.float64]:
        """Return the first ``count`` orthonormal cosines, shape (n, count), for reading only."""
        return _cosines(self.n, count)

    def products(self, weights: NDArray[np.float64], count: int) -> NDArray[np.float64]:
        """Return C_cᵀC_c of the first ``count`` cosines under weights (n, c) of the samples' squares, (c, K, K).

        As 2 cos a cos b = cos(a + b) + cos(a − b), all products are sums of two cosines of the weights.
        """
        spectrum = dct(weights, type=2, axis=0)[: 2 * count - 1].T  # (c, 2K − 1)
        order = np.arange(count)
        scale = np.where(order > 0, 1.0, np.sqrt(0.5)) / np.sqrt(2.0 * self.n)
        sums = spectrum[:, order[:, None] + order] + spectrum[:, np.abs(order[:, None] - order)]
        return np.asarray(sums * np.outer(scale, scale))

    def variances(self, levels: NoiseLevels, count: int) -> NDArray[np.float64]:
        """Return the variances of slow noise on the first ``count`` cosines, shape (K, c + 1)."""
        return _variances(levels, self.flicker_spectrum[:count], self.walk_spectrum[:count])

    def corrections(self, levels: NoiseLevels) -> NDArray[np.float64]:
        """Return 1 − σ²/S_k per mode and channel, shape (K, c + 1), cut where it no longer matters."""
        white = levels.white**2
        share = 1.0 - white / (white + self.variances(levels, len(self.frequency)))
        strong = np.flatnonzero((share > WEAKEST_CORRECTION).any(axis=1))
        return share[: int(strong[-1]) + 1 if len(strong) else 1]

    def whitened(self, residual: NDArray[np.float64], levels: NoiseLevels) -> NDArray[np.float64]:
        """Return residuals (n, c + 1), in units of white noise, without the excess of slow noise at any frequency."""
        white = levels.white**2
        kept = np.sqrt(white / (white + _variances(levels, *self._spectra(self.n))))
        return np.asarray(idct(self.transform(residual) * kept, type=2, norm="ortho", axis=0))

    def transform(self, residual: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return all cosine coefficients of residuals (n, c)."""
        return np.asarray(dct(residual, type=2, norm="ortho", axis=0))


def _variances(levels: NoiseLevels, flicker: NDArray[np.float64], walk: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the variances of slow noise on modes with the spectra (K,) of unit size, shape (K, c + 1)."""
    walks = np.append(np.full(len(levels.white) - 1, levels.walk**2), 0.0)
    return np.outer(flicker, levels.flicker**2) + np.outer(walk, walks)


@lru_cache(maxsize=8)
def _cosines(n: int, count: int) -> NDArray[np.float64]:
    phase = np.pi * np.outer(np.arange(n) + 0.5, np.arange(count)) / n
    basis = np.sqrt(2.0 / n) * np.cos(phase)
    basis[:, 0] = np.sqrt(1.0 / n)
    basis.flags.writeable = False
    return basis
