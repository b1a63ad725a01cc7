"""Geometric dilution of precision of very many geometries at once, and the least that chips in a cube can have.

GDOP² = tr (JᵀJ)⁻¹ by the Schur complement of the p block: two symmetric 3 × 3 inverses by their adjugates instead of
one 6 × 6 inverse per geometry.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.base.errors import InputError

__all__ = ["gdop", "gdop_lower_bound"]


def gdop(positions: ArrayLike, axes: ArrayLike | None = None, *, length_unit_m: float = 1.0) -> NDArray[np.float64]:
    """Compute GDOP = √tr((JᵀJ)⁻¹) of many geometries at once, without forming or inverting any 6 × 6 matrix.

    Parameters
    ----------
    positions : array_like, shape (m, k, 3) or (k, 3)
        Positions of k sensors in each of m geometries, m.
    axes : array_like, shape (m, k, 3) or (k, 3), optional
        Sensing axes, unit vectors; without them every sensor is a tri-axial chip, whose turn doesn't matter.
    length_unit_m : float
        Length that counts as 1, m.

    Returns
    -------
    ndarray, shape (m,)
        Infinite for geometries of rank < 6.

    Examples
    --------
    >>> import gfimu
    >>> cube = gfimu.AccelerometerArray.load("cube12")
    >>> gfimu.gdop(cube.chip_positions, length_unit_m=0.05).round(4).tolist()
    [1.0607]
    """
    from gfimu.array.kernels.dilution import gdop_of_axes, gdop_of_triads  # numba: scoring does not wait for it

    places = np.ascontiguousarray(positions, dtype=float)
    places = places[None] if places.ndim == 2 else places
    if places.ndim != 3 or places.shape[-1] != 3:
        raise InputError(f"positions of shape {np.shape(positions)}: give (m, k, 3), m")
    scale = 1.0 / length_unit_m
    result = np.empty(len(places))
    if axes is None:
        gdop_of_triads(places, scale, result)
        return result
    directions = np.ascontiguousarray(axes, dtype=float)
    directions = directions[None] if directions.ndim == 2 else directions
    if directions.shape not in {places.shape, (1, *places.shape[1:])}:
        raise InputError(f"axes of shape {np.shape(axes)} don't fit positions of shape {places.shape}")
    gdop_of_axes(places, scale, directions, result)
    return result


def gdop_lower_bound(n_chips: int) -> float:
    """Least GDOP that ``n_chips`` tri-axial chips inside the cube [−1, 1]³ can have: √(9/(2n)).

    tr of the α block of JᵀJ is 2 Σ|r|² ≤ 6n, so the trace of that block's inverse is at least 9/(6n); the p block is
    n·I; an inverse's block is never below the inverse of the block. Equality needs every chip in a corner, the mean
    position at the centre and equal moments: n a multiple of four.
    """
    return math.sqrt(9.0 / (2.0 * n_chips))
