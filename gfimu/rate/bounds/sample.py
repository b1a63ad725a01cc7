"""Lower bounds on the error of the angular rate from one sample, and in steady turning.

With α and p unknown, the null space of J sees the products of ω (`gfimu.array.kinematics.null_space`), so the Fisher
information on ω is DᵀQᵀNᵀN Q D / σ², with N the whitened null space and D = ∂s/∂ω. The information grows with (array
size × angular speed)² (Skog, Nilsson, Händel & Nehorai, IEEE Trans. Signal Process. 64, 2016).

The bounds are local: they use the slope of s(ω). Where the true rate is smaller than the bound itself the slope has
no information, while the curvature of s still limits |ω|; there an estimator can do better than the "bound", and the
sign of ω can be lost, which no local bound accounts for.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.kinematics import null_space, pseudo_inverse
from gfimu.base.errors import InputError

__all__ = [
    "alpha_std",
    "omega_products_jacobian",
    "rate_bound",
    "rate_bound_isotropic",
    "rate_information",
    "require_positive",
    "steady_rate_bound",
]

_SINGULAR = 1e-12  # of the information's largest eigenvalue


def alpha_std(array: AccelerometerArray, noise_std: float) -> NDArray[np.float64]:
    """Return the standard deviation of each component of α = (S a)₁…₃ for white channels, shape (3,), rad/s².

    For the tetrahedral cube σ/(√8 h), with h half the edge (σ/(√2 L)).
    """
    require_positive(noise_std, "noise_std", "m/s²")
    return noise_std * np.linalg.norm(pseudo_inverse(array)[:3], axis=1)


def omega_products_jacobian(omega: ArrayLike) -> NDArray[np.float64]:
    """Jacobian ∂s/∂ω of the six products of the angular rate.

    Parameters
    ----------
    omega : array_like, shape (..., 3)
        Angular rate in body axes, rad/s.

    Returns
    -------
    ndarray, shape (..., 6, 3)
        Rows in the order `gfimu.array.array.OMEGA_PRODUCTS`, rad/s.
    """
    x, y, z = np.moveaxis(np.asarray(omega, dtype=float), -1, 0)
    jacobian = np.zeros((*x.shape, 6, 3))
    jacobian[..., 0, 0] = 2 * x
    jacobian[..., 1, 1] = 2 * y
    jacobian[..., 2, 2] = 2 * z
    jacobian[..., 3, 0], jacobian[..., 3, 1] = y, x
    jacobian[..., 4, 0], jacobian[..., 4, 2] = z, x
    jacobian[..., 5, 1], jacobian[..., 5, 2] = z, y
    return jacobian


def rate_information(array: AccelerometerArray, omega: ArrayLike, noise_std: float) -> NDArray[np.float64]:
    """Fisher information of one sample on ω, with α and p unknown.

    Parameters
    ----------
    array : AccelerometerArray
        An array that sees all six motions.
    omega : array_like, shape (..., 3)
        True angular rate in body axes, rad/s.
    noise_std : float
        Standard deviation of every channel, independent between channels, m/s².

    Returns
    -------
    ndarray, shape (..., 3, 3)
        (rad/s)⁻²; for the tetrahedral cube 8h²|ω|²/σ² across ω and 32h²|ω|²/σ² along it.
    """
    require_positive(noise_std, "noise_std", "m/s²")
    slope = null_space(array).sensitivity @ omega_products_jacobian(omega)  # (..., c - 6, 3), m rad/s
    return np.swapaxes(slope, -1, -2) @ slope / noise_std**2


def rate_bound(array: AccelerometerArray, omega: ArrayLike, noise_std: float) -> NDArray[np.float64]:
    """Compute the Cramér–Rao bound of one sample on the components of ω, with α and p unknown.

    Parameters
    ----------
    array : AccelerometerArray
        An array that sees all six motions.
    omega : array_like, shape (..., 3)
        True angular rate in body axes, rad/s.
    noise_std : float
        Standard deviation of every channel, independent between channels, m/s².

    Returns
    -------
    ndarray, shape (..., 3)
        Least standard deviation of an unbiased estimate, rad/s; infinite for a component that one sample does not
        determine (all three at ω = 0, and always for arrays with no null space). The sign of ω is taken as known.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.rate_bound(gfimu.AccelerometerArray.load("cube12"), [0.0, 0.0, 6.28], 0.0287).round(4)
    array([0.0323, 0.0323, 0.0162])
    """
    information = rate_information(array, omega, noise_std)
    values, vectors = np.linalg.eigh(information)  # (..., 3), (..., 3, 3)
    blind = values <= _SINGULAR * np.maximum(values[..., -1:], np.finfo(float).tiny)
    spread = vectors**2  # row: component of ω, column: eigenvector
    variance = (spread / np.where(blind, 1.0, values)[..., None, :] * ~blind[..., None, :]).sum(axis=-1)
    hidden = (spread * blind[..., None, :]).sum(axis=-1) > np.sqrt(_SINGULAR)
    return np.where(hidden, np.inf, np.sqrt(variance))


def rate_bound_isotropic(alpha_noise_std: float, speed: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Per-sample bound on ω for arrays as even as the tetrahedral cube: sd⊥ = σ_α/|ω|, sd∥ = σ_α/(2|ω|).

    Parameters
    ----------
    alpha_noise_std : float
        Standard deviation of a component of α, rad/s² (`alpha_std`).
    speed : array_like, shape (...)
        Angular speed |ω|, rad/s.

    Returns
    -------
    perpendicular, parallel : ndarray, shape (...)
        Standard deviation of a component across ω and of the one along ω, rad/s; infinite at rest.
    """
    require_positive(alpha_noise_std, "alpha_noise_std", "rad/s²")
    turning = np.abs(np.asarray(speed, dtype=float))
    perpendicular = np.divide(alpha_noise_std, turning, out=np.full(turning.shape, np.inf), where=turning > 0)
    return perpendicular, perpendicular / 2.0


def steady_rate_bound(
    alpha_noise_std: float, period: float, speed: ArrayLike, *, smoother: bool = False
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Posterior bound in steady turning for arrays as even as the tetrahedral cube, many samples per radian.

    Filter: sd⊥ = σ_α √(Δt/|ω|), sd∥ = sd⊥/√2; smoother: 1/√2 of both. σ_α² Δt does not depend on the sample rate.

    Parameters
    ----------
    alpha_noise_std : float
        Standard deviation of a component of α per sample, rad/s² (`alpha_std`).
    period : float
        Sample period Δt, s.
    speed : array_like, shape (...)
        Angular speed |ω|, rad/s.
    smoother : bool
        Whether all samples are used, or only those so far.

    Returns
    -------
    perpendicular, parallel : ndarray, shape (...)
        Standard deviation across and along ω, rad/s; infinite at rest.
    """
    require_positive(alpha_noise_std, "alpha_noise_std", "rad/s²")
    require_positive(period, "period", "s")
    turning = np.abs(np.asarray(speed, dtype=float))
    radians = np.divide(period, turning, out=np.full(turning.shape, np.inf), where=turning > 0)
    perpendicular = alpha_noise_std * np.sqrt(radians / (2.0 if smoother else 1.0))
    return perpendicular, perpendicular / np.sqrt(2.0)


def require_positive(value: float, name: str, unit: str) -> None:
    """Refuse a standard deviation or a period that is not a positive number."""
    if not (np.isfinite(value) and value > 0):
        raise InputError(f"{name} = {value!r}: must be a positive number, {unit}")
