"""Positions and residual biases of an array's chips from motion: a turntable, or free motion with a gyro.

A corrected reading is y_i = A_i (p + Γ r_i) + β_i with Γ = [α×] + ωωᵀ − |ω|² I. The specific force p of the origin, the
angular acceleration α and the rate ω are unknown at every sample; a reference (tachometer or gyro) observes ω. They
are eliminated sample by sample and what is left is solved for the positions r and biases β by Gauss–Newton.

Not every combination shows: a common shift of all positions is a change of p, a bias that looks like p or α is one.
Which directions the data leave undetermined is computed from the singular values of the reduced normal matrix,
reported in words, and left as in the drawing (step of least norm).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import UnitError
from gfimu.calibration.motion_observability import describe_null_space
from gfimu.calibration.motion_reference import MotionReference
from gfimu.recording import Recording

__all__ = ["ArrayMotion", "array_motion", "gradient", "rate_derivative", "turning_readings"]

Floats = NDArray[np.float64]

_RANK_TOLERANCE = 1e-9
_ITERATIONS = 20


@dataclass(frozen=True)
class ArrayMotion:
    """Positions and residual biases fitted to motion.

    Parameters
    ----------
    positions : ndarray, shape (k, 3)
        Positions of the chips in the body frame, m.
    biases : ndarray, shape (k, 3)
        Residual bias of each sensing axis, m/s².
    covariance : ndarray, shape (6k, 6k) or (7k, 7k)
        Covariance of the positions (chip by chip), then the biases, then the delays where there are any.
    null_space : ndarray, shape (6k, m)
        Orthonormal directions (m and m/s²) that the motion does not determine.
    statements : tuple of str
        Which directions these are.
    residual_rms_m_s2, residual_rms_before_m_s2 : float
        RMS of what the fit, and the drawing, leave unexplained in the readings' null space.
    samples : int
        Samples used.
    reference : str
        Kind of reference.
    delays : ndarray, shape (k,), optional
        How late each chip samples against the mean of all, s; None where they were not fitted.
    """

    positions: Floats
    biases: Floats
    covariance: Floats
    null_space: Floats
    statements: tuple[str, ...]
    residual_rms_m_s2: float
    residual_rms_before_m_s2: float
    samples: int
    reference: str
    delays: Floats | None = None

    @property
    def position_std(self) -> Floats:
        """Standard deviation of the positions, m, shape (k, 3); of the determined part only."""
        count = self.positions.size
        return np.asarray(np.sqrt(np.diag(self.covariance)[:count]).reshape(-1, 3), dtype=np.float64)


def array_motion(recording: Recording, array: AccelerometerArray, reference: MotionReference) -> ArrayMotion:
    """Fit positions and residual biases of the chips to motion.

    Parameters
    ----------
    recording : Recording
        Readings corrected by a static calibration, m/s².
    array : AccelerometerArray
        The drawing, where the fit starts.
    reference : MotionReference
        What is known of the rotation.

    Returns
    -------
    ArrayMotion

    Raises
    ------
    UnitError
        If the readings are raw counts.
    """
    if recording.unit != "m_s2":
        raise UnitError("motion calibration needs corrected readings in m/s²; apply the static calibration first")
    y = recording.for_array(array)[reference.rows]  # (n, c)
    k, c = len(array.chips), array.n_channels
    positions, biases = array.chip_positions.copy(), np.zeros(c)
    omega, alpha = reference.omega.copy(), _start_alpha(y, array, reference)
    p = _origin_force(y, array, positions, omega, alpha)
    sigma = _reading_noise(y, array, omega)
    before = np.nan
    for iteration in range(_ITERATIONS):
        design, nuisance, residual = _linearise(y, array, positions, biases, p, alpha, omega, reference, sigma)
        reduced, reduced_residual, solve = _eliminate(design, nuisance, residual)
        flat, right = reduced.reshape(-1, 3 * k + c), reduced_residual.ravel()
        if iteration == 0:
            before = float(np.sqrt(np.mean(reduced_residual[:, :c] ** 2))) * sigma
        triangle = np.asarray(np.linalg.qr(np.column_stack([flat, right]), mode="r"))
        typical = float(np.sqrt(np.mean(np.sum(omega**2, axis=1) ** 2)))  # ω², (rad/s)²
        scale = np.repeat([1.0 / max(typical, 1e-9), 1.0], [3 * k, c])  # m and m/s² of equal effect
        left, s, vt = np.linalg.svd(triangle[:-1, :-1] * scale)
        rank = int(np.sum(s > _RANK_TOLERANCE * s[0]))
        inverse = scale[:, None] * (vt[:rank].T / s[:rank])
        step = inverse @ (left[:, :rank].T @ triangle[:-1, -1])
        change = solve(step)  # (n, q)
        positions = positions + step[: 3 * k].reshape(k, 3)
        biases = biases + step[3 * k :]
        p, alpha, omega = _updated(p, alpha, omega, change, reference)
        std = np.linalg.norm(inverse, axis=1)
        if iteration > 0 and np.all(np.abs(step) <= 1e-4 * std + 1e-12):
            break
    after = right - flat @ step
    redundancy = right.size - nuisance.shape[0] * nuisance.shape[2] - rank
    factor = float(after @ after) / redundancy
    null_space = np.linalg.qr(scale[:, None] * vt[rank:].T)[0]
    fitted = array.with_geometry(positions, [chip.axes for chip in array.chips])
    return ArrayMotion(
        positions,
        biases.reshape(k, -1),
        inverse @ inverse.T * factor,
        null_space,
        describe_null_space(scale[:, None] * vt[rank:].T, fitted),
        float(np.sqrt(np.mean(after.reshape(len(y), -1)[:, :c] ** 2))) * sigma,
        before,
        len(y),
        reference.kind,
    )


def gradient(omega: Floats, alpha: Floats) -> Floats:
    """Return Γ = [α×] + ωωᵀ − |ω|² I, shape (n, 3, 3)."""
    cross = np.zeros((len(omega), 3, 3))
    cross[:, 0, 1], cross[:, 0, 2], cross[:, 1, 2] = -alpha[:, 2], alpha[:, 1], -alpha[:, 0]
    cross -= cross.swapaxes(1, 2).copy()
    square = np.sum(omega**2, axis=1)[:, None, None] * np.eye(3)
    return np.asarray(cross + omega[:, :, None] * omega[:, None, :] - square, dtype=np.float64)


def rate_derivative(omega: Floats, r: Floats) -> Floats:
    """Return ∂(ωωᵀ r − |ω|² r)/∂ω = (ω·r) I + ω rᵀ − 2 r ωᵀ for every chip, shape (n, k, 3, 3)."""
    dot = omega @ r.T  # (n, k)
    return np.asarray(
        dot[:, :, None, None] * np.eye(3)
        + omega[:, None, :, None] * r[None, :, None, :]
        - 2.0 * r[None, :, :, None] * omega[:, None, None, :],
        dtype=np.float64,
    )


def turning_readings(y: Floats, array: AccelerometerArray, omega: Floats) -> Floats:
    """Return the angular acceleration (n, 3) that readings (n, c) show at rates (n, 3), of either sign."""
    still = y - _centripetal(array, omega)
    return np.asarray((still @ np.linalg.pinv(array.regression_matrix).T)[:, :3], dtype=np.float64)


def _start_alpha(y: Floats, array: AccelerometerArray, reference: MotionReference) -> Floats:
    if reference.kind == "turntable":
        return np.column_stack([np.zeros((len(y), 2)), reference.alpha])
    return turning_readings(y, array, reference.omega)


def _centripetal(array: AccelerometerArray, omega: Floats) -> Floats:
    gamma = gradient(omega, np.zeros_like(omega))
    return np.asarray(np.einsum("ci,nij,cj->nc", array.axes, gamma, array.positions), dtype=np.float64)


def _origin_force(y: Floats, array: AccelerometerArray, positions: Floats, omega: Floats, alpha: Floats) -> Floats:
    moved = np.einsum("nij,kj->nki", gradient(omega, alpha), positions)[:, array.chip_of_channel]
    rest = y - np.einsum("ci,nci->nc", array.axes, moved)
    return np.asarray(rest @ np.linalg.pinv(array.axes).T, dtype=np.float64)


def _reading_noise(y: Floats, array: AccelerometerArray, omega: Floats) -> float:
    """Scatter of the readings in the null space of the array, m/s²: the weight of a reading against the reference."""
    rest = y - _centripetal(array, omega)
    j = array.regression_matrix
    rest = rest - rest @ np.linalg.pinv(j).T @ j.T
    return max(float(np.sqrt(np.sum(rest**2) / (len(y) * (array.n_channels - 6)))), 1e-6)


def _linearise(
    y: Floats,
    array: AccelerometerArray,
    positions: Floats,
    biases: Floats,
    p: Floats,
    alpha: Floats,
    omega: Floats,
    reference: MotionReference,
    sigma: float,
) -> tuple[Floats, Floats, Floats]:
    """Jacobians by the unknowns (n, m, 3k + c) and by the sample's own quantities (n, m, q), and residuals (n, m).

    Rows: the c readings, then what the reference says of rate and angular acceleration.
    """
    n, c = y.shape
    k = len(positions)
    chip = array.chip_of_channel
    gamma = gradient(omega, alpha)
    model = p[:, None, :] + np.einsum("nij,kj->nki", gamma, positions)  # (n, k, 3)
    residual = (y - np.einsum("ci,nci->nc", array.axes, model[:, chip]) - biases) / sigma
    design = np.zeros((n, c, 3 * k + c))
    by_position = np.einsum("ci,nij->ncj", array.axes, gamma)
    for channel in range(c):
        design[:, channel, 3 * chip[channel] : 3 * chip[channel] + 3] = by_position[:, channel]
        design[:, channel, 3 * k + channel] = 1.0
    by_rate = np.einsum("ci,ncij->ncj", array.axes, rate_derivative(omega, positions)[:, chip])
    by_alpha = np.cross(positions[chip], array.axes)  # θᵀ(α × r) = α·(r × θ)
    by_force = np.broadcast_to(array.axes, (n, c, 3))
    if reference.kind == "turntable":
        alpha_z = np.broadcast_to(by_alpha[:, 2:], (n, c, 1))
        own = np.concatenate([by_force, alpha_z, by_rate[:, :, 2:]], axis=2) / sigma
        extra = np.zeros((n, 2, 5))
        extra[:, 0, 4], extra[:, 1, 3] = 1.0 / reference.omega_std, 1.0 / reference.alpha_std
        referred = np.column_stack(
            [
                (reference.omega[:, 2] - omega[:, 2]) / reference.omega_std,
                (reference.alpha - alpha[:, 2]) / reference.alpha_std,
            ]
        )
    else:
        own = np.concatenate([by_force, np.broadcast_to(by_alpha, (n, c, 3)), by_rate], axis=2) / sigma
        extra = np.zeros((n, 3, 9))
        extra[:, range(3), range(6, 9)] = 1.0 / reference.omega_std
        referred = (reference.omega - omega) / reference.omega_std
    unknown = np.concatenate([design / sigma, np.zeros((n, extra.shape[1], 3 * k + c))], axis=1)
    return unknown, np.concatenate([own, extra], axis=1), np.concatenate([residual, referred], axis=1)


def _eliminate(design: Floats, nuisance: Floats, residual: Floats) -> tuple[Floats, Floats, Callable[[Floats], Floats]]:
    """Project the sample's own quantities out; also return the function from a step of the rest to theirs."""
    size = np.linalg.norm(nuisance, axis=1, keepdims=True)
    size[size == 0.0] = 1.0
    q, triangle = np.linalg.qr(nuisance / size)
    reduced = design - q @ (q.swapaxes(1, 2) @ design)
    reduced_residual = residual - (q @ (q.swapaxes(1, 2) @ residual[..., None]))[..., 0]

    def solve(step: Floats) -> Floats:
        rest = residual - design @ step
        return np.asarray(
            np.linalg.solve(triangle, q.swapaxes(1, 2) @ rest[..., None])[..., 0] / size[:, 0], dtype=np.float64
        )

    return reduced, reduced_residual, solve


def _updated(
    p: Floats, alpha: Floats, omega: Floats, change: Floats, reference: MotionReference
) -> tuple[Floats, Floats, Floats]:
    if reference.kind == "turntable":
        zero = np.zeros((len(p), 2))
        return (
            p + change[:, :3],
            alpha + np.column_stack([zero, change[:, 3]]),
            omega + np.column_stack([zero, change[:, 4]]),
        )
    return p + change[:, :3], alpha + change[:, 3:6], omega + change[:, 6:]
