"""Posterior Cramér–Rao bound on the angular rate over a run.

The rate is the integral of α, which the array measures independently of the null space, and constant biases are learned
along the way. The bound of Tichavský, Muravchik & Nehorai (IEEE Trans. Signal Process. 46, 1998, eq. 21) is taken at
the true motion, for the estimate from the samples so far (filter) or from all (smoother). In steady turning it is
σ_α √(Δt/|ω|) across ω, and 1/√2 of it along ω; all samples together gain another 1/√2
(`gfimu.rate.bounds.sample.steady_rate_bound`). Unequal noise of the channels correlates α with the null space, which is
taken into account. The bound is local, see `gfimu.rate.bounds.sample`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError
from gfimu.rate.bounds.sample import omega_products_jacobian, require_positive
from gfimu.rate.channel_sets import ChannelSet, ChannelSets
from gfimu.rate.sensing import SensorErrors

__all__ = ["posterior_rate_bound"]


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
    """Compute the posterior Cramér–Rao bound on ω along a run with unknown constant biases.

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
    require_positive(start_std, "start_std", "rad/s")
    require_positive(rest_std, "rest_std", "rad/s")
    known = np.zeros(len(times), dtype=bool) if rest is None else np.asarray(rest, dtype=bool)
    full = ChannelSets(array, errors.noise_std).full
    if full.leak.any():
        raise InputError(f"array {array.name!r} leaves products of the angular rate in α; the bound needs one without")
    d = full.nulls
    readout = _readout(full, errors)
    rows = np.vstack([full.alpha_rows, full.null_rows])
    # The null space scaled to unit noise: what it says of ω, and with it of the biases and of ε.
    slopes = readout[:, 6 : 6 + d] @ full.null_sensitivity @ omega_products_jacobian(rates)  # (n, d, 3)
    start = np.zeros((9 + d, 9 + d))
    start[:3, :3] = np.eye(3) * start_std**2
    start[3 : 6 + d, 3 : 6 + d] = rows * errors.bias_std**2 @ rows.T
    filtered = _filter_bound(times, slopes, readout, full.alpha_noise, start, known, rest_std)
    if smoother:
        _smoother_bound(times, slopes, readout, full.alpha_noise, known, rest_std, filtered)
    return np.ascontiguousarray(filtered[:, :3, :3])


# State of the bound: [ω; b_α; b_z; ε], ε minus the noise of α at the sample. Over an interval the integral of the
# measured α carries half of the ε at either end: ω' = ω − Δt b_α + Δt/2 (ε + ε'). Where the channels' noise is unequal
# that of the null space depends on it: z = M s + b_z − Γ ε + (the rest).


def _readout(full: ChannelSet, errors: SensorErrors) -> NDArray[np.float64]:
    """H of the null space but for its slopes, scaled so that the noise that ε doesn't explain has unit variance."""
    d = full.nulls
    crossed = full.null_rows * errors.noise_std**2 @ full.alpha_rows.T  # (d, 3)
    explained = np.linalg.solve(full.alpha_noise, crossed.T).T  # Γ
    white = np.linalg.inv(np.linalg.cholesky(np.eye(d) - explained @ crossed.T))
    return np.hstack([np.zeros((d, 6)), white, -white @ explained])


def _transition(step: float, n: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
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


def _measurement(
    slope: NDArray[np.float64], readout: NDArray[np.float64], known: bool, rest_std: float
) -> NDArray[np.float64]:
    """H of all measurements of a sample, scaled to unit noise: the null space, and ω = 0 at rest."""
    d, n = readout.shape
    rows = np.zeros((d + 3 if known else d, n))
    rows[:d] = readout
    rows[:d, :3] = slope
    if known:
        for a in range(3):
            rows[d + a, a] = 1.0 / rest_std
    return rows


def _filter_bound(
    t: NDArray[np.float64],
    slopes: NDArray[np.float64],
    readout: NDArray[np.float64],
    alpha_noise: NDArray[np.float64],
    start: NDArray[np.float64],
    known: NDArray[np.bool_],
    rest_std: float,
) -> NDArray[np.float64]:
    """Covariance of the state given the samples so far, (n, s, s)."""
    n = len(start)
    result = np.empty((len(t), n, n))
    covariance = start.copy()
    covariance[n - 3 :, n - 3 :] = alpha_noise
    for k in range(len(t)):
        if k > 0:
            move, enter = _transition(t[k] - t[k - 1], n)
            covariance = move @ covariance @ move.T + enter @ alpha_noise @ enter.T
        rows = _measurement(slopes[k], readout, known[k], rest_std)
        gain = covariance @ rows.T
        total = rows @ gain + np.eye(len(rows))
        covariance = covariance - gain @ np.linalg.solve(total, gain.T)
        covariance = 0.5 * (covariance + covariance.T)
        result[k] = covariance
    return result


def _smoother_bound(
    t: NDArray[np.float64],
    slopes: NDArray[np.float64],
    readout: NDArray[np.float64],
    alpha_noise: NDArray[np.float64],
    known: NDArray[np.bool_],
    rest_std: float,
    filtered: NDArray[np.float64],
) -> None:
    """Add the information of the later samples, carried back in time: P_s = (P⁻¹ + J)⁻¹ = (I + P J)⁻¹ P."""
    n = filtered.shape[1]
    later = np.zeros((n, n))
    prior = np.linalg.inv(alpha_noise)
    for k in range(len(t) - 2, -1, -1):
        rows = _measurement(slopes[k + 1], readout, known[k + 1], rest_std)
        later = later + rows.T @ rows
        move, enter = _transition(t[k + 1] - t[k], n)
        seen = later @ enter
        later = later - seen @ np.linalg.solve(prior + enter.T @ seen, seen.T)
        later = move.T @ later @ move
        later = 0.5 * (later + later.T)
        filtered[k] = np.linalg.solve(np.eye(n) + filtered[k] @ later, filtered[k])
