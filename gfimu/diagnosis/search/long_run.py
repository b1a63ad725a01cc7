"""Recordings of any length: causes are searched in some stretches and fitted to all."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace

import numpy as np

from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.fit.gauss_newton import Fit
from gfimu.diagnosis.fit.learn import LEARNINGS, learn_noise, learn_roughness, starting_point
from gfimu.diagnosis.fit.linear import Point, with_residue
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.search.explain import explained
from gfimu.diagnosis.search.nuisance_models import Understanding, understand
from gfimu.diagnosis.search.sets import Sets, prune
from gfimu.diagnosis.time_limit import unlimited, what_ended

__all__ = ["spread_over_runs", "understand_any_length"]

Report = Callable[[float, str], None]


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
        mine = [index for index, number in enumerate(runs) if number == run]
        count = min(max(round(most * len(mine) / len(runs)), 1), len(mine))
        chosen += [mine[int(place)] for place in np.linspace(0, len(mine) - 1, count).round()]
    return chosen


def understand_any_length(
    stretches: Sequence[Stretch], policy: Policy, report: Report, *, models: Collection[str] | None = None
) -> Understanding:
    """Explain stretches; where there are many, some of them, and fit what was found to all.

    `models` names the only alternatives for the nuisance parameters that are searched; all by default.
    """
    chosen = spread_over_runs([stretch.index for stretch in stretches], policy.most_searched)
    if len(chosen) == len(stretches):
        return understand(stretches, policy, report, models=models)
    some = [stretches[place] for place in chosen]
    part = understand(some, policy, lambda s, text: report(0.6 * s, text), models=models)
    if not part.explanation.interrupted:
        try:
            return _over_all(stretches, chosen, part, policy, report)
        except KeyboardInterrupt as stop:
            part = replace(part, explanation=replace(part.explanation, interrupted=what_ended(stop)))
    with unlimited():
        point = _started(stretches, chosen, part.explanation.best, policy)
    best = replace(part.explanation.best, point=point)
    nothing = replace(part.explanation.nothing, point=replace(point, causes=()))
    return replace(part, explanation=replace(part.explanation, best=best, nothing=nothing, stretches=tuple(stretches)))


def _started(stretches: Sequence[Stretch], chosen: Sequence[int], best: Fit, policy: Policy) -> Point:
    """Return the causes of a fit of some stretches with its drives there, and those of the reference in the others."""
    start = starting_point(stretches, policy.knots)
    of_run = {stretches[place].index: levels for place, levels in zip(chosen, best.point.levels, strict=True)}
    levels = tuple(of_run.get(stretch.index, best.point.levels[0]) for stretch in stretches)
    drives = list(start.drives)
    for place, drive in zip(chosen, best.point.drives, strict=True):
        drives[place] = drive
    return Point(best.causes, tuple(drives), levels)


def _over_all(
    stretches: Sequence[Stretch], chosen: Sequence[int], part: Understanding, policy: Policy, report: Report
) -> Understanding:
    """Fit what was found in some stretches to all of them."""
    report(0.6, "the whole length")
    point = _with_residue(stretches, _started(stretches, chosen, part.explanation.best, policy), part.residue)
    point = learn_roughness(stretches, point, LEARNINGS)
    sets = Sets(stretches, point, policy)
    found = sets.fit([point])[0]
    if found is None:
        raise np.linalg.LinAlgError("the stretches left out determine no drive")
    point = _with_residue(stretches, learn_noise(stretches, found.point), part.residue)
    sets = Sets(stretches, point, policy)
    rivals = [rival.causes for rival in part.explanation.rivals[: policy.beam - 1]]
    report(0.8, "compare")
    sets.fit([point, *(replace(point, causes=causes) for causes in rivals)])
    return replace(part, explanation=explained(sets, prune(sets), 0))


def _with_residue(stretches: Sequence[Stretch], point: Point, scale: float) -> Point:
    return with_residue(stretches, point, scale) if scale > 0.0 else point
