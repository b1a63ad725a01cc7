"""What is left of a stretch once it is linearised and its drive eliminated (`gfimu.diagnosis.segment`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from gfimu.diagnosis.drive_jacobian import DriveJacobian
from gfimu.diagnosis.drive_prior import DrivePrior
from gfimu.diagnosis.drive_root import InverseRoot
from gfimu.diagnosis.slow_modes import DriveModes
from gfimu.world_model import SpinState

__all__ = ["DriveElimination", "DriveEquations", "Linearisation"]


@dataclass(frozen=True)
class DriveEquations:
    """Normal equations of a drive from the data alone.

    Parameters
    ----------
    prediction, residual, slow_residual, jacobian, slow
        As in `Linearisation`.
    information : csr_array or ndarray, shape (m, m)
        JᵀWJ under the white noise alone; if dense, the lower triangle.
    rhs : ndarray, shape (m,)
        JᵀWr.
    objective : float
        rᵀWr.
    residue : tuple of ndarray, optional
        Where a calibration residue is admitted, its information (q, q), score (q,) and coupling to the drive (m, q).
    """

    prediction: NDArray[np.float64]
    residual: NDArray[np.float64]
    slow_residual: NDArray[np.float64]
    jacobian: DriveJacobian
    slow: DriveModes
    information: csr_array | NDArray[np.float64]
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
        matrix = _sum(self.information, prior.precision)
        if self.residue is None:
            root = InverseRoot.of(matrix, self.slow.rows)
        else:
            inner, right, cross = self.residue
            root = InverseRoot.of(matrix, self.slow.rows, (inner, cross))
            rhs = np.concatenate([rhs, right])
        forward = root.apply(rhs)
        return DriveElimination(root, forward, objective - float(forward @ forward), len(self.rhs))


def _sum(matrix: csr_array | NDArray[np.float64], added: csr_array) -> csr_array | NDArray[np.float64]:
    """Return the sum of two symmetric matrices, dense if the first is."""
    if isinstance(matrix, csr_array):
        return csr_array(matrix + added)
    total, entries = matrix.copy(order="F"), added.tocoo()
    total[entries.row, entries.col] += entries.data
    return total


@dataclass(frozen=True)
class DriveElimination:
    """What is needed to step the drive once the causes are known.

    Parameters
    ----------
    root : InverseRoot
        V with VᵀV = H⁻¹; the last q unknowns are the calibration residue, where it is admitted.
    forward : ndarray, shape (m + k + q,)
        x = V(JᵀWr − Rd).
    objective : float
        rᵀWr + dᵀRd − xᵀx: twice the negative log likelihood, drive marginalised.
    size : int
        m.
    """

    root: InverseRoot
    forward: NDArray[np.float64]
    objective: float
    size: int

    def eliminate(self, cross: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return X = V JᵀWA of what couples signatures to the drive, JᵀWA (m + q, P), shape (m + k + q, P)."""
        return self.root.apply(cross)

    def response(self, eliminated: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how the drive follows each of the signatures' coordinates, shape (m, P)."""
        return -self.root.transposed(eliminated)[: self.size]

    def alone(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the step of the drive (m,) and the sizes of the calibration residue (q,), the causes held."""
        both = self.root.transposed(self.forward)
        return both[: self.size], both[self.size :]

    def log_volume(self) -> float:
        """Return the log of the posterior's volume, up to a constant: −½ log det H."""
        return self.root.log_volume()

    def distance(self) -> float:
        """Return how far the drive is from its best, in squared standard deviations, the causes held."""
        total = float(self.forward @ self.forward)
        if not len(self.root.corner):
            return total
        border = np.concatenate([self.root.border, self.root.corner.T])  # (m + k + q, q)
        right = border.T @ self.forward
        return total - float(right @ np.linalg.solve(border.T @ border, right))  # the residue free at any drive

    def residue(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the information (q, q), prior included, and score (q,) of the residue, drive eliminated."""
        corner = self.root.corner
        return corner @ corner.T, corner @ self.forward[len(self.root.border) :]


@dataclass(frozen=True)
class Linearisation:
    """Residual, drive Jacobian and eliminated drive of a segment about given effects.

    Parameters
    ----------
    prediction : ndarray, shape (n, c + 1)
        Channels and reference.
    residual : ndarray, shape (n, c + 1)
        Measured minus predicted, or what stands for it where readings are coarse; zero where invalid.
    slow_residual : ndarray, shape (K, c + 1)
        The same in the modes of slow noise.
    jacobian : DriveJacobian
        Derivative of each observation with respect to the drive's coefficients.
    slow : DriveModes
        The Jacobian in the modes of slow noise.
    drive : DriveElimination
        The drive's step and the likelihood without it.
    state : SpinState
        The table's motion at the samples, each (n,).
    """

    prediction: NDArray[np.float64]
    residual: NDArray[np.float64]
    slow_residual: NDArray[np.float64]
    jacobian: DriveJacobian
    slow: DriveModes
    drive: DriveElimination
    state: SpinState
