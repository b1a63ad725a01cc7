"""The beam: sets of hypotheses scored on the normal equations of a screening, grown one effect at a time."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from gfimu.diagnosis.fit.evidence import SCALES, inverse, log_evidence, log_evidence_each, posterior
from gfimu.diagnosis.fit.gauss_newton import determined
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.search.screening import Hypothesis, Screening
from gfimu.diagnosis.terms.cause import ALIKE, Cause

__all__ = ["STARTS", "Blocks", "Candidate", "grown_sets", "leading_sets", "promise"]

_GROWN = 3  # numerical: best effects by which a set is grown
_FRONT, _PARTNERS = 8, 30  # numerical: sets that are grown, and how many of the best partners of each are scored
STARTS = 3  # numerical: optima over the shapes of an effect from which the best set is fitted again


@dataclass(frozen=True)
class Candidate:
    """A set of hypotheses with its log odds against nothing."""

    log_odds: float
    members: tuple[int, ...]


class Blocks:
    """The normal equations of a screening by hypothesis."""

    def __init__(self, screening: Screening, policy: Policy) -> None:
        self.screening, self.hypotheses, self._policy = screening, screening.hypotheses, policy
        self._one = np.array([len(h.positive) == 1 for h in self.hypotheses])
        # The one-dimensional hypotheses in the columns, shape (P, count).
        self._mixing = np.zeros((len(screening.score), int(self._one.sum())))
        for index, number in enumerate(np.flatnonzero(self._one)):
            hypothesis = self.hypotheses[number]
            self._mixing[hypothesis.signature.columns, index] = hypothesis.cause.mixing[:, 0]
        self._signs = np.array([bool(h.positive[0]) for h in self.hypotheses])[self._one]
        self.log_prior = np.array([h.cause.log_prior for h in self.hypotheses])

    def _in_columns(self, members: Sequence[int]) -> tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.bool_]]:
        chosen = [self.hypotheses[number] for number in members]
        columns = np.concatenate([h.signature.columns for h in chosen])
        mixing = block_diag(*[h.cause.mixing for h in chosen])
        return columns, np.asarray(mixing), np.concatenate([h.positive for h in chosen])

    def system(self, members: Sequence[int]) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
        """Return G, b and the signs of a set."""
        columns, mixing, positive = self._in_columns(members)
        gram = mixing.T @ self.screening.gram[np.ix_(columns, columns)] @ mixing
        return 0.5 * (gram + gram.T), mixing.T @ self.screening.score[columns], positive

    def log_odds(self, members: Sequence[int]) -> float:
        """Return log evidence plus log prior of a set."""
        prior = float(self.log_prior[list(members)].sum()) + self._policy.extra_cause * (len(members) - 1)
        return log_evidence(*self.system(members)) + prior

    def log_odds_each(self, members: Sequence[int] = ()) -> NDArray[np.float64]:
        """Return the log odds that every hypothesis adds to a set whose sizes are integrated out."""
        gram, score = self.screening.gram, self.screening.score
        if members:
            columns, mixing, _ = self._in_columns(members)
            inner, right, _ = self.system(members)
            left = gram[:, columns] @ mixing  # (P, k)
            gain = inverse(inner + np.eye(len(right)) / SCALES[-1] ** 2) @ left.T
            gram, score = gram - left @ gain, score - gain.T @ right
        values = np.empty(len(self.hypotheses))
        information = np.einsum("pk,pk->k", self._mixing, gram @ self._mixing)
        values[self._one] = log_evidence_each(np.maximum(information, 0.0), self._mixing.T @ score, self._signs)
        for number in np.flatnonzero(~self._one):
            hypothesis = self.hypotheses[number]
            columns, mixing = hypothesis.signature.columns, hypothesis.cause.mixing
            part = mixing.T @ gram[np.ix_(columns, columns)] @ mixing
            values[number] = log_evidence(0.5 * (part + part.T), mixing.T @ score[columns], hypothesis.positive)
        return values + self.log_prior

    def causes(self, members: Sequence[int]) -> tuple[Cause, ...]:
        """Return a set at its linear estimates."""
        gram, score, positive = self.system(members)
        mean, _ = posterior(gram, score, SCALES[-1])
        if self._policy.least_information:  # what is not determined stays at zero
            _, turn, seen = determined(gram, self._policy.least_information)
            mean = turn[:, seen] @ (turn[:, seen].T @ mean)
        mean = np.where(positive, np.maximum(mean, 1e-3), mean)
        ends = np.cumsum([len(self.hypotheses[number].positive) for number in members])[:-1]
        return tuple(
            self.hypotheses[number].cause.at(part) for number, part in zip(members, np.split(mean, ends), strict=True)
        )

    def nearest(self, cause: Cause) -> int:
        """Return the hypothesis nearest to a cause: the same effect and place, the most similar shape."""
        same = [index for index, hypothesis in enumerate(self.hypotheses) if hypothesis.cause.key == cause.key]
        return min(same, key=lambda number: self.hypotheses[number].cause.apart(cause))

    def optima(self, cause: Cause, rest: Sequence[int]) -> list[int]:
        """Return hypotheses of the effect and place of a cause that are optima over its shapes beside others.

        The best is the first.
        """
        odds = self.log_odds_each(rest)
        same = [index for index, hypothesis in enumerate(self.hypotheses) if hypothesis.cause.key == cause.key]
        same.sort(key=lambda number: -odds[number])
        causes = [self.hypotheses[number].cause for number in same]
        optimal = [all(mine.apart(other) > ALIKE for other in causes[:place]) for place, mine in enumerate(causes)]
        return [number for number, is_optimum in zip(same, optimal, strict=True) if is_optimum]


def leading_sets(blocks: Blocks, most: int, policy: Policy) -> list[Candidate]:
    """Return the most probable sets of up to ``most`` effects in a linear world, one per set of names, best first."""
    alone = blocks.log_odds_each()
    every = [Candidate(float(alone[number]), (int(number),)) for number in np.argsort(-alone)]
    front = list(islice(_distinct(every, blocks.hypotheses), _FRONT))
    names = [h.cause.name for h in blocks.hypotheses]
    for _ in range(1, most):
        grown: dict[tuple[int, ...], Candidate] = {}
        for candidate in front:
            taken = {names[number] for number in candidate.members}
            added = blocks.log_odds_each(candidate.members)
            for number in np.argsort(-added)[:_PARTNERS]:
                members = tuple(sorted((*candidate.members, int(number))))
                if names[number] in taken or (policy.free_body and _nested(blocks.hypotheses, members)):
                    continue
                if members not in grown:
                    grown[members] = Candidate(blocks.log_odds(members), members)
        larger = sorted(grown.values(), key=lambda one: -one.log_odds)
        every += larger
        front = list(islice(_distinct(larger, blocks.hypotheses), policy.beam))
    if not policy.free_body:  # whose sets grow from the present one
        every += _exchanged(blocks, max(every, key=lambda one: one.log_odds).members)
    every.sort(key=lambda one: -one.log_odds)
    worth = (one for one in _distinct(every, blocks.hypotheses) if _is_worth(blocks, one, policy))
    return list(islice(worth, policy.beam))


def promise(blocks: Blocks, causes: Sequence[Cause], others: Collection[str], policy: Policy) -> float:
    """Return by how much sets with some other effects are more probable than a set of causes in a linear world, nats.

    Parameters
    ----------
    blocks : Blocks
        Normal equations about those causes, with the other effects among the hypotheses.
    causes : sequence of Cause
        The set.
    others : collection of str
        Names of the other effects.
    policy : Policy
        Thresholds.
    """
    sets = leading_sets(blocks, min(len(causes) + 1, policy.most_causes), policy)
    new = [
        one.log_odds for one in sets if any(blocks.hypotheses[member].cause.name in others for member in one.members)
    ]
    present = blocks.log_odds([blocks.nearest(cause) for cause in causes]) if causes else 0.0
    return max(new, default=-np.inf) - present


def _exchanged(blocks: Blocks, members: tuple[int, ...]) -> list[Candidate]:
    """Return a set with one member exchanged for others: what grew one by one may have taken the wrong one first."""
    found = []
    for member in members if len(members) > 1 else ():
        rest = tuple(other for other in members if other != member)
        taken = {blocks.hypotheses[number].cause.name for number in rest}
        for number in np.argsort(-blocks.log_odds_each(rest))[:_PARTNERS]:
            other = tuple(sorted((*rest, int(number))))
            if blocks.hypotheses[number].cause.name not in taken:
                found.append(Candidate(blocks.log_odds(other), other))
    return found


def grown_sets(blocks: Blocks, members: tuple[int, ...], policy: Policy) -> list[Candidate]:
    """Return a set with each of the effects that add most to it, each at its best place and shape, best first."""
    names = [h.cause.name for h in blocks.hypotheses]
    found: dict[str, Candidate] = {}
    for number in np.argsort(-blocks.log_odds_each(members)):
        grown = tuple(sorted((*members, int(number))))
        taken = {names[member] for member in members}
        if names[number] not in taken and not (policy.free_body and _nested(blocks.hypotheses, grown)):
            found.setdefault(names[number], Candidate(blocks.log_odds(grown), grown))
        if len(found) == _GROWN:
            break
    return list(found.values())


def _nested(hypotheses: Sequence[Hypothesis], members: Sequence[int]) -> bool:
    """Whether one effect of a set can do all that another does: both together mean nothing."""
    families = [hypotheses[number].cause.family for number in members]
    names = {str(family.name) for family in families}
    return any(names & getattr(family, "contained_in", frozenset()) for family in families)


def _is_worth(blocks: Blocks, candidate: Candidate, policy: Policy) -> bool:
    """Whether every member of a set adds something to the others, as much as makes it worth a fit."""
    members = candidate.members
    rests = [tuple(other for other in members if other != member) for member in members] if len(members) > 1 else []
    return all(candidate.log_odds - blocks.log_odds(rest) >= policy.worth_a_search for rest in rests)


def _distinct(candidates: Iterable[Candidate], hypotheses: Sequence[Hypothesis]) -> Iterator[Candidate]:
    """Return the first candidate of every set of names."""
    seen: set[frozenset[str]] = set()
    for candidate in candidates:
        names = frozenset(hypotheses[number].cause.name for number in candidate.members)
        if names not in seen:
            seen.add(names)
            yield candidate
