"""Twelve-position calibration: coarse solution from six faces, fine solution by Newton steps on |a|² = g².

Source: Chinese calibration paper. Its fine stage has twelve unknowns and one equation per pose, but a common rotation
of the three sensing axes changes no magnitude: three directions of the unknowns are not determined and a plain Newton
step is singular. Here that is detected, reported and resolved on purpose: steps of least norm from the coarse
solution, which leave the rotation where the levelled faces put it, or a triangular model with nine unknowns.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gfimu.base.errors import InputError
from gfimu.calibration.coverage import check_magnitude_coverage, pose_directions
from gfimu.calibration.error_model import ErrorModel, free_elements
from gfimu.calibration.fit_quality import covariance_scale
from gfimu.calibration.gauss_helmert import Adjustment
from gfimu.calibration.known_poses import face_poses, forward_design, levelling_covariance
from gfimu.calibration.multi_position import (
    adjust_triad,
    magnitude_condition,
    pose_variance_factor,
    triad_model,
    triad_names,
)
from gfimu.calibration.nonlinearity import quadratic_statement, with_quadratic
from gfimu.calibration.observations import Observations
from gfimu.calibration.result import Calibration

__all__ = ["coarse_solution", "twelve_position"]

Floats = NDArray[np.float64]

_MINIMUM_POSES = 12
_LEVELLING_WIDENING = 1.33
# Six residuals of variance ratio 1 : 1/3 are worth 4.8 degrees of freedom; Student's 97.5 % point there is 2.60, the
# normal one 1.96: with the ratio of the two, intervals of 1.96 standard deviations cover 95 %.


def coarse_solution(observations: Observations, gravity: float) -> ErrorModel:
    """Solve the six faces for the inverse linear model, (GᵀG)⁻¹ Gᵀ (±g, 0) axis by axis.

    Parameters
    ----------
    observations : Observations
        Rows of one triad; poses that are no face are left out.
    gravity : float
        Local gravity, m/s².

    Raises
    ------
    InputError
        If a face is missing.
    """
    faces, references = face_poses(observations, gravity)
    means = faces.means
    centre, size = means.mean(axis=0), float(np.std(means))
    design = np.column_stack([np.ones(len(means)), (means - centre) / size])  # G with its columns balanced
    solution = np.linalg.lstsq(design, references, rcond=None)[0].T  # rows: (offset, W) per axis
    w = solution[:, 1:] / size
    return ErrorModel.from_voltage(solution[:, 0] - w @ centre, w)


def twelve_position(
    observations: Observations,
    *,
    gravity: float,
    gauge: str = "coarse",
    levelling_std_rad: float | None = None,
) -> Calibration:
    """Calibrate one triad from the six faces and six or more other poses.

    Parameters
    ----------
    observations : Observations
        Rows of one triad: all six faces and, best, the edges (planes at 45° and 135°).
    gravity : float
        Local gravity, m/s².
    gauge : {"coarse", "x_axis", "z_axis"}
        ``coarse`` keeps all 12 parameters, the undetermined rotation staying where the faces put it; the others use a
        triangular M with 9.
    levelling_std_rad : float, optional
        Standard deviation of the tilt of a face per axis, rad: the uncertainty of that rotation. By default it is
        estimated from how the faces disagree with each other.

    Returns
    -------
    Calibration
        ``null_space`` holds the three undetermined directions.

    Raises
    ------
    InputError
        If a face is missing or the poses are fewer than twelve or too similar; the message says which to add.
    """
    coarse = coarse_solution(observations, gravity)
    check_magnitude_coverage(pose_directions(observations.means))
    if observations.n_poses < _MINIMUM_POSES:
        raise InputError(
            f"{observations.n_poses} poses, {_MINIMUM_POSES} are needed: "
            "the six faces and the six edges at 45° and 135°"
        )
    begin = coarse if gauge == "coarse" else coarse.in_gauge(gauge)
    condition = magnitude_condition(gravity, gauge, squared=True)
    adjustment = adjust_triad(
        condition,
        begin.parameters(gauge),
        observations,
        observations.row_covariance,
        minimum_norm=gauge == "coarse",
        move_observations=False,
    )
    factor, redundancy = pose_variance_factor(observations, adjustment, gravity, gauge)
    scale, warnings = covariance_scale(factor, redundancy, observations.variance_factor)
    model = triad_model(adjustment.parameters, gauge)
    statements = quadratic_statement(observations)
    covariance = adjustment.cofactor * scale
    tilt = _levelling(observations, coarse, gravity) if levelling_std_rad is None else levelling_std_rad
    if gauge == "coarse":
        covariance = _coarse_gauge_covariance(observations, adjustment, gravity, scale, tilt)
        text = (
            f"{adjustment.null_space.shape[1]} directions of the 12 parameters are not determined by magnitudes: the "
            "common rotations of the three sensing axes about x, y and z; they are taken from the six faces, level to "
            f"{tilt:.2g} rad (standard deviation{' estimated from the faces' if levelling_std_rad is None else ''})"
        )
        statements = (text, *statements)
    miss_coarse = np.linalg.norm(coarse.correct(observations.means), axis=1) - gravity
    miss_fine = np.linalg.norm(model.correct(observations.means), axis=1) - gravity
    return Calibration(
        "twelve-position",
        observations.unit,
        observations.channels,
        gauge,
        gravity,
        triad_names(observations, gauge),
        adjustment.parameters,
        covariance,
        adjustment.null_space,
        statements=statements,
        warnings=warnings,
        statistics={
            "poses": float(observations.n_poses),
            "redundancy": float(redundancy),
            "variance_factor": factor,
            "covariance_factor": scale,
            "iterations": float(adjustment.iterations),
            "levelling_std_rad": float(tilt),
            "coarse_magnitude_residual_rms_m_s2": float(np.sqrt(np.mean(miss_coarse**2))),
            "magnitude_residual_rms_m_s2": float(np.sqrt(np.mean(miss_fine**2))),
            "input": observations.kind,
        },
    )


def _levelling(observations: Observations, coarse: ErrorModel, gravity: float) -> float:
    """Estimate the tilt of the faces from the residuals of the coarse solution, rad.

    With one pose per face, each axis leaves two degrees of freedom, in which tilts of standard deviation s put a
    square of (4/3) s² g² on average; the noise of the means and the bend of the axes are taken off. The estimate has
    few degrees of freedom, so that it is widened by `_LEVELLING_WIDENING`.
    """
    faces, references = face_poses(observations, gravity)
    design = np.column_stack([references, np.ones(len(references))])
    means = faces.means
    hat = design @ np.linalg.pinv(design)
    residual = (means - hat @ means) @ coarse.inverse.T  # (p, 3), m/s²
    spread = faces.covariance / np.bincount(faces.pose)[:, None, None]
    unit_tilt = levelling_covariance(coarse, references, 1.0)
    free = np.eye(len(means)) - hat
    metric = coarse.inverse.T @ coarse.inverse
    expected = np.einsum("qp,pij,ij->", free**2, unit_tilt, metric)
    noise = np.einsum("qp,pij,ij->", free**2, spread, metric)
    if observations.bends:
        bend = free @ (means - coarse.bias) ** 2  # (p, 3)
        noise = noise + np.sum(bend**2 @ (observations.quadratic_prior**2 * np.diag(metric)))
    variance = max(float(np.sum(residual**2)) - float(noise), 0.0) / float(expected)
    return float(_LEVELLING_WIDENING * np.sqrt(variance))


def _coarse_gauge_covariance(
    observations: Observations, adjustment: Adjustment, gravity: float, scale: float, tilt: float
) -> Floats:
    """Covariance of the least-norm solution: determined part from all poses, the rotations from the six faces.

    x = V Vᵀ x_coarse + N⁺ Aᵀ(BQBᵀ)⁻¹ (…), with V the undetermined directions; both parts are carried back to the
    readings of each pose, which they share.
    """
    means = observations.means
    spread = observations.mean_covariance  # (p, 3, 3)
    condition = magnitude_condition(gravity, "coarse", squared=True)
    bent = with_quadratic(condition, np.arange(9, 12)) if observations.bends else condition
    _, a, b = bent(adjustment.parameters, means)
    weight = 1.0 / np.einsum("pri,pij,prj->p", b, spread, b)
    fine = -(adjustment.cofactor @ (a[:, 0] * weight[:, None]).T).T[:, :, None] * b  # ∂x/∂l of each pose, (p, u, 3)
    rotation = (adjustment.null_space @ adjustment.null_space.T)[:, :12]  # of 12 parameters
    faces, references = face_poses(observations, gravity)
    design = forward_design(references, free_elements("coarse"))  # (f, 3, 12)
    inverse = np.linalg.pinv(design.reshape(-1, 12)).reshape(12, -1, 3)  # (12, f, 3)
    coarse = np.einsum("uv,vfi->fui", rotation, inverse)
    transfer = fine
    numbers = np.searchsorted(observations.start_s, faces.start_s)
    transfer[numbers] += coarse
    covariance = np.einsum("pui,pij,pvj->uv", transfer, spread * scale, transfer)
    model = triad_model(adjustment.parameters, "coarse")
    covariance += np.einsum("pui,pij,pvj->uv", coarse, levelling_covariance(model, references, tilt), coarse)
    if observations.bends:
        covariance += _quadratic_covariance(observations, adjustment, coarse, faces.means, scale)
    return np.asarray(covariance, dtype=np.float64)


def _quadratic_covariance(
    observations: Observations, adjustment: Adjustment, coarse: Floats, faces: Floats, scale: float
) -> Floats:
    """Share of the coefficients' prior: they move the fine solution as one more observation, the faces as errors.

    Parameters
    ----------
    coarse : ndarray, shape (f, u, 3)
        Derivative of the parameters by the readings of the faces, through the rotation.
    faces : ndarray, shape (f, 3)
        Readings of the faces.
    """
    std = observations.quadratic_prior
    by_error = adjustment.cofactor[:, 12:] / std**2  # of the fine solution by the error of the prior, (u, 3)
    bend = (faces - adjustment.parameters[9:12]) ** 2
    by_error = by_error - np.einsum("fui,fi->ui", coarse, bend)  # q = 0 + error: the faces read more by −error · y²
    return np.asarray((by_error * (std**2 * scale)) @ by_error.T, dtype=np.float64)
