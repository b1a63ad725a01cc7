"""Static calibration of a whole array: every chip in one body frame, from poses of unknown direction.

At rest all chips of a rigid array see the same specific force a, so that l_i = M_i A_i a + b_i with A_i the chip's
axes on the drawing. The conditions of a pose are |a_1| = g and a_i = a_1 for every other chip; they are adjusted
together (combined adjustment). What M_i holds beyond scale and non-orthogonality is the rotation of the chip against
the drawing. A common rotation of all chips changes nothing at rest: the body frame is defined as the one in which the
mean rotation of the chips is zero.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, null_space

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError
from gfimu.calibration.coverage import check_magnitude_coverage, fit_sphere, pose_directions
from gfimu.calibration.fit_quality import covariance_scale, odd_poses
from gfimu.calibration.gauss_helmert import Condition, gauss_helmert
from gfimu.calibration.nonlinearity import quadratic_statement, with_quadratic
from gfimu.calibration.observations import Observations
from gfimu.calibration.parameter_names import parameter_names, quadratic_names
from gfimu.calibration.result import Calibration

__all__ = [
    "apparent_alpha",
    "array_static",
    "bias_places",
    "body_specific_force",
    "disagreement",
    "same_specific_force",
    "seen_alpha",
]

Floats = NDArray[np.float64]

_DRAWING_DEG = 25.0


def array_static(observations: Observations, array: AccelerometerArray, *, gravity: float) -> Calibration:
    """Calibrate every chip of an array in one body frame.

    Parameters
    ----------
    observations : Observations
        Rows of all channels of the array, in its order; averaged poses are best.
    array : AccelerometerArray
        The drawing; every chip with three orthogonal axes.
    gravity : float
        Local gravity, m/s².

    Returns
    -------
    Calibration
        Twelve parameters per chip, with their joint covariance; ``null_space`` holds the common rotations.

    Raises
    ------
    InputError
        If a chip is not a triad or not mounted as drawn, or the poses don't suffice.
    """
    axes = _triads(array)
    if observations.channels != array.channels:
        raise InputError(f"the readings are of {', '.join(observations.channels)}, not of array {array.name!r}")
    means = observations.means
    check_magnitude_coverage(pose_directions(means[:, :3]))
    start = _start(means, axes, array, gravity)
    gauge = _rotation_gauge(axes)  # (3, u)
    condition, basis = same_specific_force(axes, gravity), null_space(gauge)
    prior: Floats | None = None
    names = [name for chip in array.chips for name in parameter_names(chip.name, "array")]
    if observations.bends:
        condition = with_quadratic(condition, bias_places(len(axes)))
        start = np.concatenate([start, np.zeros(array.n_channels)])
        basis = block_diag(basis, np.eye(array.n_channels))
        prior = np.concatenate([np.full(len(names), np.inf), observations.quadratic_prior])
        names += quadratic_names(tuple(chip.name for chip in array.chips))
    adjustment = gauss_helmert(
        condition,
        start,
        observations.readings,
        observations.row_covariance,
        basis=basis,
        prior_std=prior,
        tolerance=1e-8,
    )
    scale, warnings = covariance_scale(adjustment.variance_factor, adjustment.redundancy)
    f, _, b = condition(adjustment.parameters, means)
    weight = np.linalg.inv(b @ observations.mean_covariance @ b.swapaxes(1, 2))
    misfit = np.einsum("pr,prs,ps->p", f, weight, f) / f.shape[1]
    statement = (
        "a common rotation of all chips changes nothing at rest: the body frame is the one in which the mean rotation "
        "of the chips against the drawing is zero"
    )
    result = Calibration(
        "array",
        observations.unit,
        observations.channels,
        "array",
        gravity,
        tuple(names),
        adjustment.parameters,
        adjustment.cofactor * scale,
        _common_rotations(adjustment.parameters, axes),
        statements=(statement, *quadratic_statement(observations)),
        warnings=(*warnings, *odd_poses(misfit, observations.start_s)),
    )
    body = body_specific_force(result, array, means)
    magnitude = np.linalg.norm(body.mean(axis=1), axis=1) - gravity
    alpha = apparent_alpha(array, body)
    statistics: dict[str, float | str] = {
        "poses": float(observations.n_poses),
        "redundancy": float(adjustment.redundancy),
        "variance_factor": adjustment.variance_factor,
        "covariance_factor": scale,
        "iterations": float(adjustment.iterations),
        "magnitude_residual_rms_m_s2": float(np.sqrt(np.mean(magnitude**2))),
        "disagreement_rms_m_s2": disagreement(body),
        "input": observations.kind,
    }
    seen = seen_alpha(array)
    for axis, value in zip("xyz", np.sqrt(np.mean(alpha**2, axis=0)), strict=True):
        if axis in seen:
            statistics[f"apparent_alpha_{axis}_rms_rad_s2"] = float(value)
    return replace(result, statistics=statistics, warnings=(*result.warnings, *_unseen_text(array, seen)))


def seen_alpha(array: AccelerometerArray) -> str:
    """Return the axes, of x, y and z, about which the array observes an angular acceleration at rest."""
    share = np.diag(np.linalg.pinv(array.regression_matrix) @ array.regression_matrix)[:3]
    return "".join(axis for axis, one in zip("xyz", share, strict=True) if one > 1.0 - 1e-6)


def _unseen_text(array: AccelerometerArray, seen: str) -> tuple[str, ...]:
    """Return what poses at rest can't show of an array with few channels, in one line; nothing for others."""
    unseen = [axis for axis in "xyz" if axis not in seen]
    if not unseen:
        return ()
    text = (
        f"array {array.name!r} does not observe the angular acceleration about {', '.join(unseen)}: its apparent value "
        "at rest, which checks the chips against one another, can't be stated, nor can these poses show where the "
        "chips are; a run with a reference of the rotation shows places"
    )
    return (text,)


def disagreement(body: Floats) -> float:
    """Compute the RMS, over poses, chips and axes, of the chips' specific forces (p, k, 3) about their mean, m/s²."""
    return float(np.sqrt(np.mean((body - body.mean(axis=1, keepdims=True)) ** 2)))


def apparent_alpha(array: AccelerometerArray, body: Floats) -> Floats:
    """Compute the angular acceleration that the array seems to have at rest, where there is none, rad/s², shape (p, 3).

    Parameters
    ----------
    array : AccelerometerArray
        The array, at its drawn or fitted positions.
    body : ndarray, shape (p, k, 3)
        Specific force of each chip in body axes.
    """
    readings = np.concatenate(
        [body[:, index] @ chip.axes.T for index, chip in enumerate(array.chips)], axis=1
    )  # (p, c)
    return np.asarray((readings @ np.linalg.pinv(array.regression_matrix).T)[:, :3], dtype=np.float64)


def _triads(array: AccelerometerArray) -> Floats:
    """Axes of every chip, (k, 3, 3); refuse chips that are no orthogonal triads."""
    for chip in array.chips:
        if len(chip.axes) != 3 or not np.allclose(chip.axes @ chip.axes.T, np.eye(3), atol=1e-3):
            raise InputError(
                f"chip {chip.name} of array {array.name!r} is not three orthogonal axes; array calibration needs triads"
            )
    return np.array([chip.axes for chip in array.chips])


def _start(means: Floats, axes: Floats, array: AccelerometerArray, gravity: float) -> Floats:
    """Take starting values from the sphere of each chip; refuse a chip not mounted as drawn."""
    parameters, directions = [], []
    for index in range(len(axes)):
        centre, radius = fit_sphere(means[:, 3 * index : 3 * index + 3])
        scale = radius / gravity
        parameters.append(np.concatenate([(scale * np.eye(3)).ravel(), centre]))
        arrows = (means[:, 3 * index : 3 * index + 3] - centre) @ axes[index]
        directions.append(arrows / np.linalg.norm(arrows, axis=1, keepdims=True))
    common = np.median(directions, axis=0)
    for chip, own in zip(array.chips, directions, strict=True):
        cosine = np.sum(own * common, axis=1) / np.linalg.norm(common, axis=1)
        angle = float(np.rad2deg(np.arccos(np.clip(np.median(cosine), -1.0, 1.0))))
        if not angle < _DRAWING_DEG:
            raise InputError(
                f"chip {chip.name} points {angle:.0f}° away from the other chips: its axes are not as array "
                f"{array.name!r} draws them; correct the array file or the wiring"
            )
    return np.concatenate(parameters)


def _rotation_gauge(axes: Floats) -> Floats:
    """Rows of the three conditions Σ_i antisymmetric part of A_iᵀ M_i A_i = 0, shape (3, u)."""
    rows = np.zeros((3, 12 * len(axes)))
    for index, a in enumerate(axes):
        for row, (p, q) in enumerate(((2, 1), (0, 2), (1, 0))):
            # (A^T M A)_pq − (A^T M A)_qp, linear in the elements of M.
            weight = np.outer(a[:, p], a[:, q]) - np.outer(a[:, q], a[:, p])
            rows[row, 12 * index : 12 * index + 9] = weight.ravel()
    return rows


def same_specific_force(axes: Floats, gravity: float) -> Condition:
    """Build the conditions |a_1| − g = 0 and a_i − a_1 = 0 of `array_static` with their Jacobians.

    Parameters
    ----------
    axes : ndarray, shape (k, 3, 3)
        Axes of every chip on the drawing.
    gravity : float
        Local gravity, m/s².
    """
    k = len(axes)

    def condition(parameters: Floats, readings: Floats) -> tuple[Floats, Floats, Floats]:
        n = len(readings)
        per_chip = parameters.reshape(k, 12)
        w = np.linalg.inv(per_chip[:, :9].reshape(k, 3, 3))
        own = np.einsum("kij,nkj->nki", w, readings.reshape(n, k, 3) - per_chip[:, 9:])  # (n, k, 3), chip axes
        to_body = axes.swapaxes(1, 2)  # A_iᵀ
        body = np.einsum("kij,nkj->nki", to_body, own)
        by_reading = to_body @ w  # ∂a_i/∂l_i, (k, 3, 3)
        # ∂a_i/∂M_pq = −A_iᵀ W e_p (own)_q; ∂a_i/∂b = −A_iᵀ W.
        by_m = -np.einsum("kip,nkq->nkipq", by_reading, own).reshape(n, k, 3, 9)
        by_parameters = np.concatenate([by_m, np.broadcast_to(-by_reading, (n, k, 3, 3))], axis=3)  # (n, k, 3, 12)
        r = 1 + 3 * (k - 1)
        f, a, b = np.zeros((n, r)), np.zeros((n, r, 12 * k)), np.zeros((n, r, 3 * k))
        norm = np.linalg.norm(body[:, 0], axis=1)
        unit = body[:, 0] / norm[:, None]
        f[:, 0] = norm - gravity
        a[:, 0, :12] = np.einsum("ni,niu->nu", unit, by_parameters[:, 0])
        b[:, 0, :3] = unit @ by_reading[0]
        for chip in range(1, k):
            rows = slice(3 * chip - 2, 3 * chip + 1)
            f[:, rows] = body[:, chip] - body[:, 0]
            a[:, rows, 12 * chip : 12 * chip + 12] = by_parameters[:, chip]
            a[:, rows, :12] = -by_parameters[:, 0]
            b[:, rows, 3 * chip : 3 * chip + 3] = by_reading[chip]
            b[:, rows, :3] = -by_reading[0]
        return f, a, b

    return condition


def bias_places(chips: int) -> NDArray[np.intp]:
    """Places of the biases among the twelve parameters of every chip, shape (3k,)."""
    return np.asarray(np.flatnonzero(np.tile(np.arange(12) >= 9, chips)), dtype=np.intp)


def _common_rotations(parameters: Floats, axes: Floats) -> Floats:
    """Parameter changes made by common rotations of the body frame, orthonormal, shape (u, 3)."""
    columns = []
    rest = np.zeros(len(parameters) - 12 * len(axes))
    for direction in np.eye(3):
        turn = np.cross(np.eye(3), direction)  # [δ×] up to sign
        blocks = []
        for index, a in enumerate(axes):
            m = parameters[12 * index : 12 * index + 9].reshape(3, 3)
            blocks.append(np.concatenate([(m @ a @ turn @ a.T).ravel(), np.zeros(3)]))
        columns.append(np.concatenate([*blocks, rest]))
    return np.asarray(np.linalg.qr(np.column_stack(columns))[0], dtype=np.float64)


def body_specific_force(result: Calibration, array: AccelerometerArray, means: Floats) -> Floats:
    """Correct readings (p, c) to the specific force of each chip in body axes, shape (p, k, 3), m/s²."""
    parts = [
        result.models[chip.name].correct(means[:, 3 * index : 3 * index + 3]) @ chip.axes
        for index, chip in enumerate(array.chips)
    ]
    return np.stack(parts, axis=1)
