"""White noise of each channel as a recording shows it, with the data sheet as prior.

Parity combinations of the readings see no motion, so their scatter is noise alone. The variances r of the channels
follow from the covariance S of the parity rows by maximum likelihood: with Σ = Z diag(r) Zᵀ and B = Zᵀ Σ⁻¹ Z, the
expectation of (Zᵀ Σ⁻¹ S Σ⁻¹ Z)_ii is Σ_j B_ij² r_j, which is solved for r and repeated with it (Fisher's scoring).
What the rows of a symmetric array can't tell apart is alike, by the prior.
In windows whose products don't change all rows of the null space show noise alone. An array without parity rows has
the third differences instead, which suppress a motion.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from gfimu.array.array import AccelerometerArray
from gfimu.rate.channel_sets import ChannelSets
from gfimu.rate.sensing import SensorErrors

__all__ = ["NoisePolicy", "measured_noise", "noise_ratio", "timing_noise"]


@dataclass(frozen=True)
class NoisePolicy:
    """How noise is measured.

    Parameters
    ----------
    window_s : float
        Length over which the mean of a parity row is removed, s: long beside the noise, short beside a bias that
        changes with temperature.
    prior : float
        Degrees of freedom that the data sheet's noise is worth; its spread from part to part is about 30 %.
    outlier : float
        χ² per degree of freedom from which a sample counts less: 3, which noise alone hardly reaches.
    quiet : float
        Share of the windows that count as quiet.
    calm : float
        χ² per degree of freedom of a window, over that of the quiet ones, up to which it is used.
    fewest : int
        Windows without motion from which all rows are used, beside parity.
    loud : float
        Variance of a window over that of its third differences up to which it holds noise, or tones of few channels,
        and no motion.
    significance : float
        Standard deviations by which differences must show less noise than stated, where a motion may add to them.
    iterations : int
        Numerical: steps of the fit.
    largest_step : float
        Numerical: factor by which a step changes a variance at most.
    most : int
        Numerical: samples that are looked at, evenly chosen.
    """

    window_s: float = 1.0
    prior: float = 20.0
    outlier: float = 3.0
    quiet: float = 0.2
    calm: float = 1.5
    fewest: int = 3
    loud: float = 2.25
    significance: float = 3.0
    iterations: int = 15
    largest_step: float = 4.0
    most: int = 20_000


_LEAST_PARITY = 3
_LEAST_SAMPLES = 100
_DISAGREES = 1.5  # χ² of fast samples over that of slow ones from which their times differ
_SIGNIFICANT = 5.0  # standard deviations from which times differ
_THIRD = 20.0  # variance of the third difference of white noise of unit variance
_THIRD_SHARE = 0.43  # independent samples in third differences of white noise, as a share of their number


def measured_noise(
    sets: ChannelSets, readings: NDArray[np.float64], period: float, policy: NoisePolicy = NoisePolicy()
) -> NDArray[np.float64]:
    """Return the noise of each channel per sample, shape (c,), m/s².

    Parameters
    ----------
    sets : ChannelSets
        The array, with the noise that its data sheets state.
    readings : ndarray, shape (n, c)
        Readings, m/s²; samples with a missing channel are left out.
    period : float
        Sample period, s.
    policy : NoisePolicy, optional
        Windows and weights.
    """
    complete = readings[np.isfinite(readings).all(axis=1)]
    if len(complete) > policy.most:  # whole windows, evenly spread
        length = 2 * max(8, round(policy.window_s / period))
        starts = np.linspace(0, len(complete) - length, max(1, policy.most // length)).astype(np.intp)
        complete = complete[(starts[:, None] + np.arange(length)).reshape(-1)]
    stated = sets.noise_std**2
    window = max(8, round(policy.window_s / period))
    channels = len(stated)
    if len(complete) < window // 4 + 4:
        return sets.noise_std
    rows = np.vstack([sets.full.product_rows, sets.parity_rows])
    if len(rows) == 0:
        return sets.noise_std
    null = complete @ rows.T
    windows = _centred(null, window)
    has_parity = 2 * len(sets.parity_rows) >= channels
    if has_parity:
        blind, blind_rows, independent = windows[:, :, sets.products :], sets.parity_rows, 1.0
    else:
        length = windows.shape[1]
        differences = np.diff(null, 3, axis=0)[: len(windows) * length - 3] / np.sqrt(_THIRD)
        blind = differences[: len(differences) // len(windows) * len(windows)].reshape(len(windows), -1, len(rows))
        blind_rows, independent = rows, _THIRD_SHARE
    level, whole = _levels(blind, blind_rows, stated), _levels(windows, rows, stated)
    calm = level <= policy.calm * np.quantile(level, policy.quiet)
    still = calm & (whole <= (policy.calm if has_parity else policy.loud) * level)
    rests = still.sum() >= min(policy.fewest, len(windows))
    values = blind[calm].reshape(-1, len(blind_rows))
    if not rests and not has_parity:  # differences may show a motion as noise, but no less noise than there is
        shown = _fit(values, rows, stated, policy, independent)
        freedom = independent * len(values) * len(rows) / channels
        quieter = shown < stated * (1.0 - policy.significance * np.sqrt(2.0 / freedom))
        return np.sqrt(np.where(quieter, shown, stated))
    if not rests:
        return np.sqrt(_fit(values, blind_rows, stated, policy, independent))
    resting = _fit(windows[still].reshape(-1, len(rows)), rows, stated, policy, 1.0)
    if has_parity:
        return np.sqrt(resting)
    # There are more differences than samples at rest; these show what differences suppress, and whether they show more.
    shown = _fit(values, rows, stated, policy, independent)
    if np.mean(shown / resting) > policy.calm:
        return np.sqrt(resting)
    return np.sqrt(np.where(resting > policy.loud * shown, resting, shown))


def timing_noise(sets: ChannelSets, t: NDArray[np.float64], readings: NDArray[np.float64]) -> float:
    """Return how far the channels' sampling times are from the stated ones, standard deviation, s.

    Channels that sample at different instants disagree in proportion to how fast they change: χ² of the parity rows
    grows with the squared slopes of the readings, s_k² = a + τ² ⟨(ẏ/σ)²⟩_k. By medians, because both have long tails;
    zero where fast samples hardly disagree more than slow ones.

    Parameters
    ----------
    sets : ChannelSets
        The array, with the noise of its channels.
    t : ndarray, shape (n,)
        Times, s.
    readings : ndarray, shape (n, c)
        Readings, m/s²; NaN where missing.
    """
    if len(sets.parity_rows) < _LEAST_PARITY or len(t) < _LEAST_SAMPLES:
        return 0.0
    slope = np.gradient(readings, t, axis=0) / sets.noise_std  # (n, c) 1/s
    moved = np.mean(slope**2, axis=1)
    parity = readings @ sets.parity_rows.T
    used = np.isfinite(moved) & np.isfinite(parity).all(axis=1)
    if used.sum() < _LEAST_SAMPLES:
        return 0.0
    centred = parity[used] - np.median(parity[used], axis=0)
    square, moved = np.mean(centred**2, axis=1), moved[used]
    fast = moved > np.median(moved)
    low, high = np.median(square[~fast]), np.median(square[fast])
    spread = low * np.sqrt(2.0 / len(sets.parity_rows)) * 1.25 / np.sqrt(fast.sum())
    if high < _DISAGREES * low or high - low < _SIGNIFICANT * spread:
        return 0.0
    return float(np.sqrt(np.median((square[fast] - low) / moved[fast])))


def noise_ratio(array: AccelerometerArray, readings: NDArray[np.float64], errors: SensorErrors, period: float) -> float:
    """Return the measured noise of readings (n, c), m/s², over the stated one, root mean square over the channels."""
    usable = np.where(np.abs(readings) < errors.limits, readings, np.nan)
    measured = measured_noise(ChannelSets(array, errors.noise_std), usable, period)
    return float(np.sqrt(np.mean(np.square(measured / errors.noise_std))))


def _levels(
    windows: NDArray[np.float64], rows: NDArray[np.float64], stated: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return χ² per degree of freedom of windows (k, w, d) by the stated noise, shape (k,)."""
    inverse = np.linalg.inv(rows * stated @ rows.T)
    return np.asarray(np.einsum("kni,ij,knj->k", windows, inverse, windows) / windows[0].size)


def _centred(values: NDArray[np.float64], window: int) -> NDArray[np.float64]:
    """Return values (n, d) in windows about their means, shape (windows, window, d), with their variance kept."""
    window = min(window, len(values))
    blocks = values[: len(values) // window * window].reshape(-1, window, values.shape[1])
    return (blocks - blocks.mean(axis=1, keepdims=True)) * np.sqrt(window / (window - 1.0))


def _fit(
    values: NDArray[np.float64],
    rows: NDArray[np.float64],
    stated: NDArray[np.float64],
    policy: NoisePolicy,
    independent: float,
) -> NDArray[np.float64]:
    """Return variances (c,) of channels seen through ``rows`` (d, c), from samples (n, d) of zero mean."""
    count = independent * len(values)
    # Channels are alike: all of them are drawn to the data sheet times a common factor.
    first = np.linalg.inv(rows * stated @ rows.T)
    square = np.einsum("ni,ij,nj->n", values, first, values) / len(rows)
    common = np.mean(np.minimum(square, policy.outlier * np.median(square)))
    stated = stated * (count * len(rows) * common + policy.prior) / (count * len(rows) + policy.prior)
    variance = stated.copy()
    weight = np.ones(len(values))
    freedom, limit = len(rows), policy.outlier * len(rows)
    kept = (
        1.0 - chdtrc(freedom + 2, limit) + policy.outlier * chdtrc(freedom, limit)
    )  # of the mean square, by weighting
    for step in range(policy.iterations):
        inverse = np.linalg.inv(rows * variance @ rows.T)
        if step in (3, 6, 10):  # the weights of samples that disagree settle sooner than the variances
            square = np.einsum("ni,ij,nj->n", values, inverse, values) / len(rows)
            weight = np.minimum(1.0, policy.outlier / np.maximum(square, 1e-9)) / kept
        scatter = (values * weight[:, None]).T @ values / len(values)
        seen = rows.T @ inverse  # (c, d)
        shown = np.einsum("ik,kl,il->i", seen, scatter, seen)
        shares = (seen @ rows) ** 2  # (c, c), expectation of what is shown by the variances
        prior = policy.prior / (count * variance**2)  # its information, as shares are
        found = np.linalg.solve(shares + np.diag(prior), shown + prior * stated)
        variance = np.clip(found, variance / policy.largest_step, variance * policy.largest_step)
    return variance
