"""A filter's or smoother's second pass: noise measured in the first, and the sign as a probability.

A filter that takes its channels for better than they are trusts its prediction too much, and its estimate is worse than
it need be as well as its standard deviation too small. So the noise is measured first, and where it is significantly
larger than stated the run is estimated again with it. Combinations of the readings that no motion changes (the null
space of [J Q]) show the noise of each sample without any knowledge of ω. Where an array has none, the innovations of
the first pass show it, averaged over about a second.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import GeometryError
from gfimu.rate.disagreement import POLICY, MeasuredNoise, lasting_scale, measured_scale
from gfimu.rate.kalman import FilterSettings
from gfimu.rate.maximum_likelihood import maximum_likelihood_rate
from gfimu.rate.per_sample import UNDECIDABLE, KnownStart, decision
from gfimu.rate.result import RateEstimate
from gfimu.rate.sensing import ChannelTables, SensorErrors

__all__ = ["noise_of_run", "parity_rows", "parity_scale", "refined", "same_sign"]

_BLIND = 1e-9  # numerical: sensitivity of a combination that sees no product of ω, of the best


def refined(
    array: AccelerometerArray,
    t: NDArray[np.float64],
    readings: NDArray[np.float64],
    errors: SensorErrors,
    settings: FilterSettings,
    run: Callable[[FilterSettings], RateEstimate],
    *,
    causal: bool,
) -> RateEstimate:
    """Run a filter, and once more with the noise measured by it where that is larger than stated.

    Parameters
    ----------
    array, errors : AccelerometerArray, SensorErrors
        The array, and the errors of its sensors.
    t : ndarray, shape (n,)
        Sample times, s.
    readings : ndarray, shape (n, c)
        Specific force, m/s²; NaN where missing.
    settings : FilterSettings
        Start, rest.
    run : callable
        Estimates with given settings.
    causal : bool
        Whether the noise is measured from earlier samples alone.

    Returns
    -------
    RateEstimate
        Its ``nis`` are those of the stated noise.
    """
    first = run(settings)
    if settings.noise is not None:
        return first
    scale = noise_of_run(array, readings, errors, first, causal=causal)
    found = replace(first, scale=scale)
    if np.mean(scale > 1.0) >= POLICY.again_share:
        again = _as_decided(run(replace(settings, noise=MeasuredNoise(t, scale))), first)
        found = replace(again, nis=first.nis, nis_dof=first.nis_dof, scale=scale)
    # Where the stated errors explain the innovations of the run as a whole, so they do its sign.
    often = np.mean(scale > POLICY.notable_ratio) >= POLICY.notable_share
    in_doubt = often and first.mean_nis > POLICY.notable_ratio
    if not in_doubt and found.sign.state != "undecided":
        return found
    return _with_sign(found, array, t, readings, errors, settings)


def _as_decided(again: RateEstimate, first: RateEstimate) -> RateEstimate:
    """Return of two undecided mirror hypotheses the one that the first pass decided for, if it decided."""
    if again.mirrored is None or first.sign.state != "decided":
        return again
    alike = float(np.nansum(again.omega * first.omega)) >= 0.0
    return replace(again if alike else again.mirrored, sign=first.sign, mirrored=None)


def noise_of_run(
    array: AccelerometerArray,
    readings: NDArray[np.float64],
    errors: SensorErrors,
    found: RateEstimate,
    *,
    causal: bool,
) -> NDArray[np.float64]:
    """Return s̃ of each sample, shape (n,), by parity where the array has enough of it, else by innovations."""
    period = float(np.median(np.diff(found.t_s)))
    scale = None
    if errors.white_only:  # other stated errors are in the innovations' covariance, not in that of parity
        scale = parity_scale(array, readings, errors, period, causal=causal)
    if scale is None:
        right = np.isfinite(found.omega).all(axis=1)  # elsewhere the filter was wrong, and not the noise
        scale = lasting_scale(np.where(right, found.nis, np.nan), found.nis_dof.astype(float), period, causal=causal)
    return scale


def parity_rows(tables: ChannelTables) -> NDArray[np.float64] | None:
    """Return the combinations of readings that no motion changes, whitened, shape (d, c); None with too few of them."""
    strength = np.linalg.norm(tables.null_sensitivity[0], axis=1)
    blind = strength <= _BLIND * max(1.0, float(strength.max(initial=0.0)))
    return np.asarray(tables.null_rows[0][blind]) if int(blind.sum()) >= POLICY.least_parity else None


def parity_scale(
    array: AccelerometerArray,
    readings: NDArray[np.float64],
    errors: SensorErrors,
    period: float,
    *,
    causal: bool,
) -> NDArray[np.float64] | None:
    """Return s̃ of each sample, shape (n,), by the combinations that no motion changes; None with too few of them.

    Their biases are taken off as the mean over the run, or with ``causal`` over the samples so far.
    """
    rows = parity_rows(ChannelTables(array, errors))
    if rows is None:
        return None
    usable = np.asarray((np.abs(readings) < errors.limits).all(axis=1))
    parity = np.where(usable[:, None], readings, 0.0) @ rows.T  # (n, d)
    count = np.cumsum(usable)
    if causal:
        parity = parity - np.cumsum(parity, axis=0) / np.maximum(count, 1)[:, None]
    elif usable.any():
        parity = parity - parity.sum(axis=0) / count[-1]
    freedom = np.where(usable, float(len(rows)), 0.0)
    squares = np.where(usable, np.sum(parity**2, axis=1), np.nan)
    return measured_scale(squares, freedom, period, causal=causal)


def _with_sign(
    found: RateEstimate,
    array: AccelerometerArray,
    t: NDArray[np.float64],
    readings: NDArray[np.float64],
    errors: SensorErrors,
    settings: FilterSettings,
) -> RateEstimate:
    """Give each rate its more probable sign by the chain of the single samples, and the probability."""
    start = None if found.channels.restarts else settings.start_omega
    at_rest = start is not None and not np.any(start)
    known = None if start is None or at_rest else KnownStart(start, settings.start_std)
    try:
        single = maximum_likelihood_rate(array, t, readings, errors, start_at_rest=at_rest, start=known)
    except GeometryError:  # sees too few products: nothing shows the sign of a sample
        return found
    chance = single.sign_probability
    assert chance is not None
    alike = same_sign(single.omega, single.covariance, found)
    probability = _filled(alike * chance + (1.0 - alike) * (1.0 - chance))
    wrong = probability < 0.5 - UNDECIDABLE
    signed = replace(
        found,
        omega=np.where(wrong[:, None], -found.omega, found.omega),
        sign_probability=np.where(wrong, 1.0 - probability, probability),
    )
    return replace(signed, sign=decision(signed, known=start is not None))


def same_sign(omega: NDArray[np.float64], covariance: NDArray[np.float64], found: RateEstimate) -> NDArray[np.float64]:
    """Return the probability (n,) that rates (n, 3) that are known but for their sign have the sign of an estimate."""
    spread = covariance + found.covariance
    known = np.asarray(np.isfinite(spread).all(axis=(1, 2)) & np.isfinite(omega).all(axis=1))
    along = np.zeros(len(omega))
    solved = np.linalg.solve(spread[known], found.omega[known][..., None])[..., 0]
    along[known] = np.sum(omega[known] * solved, axis=1)
    return np.asarray(1.0 / (1.0 + np.exp(-np.clip(2.0 * along, -50.0, 50.0))))


def _filled(probability: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return probabilities (n,) with those of samples without one taken from the sample before."""
    place = np.where(np.isfinite(probability), np.arange(len(probability)), 0)
    return np.nan_to_num(probability[np.maximum.accumulate(place)], nan=0.5)
