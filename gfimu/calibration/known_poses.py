"""Reference inputs of poses whose direction is known: the six faces on a level table."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.base.errors import InputError
from gfimu.calibration.coverage import FACES, check_faces, pose_directions
from gfimu.calibration.error_model import ErrorModel
from gfimu.calibration.observations import Observations

__all__ = ["face_poses", "forward_design", "levelling_covariance"]

Floats = NDArray[np.float64]


def face_poses(
    observations: Observations, gravity: float, references: ArrayLike | None = None
) -> tuple[Observations, Floats]:
    """Keep the poses whose true input is known and return it.

    Parameters
    ----------
    observations : Observations
        Rows of one triad.
    gravity : float
        Local gravity, m/s².
    references : array_like, shape (p, 3), optional
        True specific force of each pose, m/s²; by default each pose is taken as the nearest of the six faces, and
        poses more than 20° from every face are left out.

    Returns
    -------
    observations : Observations
        Rows of the poses kept.
    references : ndarray, shape (p, 3)
        True specific force of each kept pose, m/s².

    Raises
    ------
    InputError
        If a face is missing, or the references don't fit the poses.
    """
    if references is not None:
        given = np.asarray(references, dtype=float)
        if given.shape != (observations.n_poses, 3):
            raise InputError(f"{observations.n_poses} poses need references of shape ({observations.n_poses}, 3)")
        return observations, given
    face = check_faces(pose_directions(observations.means))
    kept = np.flatnonzero(face >= 0)
    return observations.keep(kept), gravity * FACES[face[kept]]


def forward_design(references: Floats, elements: tuple[tuple[int, int], ...]) -> Floats:
    """Design matrix of l = M a + b, shape (n, 3, u): Persian calibration paper, eqs 5-6.

    Parameters
    ----------
    references : ndarray, shape (n, 3)
        True inputs a.
    elements : tuple of (row, column)
        Elements of M that are parameters.
    """
    design = np.zeros((len(references), 3, len(elements) + 3))
    for column, (i, j) in enumerate(elements):
        design[:, i, column] = references[:, j]
    design[:, range(3), range(len(elements), len(elements) + 3)] = 1.0
    return design


def levelling_covariance(model: ErrorModel, references: Floats, levelling_std_rad: float) -> Floats:
    """Covariance of the readings that a tilt of each pose by ``levelling_std_rad`` per axis causes, (n, 3, 3).

    A tilt moves the specific force across its own direction e: cov = M (|a|² I − a aᵀ) Mᵀ σ².
    """
    across = np.sum(references**2, axis=1)[:, None, None] * np.eye(3) - references[:, :, None] * references[:, None, :]
    return np.asarray(model.sensitivity @ across @ model.sensitivity.T * levelling_std_rad**2, dtype=np.float64)
