"""White noise plus bias instability as one process: a small linear filter driven by one normal number per sample.

Noise of spectrum 1/f is a sum of first-order processes whose time constants are spread evenly in octaves; with white
noise added the sum has an innovations form (Anderson & Moore, Optimal Filtering, 1979, ch. 9),

    y_t = Σ_j x_j,t + s e_t,    x_j,t+1 = a_j x_j,t + k_j s e_t,    e_t ~ N(0, 1),

which has the same distribution and needs one number e_t per sample. Its start is drawn from the stationary
distribution, so that no sample is transient.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_are
from scipy.optimize import nnls

from gfimu.base.errors import InputError

__all__ = ["FlickerShape", "add_noise", "flicker_shape"]

Floats = NDArray[np.float64]

_PERIODS = 4  # lowest frequency of the 1/f spectrum: one period in so many lengths of the record
_POLES_PER_OCTAVE = 0.7  # covariances within 0.02 of the variance
_LEVEL_STEP = 0.02  # levels of bias instability over white noise are rounded to this, relative


@dataclass(frozen=True)
class FlickerShape:
    """First-order processes that together have the spectrum 1/f over a record.

    Parameters
    ----------
    length : int
        Samples n of the record. The spectrum is 1/f from one period in 4 n samples to half the sample rate.
    decay : ndarray, shape (m,)
        a_j: what is left of each process after one sample.
    variance : ndarray, shape (m,)
        Variance of each; their sum is 1 to within 4 %.
    """

    length: int
    decay: Floats
    variance: Floats

    @lru_cache(maxsize=4096)  # noqa: B019 - shapes are few and live as long as the program
    def _filter(self, ratio: int) -> tuple[Floats, float, Floats]:
        """Return k (m,), s and a root of the covariance of the start (m, m), for white noise of variance 1.

        ``ratio`` is the rounded logarithm of the rms of the 1/f noise over that of the white noise.
        """
        scale = float(np.exp(2.0 * _LEVEL_STEP * ratio))
        variance = scale * self.variance
        a, c = np.diag(self.decay), np.ones((1, len(self.decay)))
        driving = np.diag(variance * (1.0 - self.decay**2))
        # Steady-state Kalman filter of the sum in unit white noise: its innovations drive the same process.
        predicted = solve_discrete_are(a.T, c.T, driving, np.eye(1))
        innovation = float((c @ predicted @ c.T)[0, 0]) + 1.0
        gain = (a @ predicted @ c.T / innovation)[:, 0]
        values, vectors = np.linalg.eigh(np.diag(variance) - predicted)  # of the filter's own state
        return gain, float(np.sqrt(innovation)), vectors * np.sqrt(np.maximum(values, 0.0))

    def filters(self, white: Floats, flicker: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the filters of channels.

        Parameters
        ----------
        white, flicker : ndarray, shape (c,)
            Standard deviation of the white noise, above zero, and rms of the 1/f noise.

        Returns
        -------
        gain : ndarray, shape (c, m)
        innovation : ndarray, shape (c,)
        roots : ndarray, shape (c, m, m)
            In units of each channel's white noise.
        """
        if np.any(white <= 0.0) or np.any(flicker <= 0.0):
            raise InputError(
                "levels of white noise and bias instability have to be above zero; leave out what is not there"
            )
        ratios = np.round(np.log(flicker / white) / _LEVEL_STEP).astype(int)
        found = [self._filter(int(ratio)) for ratio in ratios]
        gain = np.array([one[0] for one in found])  # (c, m)
        return gain, white * np.array([one[1] for one in found]), np.array([one[2] for one in found])

    def __hash__(self) -> int:
        return hash(self.length)


@lru_cache(maxsize=64)
def flicker_shape(length: int) -> FlickerShape:
    """Fit first-order processes to the covariances of 1/f noise over a record of ``length`` samples."""
    if length < 2:
        raise InputError(f"1/f noise needs at least 2 samples, not {length}")
    long = _PERIODS * length
    constants = np.geomspace(0.4, long, max(int(np.log2(2.5 * long) * _POLES_PER_OCTAVE), 2))
    near = np.arange(min(20, length))
    lags = np.unique(np.concatenate([near, np.round(np.geomspace(1, length - 1, 140)).astype(int)]))
    k = np.arange(1, long // 2 + 1)
    weights = 1.0 / k
    weights /= weights.sum()
    wanted = np.array([np.cos(2.0 * np.pi * k * (lag / long)) @ weights for lag in lags])
    wanted -= min(float(wanted.min()), 0.0)  # a constant over the record, which no difference shows
    decay = np.exp(-1.0 / constants)
    variance, _ = nnls(decay[None, :] ** lags[:, None], wanted)
    used = variance > 0.0
    return FlickerShape(length, decay[used], variance[used])


def add_noise(
    readings: Floats, white: Floats, flicker: Floats, rng: np.random.Generator, *, shape: FlickerShape | None = None
) -> None:
    """Add white noise and bias instability to readings, in place.

    Parameters
    ----------
    readings : ndarray, shape (n, c)
        Readings without noise, in any unit.
    white, flicker : ndarray, shape (c,)
        Standard deviation of a sample's white noise, and rms of the 1/f noise over four records, in that unit.
    rng : numpy.random.Generator
        Random number generator.
    shape : FlickerShape, optional
        That of the record's length, where it is at hand.

    Raises
    ------
    InputError
        If a level is not above zero.
    """
    n, channels = readings.shape
    shape = flicker_shape(n) if shape is None else shape
    gain, innovation, roots = shape.filters(white, flicker)
    start = rng.standard_normal((channels, len(shape.decay), 1))
    state = white[:, None] * (roots @ start)[:, :, 0]  # (c, m)
    _run(readings, rng.standard_normal((n, channels)), shape.decay, gain, innovation, state)


@njit(cache=True, fastmath=True)
def _run(readings, e, decay, gain, innovation, state):  # type: ignore[no-untyped-def]
    """Run the filters over numbers e (n, c) from their states (c, m), and add what they give to the readings."""
    for c in range(e.shape[1]):
        x, k = state[c].copy(), gain[c].copy()
        for t in range(e.shape[0]):
            w = innovation[c] * e[t, c]
            y = w
            for j in range(len(decay)):
                y += x[j]
                x[j] = decay[j] * x[j] + k[j] * w
            readings[t, c] += y
