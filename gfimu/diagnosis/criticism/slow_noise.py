"""Noise that is more than the parts should have: one loud channel, more white noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gfimu.diagnosis.data.cosine_basis import NoiseLevels
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.fit.linear import Point
from gfimu.diagnosis.fit.observed_at import observed_at
from gfimu.diagnosis.fit.random_walk import slow_powers, whittle
from gfimu.diagnosis.policy import Policy

__all__ = ["LoudestChannel", "loudest_channel", "white_factor"]

_LEAST_ANALOGUE = 1e-6  # numerical: m/s²


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
        """Whether it surely has more slow noise than the other channels."""
        return self.ratio > policy.loud_ratio and self.log_odds > policy.ambiguous


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
        Thresholds ``loud_ratio`` and ``ambiguous``.
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
        slow = slow_powers(stretch, seen)
        power, flicker, walk = (
            np.broadcast_to(one, slow.power.shape)[:, [channel]] for one in (slow.power, slow.flicker, slow.walk)
        )
        besides = seen.levels.white[channel] ** 2 + walk * seen.levels.walk**2
        own, allowed = (whittle(power, besides + flicker * size**2) for size in (level, policy.loud_ratio * usual))
        odds += float(own[0] - allowed[0])
    return LoudestChannel(channels[channel], level, ratio, odds)


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
        Thresholds ``white_ratio`` and ``noise_accuracy``.

    Returns
    -------
    tuple of float, or None
        None where the level is within the spread of parts of a kind.
    """
    # A run has one level for all of its stretches; of several runs it is the rms.
    ratios, factors = [], []
    for stretch, mine in zip(stretches, levels, strict=True):
        expected = stretch.model.expected_noise(stretch.run.output_data_rate)
        measured = mine.white[:-1]
        coarse = bool(stretch.steps.channels)
        rounding = 0.0 if coarse else expected.quantum**2 / 12.0
        analogue = np.sqrt(np.maximum(measured**2 - rounding, 0.0))
        ratios.append(measured / (expected.analogue if coarse else expected.white))
        factors.append(analogue / np.maximum(expected.analogue, _LEAST_ANALOGUE))
    counts = _counts(stretches)
    ratio, factor_each = (np.sqrt(np.average(np.square(one), axis=0, weights=counts)) for one in (ratios, factors))
    if np.median(ratio) < policy.white_ratio or ratio.min() < np.sqrt(policy.white_ratio):
        return None
    factor = float(np.median(factor_each))
    samples = sum(len(stretch.run.t) for stretch in stretches)
    return factor, factor * float(1.0 / np.sqrt(samples * len(ratio) / 4.0) + policy.noise_accuracy)


def _counts(stretches: Sequence[Stretch]) -> list[int]:
    return [len(stretch.run.t) for stretch in stretches]
