"""The motion in which tolerances act: what an ideal array would measure at each sample."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.kinematics import specific_force
from gfimu.base.short_repr import short_repr
from gfimu.base.units import STANDARD_GRAVITY

__all__ = ["LEVEL_SECONDS", "KnownMotion"]

Floats = NDArray[np.float64]

LEVEL_SECONDS = 1.0
"""Time over which an estimate levels itself at the start (`gfimu.motion.estimation`), s."""

_TURNING_SHARE = 0.5
"""Share of the largest rate from which a sample counts as turning: there the null space shows ω well."""

_REST_RATE, _REST_ACCELERATION = 1e-6, 1e-6  # numerical: rad/s and rad/s², of a table that stands still


@dataclass(frozen=True)
class KnownMotion:
    """Motion of the body origin at n samples of equal spacing.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Sample times, s.
    p : ndarray, shape (n, 3)
        Specific force of the body origin, body axes, m/s².
    alpha, omega : ndarray, shape (n, 3)
        Angular acceleration, rad/s², and rate, rad/s, body axes.
    rotation : ndarray, shape (n, 3, 3)
        Rotation matrix from body to world axes.
    gravity : float
        Local gravity, m/s².
    """

    t: Floats
    p: Floats
    alpha: Floats
    omega: Floats
    rotation: Floats
    gravity: float = STANDARD_GRAVITY

    __repr__ = short_repr

    def __len__(self) -> int:
        return len(self.t)

    @property
    def step(self) -> float:
        """Time between samples, s."""
        return float((self.t[-1] - self.t[0]) / (len(self.t) - 1))

    @property
    def gradient(self) -> Floats:
        """[α×] + ωωᵀ − |ω|² I, shape (n, 3, 3), 1/s²: acceleration of a point of the body per position."""
        square = np.sum(self.omega**2, axis=1)[:, None, None] * np.eye(3)
        return cross_matrix(self.alpha) + self.omega[:, :, None] * self.omega[:, None, :] - square

    def readings(self, array: AccelerometerArray) -> Floats:
        """Return what an ideal array reads, shape (n, c), m/s²."""
        return specific_force(array, self.p, self.alpha, self.omega)

    @property
    def rest(self) -> int:
        """Number of samples from the start during which the body stands still."""
        turning = np.abs(self.omega).max(axis=1) > _REST_RATE
        turning |= np.abs(self.alpha).max(axis=1) > _REST_ACCELERATION
        pushed = np.linalg.norm(self.p - self.p[0], axis=1) > _REST_ACCELERATION
        moves = turning | pushed | (abs(np.linalg.norm(self.p[0]) - self.gravity) > _REST_ACCELERATION)
        return int(np.argmax(moves)) if moves.any() else len(self)

    @property
    def levelled(self) -> int:
        """Number of samples from which an estimate levels itself; 0 where the body moves during that time."""
        count = int(np.sum(self.t < self.t[0] + LEVEL_SECONDS))
        return count if self.rest >= count else 0

    @property
    def turning(self) -> NDArray[np.bool_]:
        """Samples at which the rate is at least half its largest, shape (n,)."""
        speed = np.linalg.norm(self.omega, axis=1)
        return np.asarray((speed >= _TURNING_SHARE * speed.max()) & (speed > _REST_RATE))


def cross_matrix(vectors: Floats) -> Floats:
    """Return the matrices [v×], shape (..., 3, 3), of vectors (..., 3)."""
    matrix = np.zeros((*vectors.shape, 3))
    x, y, z = np.moveaxis(vectors, -1, 0)
    matrix[..., 0, 1], matrix[..., 0, 2], matrix[..., 1, 2] = -z, y, -x
    matrix[..., 1, 0], matrix[..., 2, 0], matrix[..., 2, 1] = z, -y, x
    return matrix
