"""`explain`: the most probable set of causes. Screen, fit the leaders, learn the nuisances, until nothing changes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.fit.gauss_newton import Fit, fit
from gfimu.diagnosis.fit.learn import LEARNINGS, learn_noise, learn_roughness, sharpened, starting_point
from gfimu.diagnosis.fit.linear import Point, with_residue
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.search.beam import STARTS, Blocks, grown_sets, leading_sets
from gfimu.diagnosis.search.screening import Screening, screen
from gfimu.diagnosis.search.sets import Key, Sets, has_stalled, prune
from gfimu.diagnosis.terms.cause import Cause, effects_of
from gfimu.diagnosis.terms.drive import Drive
from gfimu.diagnosis.terms.located.term import LocatedTerm, is_located
from gfimu.diagnosis.time_limit import what_ended
from gfimu.model.world_model import memory_of

__all__ = ["Explanation", "Report", "exactly", "explain", "explained", "leading_words", "reduced"]

Report = Callable[[float, str], None]


@dataclass(frozen=True)
class Explanation:
    """What a search ended with: the most probable set of causes and what it is compared with.

    Parameters
    ----------
    best : Fit
        The most probable set.
    nothing : Fit
        No cause at all, under the same nuisance parameters.
    without : dict of str to Fit
        The best fit without each cause.
    rivals : tuple of Fit
        Other sets, best first, under the same nuisance parameters.
    screening : Screening
        The last one, about the best set.
    stretches : tuple of Stretch
        The data.
    elsewhere : tuple of Fit
        The best set under each other model of the nuisance parameters, its log posterior less what that model needs
        more than this one.
    interrupted : str
        What ended the search before it was done; empty where nothing did. It has no screening then.
    """

    best: Fit
    nothing: Fit
    without: dict[str, Fit]
    rivals: tuple[Fit, ...]
    screening: Screening | None
    stretches: tuple[Stretch, ...] = ()
    fits: int = 0
    by_reference: tuple[Drive, ...] = ()
    elsewhere: tuple[Fit, ...] = ()
    interrupted: str = ""


def explain(
    stretches: Sequence[Stretch], policy: Policy, *, start: Point | None = None, report: Report | None = None
) -> Explanation:
    """Find the most probable set of causes under one model of the nuisance parameters.

    Parameters
    ----------
    stretches : sequence of Stretch
        The data.
    policy : Policy
        Thresholds.
    start : Point, optional
        Where to start, with its causes and its model of the nuisance parameters: a random walk of the biases, a residue
        of the calibration. By default nothing is known but the reference and the data sheet.
    report : callable, optional
        Called with the share done and a line of text.
    """
    progress = report or (lambda share, text: None)
    progress(0.05, "drive")
    if start is not None:
        sets = Sets(stretches, start, policy)
        sets.fit([start, replace(start, causes=())])
        return _searched(sets, partial(_report_part, progress, 0, 1))
    reference = starting_point(stretches, policy.knots)
    starts = _started(stretches, reference, policy)
    found = []
    for index, sets in enumerate(starts):
        found.append(_searched(sets, partial(_report_part, progress, index, len(starts))))
        if found[-1].interrupted:
            break
    best = max(found, key=lambda one: one.best.log_posterior)
    return replace(
        best,
        fits=sum(one.fits for one in found),
        by_reference=reference.drives,
        interrupted=found[-1].interrupted,
    )


def _report_part(progress: Report, number: int, count: int, share: float, text: str) -> None:
    progress(0.1 + 0.8 * (number + share) / count, text)


def _started(stretches: Sequence[Stretch], reference: Point, policy: Policy) -> list[Sets]:
    """Return sets under the roughness that channels and reference show without a cause; the noise not yet.

    Where the drive bends sharply there are two: with closer knots, which can follow a cause that moves the table, and
    with those of the reference.
    """
    sets = Sets(stretches, reference, policy)
    nothing = sets.fit([sets.base])[0]
    if nothing is None:
        raise np.linalg.LinAlgError("the reference determines no drive")
    point = learn_roughness(stretches, nothing.point, LEARNINGS)
    closer = sharpened(stretches, point, policy)
    return [_under(sets, one, [nothing]) for one in ((point,) if closer is point else (closer, point))]


def _searched(sets: Sets, progress: Report) -> Explanation:
    """Screen, fit the leaders and learn the nuisances, until the most probable set repeats itself.

    An interrupt (Ctrl-C, the time limit) ends the search with what is known by then.
    """
    policy, fits, seen, last = sets.policy, 0, set[Key](), None
    try:
        for index in range(policy.rounds):
            progress(index / policy.rounds, leading_words("search", sets.best))
            before = sets.best
            last = (before.key, screen(sets.stretches, before.point))
            _fit_leaders(sets, last[1], before, near=index > 0)
            leader = prune(sets)
            if leader.key not in seen:
                _fit_other_shapes(sets, leader)
            # While a set still grows its noise is that of the largest: a smaller one would pass for more noise.
            best = sets.best if policy.free_body and sets.best.key not in seen else prune(sets)
            fits += sets.count
            if index > 0 and (best.key in seen or has_stalled(sets.stretches, before, best, policy)):
                break
            seen.add(best.key)
            try:
                learnt = _relearned(sets.stretches, best, policy, sharpen=best.key != before.key)
            except np.linalg.LinAlgError:  # what would be learnt leaves nothing that can be solved
                break
            following = _under(sets, learnt, _near(sets, best))
            if not following.found:
                break
            sets = following
    except KeyboardInterrupt as stop:
        rest = tuple(one for one in sets.ranked() if one.causes and one is not sets.best)
        nothing = sets.found.get(frozenset(), sets.best)
        return Explanation(sets.best, nothing, {}, rest, None, tuple(sets.stretches), interrupted=what_ended(stop))
    best = prune(sets)
    return explained(sets, best, fits + sets.count, last[1] if last is not None and best.key == last[0] else None)


def leading_words(stage: str, best: Fit) -> str:
    """Return what a stage of a search says of itself: the most probable set so far."""
    names = [one.family.where.words if isinstance(one.family, LocatedTerm) else one.name for one in best.causes]
    return f"{stage}; leading: {' + '.join(sorted(names))}" if names else stage


def _relearned(stretches: Sequence[Stretch], best: Fit, policy: Policy, *, sharpen: bool) -> Point:
    """Return a point with all nuisance parameters learnt from what a set leaves, until that gains no more.

    The roughness that was learnt without a cause has taken in what that does; each round gives some of it back.
    """
    found = replace(best, point=_reaching(stretches, best.point))
    if not best.causes:  # what nothing leaves is learnt once: a cause may yet explain it
        return _learnt(stretches, found.point, policy, sharpen=sharpen)
    point = best.point
    for _ in range(policy.rounds):
        before = found
        try:
            learnt = _learnt(stretches, found.point, policy)
            found = fit(stretches, learnt, policy, closely=best.point.exact)
        except np.linalg.LinAlgError:  # what was learnt last leaves nothing that can be solved
            found = before
            break
        point = learnt
        if found.log_posterior - before.log_posterior < policy.steady:
            if not sharpen:
                break
            # Knots come last: what the roughness has yet to give back looks like corners of the drive.
            sharpen = False
            closer = sharpened(stretches, found.point, policy)
            if closer is found.point:
                break
            found = fit(stretches, closer, policy, closely=best.point.exact)
    return replace(point, drives=found.point.drives)


def _learnt(stretches: Sequence[Stretch], point: Point, policy: Policy, *, sharpen: bool = False) -> Point:
    """Return the point with roughness, knots if ``sharpen``, noise and residue as its causes and drives leave them."""
    point = learn_roughness(stretches, point, LEARNINGS)
    point = learn_noise(stretches, sharpened(stretches, point, policy) if sharpen else point)
    return point if point.residue is None else with_residue(stretches, point, point.residue.scale)


def _reaching(stretches: Sequence[Stretch], point: Point) -> Point:
    """Return the point with drives that reach as far as its causes ask for: a slow clock, late chips."""
    drives = []
    for stretch, drive in zip(stretches, point.drives, strict=True):
        times = stretch.counted_times(effects_of(point.causes, stretch.model.array, stretch.index))
        drives.append(drive.covering(times))
    return replace(point, drives=tuple(drives))


def _near(sets: Sets, best: Fit) -> list[Fit]:
    """Return the sets that are worth another look under other nuisance parameters."""
    close = [
        one
        for one in sets.ranked()
        if one.log_posterior > best.log_posterior - sets.policy.close and not one.key > best.key
    ]
    return [best, _nothing(sets), *close[: sets.policy.beam - 1]]


def explained(sets: Sets, best: Fit, fits: int, screening: Screening | None = None) -> Explanation:
    """Return the best of some sets with what it is compared with, and a screening about it."""
    without = {
        cause.name: sets.found[best.key - {cause.key}] for cause in best.causes if best.key - {cause.key} in sets.found
    }
    rivals = tuple(one for one in sets.ranked() if one.causes and one.key != best.key)
    nothing = _nothing(sets)
    about = screening if screening is not None else screen(sets.stretches, best.point)
    return Explanation(best, nothing, without, rivals, about, stretches=tuple(sets.stretches), fits=fits)


def _nothing(sets: Sets) -> Fit:
    found = sets.found.get(frozenset())
    if found is None:
        found = sets.fit([replace(sets.best.point, causes=())])[0]
    assert found is not None
    return found


def _under(sets: Sets, base: Point, some: Sequence[Fit]) -> Sets:
    """Fit sets anew under other nuisances."""
    new = Sets(sets.stretches, base, sets.policy)
    points = []
    for one in some:
        drives = tuple(learnt.following(mine) for learnt, mine in zip(base.drives, one.point.drives, strict=True))
        points.append(replace(one.point, drives=drives))
    new.fit(points)
    return new


def _fit_leaders(sets: Sets, screening: Screening, about: Fit, *, near: bool) -> None:
    """Fit the sets that lead in a linear world; ``near`` the best, where it is the true one, only close ones."""
    policy = sets.policy
    blocks = Blocks(screening, policy)
    most = min(max(2, len(about.causes) + 1), policy.most_causes)
    points = []
    candidates = leading_sets(blocks, most, policy)
    least = -policy.worth_a_search  # less than nothing, by more than a linear form may err
    if near and candidates:
        least = max(least, candidates[0].log_odds - policy.close)
    leaders = [one for one in candidates if one.log_odds >= least]
    # With many causes the leaders are far from the point, and what they promise comes true less.
    for members in _about(blocks, about.causes) if policy.free_body else ():
        leaders += grown_sets(blocks, members, policy)
    for candidate in leaders:
        causes = blocks.causes(candidate.members)
        moves = screening.drive_moves(candidate.members, causes)
        drives = tuple(drive.moved(move) for drive, move in zip(about.point.drives, moves, strict=True))
        points.append(replace(about.point, causes=causes, drives=drives))
    sets.fit(points)


def _fit_other_shapes(sets: Sets, best: Fit) -> None:
    """Fit the best set also from other shapes of its effects that look likely: a shape may have many optima."""
    for cause in best.causes:
        others = tuple(other for other in best.causes if other is not cause)
        rest = sets.fit([replace(best.point, causes=others)])[0] if cause.free_shape else None
        if rest is None:
            continue
        screening = screen(sets.stretches, rest.point, only={cause.name})
        blocks = Blocks(screening, sets.policy)
        members = [blocks.nearest(other) for other in rest.causes]
        points = []
        for number in blocks.optima(cause, members)[:STARTS]:
            causes = blocks.causes((*members, number))
            moves = screening.drive_moves((*members, number), causes)
            drives = tuple(drive.moved(move) for drive, move in zip(rest.point.drives, moves, strict=True))
            points.append(replace(rest.point, causes=causes, drives=drives))
        sets.refit(points)


def _about(blocks: Blocks, causes: Sequence[Cause]) -> list[tuple[int, ...]]:
    """Return the hypotheses that a set of causes is, and those of the set without each of them."""
    places = {h.cause.key: number for number, h in reversed(list(enumerate(blocks.hypotheses)))}
    whole = tuple(sorted(places[cause.key] for cause in causes))
    return [whole, *(tuple(m for m in whole if m != member) for member in whole)] if whole else []


def reduced(explanation: Explanation, name: str, policy: Policy) -> Explanation:
    """Return the explanation without one of its causes, the others judged anew."""
    sets = Sets(explanation.stretches, explanation.best.point, policy)
    for one in (explanation.without[name], explanation.nothing):
        sets.found[one.key] = one
    for one in explanation.rivals:
        if name not in one.names:
            sets.found[one.key] = one
    sets.found = {key: one for key, one in sets.found.items() if one.key <= explanation.best.key}
    about = explanation.screening if any(map(is_located, explanation.best.causes)) else None
    return replace(explained(sets, prune(sets), explanation.fits, about), elsewhere=explanation.elsewhere)


def exactly(explanation: Explanation, policy: Policy) -> Explanation:
    """Return the explanation with its best set at its very optimum, where a cause of it remembers the drive for long.

    What sets are compared by stays: it is of the same derivative for all.
    """
    best, stretches = explanation.best, explanation.stretches
    if not any(_remembers(cause, stretches[0]) for cause in best.causes):
        return explanation
    try:
        near = fit(stretches, replace(best.point, exact=True), policy)
        point = learn_noise(stretches, learn_roughness(stretches, near.point))
        found, nothing = fit(stretches, point, policy), fit(stretches, replace(point, causes=(), exact=False), policy)
    except np.linalg.LinAlgError:
        return explanation
    causes = tuple(
        _widened(one, other) if _remembers(one, stretches[0]) else one
        for one, other in zip(found.causes, best.causes, strict=True)
    )
    found = replace(found, point=replace(found.point, causes=causes))
    return replace(explanation, best=_compared_as(found, best), nothing=_compared_as(nothing, explanation.nothing))


def _remembers(cause: Cause, stretch: Stretch) -> bool:
    return memory_of(cause.effect(stretch.model.array, stretch.index)) > 0.0


def _widened(cause: Cause, other: Cause) -> Cause:
    """Return a cause whose uncertainty holds how far it is from another fit of it.

    Whether the drive or a mode oscillates, only the prior of the drive decides, which is learnt beside it: the
    covariance alone is too small.
    """
    apart = cause.coordinates - other.coordinates
    shape_std = {key: float(np.hypot(std, cause.shape[key] - other.shape[key])) for key, std in cause.shape_std.items()}
    return replace(cause, covariance=cause.covariance + np.outer(apart, apart), shape_std=shape_std)


def _compared_as(found: Fit, other: Fit) -> Fit:
    return replace(found, log_evidence=other.log_evidence, log_posterior=other.log_posterior)
