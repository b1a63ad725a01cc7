"""`challenge`: named causes against located terms: beside them, and instead of each of them or of all.

Every set is compared under the noise and the roughness that it leaves. A located term that makes the data more
probable joins the set, or takes the place of a named cause; what comes close without winning is a rival.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gfimu.diagnosis.data.body.stretch import BodyStretch
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.fit.gauss_newton import FEW, Fit, fit, linearly_without
from gfimu.diagnosis.fit.learn import learn_noise, learn_roughness
from gfimu.diagnosis.fit.linear import Point, with_residue
from gfimu.diagnosis.fit.random_walk import as_it_walks
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.search.explain import Explanation, Report, explained, leading_words
from gfimu.diagnosis.search.located_screen import Leader, LocatedScreen
from gfimu.diagnosis.search.long_run import spread_over_runs
from gfimu.diagnosis.search.sets import Key, Sets, prune
from gfimu.diagnosis.terms.located.policy import LOCATED
from gfimu.diagnosis.terms.located.term import LocatedTerm, is_located

__all__ = ["Challenged", "challenge", "challenged"]


@dataclass(frozen=True)
class Challenged:
    """What a set of causes became when located terms were compared with it.

    Parameters
    ----------
    best : Fit
        The most probable set, under the noise that it leaves.
    rivals : tuple of Fit
        Other sets with located terms, each under its own noise, best first.
    """

    best: Fit
    rivals: tuple[Fit, ...]


def challenged(explanation: Explanation, policy: Policy, report: Report = lambda share, text: None) -> Explanation:
    """Return an explanation with located terms beside its named causes, or instead of them, where these win.

    Terms are searched in some stretches, up to so many samples of each, and fitted to all.

    Parameters
    ----------
    explanation : Explanation
        What the search of the library ended with.
    policy : Policy
        Thresholds of `challenge`.
    report : callable
        Called with the share done and a line of text.

    Raises
    ------
    numpy.linalg.LinAlgError
        If what the causes leave can't be solved for.
    """
    stretches, best = explanation.stretches, explanation.best
    chosen = spread_over_runs([stretch.index for stretch in stretches], LOCATED.stretches)
    some = [stretches[place] for place in chosen]
    if not isinstance(some[0], BodyStretch):
        some = [replace(one, run=one.run.rows(0, min(len(one.run.t), LOCATED.samples))) for one in some]
    found = challenge(some, _of_part(some, chosen, best.point), policy, report)
    if not any(map(is_located, found.best.causes)):
        others = [
            replace(one, log_posterior=best.log_posterior + _gains(one, found.best))
            for one in found.rivals
            if one.key != best.key
        ]
        rivals = sorted((*explanation.rivals, *others), key=lambda one: -one.log_posterior)
        return replace(explanation, rivals=tuple(rivals))
    levels = tuple(replace(level, walk=found.best.point.levels[0].walk) for level in best.point.levels)
    point = replace(best.point, causes=found.best.causes, levels=levels)
    if best.point.residue is not None:
        point = with_residue(stretches, point, best.point.residue.scale)
    sets = Sets(stretches, learn_noise(stretches, learn_roughness(stretches, point)), policy)
    whole = sets.fit([sets.base])[0]
    if whole is None:
        return explanation
    sets.without_each(whole)
    rivals = [one for one in found.rivals if not one.key > found.best.key]  # the search has refused what these add
    sets.fit([replace(whole.point, causes=one.causes) for one in rivals[: policy.beam]])
    return replace(
        explained(sets, prune(sets), explanation.fits, explanation.screening), elsewhere=explanation.elsewhere
    )


def _of_part(stretches: Sequence[Stretch], chosen: Sequence[int], point: Point) -> Point:
    """Return a point of some stretches, which may be shorter than they were."""
    part = replace(
        point,
        drives=tuple(point.drives[place] for place in chosen),
        levels=tuple(point.levels[place] for place in chosen),
        residue=None,
    )
    return part if point.residue is None else with_residue(stretches, part, point.residue.scale)


def challenge(
    stretches: Sequence[Stretch], point: Point, policy: Policy, report: Report = lambda share, text: None
) -> Challenged:
    """Compare a set of causes with located terms beside it and instead of its members.

    Parameters
    ----------
    stretches : sequence of Stretch
        The data.
    point : Point
        The set at its optimum, with the noise that it leaves.
    policy : Policy
        Thresholds ``cause_odds``, ``extra_odds``, ``close``, ``inexactness`` and ``worth_a_search``.
    report : callable
        Called with the share done and what leads.
    """
    best, nothing = (fit(stretches, replace(point, causes=some), policy) for some in (point.causes, ()))
    is_body = isinstance(stretches[0], BodyStretch)
    leading = best if is_body else max(best, _settled(stretches, best, policy), key=lambda one: one.log_posterior)
    settled = {best.key: leading}
    for round_ in range(LOCATED.terms):
        report(round_ / LOCATED.terms, leading_words("places", leading))
        if is_body:  # the evidence is that of one misfit of the noise, and compares with no other
            settled, nothing = {leading.key: leading}, fit(stretches, replace(leading.point, causes=()), policy)
        leading, fewer = _without_the_idle(stretches, leading, policy)
        settled[leading.key] = leading
        needed = _needed(leading, fewer, nothing, policy)
        tried = _tried(stretches, leading, fewer, needed, policy)
        for one in tried:
            if one.key not in settled:
                try:
                    refined = _refined(stretches, one, policy)
                    settled[one.key] = refined if is_body else _settled(stretches, refined, policy)
                except np.linalg.LinAlgError:  # what would be learnt leaves nothing that can be solved
                    continue
        grown = [one for one in settled.values() if one.key > leading.key and _gains(one, leading) > needed]
        others = [one for one in settled.values() if not one.key >= leading.key and _gains(one, leading) > 0.0]
        if not grown and not others:
            break
        leading = max((*grown, *others), key=lambda one: one.log_posterior)
        if is_body:
            leading = _settled(stretches, leading, policy)
    rivals = sorted((one for one in settled.values() if one is not leading), key=lambda one: -one.log_posterior)
    return Challenged(leading, tuple(rivals))


def _needed(leading: Fit, fewer: Sequence[Fit], nothing: Fit, policy: Policy) -> float:
    """Return the log odds that a term needs beside a set: more than what its causes leave by their inexactness."""
    if not leading.causes:
        return policy.cause_odds
    removed = max(nothing.objective - leading.objective, 0.0)
    lost = {key: _gains(leading, one) for one in fewer if len(key := leading.key - one.key) == 1}
    rough = sum(cause.family.inexactness * max(lost.get(frozenset({cause.key}), 0.0), 0.0) for cause in leading.causes)
    return max(policy.extra_odds + rough, policy.inexactness * removed)


def _gains(one: Fit, other: Fit) -> float:
    return one.log_posterior - other.log_posterior


def _without_the_idle(stretches: Sequence[Stretch], leading: Fit, policy: Policy) -> tuple[Fit, list[Fit]]:
    """Return a set without causes whose loss makes it more probable, and what `_fewer` returns of that."""
    while True:
        fewer = _fewer(stretches, leading, policy)
        best = max(fewer, key=lambda one: one.log_posterior, default=leading)
        if _gains(best, leading) <= 0.0:
            return leading, fewer
        leading = best


def _fewer(stretches: Sequence[Stretch], found: Fit, policy: Policy) -> list[Fit]:
    """Return a set without each of its causes, and without all that are named, under its noise."""
    sets = [tuple(other for other in found.causes if other is not cause) for cause in found.causes]
    if sum(not is_located(cause) for cause in found.causes) > 1:
        sets.append(tuple(filter(is_located, found.causes)))
    few = replace(policy, steps=FEW)
    return [fit(stretches, replace(found.point, causes=causes), few) for causes in sets]


def _tried(
    stretches: Sequence[Stretch], leading: Fit, fewer: Sequence[Fit], needed: float, policy: Policy
) -> list[Fit]:
    """Return fits of a set with located terms, beside it or instead of some of its causes, best first."""
    bases = (leading, *fewer)
    # The odds of a screen are of the linear world about the leading set, so that of a smaller set counts there too.
    linear = [_linearly(leading, one.key, policy) for one in bases]
    missed = [policy.inexactness * (one.objective - leading.objective) for one in linear]
    cases: list[tuple[Key, float]] = [(frozenset(), needed - policy.worth_a_search)]
    for one, share in zip(linear[1:], missed[1:], strict=True):
        cases.append((leading.key - one.key, _gains(leading, one) - max(policy.close, share)))
    screen = LocatedScreen(stretches, leading.point)
    promised = []
    for base, there, share, leaders in zip(bases, linear, missed, screen.leaders_each(cases), strict=True):
        shaped = [screen.refined(one, leading.key - base.key) for one in _first_of_each_shape(leaders)]
        ranked = sorted([*shaped, *leaders], key=lambda one: -one.log_odds)
        others = [one for one in _distinct(ranked) if one.cause.key not in leading.key]
        promised += [(there.log_posterior + leader.log_odds - share, leader, base) for leader in others]
    promised.sort(key=lambda one: -one[0])
    fitted: list[Fit] = []
    for _, leader, base in promised[: LOCATED.fitted]:
        cause = screen.refined(leader, leading.key - base.key).cause
        tried = _fitted(stretches, replace(base.point, causes=(*base.causes, cause)), policy)
        fitted += [one for one in tried if base is leading or _says_more(one, leading, base, policy)]
    fitted.sort(key=lambda one: -one.log_posterior)
    return fitted[: LOCATED.compared]


def _linearly(leading: Fit, key: Key, policy: Policy) -> Fit:
    """Return what a leading fit would be with only some of its causes, in the linear world about it."""
    found = leading
    for cause in leading.causes:
        if cause.key not in key:
            found = linearly_without(found, next(one for one in found.causes if one.key == cause.key), policy)
    return found


def _says_more(one: Fit, leading: Fit, base: Fit, policy: Policy) -> bool:
    """Whether a set has fewer causes or numbers than a leading one, or fits better; else it is the same without a name.

    It fits better by more than what the inexactness of the named causes leaves that it replaces, those not in ``base``.
    """
    if all(is_located(cause) for cause in leading.causes if cause.key not in base.key):
        return True
    count, most = (sum(len(cause.coordinates) for cause in fit.causes) for fit in (one, leading))
    inexact = policy.inexactness * (base.objective - leading.objective)
    simpler = count < most or len(one.causes) < len(leading.causes)
    return simpler or leading.objective - one.objective > 2.0 * max(policy.cause_odds, inexact)


def _fitted(stretches: Sequence[Stretch], point: Point, policy: Policy) -> list[Fit]:
    try:
        found = fit(stretches, point, replace(policy, steps=FEW))
    except np.linalg.LinAlgError:  # a term that can't be solved for describes nothing
        return []
    return [found] if np.isfinite(found.log_posterior) else []


def _refined(stretches: Sequence[Stretch], found: Fit, policy: Policy) -> Fit:
    """Return a fit whose last term has the most probable frequency, damping or order about it."""
    *others, last = found.causes
    if not isinstance(last.family, LocatedTerm) or not last.family.dependence.near(1.0):
        return found
    screen = LocatedScreen(stretches, found.point)
    leader = screen.refined(Leader(-np.inf, last.family, last), frozenset({last.key}))
    again = _fitted(stretches, replace(found.point, causes=(*others, leader.cause)), policy)
    return max([found, *again], key=lambda one: one.log_posterior)


def _settled(stretches: Sequence[Stretch], found: Fit, policy: Policy) -> Fit:
    """Return a fit under the roughness and the noise that it leaves, a random walk of the biases learnt anew too."""
    point = learn_roughness(stretches, found.point)
    if point.levels[0].walk > 0.0 and stretches[0].first_levels.walk == 0.0:
        point = as_it_walks(stretches, point, policy)
    return fit(stretches, learn_noise(stretches, point), replace(policy, steps=FEW))


def _first_of_each_shape(leaders: Sequence[Leader]) -> list[Leader]:
    """Return the best step, wave or mode, of each that has a shape: between those that are tried it may be better."""
    first: dict[str, Leader] = {}
    for leader in leaders:
        if leader.term.dependence.near(1.0):
            first.setdefault(leader.term.dependence.kind, leader)
    return list(first.values())


def _distinct(leaders: Sequence[Leader]) -> list[Leader]:
    """Return the leaders that differ in place, pattern or kind of dependence, and are not far behind."""
    found: dict[tuple[str, ...], Leader] = {}
    for leader in leaders:
        where, dependence = leader.term.where, leader.term.dependence
        best = leaders[0].log_odds
        if leader.log_odds < min(best - LOCATED.behind, 0.5 * best) or len(found) == LOCATED.fitted:
            break
        found.setdefault((where.name, where.what, leader.term.pattern, dependence.kind), leader)
    return list(found.values())
