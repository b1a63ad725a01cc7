"""What a good calibration leaves everywhere: small errors of every bias, gain, axis and position at once.

They are nobody's cause. Like bias instability they are part of what has to be known before anything is named: each
channel's few columns join the drive's coefficients as unknowns with a Gaussian prior of unit variance and are
marginalised with them.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
        gram, score, damped = self._own_equations(residual, modes, weights)
        everywhere = np.zeros((len(weights), self.count, len(modes.share)))  # (c + 1, q, K)
        for channel, (at, part) in enumerate(zip(self.places, damped, strict=True)):
            everywhere[channel, at] = part.T
        cross = -slow.through(everywhere, weights)
        for matrix, loading in zip(slow.jacobian.parts, slow.jacobian.loading, strict=True):
            cross += matrix.T @ self._mixed(self.parts, loading * weights)
        return gram, score, cross

    def explained(
        self,
        residual: NDArray[np.float64],
        modes: SlowModes,
        weights: NDArray[np.float64],
    ) -> float:
        """Return how much of rᵀWr the residue takes at its best, its prior counted, the drive held."""
        gram, score, _ = self._own_equations(residual, modes, weights)
        return float(score @ np.linalg.solve(gram, score))

    def _own_equations(
        self,
        residual: NDArray[np.float64],
        modes: SlowModes,
        weights: NDArray[np.float64],
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], list[NDArray[np.float64]]]:
        """Return AᵀWA + I (q, q), AᵀWr (q,) and each channel's damped modes (K, k)."""
        gram, score = np.eye(self.count), np.zeros(self.count)
        damped = []
        for channel, (at, part) in enumerate(zip(self.places, self.parts, strict=True)):
            low = modes.of(part.T, channel).T  # (K, k)
            damped.append(modes.share[:, [channel]] * low)
            gram[np.ix_(at, at)] += weights[channel] * (part.T @ part - low.T @ damped[-1])
            mine = residual[:, channel]
            score[at] += weights[channel] * (part.T @ mine - modes.of(mine[None], channel)[0] @ damped[-1])
        return gram, score, damped

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
        for channel, (at, part) in enumerate(zip(self.places, self.parts, strict=True)):
            low = modes.of(part.T, channel).T
            total[at] += weights[channel] * (part.T @ signatures[channel].T - low.T @ damped[channel].T)
        return total

    def readings(self, sizes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what sizes (q,), in standard deviations, add to the channels and the reference, shape (n, c + 1)."""
        columns = [part @ sizes[at] for at, part in zip(self.places, self.parts, strict=True)]
        return np.column_stack([*columns, np.zeros(len(columns[0]))])


def tolerance_of(families: Collection[str]) -> dict[str, float]:
    """Return the tolerances of the effects that a library has."""
    return {name: std for name, std in TOLERANCE.items() if name in families}
