"""Rates of single samples, each by its own null space: maximum likelihood, or the tensor method.

The biases are those that a leading rest shows, or as uncertain as stated. At that rest the rate is zero; after it each
rate is known but for its sign, which the chain of signs decides with a probability (`gfimu.rate.sign_chain`). The
covariance is enlarged where the samples disagree more than their noise explains (`gfimu.rate.disagreement`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.compiled import compiled
from gfimu.base.errors import GeometryError
from gfimu.rate.algebraic import rate_from_products
from gfimu.rate.bounds.sample import omega_products_jacobian
from gfimu.rate.channel_sets import ChannelSet
from gfimu.rate.disagreement import measured_scale
from gfimu.rate.filter import increasing_times
from gfimu.rate.filter_state import SingleRates
from gfimu.rate.live import LiveRateFilter
from gfimu.rate.maximum_likelihood import rates_of_null_space
from gfimu.rate.measured_noise import noise_ratio
from gfimu.rate.path_start import PathStart
from gfimu.rate.residual import bounded_covariance, least_curvature, residual_of
from gfimu.rate.result import RateEstimate, clear_of_zero
from gfimu.rate.sensing import SensorErrors
from gfimu.rate.settings import FilterSettings
from gfimu.rate.sign_chain import sign_probabilities
from gfimu.rate.signs import UNDECIDABLE, decision, sign_steps

__all__ = ["algebraic_rate", "maximum_likelihood_rate"]

_SLOW_FIT = 4.0  # at rest the closed form leaves 7 % more residual than the best fit: 4.66 squares in simulation


def maximum_likelihood_rate(
    array: AccelerometerArray,
    t: ArrayLike,
    readings: ArrayLike,
    errors: SensorErrors,
    settings: FilterSettings | None = None,
    *,
    path: PathStart | None = None,
) -> RateEstimate:
    """Estimate the rate of each sample by maximum likelihood, at the Cramér–Rao bound.

    Parameters
    ----------
    array : AccelerometerArray
        An array whose null space sees at least three products of ω.
    t : array_like, shape (n,)
        Sample times, s.
    readings : array_like, shape (n, c)
        Specific force, m/s². Samples with a missing or saturated channel have no rate.
    errors : SensorErrors
        Noise and biases of the channels, and their range.
    settings : FilterSettings, optional
        Start and rest.
    path : PathStart, optional
        Where attitude, velocity and position start, if they are asked for.

    Returns
    -------
    RateEstimate
        ``nis`` is the remaining sum of squares in units of the noise.

    Raises
    ------
    GeometryError
        If the array sees fewer than three products.
    """
    return _estimate("ml", _most_probable, array, t, readings, errors, settings, path, least_rank=3)


def algebraic_rate(
    array: AccelerometerArray,
    t: ArrayLike,
    readings: ArrayLike,
    errors: SensorErrors,
    settings: FilterSettings | None = None,
    *,
    path: PathStart | None = None,
) -> RateEstimate:
    """Estimate the rate of each sample by the tensor method, in closed form; as `maximum_likelihood_rate`.

    Raises
    ------
    GeometryError
        If the array sees fewer than six products.
    """
    return _estimate("algebraic", _closed_form, array, t, readings, errors, settings, path, least_rank=6)


def _estimate(
    method: str,
    solve: Callable[[NDArray[np.float64], ChannelSet, NDArray[np.float64]], _Rates],
    array: AccelerometerArray,
    t: ArrayLike,
    readings: ArrayLike,
    errors: SensorErrors,
    settings: FilterSettings | None,
    path: PathStart | None,
    *,
    least_rank: int,
) -> RateEstimate:
    times, period = increasing_times(t, f"method {method!r}")
    # The noise of samples is measured one by one below, so the channels keep the stated weights.
    rows = np.asarray(readings, dtype=float)
    ratio = noise_ratio(array, rows, errors, period) if rows.shape == (len(times), array.n_channels) else 1.0
    chosen = replace(settings or FilterSettings(), measure_noise=False)
    louder = replace(errors, noise_std=ratio * errors.noise_std)
    live = LiveRateFilter(array, louder, period, chosen, path=path)
    sensitivity = live.sets.full.sensitivity
    if live.sets.products < least_rank or np.linalg.matrix_rank(sensitivity, tol=1e-9) < least_rank:
        raise GeometryError(
            f"array {array.name!r} sees {live.sets.products} products of the rate; method {method!r} needs "
            f"{least_rank}; use filter"
        )
    leading, rest = live.leading_rest(times, readings)
    sets, samples = live.sets, live.samples
    sensitivity = sets.full.sensitivity
    complete = (samples.channel_set == 0)[:, None]
    of_alpha, slopes = leading.of_alpha(samples)
    of_z, by_z = leading.of_products(samples)
    spread = leading.variance_by(by_z)
    alpha = np.where(complete, samples.alpha - of_alpha, np.nan)
    z = np.where(complete, samples.z - of_z, np.nan)
    usual = spread.mean(axis=0)
    rates = solve(z, sets.full, np.linalg.inv(np.linalg.cholesky(np.eye(len(sensitivity)) + usual)))
    omega = rates.omega
    with np.errstate(invalid="ignore"):
        covariance = rates.covariance + rates.gain @ (spread - usual) @ np.swapaxes(rates.gain, 1, 2)
    curvature = least_curvature(sensitivity)
    residual = residual_of(z, sensitivity, omega, rates.slow_fit * curvature)
    blind = len(sets.parity_rows)
    parity = np.where(np.isnan(samples.parity), 0.0, blind * samples.parity)
    freedom = residual.freedom + np.where(np.isnan(samples.parity), 0.0, blind)
    scale = measured_scale(residual.squares + parity, freedom, period)
    assert live.start is not None
    steps = sign_steps(
        sets, samples.t, alpha, omega, residual.information, scale**2, rest, live.start,
        alpha_bias=float(np.mean(np.trace(leading.variance_by(slopes), axis1=1, axis2=2))) / 3.0,
        null_bias=float(np.linalg.eigvalsh(usual)[-1]),
    )  # fmt: skip
    omega, probability = _signed(times, alpha, omega, sign_probabilities(steps))
    with np.errstate(invalid="ignore"):  # noise beyond the stated one adds to the rates; biases add nothing more
        wider = covariance + (scale**2 - 1.0)[:, None, None] * (rates.gain @ np.swapaxes(rates.gain, 1, 2))
    omega[rest], wider[rest], probability[rest] = 0.0, live.start.covariance, 1.0
    known = not live.start.sign_open
    followed = None
    if path is not None:
        white = bounded_covariance(residual.information, scale, curvature)
        white[rest] = live.start.covariance
        gain = (
            white
            / scale[:, None, None] ** 2
            @ np.swapaxes(sensitivity @ omega_products_jacobian(np.nan_to_num(omega)), 1, 2)
        )
        clear = clear_of_zero(omega, np.sqrt(np.diagonal(wider, axis1=1, axis2=2))) | rest  # elsewhere α goes on
        single = SingleRates(np.where(clear[:, None], omega, np.nan), gain, white)
        followed = live.estimate_of(times, live.follow_rates(single)).path
    found = RateEstimate(
        method, times, omega, wider, residual.squares + parity,
        np.where(np.isfinite(residual.squares), sets.products - 3 + np.where(np.isnan(samples.parity), 0, blind), 0),
        rest, channels=live.report, scale=ratio * scale, sign_probability=probability, start=live.start,
        path=followed,
    )  # fmt: skip
    return replace(found, sign=decision(found, known=known))


class _Rates(NamedTuple):
    """Rates of single samples but for their signs."""

    omega: NDArray[np.float64]  # (n, 3) rad/s
    covariance: NDArray[np.float64]  # (n, 3, 3) by the stated noise and the biases
    gain: NDArray[np.float64]  # (n, 3, m) derivative by the null space
    slow_fit: float = 1.0  # how much less than the best fit slow samples are fitted


def _most_probable(z: NDArray[np.float64], full: ChannelSet, white: NDArray[np.float64]) -> _Rates:
    """Fit z (n, m), whose noise and biases ``white`` (m, m) whitens."""
    slope = np.ascontiguousarray(white @ full.sensitivity)
    omega, covariance = rates_of_null_space(z @ white.T, slope)
    with np.errstate(invalid="ignore"):
        return _Rates(omega, covariance, covariance @ np.swapaxes(slope @ omega_products_jacobian(omega), 1, 2) @ white)


def _closed_form(z: NDArray[np.float64], full: ChannelSet, white: NDArray[np.float64]) -> _Rates:
    """Take the rate whose outer product is nearest to the products that z (n, m) shows; as `_most_probable`."""
    omega, slope = rate_from_products(z @ full.inverse.T)
    with np.errstate(invalid="ignore"):
        gain = slope @ full.inverse
        covariance = gain @ np.linalg.inv(white.T @ white) @ np.swapaxes(gain, 1, 2)
    covariance[~np.isfinite(covariance).all(axis=(1, 2))] = np.diag([np.inf] * 3)
    return _Rates(omega, covariance, gain, _SLOW_FIT)


def _signed(
    t: NDArray[np.float64], alpha: NDArray[np.float64], omega: NDArray[np.float64], plus: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return rates (n, 3) with the more probable sign, and the probability (n,) of that sign.

    ``plus`` is the probability of the sign that ``omega`` has. Where it says nothing, the sign is the one nearer to the
    integral of α.
    """
    side = _sides(t, alpha, omega, plus)
    return omega * side[:, None], np.where(side > 0, plus, 1.0 - plus)


@compiled
def _sides(t, alpha, omega, plus):  # type: ignore[no-untyped-def]
    """Sign (n,) of each rate: +1 or −1 times ``omega``.

    The integral of α is drawn to the ω so signed within its time constant 1/|ω|, so that it does not drift away.
    """
    n = len(t)
    side = np.ones(n)
    carried = np.zeros(3)
    time = t[0]
    for k in range(n):
        step = t[k] - time
        time = t[k]
        for a in range(3):
            if np.isfinite(alpha[k, a]):
                carried[a] += step * alpha[k, a]
        if not (np.isfinite(omega[k, 0]) and np.isfinite(plus[k])):
            continue
        along = 0.0
        square = 0.0
        for a in range(3):
            along += omega[k, a] * carried[a]
            square += omega[k, a] * omega[k, a]
        decided = plus[k] - 0.5 if abs(plus[k] - 0.5) > UNDECIDABLE else along
        side[k] = 1.0 if decided >= 0.0 else -1.0
        drawn = min(1.0, step * np.sqrt(square))
        for a in range(3):
            carried[a] += drawn * (side[k] * omega[k, a] - carried[a])
    return side
