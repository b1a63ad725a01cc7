"""The search for causes on a free body: screen, take the best set and its sizes, relearn the noise, until settled.

Every screening linearises the full simulation about the causes found so far, so that repeating it is Gauss–Newton on
the sizes of the causes, and every set is compared on the same normal equations.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.fit.evidence import SCALES
from gfimu.diagnosis.fit.gauss_newton import SETTLED
from gfimu.diagnosis.free_body.screening import BodyScreening, Known, plan_signatures, screen, signature_columns
from gfimu.diagnosis.free_body.segment import BodySegment
from gfimu.diagnosis.free_body.undetermined import LEAST_INFORMATION, determined
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.search.beam import Blocks, leading_sets
from gfimu.diagnosis.search.comparison import Comparison
from gfimu.diagnosis.terms.cause import SMALLEST_POSITIVE, Cause, effects_of
from gfimu.world_model import EffectFamily

__all__ = ["BodyFit", "Sets", "explain", "learn_noise", "reduced"]

Report = Callable[[float, str], None]
Members = tuple[int, ...]

_SEARCHED = 3  # numerical: causes up to which sets are searched for from scratch
_GROWN = 3  # numerical: best effects that each set is grown by
_UPHILL = 2.0  # numerical: χ² by which a step that the linear form promised may go uphill


@dataclass(frozen=True)
class BodyFit:
    """A set of causes at its optimum.

    Parameters
    ----------
    causes : tuple of Cause
        With coordinates and covariance.
    log_posterior : float
        Log posterior probability, up to a constant common to all sets of a screening.
    objective : float
        Sum of squares, nuisance parameters eliminated.
    """

    causes: tuple[Cause, ...]
    log_posterior: float
    objective: float

    @property
    def names(self) -> frozenset[str]:
        """Names of the effects."""
        return frozenset(cause.name for cause in self.causes)

    @property
    def key(self) -> frozenset[tuple[str, str]]:
        """Effects and places, which identify the set."""
        return frozenset(cause.key for cause in self.causes)


class Sets:
    """Sets of hypotheses on the normal equations of one screening.

    Parameters
    ----------
    screening : BodyScreening
        The normal equations.
    policy : Policy
        Thresholds ``body_causes``, ``extra_cause``, ``cause_odds`` and ``extra_odds``.
    """

    def __init__(self, screening: BodyScreening, policy: Policy) -> None:
        self.screening, self.policy = screening, policy
        self.blocks = Blocks(screening, policy)
        self.hypotheses = screening.hypotheses
        self._places = {h.cause.key: number for number, h in reversed(list(enumerate(self.hypotheses)))}

    def members(self, causes: Sequence[Cause]) -> Members:
        """Return the numbers of the hypotheses that causes are."""
        return tuple(sorted(self._places[cause.key] for cause in causes))

    def key(self, members: Members) -> frozenset[tuple[str, str]]:
        """Return effects and places of a set."""
        return frozenset(self.hypotheses[number].cause.key for number in members)

    def odds(self, members: Members) -> float:
        """Return the log odds of a set against nothing."""
        return self.blocks.log_odds(members) if members else 0.0

    def fit(self, members: Members) -> BodyFit:
        """Return a set at its best sizes."""
        screening = self.screening
        nothing = -0.5 * screening.nothing / screening.misfit
        if not members:
            return BodyFit((), nothing, screening.nothing)
        gram, score, positive = self.blocks.system(members)
        values, covariance = _seen(gram, score)
        values = np.where(positive, np.maximum(values, SMALLEST_POSITIVE), values)
        chosen = [self.hypotheses[number].cause for number in members]
        places = np.split(np.arange(len(values)), np.cumsum([len(cause.coordinates) for cause in chosen])[:-1])
        causes = tuple(
            replace(cause, coordinates=values[mine], covariance=covariance[np.ix_(mine, mine)])
            for cause, mine in zip(chosen, places, strict=True)
        )
        objective = screening.nothing - screening.misfit * float(2.0 * score @ values - values @ gram @ values)
        return BodyFit(causes, nothing + self.odds(members), objective)

    def pruned(self, members: Members) -> Members:
        """Drop effects that the data hardly ask for."""
        while members:
            own = self.odds(members)
            rests = [tuple(m for m in members if m != member) for member in members]
            odds = [self.odds(rest) for rest in rests]
            weakest = int(np.argmax(odds))
            needed = self.policy.cause_odds if len(members) == 1 else self.policy.extra_odds
            if own - odds[weakest] >= needed:
                break
            members = rests[weakest]
        return members

    def candidates(self, members: Members) -> list[tuple[Members, float]]:
        """Return sets, best first: small ones from scratch; larger ones grown, moved or exchanged one at a time."""
        sets: dict[Members, float] = {members: self.odds(members)}
        if len(members) < _SEARCHED:
            found = leading_sets(self.blocks, min(len(members) + 2, _SEARCHED), self.policy)
            sets |= {tuple(sorted(one.members)): one.log_odds for one in found}
        for rest in [members, *(tuple(m for m in members if m != member) for member in members)]:
            if not members or len(rest) >= self.policy.body_causes:
                continue
            for number in self._best_partners(rest):
                grown = tuple(sorted((*rest, number)))
                if grown not in sets:
                    sets[grown] = self.odds(grown)
        whole = {some: odds for some, odds in sets.items() if not self._nested(some)}
        return sorted(whole.items(), key=lambda one: -one[1])

    def _best_partners(self, members: Members) -> list[int]:
        """Return the effects that add most to a set, each at its best place and shape."""
        names = [h.cause.name for h in self.hypotheses]
        taken = {names[number] for number in members}
        found: dict[str, int] = {}
        for number in np.argsort(-self.blocks.log_odds_each(members)):
            if names[number] not in taken:
                found.setdefault(names[number], int(number))
            if len(found) == _GROWN:
                break
        return list(found.values())

    def _nested(self, members: Members) -> bool:
        """Tell whether one effect of a set can do all that another does: both together mean nothing."""
        families = [self.hypotheses[number].cause.family for number in members]
        names = {str(family.name) for family in families}
        return any(names & getattr(family, "contained_in", frozenset()) for family in families)


def _seen(gram: NDArray[np.float64], score: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the sizes and their covariance: zero along what the data don't determine, with the spread of the prior.

    What all chips share of a displacement or a turn, a free body takes for its own.
    """
    strength, turn, seen = determined(gram)
    gain = np.where(seen, 1.0 / (np.maximum(strength, LEAST_INFORMATION) + 1.0 / SCALES[-1] ** 2), 0.0)
    return (turn * gain) @ (turn.T @ score), (turn * np.where(seen, gain, 1.0)) @ turn.T


def learn_noise(segments: Sequence[BodySegment], causes: Sequence[Cause], fixed: Known) -> None:
    """Learn the noise of every segment again from what causes leave."""
    for segment, known in zip(segments, fixed, strict=True):
        effects = [*known, *effects_of(causes, segment.model.array, segment.index)]
        segment.learn_noise(segment.linearise(effects))
        line = segment.linearise(effects)
        # What a pose decides must not pass for slow noise before its cause is found.
        constant = plan_signatures([segment], causes, _is_of_pose)
        columns = signature_columns(segment, constant, causes, known, line)
        segment.learn_flicker(line, np.hstack([columns, segment.motion_columns(effects, line)]))


def _is_of_pose(family: EffectFamily) -> bool:
    return bool(getattr(family, "of_pose", False))


def explain(
    segments: Sequence[BodySegment], fixed: Known, policy: Policy, *, report: Report | None = None
) -> Comparison[BodyFit]:
    """Find the most probable set of causes.

    Parameters
    ----------
    segments : sequence of BodySegment
        The runs.
    fixed : sequence of sequence of Effect
        Effects known beforehand, per run.
    policy : Policy
        Thresholds.
    report : callable, optional
        Called with the share done and a line of text.
    """
    tell = report or (lambda share, text: None)
    learn_noise(segments, (), fixed)
    causes: tuple[Cause, ...] = ()
    base: tuple[BodyScreening, tuple[Cause, ...]] | None = None
    refused: set[frozenset[tuple[str, str]]] = set()
    stable = False
    for number in range(policy.body_rounds):
        tell(0.05 + 0.8 * number / policy.body_rounds, f"search {number + 1}")
        screening = screen(segments, causes, fixed)
        if base is not None and not screening.objective <= base[0].objective + _UPHILL * screening.misfit:
            # The linear form promised what the simulation does not keep.
            refused.add(frozenset(cause.key for cause in causes))
            screening, causes = base
        sets = Sets(screening, policy)
        members = sets.members(causes)
        chosen = _best(sets, members, refused)
        fit = sets.fit(chosen)
        moved = (screening.objective - fit.objective) / screening.misfit
        base = (screening, causes)
        same = set(chosen) == set(members)
        if same and stable and moved < SETTLED * max(len(causes), 1):
            break
        causes = fit.causes
        if same or number in {1, 3}:
            learn_noise(segments, causes, fixed)
            base = None
        stable = same
    tell(0.85, "compare")
    return _compared(screen(segments, causes, fixed), causes, policy)


def _best(sets: Sets, members: Members, refused: Collection[frozenset[tuple[str, str]]]) -> Members:
    """Return the best set in reach of a set, pruned, but none of those refused."""
    for candidate, odds in sets.candidates(members):
        best = sets.pruned(candidate) if odds > 0 else ()
        if sets.key(best) not in refused:
            return best
    return members


def _compared(screening: BodyScreening, causes: Sequence[Cause], policy: Policy) -> Comparison[BodyFit]:
    """Put beside a set what is left without each cause, and its rivals."""
    sets = Sets(screening, policy)
    members = sets.pruned(sets.members(causes))
    best, nothing = sets.fit(members), sets.fit(())
    without = {
        sets.hypotheses[member].cause.name: sets.fit(tuple(m for m in members if m != member)) for member in members
    }
    near = [chosen for chosen, _ in sets.candidates(members)][: 3 * policy.beam]
    # The set with one more effect is no rival: that effect was not worth its while.
    fits = [sets.fit(chosen) for chosen in near if chosen and not set(chosen) >= set(members)]
    close = {fit.key: fit for fit in fits if fit.log_posterior > best.log_posterior - policy.close}
    rivals = tuple(sorted(close.values(), key=lambda fit: -fit.log_posterior)[: policy.beam])
    return Comparison(best, nothing, without, rivals, screening)


def reduced(
    segments: Sequence[BodySegment], causes: Sequence[Cause], fixed: Known, name: str, policy: Policy
) -> Comparison[BodyFit]:
    """Fit what is left of a set when one cause is withdrawn."""
    kept = tuple(cause for cause in causes if cause.name != name)
    for _ in range(2):
        sets = Sets(screen(segments, kept, fixed), policy)
        kept = sets.fit(sets.members(kept)).causes
    return _compared(screen(segments, kept, fixed), kept, policy)
