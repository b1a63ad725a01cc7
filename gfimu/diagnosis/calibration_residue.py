"""What a good calibration leaves everywhere: small errors of every bias, gain, axis and position at once.

They are nobody's cause. Like bias instability they are part of what has to be known before anything is named: each
channel's few columns join the drive's coefficients as unknowns with a Gaussian prior of unit variance and are
marginalised with them.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve

from gfimu.diagnosis.slow_modes import DriveModes, SlowModes
from gfimu.units import STANDARD_GRAVITY

__all__ = ["TOLERANCE", "CalibrationResidue", "tolerance_of"]

TOLERANCE = {
    "bias": 0.3e-3 * STANDARD_GRAVITY,
    "scale_factor": 5e-4,
    "misalignment": float(np.deg2rad(0.02)),
    "sensor_position": 5e-5,
}
"""Standard deviations that a good calibration leaves, by effect: m/s², ratio, rad, m."""


@dataclass(frozen=True)
class _UnderNoise:
    """What a residue has under one noise: AᵀWA + I (q, q), its lower root, each channel's modes (K, k), and damped."""

    modes: SlowModes
    weights: NDArray[np.float64]
    gram: NDArray[np.float64]
    root: NDArray[np.float64]
    low: list[NDArray[np.float64]]
    damped: list[NDArray[np.float64]]


@dataclass(frozen=True)
class CalibrationResidue:
    """Columns of the residue, kept for each channel where they are not zero.

    Parameters
    ----------
    count : int
        Number q of columns.
    places : tuple of ndarray of int, each (k,)
        Numbers of each channel's columns.
    parts : tuple of ndarray, each (n, k)
        Each channel's columns for one standard deviation of the prior.
    """

    count: int
    places: tuple[NDArray[np.intp], ...]
    parts: tuple[NDArray[np.float64], ...]
    _known: list[_UnderNoise] = field(default_factory=list, init=False, repr=False, compare=False)

    @classmethod
    def of_columns(cls, columns: NDArray[np.float64]) -> CalibrationResidue:
        """Take columns of every observation, shape (c + 1, q, n); the reference, last, has none."""
        used = [np.flatnonzero(mine.any(axis=1)) for mine in columns[:-1]]
        parts = tuple(np.ascontiguousarray(mine[at].T) for mine, at in zip(columns[:-1], used, strict=True))
        return cls(columns.shape[1], tuple(used), parts)

    def normal_equations(
        self,
        residual: NDArray[np.float64],
        slow: DriveModes,
        modes: SlowModes,
        weights: NDArray[np.float64],
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return AᵀWA + I (q, q), AᵀWr (q,) and JᵀWA (m, q) under noise that is white plus slow modes.

        Parameters
        ----------
        residual : ndarray, shape (n, c + 1)
            r.
        slow : DriveModes
            The drive's Jacobian in the modes.
        modes : SlowModes
            Modes of slow noise.
        weights : ndarray, shape (c + 1,)
            One over the variance of each observation.
        """
        mine = self._under(modes, weights)
        everywhere = np.zeros((len(weights), self.count, len(modes.share)))  # (c + 1, q, K)
        for channel, (at, part) in enumerate(zip(self.places, mine.damped, strict=True)):
            everywhere[channel, at] = part.T
        cross = -slow.through(everywhere, weights)
        for matrix, loading in zip(slow.jacobian.parts, slow.jacobian.loading, strict=True):
            cross += matrix.T @ self._mixed(self.parts, loading * weights)
        return mine.gram, self._score(residual, mine), cross

    def explained(
        self,
        residual: NDArray[np.float64],
        modes: SlowModes,
        weights: NDArray[np.float64],
    ) -> float:
        """Return how much of rᵀWr the residue takes at its best, its prior counted, the drive held."""
        mine = self._under(modes, weights)
        score = self._score(residual, mine)
        return float(score @ cho_solve((mine.root, True), score))

    def _under(self, modes: SlowModes, weights: NDArray[np.float64]) -> _UnderNoise:
        """Return what does not change from step to step as long as the noise does not."""
        for known in list(self._known):
            if known.modes is modes and np.array_equal(known.weights, weights):
                return known
        gram = np.eye(self.count)
        low: list[NDArray[np.float64]] = []
        damped: list[NDArray[np.float64]] = []
        for channel, (at, part) in enumerate(zip(self.places, self.parts, strict=True)):
            low.append(modes.of(part.T, channel).T)  # (K, k)
            damped.append(modes.share[:, [channel]] * low[-1])
            gram[np.ix_(at, at)] += weights[channel] * (part.T @ part - low[-1].T @ damped[-1])
        found = _UnderNoise(modes, weights, gram, np.asarray(np.linalg.cholesky(gram)), low, damped)
        self._known[:] = [found]
        return found

    def _score(self, residual: NDArray[np.float64], noise: _UnderNoise) -> NDArray[np.float64]:
        """Return AᵀWr, shape (q,)."""
        score = np.zeros(self.count)
        slow = noise.modes.of_each(residual)  # (K, c + 1)
        for channel, (at, part, damped) in enumerate(zip(self.places, self.parts, noise.damped, strict=True)):
            score[at] += noise.weights[channel] * (part.T @ residual[:, channel] - slow[:, channel] @ damped)
        return score

    def _mixed(self, blocks: Sequence[NDArray[np.float64]], scale: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the sum over channels of their columns (n, k), each at its places, shape (n, q)."""
        total = np.zeros((len(blocks[0]), self.count))
        for channel, (at, block) in enumerate(zip(self.places, blocks, strict=True)):
            if scale[channel]:
                total[:, at] += scale[channel] * block
        return total

    def correlate(
        self,
        signatures: NDArray[np.float64],
        damped: NDArray[np.float64],
        modes: SlowModes,
        weights: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """Return AᵀWS of signatures (c + 1, P, n), whose damped modes are (c + 1, P, K), shape (q, P)."""
        total = np.zeros((self.count, signatures.shape[1]))
        slow = self._under(modes, weights).low
        for channel, (at, part, low) in enumerate(zip(self.places, self.parts, slow, strict=True)):
            total[at] += weights[channel] * (part.T @ signatures[channel].T - low.T @ damped[channel].T)
        return total

    def readings(self, sizes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what sizes (q,), in standard deviations, add to the channels and the reference, shape (n, c + 1)."""
        columns = [part @ sizes[at] for at, part in zip(self.places, self.parts, strict=True)]
        return np.column_stack([*columns, np.zeros(len(columns[0]))])


def tolerance_of(families: Collection[str]) -> dict[str, float]:
    """Return the tolerances of the effects that a library has."""
    return {name: std for name, std in TOLERANCE.items() if name in families}
