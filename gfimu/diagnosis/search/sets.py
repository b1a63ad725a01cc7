"""Sets of causes and their fits under the same nuisance parameters: fitted once each, ranked, pruned."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.fit.gauss_newton import FEW, Fit, fit, is_rough, linearly_without
from gfimu.diagnosis.fit.learn import learn_roughness
from gfimu.diagnosis.fit.linear import Point
from gfimu.diagnosis.fit.parallel import each_apart
from gfimu.diagnosis.fit.posterior import remembers_long
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.terms.cause import ALIKE, Cause, effects_of

__all__ = ["Key", "Sets", "excess", "has_stalled", "prune"]

_FAR = 10.0  # numerical: times `Policy.close`
Key = frozenset[tuple[str, str]]
"""Effects and places of the causes of a set."""


class Sets:
    """Fits of sets of causes under the same nuisances; each set is fitted once."""

    def __init__(self, stretches: Sequence[Stretch], base: Point, policy: Policy) -> None:
        self.stretches, self.base, self.policy = stretches, base, policy
        self.found: dict[Key, Fit] = {}
        self.count = 0

    def fit(self, points: Sequence[Point]) -> list[Fit | None]:
        """Fit the causes and drives of points under the base's noise; a point that can't be fitted gives None."""
        new = {_key(point.causes): point for point in points if _key(point.causes) not in self.found}
        self.count += len(new)
        each_apart(self._roughly, list(new.values()), keep=lambda one: self._keep([one]))
        # What remembers the drive for long is dear to fit closely: the leader of its kind alone.
        rough = [one for key in new if (one := self.found.get(key)) is not None and self._is_worth_it(one)]
        self._keep([self._closely(max(rough, key=_posterior))] if rough else [])
        return [self.found.get(_key(point.causes)) for point in points]

    def without_each(self, found: Fit) -> list[Fit | None]:
        """Fit a set without each of its causes; what is far behind in the linear world about it need not be fitted."""
        missing = [cause for cause in found.causes if found.key - {cause.key} not in self.found]
        for cause in missing:
            fewer = linearly_without(found, cause, self.policy)
            if found.log_posterior - fewer.log_posterior > _FAR * self.policy.close:
                self._keep([fewer])
        return self.fit([_less(found, cause) for cause in found.causes])

    def _keep(self, fits: Sequence[Fit | None]) -> None:
        self.found |= {one.key: one for one in fits if one is not None}

    def _roughly(self, point: Point, policy: Policy | None = None) -> Fit | None:
        """Fit with the derivative that the point has; unless that is exact, without what remembers for long."""
        try:
            point = replace(point, levels=self.base.levels, residue=self.base.residue)
            return self._own_roughness(fit(self.stretches, point, policy or self.policy, closely=False))
        except (np.linalg.LinAlgError, ValueError):
            return None

    def _is_worth_it(self, found: Fit) -> bool:
        """Whether a fit is rough, and details of what a mode remembers can matter.

        They can't where the mode reduces the residual little, nor where the residual is far above the noise.
        """
        if not is_rough(self.stretches, found):
            return False
        array = self.stretches[0].model.array
        short = [cause for cause in found.causes if not remembers_long(effects_of([cause], array, 0))]
        without = self.found.get(_key(short))
        if without is not None and has_stalled(self.stretches, without, found, self.policy):
            return False
        nothing = self.found.get(frozenset())
        allowed = self.policy.usual_excess
        if nothing is not None:
            allowed = max(allowed, self.policy.small * excess(self.stretches, nothing))
        return excess(self.stretches, found) < allowed

    def _closely(self, found: Fit) -> Fit | None:
        try:
            return self._own_roughness(fit(self.stretches, found.point, self.policy))
        except (np.linalg.LinAlgError, ValueError):
            return None

    def _own_roughness(self, found: Fit) -> Fit:
        """Learn the roughness of the drives anew where a mode may have made it: that favours what came before."""
        if not found.point.exact:
            return found
        point = learn_roughness(self.stretches, found.point)
        again = fit(self.stretches, replace(point, residue=self.base.residue), self.policy)
        return max(found, again, key=_posterior)

    def refit(self, points: Sequence[Point]) -> None:
        """Fit a set again from other starts, and keep what is more probable; a start that leads back is left there."""
        first = replace(self.policy, steps=FEW)
        looks = each_apart(lambda point: self._roughly(replace(point, exact=False), first), points)
        others = [look for look in looks if look is not None and not _is_alike(look, self.found[look.key])]
        # What leads after a few steps is followed to its optimum.
        again = self._roughly(max(others, key=_posterior).point, self.policy) if others else None
        fits = [one for one in (again,) if one is not None and not _is_alike(one, self.found[one.key])]
        self.count += len(others)
        rough = [one for one in fits if self._is_worth_it(one)]
        closely = self._closely(max(rough, key=_posterior)) if rough else None
        for one in (*fits, closely):
            if one is not None and one.log_posterior > self.found[one.key].log_posterior:
                self.found[one.key] = one

    @property
    def best(self) -> Fit:
        """The most probable of all."""
        return max(self.found.values(), key=_posterior)

    def ranked(self) -> list[Fit]:
        """All, most probable first."""
        return sorted(self.found.values(), key=_posterior, reverse=True)


def excess(stretches: Sequence[Stretch], found: Fit) -> float:
    """Return the squares that a fit leaves, over those that noise leaves, less one."""
    return found.objective / sum(stretch.observations for stretch in stretches) - 1.0


def has_stalled(stretches: Sequence[Stretch], before: Fit, after: Fit, policy: Policy) -> bool:
    """Whether a search has stalled: a fit leaves far more than noise, and little less than the one before it.

    Of a body in the hand every cause may be a small share of what real chips disagree about.
    """
    left = excess(stretches, after)
    return not policy.free_body and left > max(policy.usual_excess, (1.0 - policy.small) * excess(stretches, before))


def _key(causes: Sequence[Cause]) -> Key:
    return frozenset(cause.key for cause in causes)


def _is_alike(one: Fit, other: Fit) -> bool:
    """Whether two fits of a set ended at the same optimum over the shapes of its causes."""
    mine = {cause.key: cause for cause in other.causes}
    return all(cause.apart(mine[cause.key]) < ALIKE for cause in one.causes)


def _posterior(found: Fit) -> float:
    return found.log_posterior


def prune(sets: Sets) -> Fit:
    """Return the most probable set, without causes that the data support too weakly.

    A cause whose model is known to be inexact leaves a share of what it explains: others must bring more than that.
    """
    best = sets.best
    while best.causes:
        without = sets.without_each(best)
        lost = np.array([np.inf if one is None else best.log_posterior - one.log_posterior for one in without])
        weakest = int(np.argmin(lost))
        needed = sets.policy.cause_odds
        if len(best.causes) > 1:
            left = [cause.family.inexactness * max(by, 0.0) for cause, by in zip(best.causes, lost, strict=True)]
            needed = sets.policy.extra_odds + sum(part for index, part in enumerate(left) if index != weakest and part)
        fewer = without[weakest]
        if fewer is None or lost[weakest] >= needed:
            return best
        best = fewer
    return best


def _less(found: Fit, cause: Cause) -> Point:
    return replace(found.point, causes=tuple(other for other in found.causes if other is not cause))
