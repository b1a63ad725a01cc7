"""A random walk of the biases, by the Whittle likelihood of the slow cosines in the residual of a fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.fit.linear import Point
from gfimu.diagnosis.fit.observed_at import observed_at
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.terms.coloured_noise import likeliest_flicker
from gfimu.diagnosis.terms.observed import Observed
from gfimu.diagnosis.terms.slow_modes import WeighedPowers

__all__ = ["Walk", "as_it_walks", "slow_powers", "walk_strength", "whittle"]

_STRENGTHS = np.geomspace(2e-3, 0.5, 28)  # numerical: grid of a random walk's strength, m/s² per √s


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
        """Whether the residual shows it, equally in all channels."""
        return self.log_odds > policy.lack_odds and self.unequal < policy.unequal_walk


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
        slow, white = slow_powers(stretch, seen), seen.levels.white[:-1]
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


def as_it_walks(stretches: Sequence[Stretch], point: Point, policy: Policy) -> Point:
    """Return a point with the random walk of the biases that its residual shows; with none where none is likely.

    Parameters
    ----------
    stretches : sequence of Stretch
        The data.
    point : Point
        A fit.
    policy : Policy
        Thresholds of `walk_strength` and `Walk.is_likely`.
    """
    walk = walk_strength(stretches, point, policy)
    strength = walk.strength if walk.is_likely(policy) else 0.0
    return replace(point, levels=tuple(replace(level, walk=strength) for level in point.levels))


def slow_powers(stretch: Stretch, seen: Observed) -> WeighedPowers:
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
    return whittle(slow.power, white**2 + slow.flicker * flicker**2 + walk)


def whittle(power: NDArray[np.float64], spectrum: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the Whittle log likelihood of squared cosine coefficients (K, c) per channel."""
    return np.asarray(-0.5 * np.sum(np.log(spectrum) + power / spectrum, axis=0))
