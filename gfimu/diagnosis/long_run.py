"""Long recordings: causes are searched on some stretches, spread over the runs, and judged on all.

The search asks for hundreds of simulations of every stretch, the judgement for a few.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gfimu.diagnosis.causes import Cause
from gfimu.diagnosis.engine import Instead, Report, explain
from gfimu.diagnosis.explanation import Explanation
from gfimu.diagnosis.nuisances import learn_noise, settle_noise, sharpen_drives, widen_drives
from gfimu.diagnosis.pruning import RIVALS, prune
from gfimu.diagnosis.refinement import refine
from gfimu.diagnosis.segment import Segment
from gfimu.world_model import Effect

__all__ = ["MOST_SEARCHED", "explain_any_length", "settle_noise_of_any_length", "spread_over_runs"]

MOST_SEARCHED = 8
"""Stretches that are searched for causes, where there are as many runs at most."""
_FEW_ITERATIONS = 2


def spread_over_runs(runs: Sequence[int], most: int) -> list[int]:
    """Pick places of stretches, given the run that each belongs to: evenly spread, first and last ones included.

    Parameters
    ----------
    runs : sequence of int
        Number of the run of each stretch, in order.
    most : int
        About how many to pick; every run gives one at least.
    """
    chosen: list[int] = []
    for run in dict.fromkeys(runs):
        mine = [place for place, number in enumerate(runs) if number == run]
        count = min(max(round(most * len(mine) / len(runs)), 1), len(mine))
        chosen += [mine[int(place)] for place in np.linspace(0, len(mine) - 1, count).round()]
    return chosen


def settle_noise_of_any_length(
    segments: Sequence[Segment], causes: Sequence[Cause], fixed: Sequence[Sequence[Effect]]
) -> None:
    """Learn the noise that causes leave until it stays the same (`settle_noise`); in long recordings on some stretches.

    The others of a run take theirs.
    """
    chosen = spread_over_runs([segment.index for segment in segments], MOST_SEARCHED)
    some = [segments[place] for place in chosen]
    settle_noise(some, causes, [fixed[place] for place in chosen])
    _take_noise(segments, chosen, some)


def _take_noise(segments: Sequence[Segment], chosen: Sequence[int], known: Sequence[Segment]) -> list[int]:
    """Give segments that were not chosen the noise that is known of their runs; returns their places."""
    rest = [place for place in range(len(segments)) if place not in set(chosen)]
    for place in rest:
        like = _of_run(known, segments[place].index)
        segments[place].set_levels(like.levels)
        segments[place].rounding = like.rounding
        segments[place].prepare_weights()
    return rest


def _of_run(segments: Sequence[Segment], index: int) -> Segment:
    return next(one for one in segments if one.index == index)


def explain_any_length(
    segments: Sequence[Segment],
    fixed: Sequence[Sequence[Effect]],
    runs: int,
    *,
    start: Sequence[Cause] = (),
    instead: Instead | None = None,
    report: Report | None = None,
) -> Explanation:
    """Find the most probable set of causes (`explain`); in long recordings from some stretches, judged on all."""
    chosen = spread_over_runs([segment.index for segment in segments], MOST_SEARCHED)
    if len(chosen) == len(segments):
        return explain(segments, fixed, runs, start=start, instead=instead, report=report)
    tell = report or (lambda share, text: None)
    part = explain(
        [segments[place] for place in chosen],
        [fixed[place] for place in chosen],
        runs,
        start=start,
        instead=instead,
        report=lambda share, text: tell(0.6 * share, text),
    )
    tell(0.6, "the whole length")
    rest = _take_noise(segments, chosen, part.segments)
    for place in rest:
        segments[place].roughness.factor = _of_run(part.segments, segments[place].index).roughness.factor
    if part.left_for:  # nothing of it will be believed
        fit = refine(segments, part.fit.causes, fixed, iterations=_FEW_ITERATIONS)
        for segment, drive in zip(segments, fit.drives, strict=True):
            segment.coefficients = drive
        everywhere = tuple(tuple(effects) for effects in fixed)
        return replace(part, fit=fit, rivals=(), nothing=fit, segments=tuple(segments), fixed=everywhere)
    fit = widen_drives(segments, refine(segments, part.fit.causes, fixed), fixed)
    others, known = [segments[place] for place in rest], [fixed[place] for place in rest]
    for segment, drive in zip(others, fit.of(rest).drives, strict=True):
        segment.coefficients = drive
        segment.learn_roughness()
    sharper = dict(zip(rest, sharpen_drives(others, fit.of(rest), known).drives, strict=True))
    drives = [sharper.get(place, drive) for place, drive in enumerate(fit.drives)]
    fit = refine(segments, fit.causes, fixed, drives=drives)
    learn_noise(segments, fit, fixed)
    fit = refine(segments, fit.causes, fixed, drives=fit.drives)
    tell(0.8, "prune")
    fit, without = (fit, {}) if part.given_up else prune(segments, fit, fixed)
    rivals = [refine(segments, rival.causes, fixed, drives=fit.drives) for rival in part.rivals[:RIVALS]]
    nothing = refine(segments, (), fixed, drives=fit.drives) if fit.causes else fit
    for segment, drive in zip(segments, fit.drives, strict=True):
        segment.coefficients = drive
    return Explanation(
        fit,
        tuple(sorted(rivals, key=lambda rival: -rival.log_posterior)),
        nothing,
        without,
        tuple(segments),
        tuple(tuple(effects) for effects in fixed),
        part.signatures,
        part.given_up,
    )
