"""Six-position static calibration: weighted least squares on l = M a + b with known a.

Source: Persian calibration paper, section 2.3.1, eqs 5-8. The triad rests on a level table with each axis up and
down in turn; a tilt of the table or of a face goes into the misalignments in full.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from gfimu.calibration.error_model import ErrorModel, free_elements
from gfimu.calibration.fit_quality import covariance_scale
from gfimu.calibration.known_poses import face_poses, forward_design, levelling_covariance
from gfimu.calibration.observations import Observations
from gfimu.calibration.result import Calibration, parameter_names

__all__ = ["six_position"]


def six_position(
    observations: Observations,
    *,
    gravity: float,
    gauge: str = "poses",
    levelling_std_rad: float = 0.0,
    references: ArrayLike | None = None,
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
    references : array_like, shape (p, 3), optional
        True specific force per pose, m/s², instead of the six faces.

    Returns
    -------
    Calibration

    Raises
    ------
    InputError
        If a face is missing.
    """
    kept, references_of_pose = face_poses(observations, gravity, references)
    truth = references_of_pose[kept.pose]  # (n, 3)
    rows_in_pose = np.bincount(kept.pose)[kept.pose]
    design = forward_design(truth, free_elements(gauge))  # (n, 3, u)
    covariance = kept.row_covariance
    estimate = np.zeros(design.shape[2])
    # The levelling term needs M, which the first pass gives.
    for _ in range(2 if levelling_std_rad > 0.0 else 1):
        weight_root = np.linalg.inv(np.linalg.cholesky(covariance))
        a = (weight_root @ design).reshape(-1, design.shape[2])
        l_white = (weight_root @ kept.readings[..., None]).ravel()
        _, triangle = np.linalg.qr(a)
        cofactor_root = np.linalg.inv(triangle)
        estimate = cofactor_root @ (cofactor_root.T @ (a.T @ l_white))  # eq. 8
        estimate += cofactor_root @ (cofactor_root.T @ (a.T @ (l_white - a @ estimate)))  # one step of refinement
        tilt = levelling_covariance(ErrorModel.from_parameters(estimate, gauge), truth, levelling_std_rad)
        # All rows of a pose share its tilt, so that each row of n carries n times the variance of the mean.
        covariance = kept.row_covariance + tilt * rows_in_pose[:, None, None]
    residual = l_white - a @ estimate
    redundancy = len(residual) - len(estimate)
    factor = float(residual @ residual) / redundancy if redundancy else float("nan")
    scale, warnings = covariance_scale(factor, redundancy)
    model = ErrorModel.from_parameters(estimate, gauge)
    miss = np.linalg.norm(model.correct(kept.means), axis=1) - np.linalg.norm(references_of_pose, axis=1)
    return Calibration(
        "six-position",
        observations.unit,
        observations.channels,
        gauge,
        gravity,
        parameter_names(observations.chips[0], gauge),
        estimate,
        cofactor_root @ cofactor_root.T * scale,
        statements=("a tilt of the table or of a face goes into the misalignments: the faces must be level",),
        warnings=warnings,
        statistics={
            "poses": float(kept.n_poses),
            "redundancy": float(redundancy),
            "variance_factor": factor,
            "magnitude_residual_rms_m_s2": float(np.sqrt(np.mean(miss**2))),
            "input": observations.kind,
        },
    )
