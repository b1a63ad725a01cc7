"""Lower bounds on the error of the angular rate that an accelerometer array can reach, per sample and over a run.

Per sample, with α and p unknown: the null space of J sees the products of ω
(`gfimu.geometry.kinematics.null_space`), so the Fisher information on ω is DᵀQᵀNᵀN Q D / σ², with N the whitened null
space and D = ∂s/∂ω. The information grows with (array size × angular speed)² (Skog, Nilsson, Händel & Nehorai, IEEE
Trans. Signal Process. 64, 2016).

Over a run: the rate is also the integral of α, which the array measures independently of the null space, and constant
biases are learned along the way. The posterior Cramér–Rao bound of Tichavský, Muravchik & Nehorai (IEEE Trans. Signal
Process. 46, 1998, eq. 21) is taken at the true motion, for the estimate from the samples so far (filter) or from all
(smoother). In steady turning it is σ_α √(Δt/|ω|) across ω, and 1/√2 of it along ω; all samples together gain another
1/√2. Unequal noise of the channels correlates α with the null space, which is taken into account.

The bounds are local: they use the slope of s(ω). Where the true rate is smaller than the bound itself the slope says
that a sample tells nothing, while its curvature still limits |ω|; there an estimator can do better than the "bound",
and the sign of ω can be lost, which no local bound accounts for.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from gfimu.errors import InputError
from gfimu.geometry.array import AccelerometerArray
from gfimu.geometry.kinematics import null_space, pseudo_inverse
from gfimu.rate.sensing import ChannelTables, SensorErrors

__all__ = [
    "alpha_std",
    "omega_products_jacobian",
    "posterior_rate_bound",
    "rate_bound",
    "rate_bound_isotropic",
    "rate_information",
    "steady_rate_bound",
]

_SINGULAR = 1e-12  # of the information's largest eigenvalue


def alpha_std(array: AccelerometerArray, noise_std: float) -> NDArray[np.float64]:
    """Return the standard deviation of each component of α = (S a)₁…₃ for white channels, shape (3,), rad/s².

    For the tetrahedral cube σ/(√8 h), with h half the edge (σ/(√2 L)).
    """
    _require_positive(noise_std, "noise_std", "m/s²")
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
        Rows in the order `gfimu.geometry.array.OMEGA_PRODUCTS`, rad/s.
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
    _require_positive(noise_std, "noise_std", "m/s²")
    slope = null_space(array).sensitivity @ omega_products_jacobian(omega)  # (..., c - 6, 3), m rad/s
    return np.swapaxes(slope, -1, -2) @ slope / noise_std**2


def rate_bound(array: AccelerometerArray, omega: ArrayLike, noise_std: float) -> NDArray[np.float64]:
    """Cramér–Rao bound of one sample on the components of ω, with α and p unknown.

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
        Least standard deviation of an unbiased estimate, rad/s; infinite for a component that one sample can't tell
        (all three at ω = 0, and always for arrays with no null space). The sign of ω is taken as known.
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
    _require_positive(alpha_noise_std, "alpha_noise_std", "rad/s²")
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
    _require_positive(alpha_noise_std, "alpha_noise_std", "rad/s²")
    _require_positive(period, "period", "s")
    turning = np.abs(np.asarray(speed, dtype=float))
    radians = np.divide(period, turning, out=np.full(turning.shape, np.inf), where=turning > 0)
    perpendicular = alpha_noise_std * np.sqrt(radians / (2.0 if smoother else 1.0))
    return perpendicular, perpendicular / np.sqrt(2.0)


def posterior_rate_bound(
    array: AccelerometerArray,
    t: ArrayLike,
    omega: ArrayLike,
    errors: SensorErrors,
    *,
    start_std: float = 1e-3,
    rest: ArrayLike | None = None,
    rest_std: float = 1e-3,
    smoother: bool = False,
) -> NDArray[np.float64]:
    """Posterior Cramér–Rao bound on ω along a run, with constant biases unknown.

    Parameters
    ----------
    array : AccelerometerArray
        An array that sees all six motions and whose α is free of the products of ω.
    t : array_like, shape (n,)
        Sample times, s.
    omega : array_like, shape (n, 3)
        True angular rate in body axes, rad/s.
    errors : SensorErrors
        Noise and bias of the channels.
    start_std : float
        How well the rate at the first sample is known, rad/s.
    rest : array_like of bool, shape (n,), optional
        Samples at which the body is known to be at rest, to within ``rest_std``, rad/s.
    smoother : bool
        Whether all samples are used, or only those so far.

    Returns
    -------
    ndarray, shape (n, 3, 3)
        Least covariance of ω, (rad/s)². Valid while ω is large against its own bound (see the module).

    Raises
    ------
    GeometryError
        If the array can't see all six motions.
    InputError
        If the shapes don't fit, or α contains products of ω.
    """
    times = np.asarray(t, dtype=float)
    rates = np.asarray(omega, dtype=float)
    if times.ndim != 1 or rates.shape != (len(times), 3):
        raise InputError(f"times have shape {times.shape}, omega {rates.shape}; one row of three per time is needed")
    _require_positive(start_std, "start_std", "rad/s")
    _require_positive(rest_std, "rest_std", "rad/s")
    known = np.zeros(len(times), dtype=bool) if rest is None else np.asarray(rest, dtype=bool)
    tables = ChannelTables(array, errors)
    if tables.alpha_leak[0].any():
        raise InputError(f"array {array.name!r} leaves products of the angular rate in α; the bound needs one without")
    d = tables.n_null
    readout = _readout(tables, errors)
    # The null space scaled to unit noise: what it says of ω, and with it of the biases and of ε.
    slopes = readout[:, 6 : 6 + d] @ tables.null_sensitivity[0] @ omega_products_jacobian(rates)  # (n, d, 3)
    start = np.zeros((9 + d, 9 + d))
    start[:3, :3] = np.eye(3) * start_std**2
    start[3 : 6 + d, 3 : 6 + d] = tables.bias_covariance(errors.bias_std)
    filtered = _filter_bound(times, slopes, readout, tables.alpha_noise[0], start, known, rest_std)
    if smoother:
        _smoother_bound(times, slopes, readout, tables.alpha_noise[0], known, rest_std, filtered)
    return np.ascontiguousarray(filtered[:, :3, :3])


# State of the bound: [ω; b_α; b_z; ε], ε minus the noise of α at the sample. Over an interval the integral of the
# measured α carries half of the ε at either end: ω' = ω − Δt b_α + Δt/2 (ε + ε'). Where the channels' noise is unequal
# that of the null space depends on it: z = M s + b_z − Γ ε + (the rest).


def _readout(tables: ChannelTables, errors: SensorErrors) -> NDArray[np.float64]:
    """H of the null space but for its slopes, scaled so that the noise that ε doesn't explain has unit variance."""
    d = tables.n_null
    crossed = tables.null_rows[0] * errors.noise_std**2 @ tables.alpha_rows[0].T  # (d, 3)
    explained = np.linalg.solve(tables.alpha_noise[0], crossed.T).T  # Γ
    white = np.linalg.inv(np.linalg.cholesky(np.eye(d) - explained @ crossed.T))
    return np.hstack([np.zeros((d, 6)), white, -white @ explained])


@njit(cache=True)
def _transition(step, n):  # type: ignore[no-untyped-def]
    """F and G of x' = F x + G ε'."""
    move = np.eye(n)
    enter = np.zeros((n, 3))
    for a in range(3):
        move[a, 3 + a] = -step
        move[a, n - 3 + a] = 0.5 * step
        move[n - 3 + a, n - 3 + a] = 0.0
        enter[a, a] = 0.5 * step
        enter[n - 3 + a, a] = 1.0
    return move, enter


@njit(cache=True)
def _measurement(slope, readout, known, rest_std, n):  # type: ignore[no-untyped-def]
    """H of all measurements of a sample, scaled to unit noise: the null space, and ω = 0 at rest."""
    d = len(slope)
    rows = np.zeros((d + 3 if known else d, n))
    rows[:d] = readout
    rows[:d, :3] = slope
    if known:
        for a in range(3):
            rows[d + a, a] = 1.0 / rest_std
    return rows


@njit(cache=True)
def _filter_bound(t, slopes, readout, alpha_noise, start, known, rest_std):  # type: ignore[no-untyped-def]
    n = len(start)
    result = np.empty((len(t), n, n))
    covariance = start.copy()
    covariance[n - 3 :, n - 3 :] = alpha_noise
    for k in range(len(t)):
        if k > 0:
            move, enter = _transition(t[k] - t[k - 1], n)
            covariance = move @ covariance @ move.T + enter @ alpha_noise @ enter.T
        rows = _measurement(slopes[k], readout, known[k], rest_std, n)
        gain = covariance @ rows.T
        total = rows @ gain + np.eye(len(rows))
        covariance = covariance - gain @ np.linalg.solve(total, gain.T)
        covariance = 0.5 * (covariance + covariance.T)
        result[k] = covariance
    return result


@njit(cache=True)
def _smoother_bound(t, slopes, readout, alpha_noise, known, rest_std, filtered):  # type: ignore[no-untyped-def]
    """Add the information of the later samples, carried back in time: P_s = (P⁻¹ + J)⁻¹ = (I + P J)⁻¹ P."""
    n = filtered.shape[1]
    later = np.zeros((n, n))
    prior = np.linalg.inv(alpha_noise)
    for k in range(len(t) - 2, -1, -1):
        rows = _measurement(slopes[k + 1], readout, known[k + 1], rest_std, n)
        later = later + rows.T @ rows
        move, enter = _transition(t[k + 1] - t[k], n)
        seen = later @ enter
        later = later - seen @ np.linalg.solve(prior + enter.T @ seen, seen.T)
        later = move.T @ later @ move
        later = 0.5 * (later + later.T)
        filtered[k] = np.linalg.solve(np.eye(n) + filtered[k] @ later, filtered[k])


def _require_positive(value: float, name: str, unit: str) -> None:
    if not (np.isfinite(value) and value > 0):
        raise InputError(f"{name} = {value!r}: must be a positive number, {unit}")
