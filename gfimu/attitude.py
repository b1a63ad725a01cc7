"""Attitude of the body: propagation of the quaternion, conversions, table angle.

A quaternion (w, x, y, z) turns body axes into world axes: v_world = q ⊗ v_body ⊗ q*. It obeys q̇ = ½ q ⊗ ω with ω in
body axes. Over one sample interval of length h the methods apply a rotation vector φ by the exponential map

* ``exponential``: φ = h/2 (ω₀ + ω₁), second order;
* ``coning``: adds h²/12 (ω₀ × ω₁), the turning of the axis of rotation; still second order in general, because the
  mean of two samples misses the curvature of ω;
* ``fourth_order``: adds h²/12 (α₀ − α₁), which is that curvature. An accelerometer array measures α, so this costs
  nothing here;

or, ``runge_kutta``, take the classical fourth-order step with ω interpolated linearly, then normalise.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from gfimu.errors import InputError, unknown_name
from gfimu.rate.integration import integrate_samples

__all__ = [
    "ATTITUDE_METHODS",
    "from_rotation",
    "integrate_attitude",
    "table_angle",
    "to_rotation",
    "twist_angle",
]

_EXPONENTIAL, _CONING, _FOURTH_ORDER, _RUNGE_KUTTA = range(4)
_METHODS = {
    "exponential": _EXPONENTIAL,
    "coning": _CONING,
    "fourth_order": _FOURTH_ORDER,
    "runge_kutta": _RUNGE_KUTTA,
}

ATTITUDE_METHODS = tuple(_METHODS)
"""Names of the attitude methods."""


def integrate_attitude(
    t: ArrayLike,
    omega: ArrayLike,
    alpha: ArrayLike | None = None,
    q0: ArrayLike = (1.0, 0.0, 0.0, 0.0),
    *,
    method: str | None = None,
) -> NDArray[np.float64]:
    """Propagate the attitude quaternion along sampled angular rates.

    Parameters
    ----------
    t : array_like, shape (n,)
        Sample times, s, strictly increasing.
    omega : array_like, shape (n, 3)
        Angular rate in body axes, rad/s. Rows with NaN count as lost samples.
    alpha : array_like, shape (n, 3), optional
        Angular acceleration in body axes, rad/s²; needed by ``fourth_order`` only.
    q0 : array_like, shape (4,)
        Attitude (w, x, y, z) at the first valid sample, body to world; normalised here.
    method : {"fourth_order", "coning", "exponential", "runge_kutta"}, optional
        By default ``fourth_order`` where ``alpha`` is given and ``coning`` where not.

    Returns
    -------
    ndarray, shape (n, 4)
        Unit quaternions (w, x, y, z), body to world; NaN in the rows of lost samples.

    Raises
    ------
    InputError
        If the shapes don't fit, time does not increase, ``q0`` has no direction, or the method is unknown or lacks
        ``alpha``.
    """
    if method is None:
        method = "coning" if alpha is None else "fourth_order"
    if method not in _METHODS:
        raise unknown_name("attitude method", method, ATTITUDE_METHODS)
    if method == "fourth_order" and alpha is None:
        raise InputError("attitude method 'fourth_order' needs alpha; give it or use method='coning'")
    times = np.asarray(t, dtype=float)
    rate = np.asarray(omega, dtype=float)
    acceleration = np.zeros_like(rate) if alpha is None else np.asarray(alpha, dtype=float)
    if times.ndim != 1 or rate.shape != (len(times), 3) or acceleration.shape != rate.shape:
        raise InputError(
            f"times have shape {times.shape}, omega {rate.shape}, alpha {acceleration.shape}; "
            "omega and alpha need one row of three per time"
        )
    if not np.isfinite(times).all() or np.any(np.diff(times) <= 0):
        raise InputError("times must be finite and strictly increasing; sort the samples and drop repeated ones")
    start = np.asarray(q0, dtype=float)
    if start.shape != (4,) or not np.isfinite(start).all() or not np.any(start):
        raise InputError("q0 must be four finite numbers (w, x, y, z), not all zero")
    start = start / np.linalg.norm(start)

    valid = np.isfinite(rate).all(axis=1) & np.isfinite(acceleration).all(axis=1)
    if valid.all():
        return _propagate(times, rate, acceleration, start, _METHODS[method])
    quaternion = np.full((len(times), 4), np.nan)
    if valid.any():
        quaternion[valid] = _propagate(times[valid], rate[valid], acceleration[valid], start, _METHODS[method])
    return quaternion


def table_angle(
    t: ArrayLike,
    omega: ArrayLike,
    *,
    axis: ArrayLike = (0.0, 0.0, 1.0),
    angle0: float = 0.0,
    method: str = "runge_kutta",
) -> NDArray[np.float64]:
    """Integrate the rate about the table's axis to the table angle (GF-IMU paper, step 10 (e)).

    Parameters
    ----------
    t : array_like, shape (n,)
        Sample times, s.
    omega : array_like, shape (n, 3)
        Angular rate in body axes, rad/s.
    axis : array_like, shape (3,)
        Direction of the table's axis in body axes.
    angle0 : float
        Angle at the first valid sample, rad.
    method : str
        As for `gfimu.rate.integration.integrate_rate`.

    Returns
    -------
    ndarray, shape (n,)
        Table angle, rad, not wrapped.
    """
    direction = np.asarray(axis, dtype=float)
    direction = direction / np.linalg.norm(direction)
    return integrate_samples(t, np.asarray(omega, dtype=float) @ direction, angle0, method=method)


def twist_angle(quaternion: ArrayLike) -> NDArray[np.float64]:
    """Angle of the turn about the world's z that an attitude holds.

    Parameters
    ----------
    quaternion : array_like, shape (n, 4)
        Attitudes (w, x, y, z), body to world, close enough in time that neighbours differ by less than π.

    Returns
    -------
    ndarray, shape (n,)
        Angle ψ, rad, unwrapped over the rows, of the decomposition into a turn ψ about z and a tilt about a
        horizontal direction.
    """
    q = np.atleast_2d(np.asarray(quaternion, dtype=float))
    return np.unwrap(2.0 * np.arctan2(q[:, 3], q[:, 0]))


def to_rotation(quaternion: ArrayLike) -> Rotation:
    """Turn quaternions (w, x, y, z), shape (..., 4), into scipy rotations, body to world."""
    return Rotation.from_quat(np.asarray(quaternion, dtype=float)[..., [1, 2, 3, 0]])


def from_rotation(rotation: Rotation) -> NDArray[np.float64]:
    """Turn scipy rotations into quaternions (w, x, y, z), shape (..., 4)."""
    return rotation.as_quat()[..., [3, 0, 1, 2]]


@njit(cache=True)
def _propagate(t, omega, alpha, q0, method):  # type: ignore[no-untyped-def]
    n = len(t)
    result = np.empty((n, 4))
    if n == 0:
        return result
    w, x, y, z = q0[0], q0[1], q0[2], q0[3]
    result[0] = q0
    for i in range(n - 1):
        h = t[i + 1] - t[i]
        ax, ay, az = omega[i, 0], omega[i, 1], omega[i, 2]
        bx, by, bz = omega[i + 1, 0], omega[i + 1, 1], omega[i + 1, 2]
        if method == _RUNGE_KUTTA:
            w, x, y, z = _runge_kutta_step(w, x, y, z, ax, ay, az, bx, by, bz, h)
        else:
            px, py, pz = 0.5 * h * (ax + bx), 0.5 * h * (ay + by), 0.5 * h * (az + bz)
            if method >= _CONING:
                c = h * h / 12.0
                px += c * (ay * bz - az * by)
                py += c * (az * bx - ax * bz)
                pz += c * (ax * by - ay * bx)
                if method == _FOURTH_ORDER:
                    px += c * (alpha[i, 0] - alpha[i + 1, 0])
                    py += c * (alpha[i, 1] - alpha[i + 1, 1])
                    pz += c * (alpha[i, 2] - alpha[i + 1, 2])
            squared = px * px + py * py + pz * pz
            if squared < 1e-6:  # sin(θ/2)/θ and cos(θ/2) by series: the next terms are below 1e-16
                s = 0.5 - squared / 48.0 + squared * squared / 3840.0
                e = 1.0 - squared / 8.0 + squared * squared / 384.0
            else:
                angle = math.sqrt(squared)
                s = math.sin(0.5 * angle) / angle
                e = math.cos(0.5 * angle)
            px, py, pz = s * px, s * py, s * pz
            w, x, y, z = (
                w * e - x * px - y * py - z * pz,
                w * px + x * e + y * pz - z * py,
                w * py - x * pz + y * e + z * px,
                w * pz + x * py - y * px + z * e,
            )
        # Rounding and the Runge-Kutta step leave the norm slightly off 1.
        norm = 1.0 / math.sqrt(w * w + x * x + y * y + z * z)
        w, x, y, z = w * norm, x * norm, y * norm, z * norm
        result[i + 1, 0] = w
        result[i + 1, 1] = x
        result[i + 1, 2] = y
        result[i + 1, 3] = z
    return result


@njit(cache=True)
def _rate_of_quaternion(w, x, y, z, p, q, r):  # type: ignore[no-untyped-def]
    return (
        0.5 * (-x * p - y * q - z * r),
        0.5 * (w * p + y * r - z * q),
        0.5 * (w * q - x * r + z * p),
        0.5 * (w * r + x * q - y * p),
    )


@njit(cache=True)
def _runge_kutta_step(w, x, y, z, ax, ay, az, bx, by, bz, h):  # type: ignore[no-untyped-def]
    mx, my, mz = 0.5 * (ax + bx), 0.5 * (ay + by), 0.5 * (az + bz)
    k1 = _rate_of_quaternion(w, x, y, z, ax, ay, az)
    d = 0.5 * h
    k2 = _rate_of_quaternion(w + d * k1[0], x + d * k1[1], y + d * k1[2], z + d * k1[3], mx, my, mz)
    k3 = _rate_of_quaternion(w + d * k2[0], x + d * k2[1], y + d * k2[2], z + d * k2[3], mx, my, mz)
    k4 = _rate_of_quaternion(w + h * k3[0], x + h * k3[1], y + h * k3[2], z + h * k3[3], bx, by, bz)
    s = h / 6.0
    return (
        w + s * (k1[0] + 2.0 * (k2[0] + k3[0]) + k4[0]),
        x + s * (k1[1] + 2.0 * (k2[1] + k3[1]) + k4[1]),
        y + s * (k1[2] + 2.0 * (k2[2] + k3[2]) + k4[2]),
        z + s * (k1[3] + 2.0 * (k2[3] + k3[3]) + k4[3]),
    )
