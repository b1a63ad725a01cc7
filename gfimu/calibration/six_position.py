"""Six-position static calibration: weighted least squares on l = M a + b with known a.

Source: Persian calibration paper, section 2.3.1, eqs 5-8. The triad rests on a level table with each axis up and
down in turn; a tilt of the table or of a face goes into the misalignments in full.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gfimu.calibration.error_model import free_elements
from gfimu.calibration.fit_quality import covariance_scale
from gfimu.calibration.known_poses import face_poses, forward_design, levelling_covariance
from gfimu.calibration.multi_position import triad_model, triad_names
from gfimu.calibration.nonlinearity import quadratic_statement
from gfimu.calibration.observations import Observations
from gfimu.calibration.result import Calibration

__all__ = ["six_position"]

Floats = NDArray[np.float64]


def six_position(
    observations: Observations, *, gravity: float, gauge: str = "poses", levelling_std_rad: float = 0.0
) -> Calibration:
    """Calibrate one triad from six poses on a level table.

    Parameters
    ----------
    observations : Observations
        Rows of one triad; poses that are no face are left out.
    gravity : float
        Local gravity, m/s².
    gauge : {"poses", "x_axis", "z_axis"}
        ``poses`` estimates all 12 parameters, the others a triangular M with 9.
    levelling_std_rad : float
        Standard deviation of the tilt of a pose per axis, rad; enters the weights and the standard deviations.

    Returns
    -------
    Calibration

    Raises
    ------
    InputError
        If a face is missing.
    """
    kept, references = face_poses(observations, gravity)
    truth = references[kept.pose]  # (n, 3)
    rows_in_pose = np.bincount(kept.pose)[kept.pose]
    design = forward_design(truth, free_elements(gauge))  # (n, 3, u)
    covariance, mean_covariance = kept.row_covariance, kept.mean_covariance
    estimate, cofactor = _least_squares(design, kept.readings, covariance, np.empty(0))
    prior = kept.quadratic_prior if kept.bends else np.empty(0)
    # The levelling term and the bend of the axes need M, which the first pass gives.
    for _ in range(2 if levelling_std_rad > 0.0 or kept.bends else 0):
        model = triad_model(estimate, gauge)
        tilt = levelling_covariance(model, references, levelling_std_rad)
        # All rows of a pose share its tilt, so that each row of n carries n times the variance of the mean.
        covariance = kept.row_covariance + tilt[kept.pose] * rows_in_pose[:, None, None]
        mean_covariance = kept.mean_covariance + tilt
        bend = (truth @ model.sensitivity.T) ** 2  # (n, 3)
        whole = np.concatenate([design, bend[:, :, None] * np.eye(3)], axis=2) if kept.bends else design
        estimate, cofactor = _least_squares(whole, kept.readings, covariance, prior)
    model = triad_model(estimate, gauge)
    residual = kept.means - model.read(references)
    square = np.einsum("pi,pij,pj->", residual, np.linalg.inv(mean_covariance), residual)
    square += np.sum((model.quadratic / prior) ** 2) if kept.bends else 0.0
    redundancy = 3 * kept.n_poses - design.shape[2]  # a prior for every coefficient
    factor = float(square) / redundancy if redundancy else float("nan")
    scale, warnings = covariance_scale(factor, redundancy, observations.variance_factor)
    miss = np.linalg.norm(model.correct(kept.means), axis=1) - np.linalg.norm(references, axis=1)
    return Calibration(
        "six-position",
        observations.unit,
        observations.channels,
        gauge,
        gravity,
        triad_names(observations, gauge),
        estimate,
        cofactor * scale,
        statements=(
            "a tilt of the table or of a face goes into the misalignments: the faces must be level",
            *quadratic_statement(observations),
        ),
        warnings=warnings,
        statistics={
            "poses": float(kept.n_poses),
            "redundancy": float(redundancy),
            "variance_factor": factor,
            "covariance_factor": scale,
            "levelling_std_rad": levelling_std_rad,
            "magnitude_residual_rms_m_s2": float(np.sqrt(np.mean(miss**2))),
            "input": observations.kind,
        },
    )


def _least_squares(design: Floats, readings: Floats, covariance: Floats, prior: Floats) -> tuple[Floats, Floats]:
    """Weighted least squares (eq. 8) and its cofactor matrix; ``prior`` are the stds of the last unknowns about 0."""
    weight_root = np.linalg.inv(np.linalg.cholesky(covariance))
    count = design.shape[2]
    rows = np.eye(count)[count - len(prior) :] / prior[:, None]
    a = np.concatenate([(weight_root @ design).reshape(-1, count), rows])
    l_white = np.concatenate([(weight_root @ readings[..., None]).ravel(), np.zeros(len(prior))])
    _, triangle = np.linalg.qr(a)
    cofactor_root = np.linalg.inv(triangle)
    estimate = cofactor_root @ (cofactor_root.T @ (a.T @ l_white))
    estimate += cofactor_root @ (cofactor_root.T @ (a.T @ (l_white - a @ estimate)))  # one step of refinement
    return estimate, cofactor_root @ cofactor_root.T
