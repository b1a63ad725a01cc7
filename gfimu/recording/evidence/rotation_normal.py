"""Normal equations of the rate at the start and the bias of α of a window, compiled: they are asked for very often."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["rotation_normal"]


@njit(cache=True)  # type: ignore[misc]
def rotation_normal(
    centred: NDArray[np.float64],
    turned: NDArray[np.float64],
    t: NDArray[np.float64],
    sensitivity: NDArray[np.float64],
    point: NDArray[np.float64],
) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
    """Return what a rate leaves of the null space, and the normal equations of its change.

    Residuals and slopes are taken about their means over the window, as the null space may have a constant bias.

    Parameters
    ----------
    centred : ndarray, shape (m, d)
        Null space of the readings about its mean, m/s².
    turned : ndarray, shape (m, 3)
        Integral of α since the start, rad/s.
    t : ndarray, shape (m,)
        Time since the start, s.
    sensitivity : ndarray, shape (d, 6)
        Of the null space to the products of ω.
    point : ndarray, shape (6,)
        Rate at the start, rad/s, and bias of α, rad/s².

    Returns
    -------
    float
        Sum of squares of the residuals, m²/s⁴.
    normal : ndarray, shape (6, 6)
        Slopesᵀ slopes.
    pull : ndarray, shape (6,)
        Slopesᵀ residuals.
    """
    m, d = centred.shape
    seen, slope = np.empty((m, d)), np.empty((m, d, 6))
    mean, mean_slope = np.zeros(d), np.zeros((d, 6))
    for k in range(m):
        x = turned[k, 0] + point[0] - t[k] * point[3]
        y = turned[k, 1] + point[1] - t[k] * point[4]
        z = turned[k, 2] + point[2] - t[k] * point[5]
        for i in range(d):
            xx, yy, zz = sensitivity[i, 0], sensitivity[i, 1], sensitivity[i, 2]
            xy, xz, yz = sensitivity[i, 3], sensitivity[i, 4], sensitivity[i, 5]
            seen[k, i] = xx * x * x + yy * y * y + zz * z * z + xy * x * y + xz * x * z + yz * y * z
            slope[k, i, 0] = 2.0 * xx * x + xy * y + xz * z
            slope[k, i, 1] = 2.0 * yy * y + xy * x + yz * z
            slope[k, i, 2] = 2.0 * zz * z + xz * x + yz * y
            for axis in range(3):
                slope[k, i, 3 + axis] = -t[k] * slope[k, i, axis]
            mean[i] += seen[k, i] / m
            for axis in range(6):
                mean_slope[i, axis] += slope[k, i, axis] / m
    square, normal, pull = 0.0, np.zeros((6, 6)), np.zeros(6)
    for k in range(m):
        for i in range(d):
            residual = centred[k, i] - (seen[k, i] - mean[i])
            square += residual * residual
            for axis in range(6):
                own = slope[k, i, axis] - mean_slope[i, axis]
                pull[axis] += own * residual
                for other in range(axis + 1):
                    normal[axis, other] += own * (slope[k, i, other] - mean_slope[i, other])
    for axis in range(6):
        for other in range(axis):
            normal[other, axis] = normal[axis, other]
    return square, normal, pull
