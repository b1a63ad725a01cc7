"""Reference inputs of poses whose direction is known: the six faces on a level table."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gfimu.calibration.coverage import FACES, check_faces, pose_directions
from gfimu.calibration.error_model import ErrorModel
from gfimu.calibration.observations import Observations

__all__ = ["face_poses", "forward_design", "levelling_covariance"]

Floats = NDArray[np.float64]


def face_poses(observations: Observations, gravity: float) -> tuple[Observations, Floats]:
    """Keep the poses nearest to the six faces, and return their true input; those more than 20° off are left out.

    Parameters
    ----------
    observations : Observations
        Rows of one triad.
    gravity : float
        Local gravity, m/s².

    Returns
    -------
    observations : Observations
        Rows of the poses kept.
    references : ndarray, shape (p, 3)
        True specific force of each kept pose, m/s².

    Raises
    ------
    InputError
        If a face is missing.
    """
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
