"""Rigid-body kinematics of an accelerometer array: readings from motion, and motion from readings.

Forward (GF-IMU paper, step 3): a_i = θ_iᵀ p + θ_iᵀ (α × r_i) + θ_iᵀ (ωωᵀ − |ω|² I) r_i, with p the specific force of
the body origin, α the angular acceleration and ω the angular rate, all in body axes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.array import AccelerometerArray

__all__ = ["omega_products", "specific_force"]


def omega_products(omega: ArrayLike) -> NDArray[np.float64]:
    """Six products of the angular rate in the order `gfimu.array.OMEGA_PRODUCTS`.

    Parameters
    ----------
    omega : array_like, shape (..., 3)
        Angular rate in body axes, rad/s.

    Returns
    -------
    ndarray, shape (..., 6)
        ω_x², ω_y², ω_z², ω_x ω_y, ω_x ω_z, ω_y ω_z, rad²/s².
    """
    x, y, z = np.moveaxis(np.asarray(omega, dtype=float), -1, 0)
    return np.stack([x * x, y * y, z * z, x * y, x * z, y * z], axis=-1)


def specific_force(array: AccelerometerArray, p: ArrayLike, alpha: ArrayLike, omega: ArrayLike) -> NDArray[np.float64]:
    """Specific force along each sensing axis of a moving array.

    Parameters
    ----------
    array : AccelerometerArray
        The array, with c channels.
    p : array_like, shape (n, 3)
        Specific force of the body origin in body axes, m/s².
    alpha : array_like, shape (n, 3)
        Angular acceleration in body axes, rad/s².
    omega : array_like, shape (n, 3)
        Angular rate in body axes, rad/s.

    Returns
    -------
    ndarray, shape (n, c)
        Readings of ideal sensors, m/s².
    """
    motion = np.concatenate(np.broadcast_arrays(*np.atleast_2d(alpha, p)), axis=-1)  # (n, 6)
    return motion @ array.regression_matrix.T + omega_products(np.atleast_2d(omega)) @ array.centripetal_matrix.T
