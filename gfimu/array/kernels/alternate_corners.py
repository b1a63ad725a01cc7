"""Compiled loop of `gfimu.array.kinematics.closed_form`."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["sum_alternate_corners"]


@njit(cache=True)
def sum_alternate_corners(
    rows: NDArray[np.float64],
    columns: NDArray[np.intp],
    per_arm: NDArray[np.float64],
    per_chip: NDArray[np.float64],
    motion: NDArray[np.float64],
) -> None:
    """Fill ``motion`` (n, 6) from ``rows`` (n, 12) by eqs 28–29."""
    # x1 is the specific force of chip 1 along body x but for the sign of its axis.
    jx, jy, jz = columns[0], columns[1], columns[2]
    ax, ay, az = per_arm[0], per_arm[1], per_arm[2]
    px, py, pz = per_chip[0], per_chip[1], per_chip[2]
    for i in range(rows.shape[0]):
        x1, x2, x3, x4 = rows[i, jx], rows[i, 3 + jx], rows[i, 6 + jx], rows[i, 9 + jx]
        y1, y2, y3, y4 = rows[i, jy], rows[i, 3 + jy], rows[i, 6 + jy], rows[i, 9 + jy]
        z1, z2, z3, z4 = rows[i, jz], rows[i, 3 + jz], rows[i, 6 + jz], rows[i, 9 + jz]
        # Eq. 29: α = Σ r_i × f_i / (8 h²), every coordinate of r_i being ±h.
        motion[i, 0] = az * ((z1 - z2) + (z3 - z4)) - ay * ((y1 - y2) - (y3 - y4))
        motion[i, 1] = ax * ((x1 - x2) - (x3 - x4)) - az * ((z1 + z2) - (z3 + z4))
        motion[i, 2] = ay * ((y1 + y2) - (y3 + y4)) - ax * ((x1 - x2) + (x3 - x4))
        # Eq. 28: p is the mean of the four chips.
        motion[i, 3] = px * ((x1 + x2) + (x3 + x4))
        motion[i, 4] = py * ((y1 + y2) + (y3 + y4))
        motion[i, 5] = pz * ((z1 + z2) + (z3 + z4))
