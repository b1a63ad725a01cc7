"""`localise`: where something is wrong that no effect of the library explains, and what it goes with.

Located terms are grown one by one: screened in a linear world, the leaders fitted with the drive, and the best of
these compared under the noise that each of them leaves. Where no dependence serves, the place of an error that is free
in time is found.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.fit.gauss_newton import FEW, Fit, fit
from gfimu.diagnosis.fit.learn import LEARNINGS, learn_noise, learn_roughness, starting_point
from gfimu.diagnosis.fit.linear import Point
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.search.free_time import FreeTime, free_time
from gfimu.diagnosis.search.located_screen import Leader, LocatedScreen
from gfimu.diagnosis.terms.located.policy import LOCATED

__all__ = ["ComparedTerm", "Localised", "localise"]


@dataclass(frozen=True)
class ComparedTerm:
    """A located term that was compared with one that was taken, by the log odds, nats, that each adds."""

    leader: Leader
    log_odds: float


@dataclass(frozen=True)
class Localised:
    """What a search for located terms ended with.

    Parameters
    ----------
    stretches : tuple of Stretch
        The data.
    fit : Fit
        The terms at their optimum, beside no other cause.
    rounds : tuple of tuple of ComparedTerm
        Of each term in the order of their growth: the term that was taken, and those that it was compared with.
    free : tuple of FreeTime
        Places of errors that are free in time beside these terms, best first.
    """

    stretches: tuple[Stretch, ...]
    fit: Fit
    rounds: tuple[tuple[ComparedTerm, ...], ...]
    free: tuple[FreeTime, ...]


def localise(stretches: Sequence[Stretch], policy: Policy) -> Localised:
    """Find the places of the forward model at which unknown functions explain the data best.

    Parameters
    ----------
    stretches : sequence of Stretch
        The data of a table.
    policy : Policy
        Thresholds ``cause_odds``, ``extra_odds`` and ``dominant``.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the reference determines no drive.
    """
    few = replace(policy, steps=FEW)
    point = learn_roughness(stretches, fit(stretches, starting_point(stretches, policy.knots), few).point, LEARNINGS)
    present = fit(stretches, point, few)
    least = _settled(stretches, present, policy).log_posterior
    rounds: list[tuple[ComparedTerm, ...]] = []
    while len(rounds) < LOCATED.terms:
        needed = max(policy.extra_odds, policy.dominant * rounds[0][0].log_odds) if rounds else policy.cause_odds
        compared = _compared(stretches, present, policy)
        if not compared or compared[0][1].log_posterior - least < needed:
            break
        rounds.append(tuple(ComparedTerm(leader, found.log_posterior - least) for leader, found in compared))
        present = compared[0][1]
        least = present.log_posterior
    return Localised(tuple(stretches), present, tuple(rounds), tuple(free_time(stretches, present.point, policy)))


def _compared(stretches: Sequence[Stretch], present: Fit, policy: Policy) -> list[tuple[Leader, Fit]]:
    """Return the leading terms beside those of a fit, each under the noise that it leaves, best first."""
    fitted = []
    for leader in _distinct(LocatedScreen(stretches, present.point).leaders()):
        point = replace(present.point, causes=(*present.causes, leader.cause))
        fitted += _tried(leader, stretches, point, policy)
    fitted.sort(key=lambda pair: -pair[1].log_posterior)
    learnt = []
    for leader, found in fitted[: LOCATED.compared]:
        try:
            learnt.append((leader, _settled(stretches, found, policy)))
        except np.linalg.LinAlgError:  # what would be learnt leaves nothing that can be solved
            continue
    return sorted(learnt, key=lambda pair: -pair[1].log_posterior)


def _tried(leader: Leader, stretches: Sequence[Stretch], point: Point, policy: Policy) -> list[tuple[Leader, Fit]]:
    try:
        found = fit(stretches, point, replace(policy, steps=FEW))
    except np.linalg.LinAlgError:  # a term that can't be solved for describes nothing
        return []
    return [(leader, found)] if np.isfinite(found.log_posterior) else []


def _settled(stretches: Sequence[Stretch], found: Fit, policy: Policy) -> Fit:
    """Return a fit under the roughness and the noise that it leaves."""
    point = learn_noise(stretches, learn_roughness(stretches, found.point))
    return fit(stretches, point, replace(policy, steps=FEW))


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
