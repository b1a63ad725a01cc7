"""Lack of fit: whether anything but noise remains beside the causes of a fit, and where.

Of a table it is an error that is free in time at a place, noise that changes with the motion, or many isolated samples.
Of a free body it is a function at a place or on channels, a tone, or noise that grows with the motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from gfimu.diagnosis.criticism.body import motion_noise, tone
from gfimu.diagnosis.criticism.series_tests import NOTHING, LackOfFit, changing_noise
from gfimu.diagnosis.data.body.stretch import BodyStretch
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.fit.gauss_newton import Fit
from gfimu.diagnosis.fit.linear import Point, linearise
from gfimu.diagnosis.fit.observed_at import observed_at
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.search.free_time import free_time
from gfimu.diagnosis.search.located_screen import LocatedScreen
from gfimu.diagnosis.terms.cause import effects_of
from gfimu.diagnosis.terms.located.policy import LOCATED

__all__ = ["LackOfFit", "lack_of_fit"]


def lack_of_fit(
    stretches: Sequence[Stretch], fit: Fit, *, spikes: int = 0, rounded: bool = False, policy: Policy = Policy()
) -> LackOfFit:
    """Find the strongest thing that the causes of a fit leave unexplained.

    Parameters
    ----------
    stretches : sequence of Stretch
        The data.
    fit : Fit
        Causes and drives, under the noise that they leave.
    spikes : int
        Isolated samples that the check of the samples took out.
    rounded : bool
        Whether readings are clipped or so coarse that their rounding follows the motion.
    policy : Policy
        Thresholds ``ambiguous``, ``steady``, ``sizeable``, ``spikes``, ``spike_share`` and ``lack_odds``.
    """
    if isinstance(stretches[0], BodyStretch):
        return _of_body(stretches, fit.point, policy)
    candidates = [_free(stretches, fit, policy)]
    if not rounded:
        states = [
            stretch.motion(effects_of(fit.causes, stretch.model.array, stretch.index), drive.spin).at(stretch.run.t)
            for stretch, drive in zip(stretches, fit.point.drives, strict=True)
        ]
        candidates.append(changing_noise(stretches, observed_at(stretches, fit.point), states, policy))
    if spikes > max(policy.spikes, policy.spike_share * sum(stretch.mask.size for stretch in stretches)):
        text = f"{spikes} isolated samples far off their neighbours"
        candidates.append(LackOfFit(policy.lack_odds * spikes, text))
    return max(candidates, key=lambda found: found.log_odds)


def _free(stretches: Sequence[Stretch], fit: Fit, policy: Policy) -> LackOfFit:
    """Return the place at which an error that is free in time makes the data most probable."""
    places = free_time(stretches, fit.point, policy)
    best = places[0]
    text = f"{best.where.words}, in time, with nothing else that is known"
    return LackOfFit(best.log_odds - (LOCATED.free_odds - policy.lack_odds), text, free=tuple(places))


def _of_body(stretches: Sequence[Any], point: Point, policy: Policy) -> LackOfFit:
    """Return the strongest of a dependence and a tone, and beside it the noise that grows with the motion."""
    tones = [tone(posterior, policy) for posterior in linearise(stretches, point).posteriors]
    found = max([_function_unexplained(stretches, point), *tones], key=lambda one: one.log_odds)
    noise = motion_noise(stretches, point.levels, policy)
    if noise.noise_odds <= policy.lack_odds:
        return found
    if found.log_odds <= policy.lack_odds:
        return replace(noise, log_odds=found.log_odds)
    return replace(found, signature=f"{found.signature}; {noise.signature}", noise_odds=noise.noise_odds)


def _function_unexplained(stretches: Sequence[Any], point: Point) -> LackOfFit:
    """Return the function at a place of the body, or on its channels, that makes the data most probable."""
    leaders = LocatedScreen(stretches, point).leaders(least=0.0)
    if not leaders:
        return NOTHING
    return LackOfFit(leaders[0].log_odds, f"{leaders[0].term.where.words}, {leaders[0].term.dependence.words}")
