"""Search: the most probable sets of effects, by evidence on the normal equations.

All single effects are scored, then every pair of a leading effect with any other, and so on from the best sets: not
forward selection, whose first pick is a compromise between two causes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.evidence import SCALES, log_evidence, posterior
from gfimu.diagnosis.signatures import Hypothesis, SignatureSet

__all__ = ["EXTRA_CAUSE", "Candidate", "search"]

EXTRA_CAUSE = float(np.log(0.3))
"""Log prior odds for each cause beyond the first."""
_TOP_FAMILIES = 8
_BEAM = 6


@dataclass(frozen=True)
class Candidate:
    """A set of hypotheses with its log odds against nothing."""

    log_odds: float
    members: tuple[int, ...]


class _Blocks:
    """Gram blocks between hypotheses, computed once."""

    def __init__(self, signatures: SignatureSet) -> None:
        self.signatures = signatures
        self.hypotheses = signatures.hypotheses
        self._left: dict[int, NDArray[np.float64]] = {}
        self._scores: dict[int, NDArray[np.float64]] = {}

    def left(self, number: int) -> NDArray[np.float64]:
        """Return Mᵀ G[columns, :], shape (k, P)."""
        if number not in self._left:
            hypothesis = self.hypotheses[number]
            self._left[number] = hypothesis.mixing.T @ self.signatures.gram[hypothesis.signature.columns]
        return self._left[number]

    def score(self, number: int) -> NDArray[np.float64]:
        """Return Mᵀ b, shape (k,)."""
        if number not in self._scores:
            hypothesis = self.hypotheses[number]
            self._scores[number] = hypothesis.mixing.T @ self.signatures.score[hypothesis.signature.columns]
        return self._scores[number]

    def system(self, members: Sequence[int]) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
        """Return G, b and the signs of a set."""
        rows = []
        for one in members:
            left = self.left(one)
            rows.append(
                np.hstack(
                    [left[:, self.hypotheses[two].signature.columns] @ self.hypotheses[two].mixing for two in members]
                )
            )
        gram = np.vstack(rows)
        return (
            0.5 * (gram + gram.T),
            np.concatenate([self.score(number) for number in members]),
            np.concatenate([self.hypotheses[number].positive for number in members]),
        )

    def log_odds(self, members: Sequence[int]) -> float:
        """Return log evidence plus log prior of a set."""
        gram, score, positive = self.system(members)
        prior = sum(self.hypotheses[number].log_prior for number in members) + EXTRA_CAUSE * (len(members) - 1)
        return log_evidence(gram, score, positive) + prior

    def coordinates(self, members: Sequence[int]) -> list[NDArray[np.float64]]:
        """Return the fitted coordinates of each member of a set."""
        gram, score, positive = self.system(members)
        mean, _ = posterior(gram, score, SCALES[-1])
        mean = np.where(positive, np.maximum(mean, 1e-3), mean)
        ends = np.cumsum([self.hypotheses[number].mixing.shape[1] for number in members])
        return np.split(mean, ends[:-1])


def search(signatures: SignatureSet, *, most: int = 2, keep: int = 12) -> tuple[list[Candidate], _Blocks]:
    """Score all single effects and, from the leading ones, larger sets.

    Parameters
    ----------
    signatures : SignatureSet
        Normal equations and hypotheses.
    most : int
        Largest set.
    keep : int
        How many candidates to return.

    Returns
    -------
    list of Candidate
        Best first; sets of the same effects at other places are kept only once.
    """
    blocks = _Blocks(signatures)
    singles = [Candidate(blocks.log_odds((number,)), (number,)) for number in range(len(signatures.hypotheses))]
    singles.sort(key=lambda candidate: -candidate.log_odds)
    every = list(singles)
    front = _distinct(singles, signatures.hypotheses, _TOP_FAMILIES)
    best_of_family = _distinct(singles, signatures.hypotheses, len(signatures.hypotheses))
    for _ in range(1, most):
        grown: dict[tuple[int, ...], Candidate] = {}
        for candidate in front:
            taken = {signatures.hypotheses[number].name for number in candidate.members}
            partners = [one.members[0] for one in best_of_family] + [one.members[0] for one in singles[:80]]
            for number in dict.fromkeys(_all_places(partners, signatures.hypotheses)):
                if signatures.hypotheses[number].name in taken:
                    continue
                members = tuple(sorted((*candidate.members, number)))
                if members not in grown:
                    grown[members] = Candidate(blocks.log_odds(members), members)
        larger = sorted(grown.values(), key=lambda candidate: -candidate.log_odds)
        every += larger[: 10 * keep]
        front = _distinct(larger, signatures.hypotheses, _BEAM)
    every.sort(key=lambda candidate: -candidate.log_odds)
    return _distinct(every, signatures.hypotheses, keep), blocks


def _all_places(numbers: Sequence[int], hypotheses: Sequence[Hypothesis]) -> list[int]:
    return list(range(len(hypotheses))) if len(hypotheses) < 500 else list(numbers)


def _distinct(candidates: Sequence[Candidate], hypotheses: Sequence[Hypothesis], count: int) -> list[Candidate]:
    """Return the best candidates, one per set of effect names."""
    seen: set[frozenset[str]] = set()
    kept = []
    for candidate in candidates:
        names = frozenset(hypotheses[number].name for number in candidate.members)
        if names not in seen:
            seen.add(names)
            kept.append(candidate)
            if len(kept) == count:
                break
    return kept
