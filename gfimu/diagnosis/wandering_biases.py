"""Whether biases wander as a random walk: the search run again under such noise, and compared.

A walk passes for anything slow, and slow causes for a walk: only the evidence of both tells.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from gfimu.diagnosis.adequacy import left_over
from gfimu.diagnosis.coloured_noise import NoiseLevels
from gfimu.diagnosis.data.prepared_runs import PreparedRuns
from gfimu.diagnosis.explanation import Explanation
from gfimu.diagnosis.fit import Fit, segments_at
from gfimu.diagnosis.long_run import explain_any_length, settle_noise_of_any_length
from gfimu.diagnosis.nuisances import settle_noise
from gfimu.diagnosis.pruning import LEAST_EXTRA_ODDS, prune
from gfimu.diagnosis.refinement import refine
from gfimu.diagnosis.segment import Segment, known_walk
from gfimu.diagnosis.stochastic import UNEQUAL_WALK, WALK_ODDS, Walk, log_probability, walk_strength
from gfimu.world_model import Effect, WorldModel

__all__ = ["wanders", "with_walk"]

_ROUNDS = 3
_HOPELESS = 300.0  # `Walk.unequal` with all other causes in place
_MUCH = 500.0  # log odds of what a walk leaves of a search that was given up: more is something else
_FAR_BETTER = 1000.0  # log odds for a walk over what a search found at first, to look for the walk at once
_FITS = 1.1  # misfit per observation of what a walk explains
_WORSE = 20.0  # log odds against a walk that no other cause would bring back, where no walk is left without it
_SLOW = frozenset(
    {"bias", "warm_up", "bias_temperature", "gain_drift", "scale_factor", "quadratic", "gravity", "cross_axis"}
)


def wanders(segments: Sequence[Segment], fit: Fit, fixed: Sequence[Sequence[Effect]]) -> bool:
    """Tell whether wandering biases explain what a search found at first no causes for, and far better than these.

    Parameters
    ----------
    segments : sequence of Segment
        The data.
    fit : Fit
        What was found at first.
    fixed : sequence of sequence of Effect
        Effects known beforehand, per segment.
    """
    if known_walk(segments[0].model) > 0 or walk_strength(segments, fit, fixed).log_odds < WALK_ODDS:
        return False
    base = _without_slow(segments, fit, fixed)
    walk = walk_strength(segments, base, fixed)
    if walk.log_odds < WALK_ODDS or walk.unequal > UNEQUAL_WALK:
        return False
    other = segments_at(segments, base)
    _let_wander(other, walk)
    settle_noise(other, base.causes, fixed)
    found = refine(other, base.causes, fixed)
    observations = sum(int(segment.weight_mask.sum()) for segment in segments)
    better = log_probability(other, found) - log_probability(segments, fit)
    return found.objective < _FITS * observations and better > _FAR_BETTER


def with_walk(
    judged: Explanation,
    prepared: PreparedRuns,
    model: WorldModel,
    *,
    given_up: bool,
    report: Callable[[str], None],
) -> tuple[Explanation, Walk] | None:
    """Return what explains the data beside wandering biases, and these, where that is more probable.

    Parameters
    ----------
    judged : Explanation
        What explains them without.
    prepared : PreparedRuns
        The runs.
    model : WorldModel
        What the simulation believes.
    given_up : bool
        Whether the search without was given up.
    report : callable
        Called with a line of text before each search.
    """
    if known_walk(model) > 0:
        return None
    segments, fixed = list(judged.segments), [list(known) for known in judged.fixed]
    # It is looked for in what the other causes leave.
    base = _without_slow(segments, judged.fit, fixed)
    same = base is judged.fit
    walk = walk_strength(segments, base, fixed)
    if walk.log_odds < WALK_ODDS:
        return None
    beside = walk if same else walk_strength(segments, judged.fit, fixed)
    if min(walk.unequal, beside.unequal) > _HOPELESS:
        return None  # whatever else were found beside it
    without = log_probability(segments, judged.fit) + np.log(len(model.families()))
    before, found, odds = segments, judged, -np.inf
    for number in range(_ROUNDS):
        report("wandering biases")
        other = _wandering(before, walk, prepared, model)
        # What was taken for bias instability is the walk now.
        settle_noise_of_any_length(other, base.causes, fixed)
        if number == 0:
            fit = refine(other, base.causes, fixed)
            # Bias instability lets the drive follow the walk.
            freed = walk_strength(other, fit, fixed)
            if abs(freed.strength - walk.strength) > walk.std:
                walk = freed
                _let_wander(other, walk)
                settle_noise_of_any_length(other, base.causes, fixed)
                fit = refine(other, base.causes, fixed)
            if given_up and _leaves_much(other, fit, fixed, prepared):
                return None
            if beside.log_odds < WALK_ODDS and log_probability(other, fit) - without < -_WORSE:
                # Of the slow causes some may be right, and a walk pass for the others.
                kept = prune(other, refine(other, judged.fit.causes, fixed, drives=judged.fit.drives), fixed)[0]
                if log_probability(other, kept) - without < -_WORSE:
                    return None
        found = explain_any_length(other, fixed, len(prepared.runs), start=base.causes)
        odds = log_probability(other, found.fit) - without
        if found.given_up or number == _ROUNDS - 1:
            break
        before, base, last = other, found.fit, walk
        walk = walk_strength(before, base, fixed)
        if abs(walk.strength - last.strength) < walk.std:
            break
    replaced = len(found.fit.causes) < len(judged.fit.causes)  # not one more cause, but one for another
    if odds < (0.0 if replaced else LEAST_EXTRA_ODDS) or walk.log_odds < WALK_ODDS or walk.unequal > UNEQUAL_WALK:
        return None  # another cause was taken for a walk at first
    return found, replace(walk, log_odds=float(odds))


def _without_slow(segments: Sequence[Segment], fit: Fit, fixed: Sequence[Sequence[Effect]]) -> Fit:
    """Return a fit, or, where it has causes that a walk passes for, one without these."""
    quick = [cause for cause in fit.causes if cause.name not in _SLOW]
    return fit if len(quick) == len(fit.causes) else refine(segments, quick, fixed, drives=fit.drives)


def _let_wander(segments: Sequence[Segment], walk: Walk) -> None:
    """Let biases wander."""
    for segment in segments:
        segment.set_levels(NoiseLevels(segment.levels.white, segment.levels.flicker, walk.strength))
        segment.prepare_weights()


def _wandering(segments: Sequence[Segment], walk: Walk, prepared: PreparedRuns, model: WorldModel) -> list[Segment]:
    """Return the segments anew, with biases that wander and the drives as they are."""
    fresh, _ = prepared.segments(model)
    for segment, old in zip(fresh, segments, strict=True):
        segment.adopt(old)
    _let_wander(fresh, walk)
    return fresh


def _leaves_much(
    segments: Sequence[Segment], fit: Fit, fixed: Sequence[Sequence[Effect]], prepared: PreparedRuns
) -> bool:
    """Tell whether a fit, under the noise of the segments, leaves more than any search would find."""
    at = segments_at(segments, fit)
    return left_over(at, fit, fixed, prepared.spikes, rounded=prepared.rounded).log_odds > _MUCH
