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

from gfimu.array.integration import integrate_samples
from gfimu.base.errors import InputError, check_name

__all__ = [
    "ATTITUDE_METHODS",
    "from_rotation",
    "integrate_attitude",
    "table_angle",
    "to_rotation",
]

ATTITUDE_METHODS = ("exponential", "coning", "fourth_order", "runge_kutta")
"""Names of the attitude methods."""

_FUSED = {"contract"}  # multiply and add in one instruction; no other freedom for the compiler


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

    Examples
    --------
    >>> import numpy as np
    >>> import gfimu
    >>> t = np.arange(101) / 100.0
    >>> turning = np.tile([0.0, 0.0, np.pi], (101, 1))
    >>> gfimu.integrate_attitude(t, turning)[-1].round(6)
    array([0., 0., 0., 1.])
    """
    if method is None:
        method = "coning" if alpha is None else "fourth_order"
    check_name("attitude method", method, ATTITUDE_METHODS)
    if method == "fourth_order" and alpha is None:
        raise InputError("attitude method 'fourth_order' needs alpha; give it or use method='coning'")
    # Of one layout: each other one would be compiled anew.
    times, rate = (np.require(values, float, ("C", "W")) for values in (t, omega))
    acceleration = rate if alpha is None else np.require(alpha, float, ("C", "W"))
    if times.ndim != 1 or rate.shape != (len(times), 3) or acceleration.shape != rate.shape:
        raise InputError(
            f"times have shape {times.shape}, omega {rate.shape}, alpha {acceleration.shape}; "
            "omega and alpha need one row of three per time"
        )
    if not (np.isfinite(times[:1]).all() and np.isfinite(times[-1:]).all() and (times[1:] > times[:-1]).all()):
        raise InputError("times must be finite and strictly increasing; sort the samples and drop repeated ones")
    start = np.asarray(q0, dtype=float)
    if start.shape != (4,) or not np.isfinite(start).all() or not np.any(start):
        raise InputError("q0 must be four finite numbers (w, x, y, z), not all zero")
    start = np.ascontiguousarray(start / np.linalg.norm(start))

    if method != "fourth_order":
        acceleration = rate  # not looked at, so its NaN don't matter
    quaternion = _propagate(times, rate, acceleration, start, method)
    if len(times) and not np.isfinite(quaternion[-1]).all():  # a NaN anywhere has come through to the end
        valid = np.isfinite(rate).all(axis=1) & np.isfinite(acceleration).all(axis=1)
        quaternion[~valid] = np.nan
        quaternion[valid] = _propagate(times[valid], rate[valid], acceleration[valid], start, method)
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
        As for `gfimu.array.integration.integrate_rate`.

    Returns
    -------
    ndarray, shape (n,)
        Table angle, rad, not wrapped.
    """
    direction = np.asarray(axis, dtype=float)
    direction = direction / np.linalg.norm(direction)
    return integrate_samples(t, np.asarray(omega, dtype=float) @ direction, angle0, method=method)


def to_rotation(quaternion: ArrayLike) -> Rotation:
    """Turn quaternions (w, x, y, z), shape (..., 4), into scipy rotations, body to world."""
    return Rotation.from_quat(np.asarray(quaternion, dtype=float)[..., [1, 2, 3, 0]])


def from_rotation(rotation: Rotation) -> NDArray[np.float64]:
    """Turn scipy rotations into quaternions (w, x, y, z), shape (..., 4)."""
    return rotation.as_quat()[..., [3, 0, 1, 2]]


def _propagate(
    t: NDArray[np.float64],
    omega: NDArray[np.float64],
    alpha: NDArray[np.float64],
    q0: NDArray[np.float64],
    method: str,
) -> NDArray[np.float64]:
    """Propagate along complete samples."""
    if method == "runge_kutta":
        return _propagate_by_runge_kutta(t, omega, q0)
    return _propagate_by_rotation_vectors(t, omega, alpha, q0, float(method != "exponential"), method == "fourth_order")


@njit(cache=True, fastmath=_FUSED)
def _propagate_by_rotation_vectors(t, omega, alpha, q0, coning, fourth_order):  # type: ignore[no-untyped-def]
    n = len(t)
    result = np.empty((n, 4))
    w, x, y, z = q0[0], q0[1], q0[2], q0[3]
    result[0, 0], result[0, 1], result[0, 2], result[0, 3] = w, x, y, z  # a slice would compile five times as long
    for i in range(n - 1):
        h = t[i + 1] - t[i]
        ax, ay, az = omega[i, 0], omega[i, 1], omega[i, 2]
        bx, by, bz = omega[i + 1, 0], omega[i + 1, 1], omega[i + 1, 2]
        c = coning * h * h * (1 / 12)
        px = 0.5 * h * (ax + bx) + c * (ay * bz - az * by)
        py = 0.5 * h * (ay + by) + c * (az * bx - ax * bz)
        pz = 0.5 * h * (az + bz) + c * (ax * by - ay * bx)
        if fourth_order:
            px += c * (alpha[i, 0] - alpha[i + 1, 0])
            py += c * (alpha[i, 1] - alpha[i + 1, 1])
            pz += c * (alpha[i, 2] - alpha[i + 1, 2])
        s, e = _half_angle_factors(px * px + py * py + pz * pz)
        px, py, pz = s * px, s * py, s * pz
        w, x, y, z = (
            w * e - x * px - y * py - z * pz,
            w * px + x * e + y * pz - z * py,
            w * py - x * pz + y * e + z * px,
            w * pz + x * py - y * px + z * e,
        )
        # The step is a rotation, so the norm only gathers rounding errors. One Newton step for 1/√ takes them off
        # what is stored; the recurrence need not wait for it.
        norm = 1.5 - 0.5 * (w * w + x * x + y * y + z * z)
        result[i + 1, 0] = w * norm
        result[i + 1, 1] = x * norm
        result[i + 1, 2] = y * norm
        result[i + 1, 3] = z * norm
    return result


@njit(cache=True, fastmath=_FUSED, inline="always")
def _half_angle_factors(squared):  # type: ignore[no-untyped-def]
    """Return sin(θ/2)/θ and cos(θ/2) for θ² = ``squared``."""
    if squared < 0.25:  # Taylor series in u = −θ²/4, to the last digit; written with products, divisions are slow
        u = -0.25 * squared
        s = u * (1 / 39916800)
        s = u * (1 / 362880 + s)
        s = u * (1 / 5040 + s)
        s = u * (1 / 120 + s)
        s = u * (1 / 6 + s)
        e = u * (1 / 479001600)
        e = u * (1 / 3628800 + e)
        e = u * (1 / 40320 + e)
        e = u * (1 / 720 + e)
        e = u * (1 / 24 + e)
        e = u * (1 / 2 + e)
        return 0.5 + 0.5 * s, 1.0 + e
    angle = math.sqrt(squared)
    return math.sin(0.5 * angle) / angle, math.cos(0.5 * angle)


@njit(cache=True, fastmath=_FUSED)
def _propagate_by_runge_kutta(t, omega, q0):  # type: ignore[no-untyped-def]
    n = len(t)
    result = np.empty((n, 4))
    w, x, y, z = q0[0], q0[1], q0[2], q0[3]
    result[0, 0], result[0, 1], result[0, 2], result[0, 3] = w, x, y, z  # a slice would compile five times as long
    for i in range(n - 1):
        h = t[i + 1] - t[i]
        ax, ay, az = omega[i, 0], omega[i, 1], omega[i, 2]
        bx, by, bz = omega[i + 1, 0], omega[i + 1, 1], omega[i + 1, 2]
        w, x, y, z = _runge_kutta_step(w, x, y, z, ax, ay, az, bx, by, bz, h)
        norm = 1.0 / math.sqrt(w * w + x * x + y * y + z * z)
        w, x, y, z = w * norm, x * norm, y * norm, z * norm
        result[i + 1, 0] = w
        result[i + 1, 1] = x
        result[i + 1, 2] = y
        result[i + 1, 3] = z
    return result


@njit(cache=True, fastmath=_FUSED)
def _rate_of_quaternion(w, x, y, z, p, q, r):  # type: ignore[no-untyped-def]
    return (
        0.5 * (-x * p - y * q - z * r),
        0.5 * (w * p + y * r - z * q),
        0.5 * (w * q - x * r + z * p),
        0.5 * (w * r + x * q - y * p),
    )


@njit(cache=True, fastmath=_FUSED)
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
