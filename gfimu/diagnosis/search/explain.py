"""`explain`: the most probable set of causes. Screen, fit the leaders, learn the nuisances, until nothing changes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp

from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.fit.gauss_newton import Fit, fit
from gfimu.diagnosis.fit.learn import learn_noise, learn_roughness, starting_point
from gfimu.diagnosis.fit.linear import Point
from gfimu.diagnosis.parallel import each_apart
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.search.beam import Blocks, leading_sets
from gfimu.diagnosis.search.screening import Screening, screen
from gfimu.diagnosis.terms.cause import Cause

__all__ = ["Explanation", "explain"]

Report = Callable[[float, str], None]
_Key = frozenset[tuple[str, str]]


@dataclass(frozen=True)
class Explanation:
    """What a search ended with.

    Parameters
    ----------
    best : Fit
        The most probable set.
    nothing : Fit
        No cause at all, under the same nuisances.
    without : dict of str to Fit
        The best fit without each cause.
    rivals : tuple of Fit
        Other sets, best first, under the same nuisances.
    screening : Screening
        The last one, about the best set.
    stretches : tuple of Stretch
        The data.
    """

    best: Fit
    nothing: Fit
    without: dict[str, Fit]
    rivals: tuple[Fit, ...]
    screening: Screening
    stretches: tuple[Stretch, ...] = ()
    fits: int = 0
    screenings: int = 0


class _Sets:
    """Fits of sets of causes under the same nuisances; each set is fitted once."""

    def __init__(self, stretches: Sequence[Stretch], base: Point, policy: Policy) -> None:
        self.stretches, self.base, self.policy = stretches, base, policy
        self.found: dict[_Key, Fit] = {}
        self.count = 0

    def fit(self, points: Sequence[Point]) -> list[Fit | None]:
        """Fit the causes and drives of points under the base's noise; a point that can't be fitted gives None."""

        def one(point: Point) -> Fit | None:
            try:
                point = replace(point, levels=self.base.levels, residue=self.base.residue)
                return fit(self.stretches, point, self.policy)
            except (np.linalg.LinAlgError, ValueError):
                return None

        new = {_key(point.causes): point for point in points if _key(point.causes) not in self.found}
        self.count += len(new)
        for key, found in zip(new, each_apart(one, list(new.values())), strict=True):
            if found is not None:
                self.found[key] = found
        return [self.found.get(_key(point.causes)) for point in points]

    @property
    def best(self) -> Fit:
        """The most probable of all."""
        return max(self.found.values(), key=_posterior)

    def ranked(self) -> list[Fit]:
        """All, most probable first."""
        return sorted(self.found.values(), key=_posterior, reverse=True)


def _key(causes: Sequence[Cause]) -> _Key:
    return frozenset(cause.key for cause in causes)


def _posterior(found: Fit) -> float:
    return found.log_posterior


def explain(stretches: Sequence[Stretch], policy: Policy, report: Report | None = None) -> Explanation:
    """Find the most probable set of causes.

    Parameters
    ----------
    stretches : sequence of Stretch
        The data.
    policy : Policy
        Thresholds.
    report : callable, optional
        Called with the share done and a line of text.
    """
    tell = report or (lambda share, text: None)
    tell(0.05, "drive")
    sets = _Sets(stretches, starting_point(stretches, policy.knots), policy)
    nothing = sets.fit([sets.base])[0]
    assert nothing is not None
    sets = _under(sets, learn_roughness(stretches, nothing.point, policy.learnings), [nothing])
    fits = screenings = 0
    screening, about = None, None
    for number in range(policy.rounds):
        tell(0.1 + 0.8 * number / policy.rounds, f"search {number + 1}")
        before = sets.best
        screening, about = screen(stretches, before.point), before
        screenings += 1
        _fit_leaders(sets, screening, before)
        best = prune(sets)
        same = best.key == before.key
        fits += sets.count
        if same and number > 0:
            break
        learnt = learn_noise(stretches, learn_roughness(stretches, best.point, policy.learnings))
        ranked = sets.ranked()
        close = [one for one in ranked if one.log_posterior > best.log_posterior - policy.close]
        sets = _under(sets, learnt, [best, _nothing(sets), *close[: policy.rivals + 1]])
    best = prune(sets)
    fits += sets.count
    without = {
        cause.name: sets.found[best.key - {cause.key}] for cause in best.causes if best.key - {cause.key} in sets.found
    }
    if about is not best or screening is None:
        screening = screen(stretches, best.point)
        screenings += 1
    rivals = tuple(one for one in sets.ranked() if one.causes and one.key != best.key)
    return Explanation(best, _nothing(sets), without, rivals, screening, tuple(stretches), fits, screenings)


def _nothing(sets: _Sets) -> Fit:
    found = sets.found.get(frozenset())
    if found is None:
        found = sets.fit([replace(sets.best.point, causes=())])[0]
    assert found is not None
    return found


def _under(sets: _Sets, base: Point, some: Sequence[Fit]) -> _Sets:
    """Fit sets anew under other nuisances."""
    new = _Sets(sets.stretches, base, sets.policy)
    points = []
    for one in some:
        if sets.policy.own_roughness:
            drives = learn_roughness(sets.stretches, replace(one.point, levels=base.levels), 1).drives
        else:
            drives = tuple(
                replace(learnt, coefficients=mine.coefficients)
                for learnt, mine in zip(base.drives, one.point.drives, strict=True)
            )
        points.append(replace(one.point, drives=drives))
    new.fit(points)
    return new


def _fit_leaders(sets: _Sets, screening: Screening, about: Fit) -> None:
    policy = sets.policy
    blocks = Blocks(screening, policy)
    most = min(max(2, len(about.causes) + 1), policy.most_causes)
    points = []
    for candidate in leading_sets(blocks, most, policy)[: policy.beam]:
        causes = blocks.causes(candidate.members)
        moves = screening.drive_moves(candidate.members, causes)
        drives = tuple(drive.moved(move) for drive, move in zip(about.point.drives, moves, strict=True))
        points.append(replace(about.point, causes=_started(causes), drives=drives))
    sets.fit(points)


def _started(causes: tuple[Cause, ...]) -> tuple[Cause, ...]:
    return causes


def prune(sets: _Sets) -> Fit:
    """Return the most probable set, without causes that the data hardly ask for."""
    best = sets.best
    while best.causes:
        rest = [
            replace(best.point, causes=tuple(other for other in best.causes if other is not cause))
            for cause in best.causes
        ]
        fewer = [one for one in sets.fit(rest) if one is not None]
        top = max(fewer, key=_posterior, default=None)
        needed = sets.policy.cause_odds if len(best.causes) == 1 else sets.policy.extra_odds
        if top is None or best.log_posterior - top.log_posterior >= needed:
            return best
        best = top
    return best


def probabilities(explanation: Explanation, policy: Policy) -> dict[str, float]:
    """Return the probability of each effect to be among the causes, over all sets that were fitted."""
    fits = {one.key: one for one in (*explanation.rivals, *explanation.without.values(), explanation.nothing)}
    fits[explanation.best.key] = explanation.best
    weight = np.array([one.log_posterior for one in fits.values()]) / policy.temperature
    weight = np.exp(weight - logsumexp(weight))
    names = frozenset().union(*(one.names for one in fits.values()))
    return {name: float(sum(w for w, one in zip(weight, fits.values(), strict=True) if name in one.names)) for name in names}
