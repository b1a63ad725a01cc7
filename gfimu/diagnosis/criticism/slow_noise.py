"""Noise that is more than the parts should have: a random walk of the biases, one loud channel, more white noise.

Slow noise is judged by the Whittle likelihood of the squared sizes of slow cosines in the residual of a fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from gfimu.diagnosis.criticism.observed_at import observed_at
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.fit.linear import Point
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.terms.coloured_noise import NoiseLevels, likeliest_flicker
from gfimu.diagnosis.terms.observed import Observed
from gfimu.diagnosis.terms.slow_modes import WeighedPowers

__all__ = ["LoudestChannel", "Walk", "loudest_channel", "walk_strength", "white_factor"]

_STRENGTHS = np.geomspace(2e-3, 0.5, 28)  # numerical: grid of a random walk's strength, m/s² per √s
_LEAST_ANALOGUE = 1e-6  # numerical: m/s²


@dataclass(frozen=True)
class Walk:
    """A random walk of the biases, equally strong in all channels.

    Parameters
    ----------
    strength, std : float
        Strength and its standard deviation, m/s² per √s.
    log_odds : float
        Compared with bias instability alone, of at most `Policy.largest_flicker`.
    unequal : float
        Minus the log of the chance that channels of equal strength differ as much as these.
    """

    strength: float
    std: float
    log_odds: float
    unequal: float

    def is_likely(self, policy: Policy) -> bool:
        """Tell whether the residual shows it, equally in all channels."""
        return self.log_odds > policy.walk_odds and self.unequal < policy.unequal_walk


@dataclass(frozen=True)
class LoudestChannel:
    """The channel with the largest bias instability.

    Parameters
    ----------
    name : str
        The channel.
    level : float
        Its bias instability, m/s².
    ratio : float
        That over the median of the other channels.
    log_odds : float
        Log likelihood of its level compared with the largest that the others allow; 0 where its is no larger.
    """

    name: str
    level: float
    ratio: float
    log_odds: float

    def stands_out(self, policy: Policy) -> bool:
        """Tell whether it surely has more slow noise than the other channels."""
        return self.ratio > policy.loud_ratio and self.log_odds > policy.loud_odds


def loudest_channel(stretches: Sequence[Stretch], point: Point, policy: Policy = Policy()) -> LoudestChannel:
    """Return the channel with the largest bias instability at a point.

    A short run determines a level to a factor of about two: whether it can be as small as the other channels allow,
    the likelihood of the residual decides.

    Parameters
    ----------
    stretches : sequence of Stretch
        The data.
    point : Point
        A fit with the noise that was learnt from it.
    policy : Policy
        Thresholds ``loud_ratio`` and ``loud_odds``.
    """
    channels = stretches[0].model.array.channels
    alive = np.any([stretch.mask[:, :-1].any(axis=0) for stretch in stretches], axis=0)
    each = np.array([levels.flicker[:-1] for levels in point.levels])
    levels = np.where(alive, np.sqrt(np.average(each**2, axis=0, weights=_counts(stretches))), 0.0)
    channel = int(np.argmax(levels))
    others = np.delete(levels, channel)[np.delete(alive, channel)]
    usual = float(np.median(others)) if len(others) else 0.0
    level = float(levels[channel])
    ratio = level / usual if usual > 0.0 else 1.0
    if ratio <= policy.loud_ratio:
        return LoudestChannel(channels[channel], level, ratio, 0.0)
    odds = 0.0
    for stretch, seen in zip(stretches, observed_at(stretches, point), strict=True):
        slow = _slow_powers(stretch, seen)
        power, flicker, walk = (
            np.broadcast_to(one, slow.power.shape)[:, [channel]] for one in (slow.power, slow.flicker, slow.walk)
        )
        besides = seen.levels.white[channel] ** 2 + walk * seen.levels.walk**2
        own, allowed = (_whittle(power, besides + flicker * size**2) for size in (level, policy.loud_ratio * usual))
        odds += float(own[0] - allowed[0])
    return LoudestChannel(channels[channel], level, ratio, odds)


def walk_strength(stretches: Sequence[Stretch], point: Point, policy: Policy = Policy()) -> Walk:
    """Estimate a random walk, common to all channels, from the residual at a point.

    It is the whole random walk that the residual shows, whatever part of it the noise of the point has already.

    Parameters
    ----------
    stretches : sequence of Stretch
        The data.
    point : Point
        A fit.
    policy : Policy
        Thresholds ``largest_flicker``, ``least_walk`` and ``walk_to_drive``.
    """
    totals = np.zeros((len(_STRENGTHS), stretches[0].model.array.n_channels))
    without = 0.0
    for stretch, seen in zip(stretches, observed_at(stretches, point), strict=True):
        slow, white = _slow_powers(stretch, seen), seen.levels.white[:-1]
        without += float(_likelihood(slow, white, 0.0, policy).sum())
        totals += np.array([_likelihood(slow, white, strength, policy) for strength in _STRENGTHS])
    common = totals.sum(axis=1)
    best = int(np.argmax(common))
    weight = np.exp(common - common[best])
    mean = float(weight @ _STRENGTHS / weight.sum())
    std = float(np.sqrt(weight @ (_STRENGTHS - mean) ** 2 / weight.sum()))
    apart = 2.0 * float(totals.max(axis=0).sum() - common[best])
    unequal = -float(chi2.logsf(apart, totals.shape[1] - 1))
    odds = float(common[best] - without) if mean > policy.least_walk else 0.0
    return Walk(mean, float(np.hypot(std, policy.walk_to_drive * mean)), odds, unequal)


def white_factor(
    stretches: Sequence[Stretch], levels: Sequence[NoiseLevels], policy: Policy = Policy()
) -> tuple[float, float] | None:
    """Return by what factor the chips' white noise exceeds the expected one, and its standard deviation.

    Parameters
    ----------
    stretches : sequence of Stretch
        The data.
    levels : sequence of NoiseLevels
        Noise of every stretch.
    policy : Policy
        Thresholds ``white_ratio`` and ``white_ratio_least``.

    Returns
    -------
    tuple of float, or None
        None where the level is within the spread of parts of a kind.
    """
    # A run has one level for all of its stretches; of several runs it is the rms.
    ratios, factors = [], []
    for stretch, mine in zip(stretches, levels, strict=True):
        expected = stretch.model.expected_noise(1.0 / stretch.run.sample_period)
        measured = mine.white[:-1]
        coarse = bool(stretch.steps.channels)
        rounding = 0.0 if coarse else expected.quantum**2 / 12.0
        analogue = np.sqrt(np.maximum(measured**2 - rounding, 0.0))
        ratios.append(measured / (expected.analogue if coarse else expected.white))
        factors.append(analogue / np.maximum(expected.analogue, _LEAST_ANALOGUE))
    counts = _counts(stretches)
    ratio, factor_each = (np.sqrt(np.average(np.square(one), axis=0, weights=counts)) for one in (ratios, factors))
    if np.median(ratio) < policy.white_ratio or ratio.min() < policy.white_ratio_least:
        return None
    factor = float(np.median(factor_each))
    samples = sum(len(stretch.run.t) for stretch in stretches)
    return factor, factor * float(1.0 / np.sqrt(samples * len(ratio) / 4.0) + policy.white_accuracy)


def _counts(stretches: Sequence[Stretch]) -> list[int]:
    return [len(stretch.run.t) for stretch in stretches]


def _slow_powers(stretch: Stretch, seen: Observed) -> WeighedPowers:
    """Return squared sizes of the slow modes in the channels' residuals, and their variances per unit slow noise."""
    basis, residual = stretch.basis, seen.residual[:, :-1]
    if stretch.steps.channels:
        return WeighedPowers.of(basis, residual, seen.weight[:, :-1])
    power = basis.transform(residual)[1 : len(basis.frequency)] ** 2  # (K, c)
    return WeighedPowers(power, basis.flicker_spectrum[1:, None], basis.walk_spectrum[1:, None])


def _likelihood(
    slow: WeighedPowers, white: NDArray[np.float64], strength: float, policy: Policy
) -> NDArray[np.float64]:
    """Return the log likelihood (c,) of a random walk beside white noise (c,) and the likeliest bias instability."""
    walk = slow.walk * strength**2
    flicker = np.minimum(likeliest_flicker(slow.power, white, slow.flicker, walk), policy.largest_flicker)
    return _whittle(slow.power, white**2 + slow.flicker * flicker**2 + walk)


def _whittle(power: NDArray[np.float64], spectrum: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the Whittle log likelihood of squared cosine coefficients (K, c) per channel."""
    return np.asarray(-0.5 * np.sum(np.log(spectrum) + power / spectrum, axis=0))
