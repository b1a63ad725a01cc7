"""Search: the most probable sets of effects, by evidence on the normal equations.

All single effects are scored, then every pair of a leading effect with any other, and so on from the best sets: not
forward selection, whose first pick is a compromise between two causes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, lapack, solve_triangular

from gfimu.diagnosis.causes import WHOLE_NUMBERS, Cause
from gfimu.diagnosis.evidence import SCALES, inverse, log_evidence, log_evidence_each, posterior
from gfimu.diagnosis.signatures import Hypothesis, SignatureSet
from gfimu.geometry.array import AccelerometerArray

__all__ = ["EXTRA_CAUSE", "MOST_CAUSES", "Blocks", "Candidate", "log_odds_beside_residue", "search", "swapped"]

EXTRA_CAUSE = float(np.log(0.3))
"""Log prior odds for each cause beyond the first."""
MOST_CAUSES = 4
"""How many causes a set may have."""
_TOP_FAMILIES = 8
_BEAM = 6
_PARTNERS = 30
_OF_SHAPE = 0.1  # of what an effect explains: what its nearest listed shape may lack


@dataclass(frozen=True)
class Candidate:
    """A set of hypotheses with its log odds against nothing."""

    log_odds: float
    members: tuple[int, ...]


class Blocks:
    """The normal equations by hypothesis."""

    def __init__(self, signatures: SignatureSet) -> None:
        self.signatures = signatures
        self.hypotheses = signatures.hypotheses
        self._one = np.array([h.mixing.shape[1] == 1 for h in self.hypotheses])
        # Coordinates of the one-dimensional hypotheses in the columns, shape (P, count).
        mixing = np.zeros((len(signatures.score), int(self._one.sum())))
        for place, number in enumerate(np.flatnonzero(self._one)):
            hypothesis = self.hypotheses[number]
            mixing[hypothesis.signature.columns, place] = hypothesis.mixing[:, 0]
        self._mixing = mixing
        self._signs = np.array([bool(h.positive[0]) for h in self.hypotheses])[self._one]
        self.log_prior = np.array([h.log_prior for h in self.hypotheses])

    def system(self, members: Sequence[int]) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
        """Return G, b and the signs of a set."""
        chosen = [self.hypotheses[number] for number in members]
        columns = np.concatenate([h.signature.columns for h in chosen])
        mixing = block_diag(*[h.mixing for h in chosen])
        gram = mixing.T @ self.signatures.gram[np.ix_(columns, columns)] @ mixing
        return (
            0.5 * (gram + gram.T),
            mixing.T @ self.signatures.score[columns],
            np.concatenate([h.positive for h in chosen]),
        )

    def log_odds(self, members: Sequence[int]) -> float:
        """Return log evidence plus log prior of a set."""
        prior = float(self.log_prior[list(members)].sum()) + EXTRA_CAUSE * (len(members) - 1)
        return log_evidence(*self.system(members)) + prior

    def log_odds_each(self, members: Sequence[int] = ()) -> NDArray[np.float64]:
        """Return the log odds that every hypothesis adds to a set, the set's own sizes integrated out."""
        gram, score = self.signatures.gram, self.signatures.score
        if members:
            chosen = [self.hypotheses[number] for number in members]
            columns = np.concatenate([h.signature.columns for h in chosen])
            mixing = block_diag(*[h.mixing for h in chosen])
            inner, right, _ = self.system(members)
            left = gram[:, columns] @ mixing  # (P, k)
            gain = inverse(inner + np.eye(len(right)) / SCALES[-1] ** 2) @ left.T
            gram = gram - left @ gain
            score = score - gain.T @ right
        values = np.empty(len(self.hypotheses))
        information = np.einsum("pk,pk->k", self._mixing, gram @ self._mixing)
        values[self._one] = log_evidence_each(np.maximum(information, 0.0), self._mixing.T @ score, self._signs)
        for number in np.flatnonzero(~self._one):
            hypothesis = self.hypotheses[number]
            columns = hypothesis.signature.columns
            part = hypothesis.mixing.T @ gram[np.ix_(columns, columns)] @ hypothesis.mixing
            values[number] = log_evidence(part, hypothesis.mixing.T @ score[columns], hypothesis.positive)
        return values + self.log_prior

    def coordinates(self, members: Sequence[int]) -> list[NDArray[np.float64]]:
        """Return the fitted coordinates of each member of a set."""
        gram, score, positive = self.system(members)
        mean, _ = posterior(gram, score, SCALES[-1])
        mean = np.where(positive, np.maximum(mean, 1e-3), mean)
        ends = np.cumsum([self.hypotheses[number].mixing.shape[1] for number in members])
        return np.split(mean, ends[:-1])


def search(
    signatures: SignatureSet, *, most: int = 2, keep: int = 12
) -> tuple[list[Candidate], list[Candidate], Blocks]:
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
    candidates : list of Candidate
        Best first; sets of the same effects at other places are kept only once.
    singles : list of Candidate
        Every effect alone at its best place and shape, best first.
    blocks : Blocks
        The normal equations by hypothesis.
    """
    blocks = Blocks(signatures)
    alone = blocks.log_odds_each()
    ranked = [Candidate(float(alone[number]), (int(number),)) for number in np.argsort(-alone)]
    singles = _distinct(ranked, signatures.hypotheses, len(ranked))
    every = list(ranked)
    front = singles[:_TOP_FAMILIES]
    for _ in range(1, most):
        grown: dict[tuple[int, ...], Candidate] = {}
        for candidate in front:
            taken = {signatures.hypotheses[number].name for number in candidate.members}
            added = blocks.log_odds_each(candidate.members) + candidate.log_odds + EXTRA_CAUSE
            for number in np.argsort(-added)[:_PARTNERS]:
                members = tuple(sorted((*candidate.members, int(number))))
                if signatures.hypotheses[number].name not in taken and members not in grown:
                    grown[members] = Candidate(blocks.log_odds(members), members)
        larger = sorted(grown.values(), key=lambda candidate: -candidate.log_odds)
        every += larger
        front = _distinct(larger, signatures.hypotheses, _BEAM)
    every.sort(key=lambda candidate: -candidate.log_odds)
    return _distinct(every, signatures.hypotheses, keep), singles, blocks


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


def swapped(blocks: Blocks, causes: Sequence[Cause]) -> list[Candidate]:
    """Return sets with another effect in place of one where only its shape may keep it from doing as well.

    A large effect in nearly the right shape lacks far more than separates it from another effect, so that the right
    set may be well down the linear list.

    Parameters
    ----------
    blocks : Blocks
        The normal equations by hypothesis.
    causes : sequence of Cause
        The set; of a single cause there are none, as `search` lists single effects anyway.
    """
    names = {cause.name for cause in causes}
    places = {(one.name, one.pattern): number for number, one in reversed(list(enumerate(blocks.hypotheses)))}
    members = [places[cause.key] for cause in causes if cause.key in places]
    if not 1 < len(members) == len(causes):
        return []
    found = []
    for member in members:
        rest = [other for other in members if other != member]
        odds = blocks.log_odds_each(rest)
        best: dict[str, int] = {}
        for number in np.argsort(-odds):
            hypothesis = blocks.hypotheses[number]
            if hypothesis.name not in names and hypothesis.signature.shape.keys() - WHOLE_NUMBERS:
                best.setdefault(hypothesis.name, int(number))
        for number in best.values():
            if odds[number] > (1.0 - _OF_SHAPE) * odds[member]:
                together = tuple(sorted((*rest, number)))
                found.append(Candidate(blocks.log_odds(together), together))
    return found


def log_odds_beside_residue(
    signatures: SignatureSet, members: Sequence[int], tolerance: Mapping[str, float], array: AccelerometerArray
) -> float:
    """Return the log odds of a set beside a calibration residue, without members that it makes superfluous.

    They are −∞ where nothing of a residue is seen, or rounding errors leave the normal equations no proper ones.

    Parameters
    ----------
    signatures : SignatureSet
        Normal equations and hypotheses.
    members : sequence of int
        The hypotheses of the set.
    tolerance : mapping
        Standard deviation of the sizes of each effect that the residue has.
    array : AccelerometerArray
        The array.
    """
    columns, spread = [], []
    for signature in signatures.signatures:
        if signature.family.name in tolerance:
            prior = np.array([size.prior_std for size in signature.family.sizes(array)])
            columns.append(signature.columns)
            spread.append(np.tile(tolerance[signature.family.name] / prior, len(signature.columns) // len(prior)))
    if not columns:
        return -np.inf
    places, scale = np.concatenate(columns), np.concatenate(spread)
    information = signatures.gram[np.ix_(places, places)] * np.outer(scale, scale) + np.eye(len(scale))
    root, failed = lapack.dpotrf(0.5 * (information + information.T), lower=1, clean=1)
    if failed:
        return -np.inf
    low = solve_triangular(root, scale[:, None] * signatures.gram[places], lower=True)  # (q, P)
    forward = solve_triangular(root, scale * signatures.score[places], lower=True)
    alone = 0.5 * float(forward @ forward) - float(np.log(root.diagonal()).sum())
    beside = replace(signatures, gram=signatures.gram - low.T @ low, score=signatures.score - low.T @ forward)
    blocks = Blocks(beside)
    left = list(members)
    best = alone if not left else alone + blocks.log_odds(left)
    while left:
        fewer = [[other for other in left if other != member] for member in left]
        odds = [alone + (blocks.log_odds(some) if some else 0.0) for some in fewer]
        left = fewer[int(np.argmax(odds))]
        best = max(best, *odds)
    return best
