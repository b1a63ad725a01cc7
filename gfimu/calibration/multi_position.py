"""Multi-position calibration: |a| = g over poses of unknown direction, by combined adjustment.

Source: Persian calibration paper, section 2.3.2: f_g = √(a_x² + a_y² + a_z²) − g = 0 with a = M⁻¹ (l − b), adjusted in
parameters and observations together. No levelling is needed, only rest.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gfimu.array.gravity import EARTH_RATE
from gfimu.base.errors import check_name
from gfimu.calibration.coverage import check_magnitude_coverage, fit_sphere, pose_directions
from gfimu.calibration.error_model import ErrorModel, free_elements
from gfimu.calibration.fit_quality import covariance_scale
from gfimu.calibration.gauss_helmert import Adjustment, Condition, gauss_helmert
from gfimu.calibration.nonlinearity import quadratic_statement, with_quadratic
from gfimu.calibration.observations import Observations
from gfimu.calibration.parameter_names import parameter_names, quadratic_names
from gfimu.calibration.result import Calibration

__all__ = [
    "adjust_triad",
    "magnitude_condition",
    "multi_position",
    "multi_position_gyro",
    "pose_variance_factor",
    "triad_model",
    "triad_names",
]

Floats = NDArray[np.float64]

WEIGHTINGS = ("covariance", "uniform")
"""``covariance`` weights each row by the covariance of its reading; ``uniform`` gives each |a| − g the same weight."""

_SEEN = 0.1


def multi_position(
    observations: Observations,
    *,
    gravity: float,
    gauge: str = "x_axis",
    weighting: str = "covariance",
    start: ErrorModel | None = None,
) -> Calibration:
    """Calibrate one triad from nine or more poses of any direction.

    Parameters
    ----------
    observations : Observations
        Rows of one triad.
    gravity : float
        Local gravity, m/s².
    gauge : {"x_axis", "z_axis", "coarse"}
        Triangular M with 9 parameters (lower or upper), or, with ``coarse``, all 12: then three rotations are not
        determined, stay as in ``start``, and are reported.
    weighting : {"covariance", "uniform"}
        Weights of the conditions; ``uniform`` is ordinary least squares on |a| − g.
    start : ErrorModel, optional
        Starting values; from the sphere through the readings if not given.

    Returns
    -------
    Calibration

    Raises
    ------
    InputError
        If the poses are too few or too similar; the message says which to add.
    """
    check_name("weighting", weighting, WEIGHTINGS)
    check_magnitude_coverage(pose_directions(observations.means))
    adjustment = _adjust(observations, gravity, gauge, weighting, start or _coarse_start(observations, gravity))
    factor, redundancy = pose_variance_factor(observations, adjustment, gravity, gauge)
    scale, warnings = covariance_scale(factor, redundancy, observations.variance_factor)
    if weighting == "uniform":
        scale, warnings = adjustment.variance_factor, ()
    model = triad_model(adjustment.parameters, gauge)
    miss = np.linalg.norm(model.correct(observations.means), axis=1) - gravity
    return Calibration(
        "multi-position",
        observations.unit,
        observations.channels,
        gauge,
        gravity,
        triad_names(observations, gauge),
        adjustment.parameters,
        adjustment.cofactor * scale,
        adjustment.null_space,
        statements=(*_rotation_statement(adjustment), *quadratic_statement(observations)),
        warnings=warnings,
        statistics={
            "poses": float(observations.n_poses),
            "rows": float(len(observations.readings)),
            "redundancy": float(redundancy),
            "variance_factor": factor,
            "covariance_factor": scale,
            "iterations": float(adjustment.iterations),
            "magnitude_residual_rms_m_s2": float(np.sqrt(np.mean(miss**2))),
            "input": observations.kind,
            "weighting": weighting,
        },
    )


def magnitude_condition(magnitude: float, gauge: str, *, squared: bool = False, unit_weight: bool = False) -> Condition:
    """Build the condition |a| − magnitude = 0, or |a|² − magnitude² = 0, with its Jacobians.

    Parameters
    ----------
    magnitude : float
        Known magnitude of the true input.
    gauge : str
        Which elements of M are parameters.
    squared : bool
        Use the squares, as the Chinese calibration paper does.
    unit_weight : bool
        Scale B to length one, so that a unit covariance gives every condition the same weight.
    """
    elements = free_elements(gauge)
    rows = [i for i, _ in elements]
    columns = [j for _, j in elements]

    def condition(parameters: Floats, readings: Floats) -> tuple[Floats, Floats, Floats]:
        m = np.zeros((3, 3))
        m[rows, columns] = parameters[: len(elements)]
        w = np.linalg.inv(m)
        a = w @ (readings - parameters[len(elements) :]).T  # (3, n)
        norm = np.sqrt(np.einsum("kn,kn->n", a, a))
        slope = w.T @ a  # (3, n): ∂(½|a|²)/∂l = Wᵀ a
        if squared:
            misclosure = norm**2 - magnitude**2
            slope *= 2.0
        else:
            misclosure = norm - magnitude
            slope /= norm
        # a = W (l − b): ∂a/∂M_ij = −W e_i a_j and ∂a/∂b = −W.
        by_parameters = np.empty((len(elements) + 3, len(norm)))  # (u, n)
        for row, (i, j) in enumerate(elements):
            np.multiply(slope[i], a[j], out=by_parameters[row])
        by_parameters[len(elements) :] = slope
        np.negative(by_parameters, out=by_parameters)
        if unit_weight:
            slope = slope / np.sqrt(np.einsum("kn,kn->n", slope, slope))
        return misclosure[:, None], by_parameters.T[:, None, :], slope.T[:, None, :]

    return condition


def multi_position_gyro(observations: Observations, *, earth_rate: float = EARTH_RATE) -> Calibration:
    """Calibrate a gyro triad at rest against the Earth's rate: |ω| = Ω in every pose.

    The Earth's rate is so small that, for all but navigation-grade gyros, only the bias can be seen. The function
    works out beforehand which parameters the noise of the poses leaves visible, fits those, and states the others.

    Parameters
    ----------
    observations : Observations
        Rows of the gyro triad, rad/s.
    earth_rate : float
        Rate of the Earth, rad/s.

    Returns
    -------
    Calibration
        With M one and its elements in ``null_space`` where scale factors and misalignments can't be seen.
    """
    names = parameter_names("gyro", "x_axis")
    means = observations.means
    per_row = np.bincount(observations.pose)
    spread = observations.covariance / per_row[:, None, None]  # covariance of the means, (p, 3, 3)
    noise = float(np.sqrt(np.einsum("pcc->p", spread).mean() / 3.0))
    # A pose shows the scale to noise / Ω; p poses to about √(3 / p) of it.
    scale_std = noise / earth_rate * np.sqrt(3.0 / observations.n_poses)
    if scale_std < _SEEN:
        check_magnitude_coverage(pose_directions(means))
        start = ErrorModel(np.eye(3), fit_sphere(means)[0])
        adjustment = _adjust(observations, earth_rate, "x_axis", "covariance", start)
        factor, warnings = covariance_scale(adjustment.variance_factor, adjustment.redundancy)
        values, covariance, null_space = adjustment.parameters, adjustment.cofactor * factor, adjustment.null_space
        statements: tuple[str, ...] = ()
    else:
        # Each mean is the bias plus the Earth's rate in an unknown direction, variance Ω²/3 per axis.
        weights = np.linalg.inv(spread + earth_rate**2 / 3.0 * np.eye(3))
        bias_covariance = np.linalg.inv(weights.sum(axis=0))
        bias = bias_covariance @ np.einsum("pij,pj->i", weights, means)
        residual = means - bias
        redundancy = 3 * (observations.n_poses - 1)
        quadratic = float(np.einsum("pi,pij,pj->", residual, weights, residual))
        factor, warnings = covariance_scale(quadratic / redundancy if redundancy else float("nan"), redundancy)
        values = ErrorModel(np.eye(3), bias).parameters("x_axis")
        covariance = np.zeros((9, 9))
        covariance[6:, 6:] = bias_covariance * factor
        null_space = np.eye(9)[:, :6]
        text = (
            "scale factors and misalignments are not observable against the Earth's rate: "
            f"they would have a standard deviation of {scale_std:.3g} (relative), so M is taken as one; only the bias "
            "is estimated"
        )
        statements = (text,)
    return Calibration(
        "multi-position",
        "rad_s",
        ("gyro_x", "gyro_y", "gyro_z"),
        "x_axis",
        earth_rate,
        names,
        values,
        covariance,
        null_space,
        statements=statements,
        warnings=warnings,
        statistics={"poses": float(observations.n_poses), "mean_noise_rad_s": noise, "input": observations.kind},
    )


def _adjust(observations: Observations, magnitude: float, gauge: str, weighting: str, start: ErrorModel) -> Adjustment:
    uniform = weighting == "uniform"
    begin = start.in_gauge(gauge) if gauge != "coarse" else start
    return adjust_triad(
        magnitude_condition(magnitude, gauge, unit_weight=uniform),
        begin.parameters(gauge),
        observations,
        np.eye(3) if uniform else observations.row_covariance,
        minimum_norm=gauge == "coarse",
        move_observations=not uniform,
    )


def adjust_triad(
    condition: Condition,
    start: Floats,
    observations: Observations,
    covariance: Floats,
    *,
    minimum_norm: bool,
    move_observations: bool,
) -> Adjustment:
    """Adjust the parameters of a triad, and the quadratic coefficients of its axes where they bend.

    Parameters
    ----------
    condition : callable
        Of straight readings.
    start : ndarray, shape (u,)
        Starting values; the last three are the bias.
    observations : Observations
        Rows of one triad.
    covariance : ndarray, shape (3, 3) or (n, 3, 3)
        Covariance of the rows.
    minimum_norm, move_observations : bool
        As in `gfimu.calibration.gauss_helmert.gauss_helmert`.
    """
    prior: Floats | None = None
    if observations.bends:
        condition = with_quadratic(condition, np.arange(len(start) - 3, len(start)))
        prior = np.concatenate([np.full(len(start), np.inf), observations.quadratic_prior])
        start = np.concatenate([start, np.zeros(3)])
    return gauss_helmert(
        condition,
        start,
        observations.readings,
        covariance,
        prior_std=prior,
        minimum_norm=minimum_norm,
        move_observations=move_observations,
    )


def triad_names(observations: Observations, gauge: str) -> tuple[str, ...]:
    """Names of the parameters that `adjust_triad` adjusts."""
    bends = quadratic_names(observations.chips) if observations.bends else ()
    return (*parameter_names(observations.chips[0], gauge), *bends)


def triad_model(parameters: Floats, gauge: str) -> ErrorModel:
    """Error model of the parameters that `adjust_triad` adjusts."""
    count = len(free_elements(gauge)) + 3
    model = ErrorModel.from_parameters(parameters[:count], gauge)
    return replace(model, quadratic=parameters[count:]) if len(parameters) > count else model


def pose_variance_factor(
    observations: Observations, adjustment: Adjustment, magnitude: float, gauge: str
) -> tuple[float, int]:
    """Variance factor of the pose means: many samples per pose must not hide that the poses disagree."""
    condition = magnitude_condition(magnitude, gauge)
    count = len(free_elements(gauge)) + 3
    square = 0.0
    if observations.bends:
        condition = with_quadratic(condition, np.arange(count - 3, count))
        square = float(np.sum((adjustment.parameters[count:] / observations.quadratic_prior) ** 2))
    f, _, b = condition(adjustment.parameters, observations.means)
    variance = np.einsum("pi,pij,pj->p", b[:, 0], observations.mean_covariance, b[:, 0])
    redundancy = observations.n_poses - (count - adjustment.null_space.shape[1])  # a prior for every coefficient
    square += float(np.sum(f[:, 0] ** 2 / variance))
    return (square / redundancy if redundancy > 0 else float("nan")), redundancy


def _coarse_start(observations: Observations, gravity: float) -> ErrorModel:
    centre, radius = fit_sphere(observations.means)
    return ErrorModel(radius / gravity * np.eye(3), centre)


def _rotation_statement(adjustment: Adjustment) -> tuple[str, ...]:
    missing = adjustment.null_space.shape[1]
    if not missing:
        return ()
    text = (
        f"{missing} directions of the parameters are not determined by magnitudes: the common rotations of the three "
        "sensing axes about x, y and z; they stay as in the starting solution (minimum norm)"
    )
    return (text,)
