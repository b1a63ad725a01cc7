"""Tensor method: the rate of each sample on its own, in closed form.

The null space gives all six elements of S = ωωᵀ − |ω|² I by least squares. Then ωωᵀ = S − ½ tr(S) I, and ω is its
dominant eigenvector times the root of the eigenvalue, up to the sign. The six elements are taken for independent
unknowns, which they are not, so the method stays above the Cramér–Rao bound (by 1.22 in pure spin about z for the
tetrahedral cube); `gfimu.rate.maximum_likelihood` reaches it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["rate_from_products"]


def rate_from_products(products: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rate whose outer product is nearest to measured products of ω, up to the sign.

    Parameters
    ----------
    products : array_like, shape (n, 6)
        Products in the order `gfimu.array.array.OMEGA_PRODUCTS`, as measured one by one, rad²/s².

    Returns
    -------
    omega : ndarray, shape (n, 3)
        Rate, rad/s; zero where no eigenvalue is positive.
    slope : ndarray, shape (n, 3, 6)
        ∂ω/∂products, s/rad; infinite where ω is zero.
    """
    s = np.asarray(products, dtype=float)
    outer = s[:, [0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(-1, 3, 3)  # (n, 3, 3)
    values, vectors = np.linalg.eigh(np.nan_to_num(outer))
    direction = vectors[:, :, -1]  # (n, 3)
    speed = np.sqrt(np.maximum(values[:, -1], 0.0))
    # First order: δω = (I − ½ u uᵀ) δ(ωωᵀ) u / |ω|.
    x, y, z = direction.T
    zero = np.zeros_like(x)
    applied = np.stack(  # (n, 3, 6): δ(ωωᵀ) u per product
        [np.stack([x, zero, zero, y, z, zero], -1), np.stack([zero, y, zero, x, zero, z], -1),
         np.stack([zero, zero, z, zero, x, y], -1)],
        axis=1,
    )  # fmt: skip
    projection = np.eye(3) - 0.5 * direction[:, :, None] * direction[:, None, :]
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = projection @ applied / speed[:, None, None]
    omega = speed[:, None] * direction
    omega[~np.isfinite(s).all(axis=1)] = np.nan
    return omega, slope
