"""What is left of a stretch once it is linearised and its drive eliminated (`gfimu.diagnosis.segment`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack, solve_triangular
from scipy.linalg.blas import dsyr

from gfimu.diagnosis.drive_jacobian import DriveJacobian
from gfimu.diagnosis.drive_prior import DrivePrior
from gfimu.diagnosis.model import SpinState

__all__ = ["DriveElimination", "DriveEquations", "Linearisation"]

_RIDGE = 1e-10


@dataclass(frozen=True)
class DriveEquations:
    """Normal equations of a drive from the data alone.

    Parameters
    ----------
    residual, slow_residual, jacobian, slow
        As in `Linearisation`.
    lhs : ndarray, shape (m, m)
        Lower triangle of JᵀWJ.
    rhs : ndarray, shape (m,)
        JᵀWr.
    objective : float
        rᵀWr.
    residue : tuple of ndarray, optional
        Where a calibration residue is admitted, its information (q, q), score (q,) and coupling to the drive (m, q).
    """

    residual: NDArray[np.float64]
    slow_residual: NDArray[np.float64]
    jacobian: DriveJacobian
    slow: NDArray[np.float64]
    lhs: NDArray[np.float64]
    rhs: NDArray[np.float64]
    objective: float
    residue: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]] | None

    def eliminated(self, prior: DrivePrior, coefficients: NDArray[np.float64]) -> DriveElimination:
        """Add the prior of the drive, at coefficients (m,), and factor.

        Raises
        ------
        numpy.linalg.LinAlgError
            If data and prior hold no drive.
        """
        energy, pull = prior.energy(coefficients)
        rhs, objective = self.rhs + pull, self.objective + energy
        precision = prior.precision.tocoo()
        lhs = self.lhs.copy(order="F")
        lhs[precision.row, precision.col] += precision.data
        # A vanishing coupling keeps far entries of the factor out of the denormal range, where LAPACK crawls; its
        # sign alternates, as a constant one would hold the mean angle, which the data hardly fix.
        coupling = 1e-14 * float(np.mean(lhs.diagonal()))
        lhs = dsyr(coupling, (-1.0) ** np.arange(len(lhs)), lower=1, a=lhs, overwrite_a=1)
        if self.residue is not None:
            inner, right, cross = self.residue
            lhs = np.asfortranarray(np.block([[lhs, cross], [cross.T, inner]]))
            rhs = np.concatenate([rhs, right])
        factor, failed = lapack.dpotrf(lhs, lower=1, clean=1)
        if failed:  # a stretch of the drive that only its prior holds, and hardly
            ridge = np.asfortranarray(lhs + np.diag(_RIDGE * lhs.diagonal()))
            factor, failed = lapack.dpotrf(ridge, lower=1, clean=1, overwrite_a=1)
        if failed:
            raise np.linalg.LinAlgError("the normal equations of the drive are not positive definite")
        forward = solve_triangular(factor, rhs, lower=True, check_finite=False)
        return DriveElimination(factor, forward, objective - float(forward @ forward), len(self.rhs))


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
