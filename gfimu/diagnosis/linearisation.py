"""What is left of a stretch once it is linearised and its drive eliminated (`gfimu.diagnosis.segment`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from gfimu.diagnosis.drive_jacobian import DriveJacobian
from gfimu.diagnosis.model import SpinState

__all__ = ["DriveElimination", "Linearisation"]


@dataclass(frozen=True)
class DriveElimination:
    """What is needed to step the drive once the causes are known.

    Parameters
    ----------
    factor : ndarray, shape (m + q, m + q)
        Lower Cholesky factor L of H; the last q unknowns are the calibration residue, where it is admitted.
    forward : ndarray, shape (m + q,)
        x = L⁻¹(JᵀWr − Rd).
    objective : float
        rᵀWr + dᵀRd − xᵀx: twice the negative log likelihood, drive marginalised.
    size : int
        m.
    """

    factor: NDArray[np.float64]
    forward: NDArray[np.float64]
    objective: float
    size: int

    def step(self, eliminated: NDArray[np.float64], step: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the step of the drive (m,) to its posterior mean, given the step of the signatures' coordinates."""
        right = self.forward - eliminated @ step
        return self._solve(right)[: self.size]

    def response(self, eliminated: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how the drive follows each of the signatures' coordinates, shape (m, P)."""
        return -self._solve(eliminated)[: self.size]

    def alone(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the step of the drive (m,) and the sizes of the calibration residue (q,), the causes held."""
        both = self._solve(self.forward)
        return both[: self.size], both[self.size :]

    def log_volume(self) -> float:
        """Return the log of the posterior's volume, up to a constant: −½ log det H."""
        return -float(np.log(self.factor.diagonal()).sum())

    def distance(self) -> float:
        """Return how far the drive is from its best, in squared standard deviations, the causes held."""
        total = float(self.forward @ self.forward)
        if len(self.forward) == self.size:
            return total
        corner = self.factor[self.size :]
        right = corner @ self.forward
        return total - float(right @ np.linalg.solve(corner @ corner.T, right))  # the residue free at any drive

    def residue(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the information (q, q), prior included, and score (q,) of the residue, drive eliminated."""
        corner = self.factor[self.size :, self.size :]
        return corner @ corner.T, corner @ self.forward[self.size :]

    def _solve(self, right: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(solve_triangular(self.factor, right, lower=True, trans=1, check_finite=False))


@dataclass(frozen=True)
class Linearisation:
    """Residual, drive Jacobian and eliminated drive of a segment about given effects.

    Parameters
    ----------
    residual : ndarray, shape (n, c + 1)
        Measured minus predicted; zero where invalid.
    slow_residual : ndarray, shape (K, c + 1)
        The same in the cosines of slow noise.
    jacobian : DriveJacobian
        Derivative of each observation with respect to the drive's coefficients.
    slow : ndarray, shape (R, m, K)
        The Jacobian's parts in the cosines of slow noise.
    drive : DriveElimination
        The drive's step and the likelihood without it.
    state : SpinState
        The table's motion at the samples, each (n,).
    """

    residual: NDArray[np.float64]
    slow_residual: NDArray[np.float64]
    jacobian: DriveJacobian
    slow: NDArray[np.float64]
    drive: DriveElimination
    state: SpinState
