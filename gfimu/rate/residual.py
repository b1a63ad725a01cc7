"""What the null space of a sample keeps of its noise once a rate has been fitted."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gfimu.array.kinematics import omega_products
from gfimu.base.compiled import compiled

__all__ = ["Residual", "bounded_covariance", "least_curvature", "residual_of"]

_DIRECTIONS = 400  # numerical: over which the weakest one is looked for
_LEAST_SHARE = 1e-3  # numerical: of the strongest direction


class Residual(NamedTuple):
    """Residual of z = M s(ω) + noise per sample, with z in units of its noise."""

    squares: NDArray[np.float64]  # (n,) ‖r‖², without what a better fit would take off; NaN where there is none
    freedom: NDArray[np.float64]  # (n,) degrees of freedom
    information: NDArray[np.float64]  # (n, 3, 3) HᵀH with H = M ∂s/∂ω, 1/(rad/s)²


def residual_of(
    z: NDArray[np.float64], sensitivity: NDArray[np.float64], omega: NDArray[np.float64], curvature: float
) -> Residual:
    """Return the residual of fitted rates and its degrees of freedom.

    Parameters
    ----------
    z : ndarray, shape (n, d)
        Null space in units of its noise, NaN where channels are missing.
    sensitivity : ndarray, shape (d, 6)
        M of z = M s(ω) + noise.
    omega : ndarray, shape (n, 3)
        Fitted rates, rad/s.
    curvature : float
        Of `least_curvature`.

    Notes
    -----
    A fit takes three degrees of freedom where the body turns, and fewer at rest, where the slope H of the products
    vanishes: tr HᵀH (HᵀH + c I)⁻¹ with c the curvature, the effective number of parameters of a regularised fit.
    """
    found = _residual_of(z, sensitivity, np.ascontiguousarray(omega), curvature)
    return Residual(*found)


def least_curvature(sensitivity: NDArray[np.float64]) -> float:
    """Return the least ‖M s(u)‖ over directions u, s² /rad² in units of the noise: |ω|² up to 1/this looks like 0."""
    number = np.arange(_DIRECTIONS) + 0.5
    height = 1.0 - number / _DIRECTIONS  # half a sphere: s(u) = s(−u)
    turn = np.pi * (1.0 + np.sqrt(5.0)) * number
    side = np.sqrt(1.0 - height**2)
    directions = np.column_stack([side * np.cos(turn), side * np.sin(turn), height])
    sizes = np.linalg.norm(omega_products(directions) @ sensitivity.T, axis=1)
    return float(max(sizes.min(), _LEAST_SHARE * sizes.max()))


def bounded_covariance(
    information: NDArray[np.float64], scale: NDArray[np.float64], curvature: float
) -> NDArray[np.float64]:
    """Return the covariance (n, 3, 3) of rates that are bounded by the size of the products, (rad/s)².

    Where the slope of the products vanishes, their size still bounds |ω|²: by s̃/c with c the curvature.
    """
    eye = np.eye(3)
    clear = np.where(np.isfinite(information), information, 0.0)
    return scale[:, None, None] ** 2 * np.linalg.inv(clear + scale[:, None, None] * curvature * eye)


@compiled
def _residual_of(z, m, omega, curvature):  # type: ignore[no-untyped-def]
    n, rows = z.shape
    squares = np.full(n, np.nan)
    freedom = np.zeros(n)
    information = np.full((n, 3, 3), np.nan)
    slope = np.empty(3)
    gradient = np.empty(3)
    total = np.empty((3, 3))
    for k in range(n):
        x, y, w = omega[k]
        if not (np.isfinite(x) and np.isfinite(z[k, 0])):
            continue
        total[:] = 0.0
        gradient[:] = 0.0
        square = 0.0
        for i in range(rows):
            slope[0] = 2.0 * x * m[i, 0] + y * m[i, 3] + w * m[i, 4]
            slope[1] = 2.0 * y * m[i, 1] + x * m[i, 3] + w * m[i, 5]
            slope[2] = 2.0 * w * m[i, 2] + x * m[i, 4] + y * m[i, 5]
            misfit = z[k, i] - 0.5 * (slope[0] * x + slope[1] * y + slope[2] * w)
            square += misfit * misfit
            for a in range(3):
                gradient[a] += slope[a] * misfit
                for b in range(3):
                    total[a, b] += slope[a] * slope[b]
        information[k] = total
        for a in range(3):
            total[a, a] += curvature
        c00 = total[1, 1] * total[2, 2] - total[1, 2] * total[1, 2]
        c01 = total[0, 2] * total[1, 2] - total[0, 1] * total[2, 2]
        c02 = total[0, 1] * total[1, 2] - total[0, 2] * total[1, 1]
        c11 = total[0, 0] * total[2, 2] - total[0, 2] * total[0, 2]
        c12 = total[0, 1] * total[0, 2] - total[0, 0] * total[1, 2]
        c22 = total[0, 0] * total[1, 1] - total[0, 1] * total[0, 1]
        determinant = total[0, 0] * c00 + total[0, 1] * c01 + total[0, 2] * c02
        better = c00 * gradient[0] * gradient[0] + c11 * gradient[1] * gradient[1] + c22 * gradient[2] * gradient[2]
        better += 2.0 * (
            c01 * gradient[0] * gradient[1] + c02 * gradient[0] * gradient[2] + c12 * gradient[1] * gradient[2]
        )
        squares[k] = max(square - better / determinant, 0.0)
        freedom[k] = rows - 3.0 + curvature * (c00 + c11 + c22) / determinant
    return squares, freedom, information
