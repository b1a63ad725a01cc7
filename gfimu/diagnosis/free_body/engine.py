"""The search for causes on a free body: screen, take the best set and its sizes, relearn the noise, until settled.

Every screening linearises the full simulation about the causes found so far, so that repeating it is Gauss–Newton on
the sizes of the causes, and every set is compared on the same normal equations.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.causes import Cause, Signature, effects_of_run
from gfimu.diagnosis.evidence import SCALES, log_evidence
from gfimu.diagnosis.explanation import Explanation
from gfimu.diagnosis.fit import Fit
from gfimu.diagnosis.free_body.segment import BodySegment
from gfimu.diagnosis.free_body.signatures import plan_signatures, signature_columns
from gfimu.diagnosis.free_body.undetermined import LEAST_INFORMATION, determined
from gfimu.diagnosis.pruning import LEAST_EXTRA_ODDS, LEAST_ODDS
from gfimu.diagnosis.search import EXTRA_CAUSE, Blocks, search
from gfimu.diagnosis.signatures import SignatureSet, hypotheses
from gfimu.world_model import Effect

__all__ = ["Known", "Screening", "explain", "learn_noise", "screen", "without_cause"]

Report = Callable[[float, str], None]
Known = Sequence[Sequence[Effect]]
Members = tuple[int, ...]

_ROUNDS = 12
_MOST_CAUSES = 8
_PAIRS = 3
_GROWN = 3
_RIVALS = 6
_CLOSE = 22.0
_NESTED = (frozenset({"channel_skew", "chip_delay"}), frozenset({"misalignment", "cross_axis"}))
"""Effects of which one can do all that the other can: both together mean nothing."""
_SETTLED = 0.5
_UPHILL = 2.0
_SMALLEST_POSITIVE = 1e-6
_CONSTANT = frozenset({"bias", "scale_factor", "cross_axis", "quadratic"})


@dataclass(frozen=True)
class Screening:
    """Normal equations of all signatures about given causes.

    Parameters
    ----------
    signatures : SignatureSet
        Relative to no effects.
    objective : float
        Sum of squares about the causes, nuisances eliminated.
    at : ndarray, shape (P,)
        Where the causes are in the columns.
    misfit : float
        What the normal equations have been divided by (`BodySegment.misfit`); sums of squares have not.
    """

    signatures: SignatureSet
    objective: float
    at: NDArray[np.float64]
    misfit: float = 1.0

    @property
    def nothing(self) -> float:
        """Sum of squares without any cause, as the linear form has it."""
        pull = self.signatures.gram @ self.at
        taken = 2 * float((self.signatures.score - pull) @ self.at) + float(self.at @ pull)
        return self.objective + self.misfit * taken

    def fit(self, blocks: Blocks, members: Members) -> Fit:
        """Return a set of hypotheses at its best sizes."""
        nothing = -0.5 * self.nothing / self.misfit
        if not members:
            return Fit((), nothing, nothing, self.nothing, (), np.zeros((0, 0)), np.zeros(0))
        gram, score, positive = blocks.system(members)
        values, covariance = _seen(gram, score)
        values = np.where(positive, np.maximum(values, _SMALLEST_POSITIVE), values)
        chosen = [blocks.hypotheses[number] for number in members]
        places = np.split(np.arange(len(values)), np.cumsum([h.mixing.shape[1] for h in chosen])[:-1])
        causes = tuple(
            replace(h.cause(values[mine]), covariance=covariance[np.ix_(mine, mine)])
            for h, mine in zip(chosen, places, strict=True)
        )
        objective = self.nothing - self.misfit * float(2.0 * score @ values - values @ gram @ values)
        evidence = nothing + log_evidence(gram, score, positive)
        prior = sum(h.log_prior for h in chosen) + EXTRA_CAUSE * (len(chosen) - 1)
        return Fit(causes, evidence, evidence + prior, objective, (), gram, score)


def _seen(gram: NDArray[np.float64], score: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the sizes and their covariance: zero along what the data don't determine, with the spread of the prior.

    What all chips share of a displacement or a turn, a free body takes for its own.
    """
    strength, turn, seen = determined(gram)
    gain = np.where(seen, 1.0 / (np.maximum(strength, LEAST_INFORMATION) + 1.0 / SCALES[-1] ** 2), 0.0)
    return (turn * gain) @ (turn.T @ score), (turn * np.where(seen, gain, 1.0)) @ turn.T


def screen(
    segments: Sequence[BodySegment], causes: Sequence[Cause], fixed: Known, *, only: Collection[str] | None = None
) -> Screening:
    """Compute the signatures of the library, or of some families only, about causes."""
    array = segments[0].model.array
    signatures = plan_signatures(segments, causes, only)
    count = sum(len(one.columns) for one in signatures)
    gram, score, objective = np.zeros((count, count)), np.zeros(count), 0.0
    misfits = []
    for segment, known in zip(segments, fixed, strict=True):
        effects = [*known, *effects_of_run(causes, array, segment.index)]
        line = segment.linearise(effects)
        columns = signature_columns(segment, signatures, causes, known, line)
        nuisances = segment.nuisances(effects, line)
        part, right, squares = segment.products(columns, line, nuisances)
        misfits.append(segment.misfit(_of_causes(columns, signatures, causes), line, nuisances))
        gram += part
        score += right
        objective += squares
    at = np.zeros(count)
    for cause in causes:
        signature = next(one for one in signatures if one.family.name == cause.name)
        at[signature.columns] = cause.mixing @ cause.coordinates
    misfit = float(np.mean(misfits))
    gram, score = gram / misfit, score / misfit
    places = SignatureSet(tuple(signatures), gram, score + gram @ at, tuple(hypotheses(signatures, array, 1)), at)
    return Screening(places, objective, at, misfit)


def _of_causes(
    columns: NDArray[np.float64], signatures: Sequence[Signature], causes: Sequence[Cause]
) -> NDArray[np.float64]:
    """Return the columns of the coordinates of causes, from those of all signatures (rows, P)."""
    parts = [np.zeros((len(columns), 0))]
    for cause in causes:
        signature = next(one for one in signatures if one.family.name == cause.name)
        first, last = signature.columns[[0, -1]]
        parts.append(columns[:, first : last + 1] @ cause.mixing)
    return np.hstack(parts)


def learn_noise(segments: Sequence[BodySegment], causes: Sequence[Cause], fixed: Known) -> None:
    """Learn the noise of every segment again from what causes leave."""
    for segment, known in zip(segments, fixed, strict=True):
        effects = [*known, *effects_of_run(causes, segment.model.array, segment.index)]
        segment.learn_noise(segment.linearise(effects))
        line = segment.linearise(effects)
        # What a pose decides must not pass for slow noise before its cause is found.
        constant = plan_signatures([segment], causes, _CONSTANT)
        columns = signature_columns(segment, constant, causes, known, line)
        segment.learn_flicker(line, np.hstack([columns, segment.motion_columns(effects, line)]))


def explain(segments: Sequence[BodySegment], fixed: Known, *, report: Report | None = None) -> Explanation:
    """Find the most probable set of causes.

    Parameters
    ----------
    segments : sequence of BodySegment
        The runs.
    fixed : sequence of sequence of Effect
        Effects known beforehand, per run.
    report : callable, optional
        Called with the share done and a line of text.
    """
    tell = report or (lambda share, text: None)
    learn_noise(segments, (), fixed)
    causes: tuple[Cause, ...] = ()
    base: tuple[Screening, tuple[Cause, ...]] | None = None
    refused: set[frozenset[tuple[str, str]]] = set()
    stable = False
    for number in range(_ROUNDS):
        tell(0.05 + 0.8 * number / _ROUNDS, f"search {number + 1}")
        screening = screen(segments, causes, fixed)
        if base is not None and not screening.objective <= base[0].objective + _UPHILL * screening.misfit:
            # The linear form promised what the simulation does not keep.
            refused.add(frozenset(cause.key for cause in causes))
            screening, causes = base
        blocks = Blocks(screening.signatures)
        members = _members(blocks, causes)
        chosen = _best(blocks, members, refused)
        fit = screening.fit(blocks, chosen)
        moved = (screening.objective - fit.objective) / screening.misfit
        base = (screening, causes)
        same = set(chosen) == set(members)
        if same and stable and moved < _SETTLED * max(len(causes), 1):
            break
        causes = fit.causes
        if same or number in {1, 3}:
            learn_noise(segments, causes, fixed)
            base = None
        stable = same
    tell(0.85, "compare")
    return _explanation(screen(segments, causes, fixed), causes, fixed)


def _explanation(screening: Screening, causes: Sequence[Cause], fixed: Known) -> Explanation:
    """Put beside a set what is left without each cause, and its rivals."""
    blocks = Blocks(screening.signatures)
    members = _pruned(blocks, _members(blocks, causes))
    best = screening.fit(blocks, members)
    without = {
        blocks.hypotheses[member].name: screening.fit(blocks, tuple(m for m in members if m != member))
        for member in members
    }
    sets = [chosen for chosen, _ in _candidates(blocks, members)][: 3 * _RIVALS]
    # The set with one more effect is no rival: that effect was not worth its while.
    rivals = [screening.fit(blocks, chosen) for chosen in sets if chosen and not set(chosen) >= set(members)]
    near = {fit.key: fit for fit in rivals if fit.log_posterior > best.log_posterior - _CLOSE}
    return Explanation(
        best,
        tuple(sorted(near.values(), key=lambda fit: -fit.log_posterior)[:_RIVALS]),
        screening.fit(blocks, ()) if best.causes else best,
        without,
        (),
        tuple(tuple(known) for known in fixed),
        screening.signatures,
    )


def without_cause(segments: Sequence[BodySegment], causes: Sequence[Cause], fixed: Known, name: str) -> Explanation:
    """Fit what is left of a set when one cause is withdrawn."""
    kept = tuple(cause for cause in causes if cause.name != name)
    for _ in range(2):
        screening = screen(segments, kept, fixed)
        blocks = Blocks(screening.signatures)
        kept = screening.fit(blocks, _members(blocks, kept)).causes
    return _explanation(screen(segments, kept, fixed), kept, fixed)


def _members(blocks: Blocks, causes: Sequence[Cause]) -> Members:
    """Return the numbers of the hypotheses that causes are."""
    places = {(h.name, h.pattern): number for number, h in reversed(list(enumerate(blocks.hypotheses)))}
    return tuple(sorted(places[cause.key] for cause in causes))


def _best(blocks: Blocks, members: Members, refused: Collection[frozenset[tuple[str, str]]]) -> Members:
    """Return the best set in reach of a set, pruned, but none of those refused."""
    for candidate, odds in _candidates(blocks, members):
        best = _pruned(blocks, candidate) if odds > 0 else ()
        if frozenset((blocks.hypotheses[n].name, blocks.hypotheses[n].pattern) for n in best) not in refused:
            return best
    return members


def _odds(blocks: Blocks, members: Members) -> float:
    return blocks.log_odds(members) if members else 0.0


def _pruned(blocks: Blocks, members: Members) -> Members:
    """Drop effects that the data hardly ask for."""
    while members:
        own = _odds(blocks, members)
        rests = [tuple(m for m in members if m != member) for member in members]
        odds = [_odds(blocks, rest) for rest in rests]
        weakest = int(np.argmax(odds))
        if own - odds[weakest] >= (LEAST_ODDS if len(members) == 1 else LEAST_EXTRA_ODDS):
            break
        members = rests[weakest]
    return members


def _candidates(blocks: Blocks, members: Members) -> list[tuple[Members, float]]:
    """Return sets, best first: small ones from scratch; larger ones grown, moved or exchanged one effect at a time."""
    sets: dict[Members, float] = {members: _odds(blocks, members)}
    if len(members) < _PAIRS:
        found, _, _ = search(blocks.signatures, most=min(len(members) + 2, _PAIRS))
        sets |= {tuple(sorted(one.members)): one.log_odds for one in found}
    names = [h.name for h in blocks.hypotheses]
    for rest in [members, *(tuple(m for m in members if m != member) for member in members)]:
        if not members or len(rest) >= _MOST_CAUSES:
            continue
        base = _odds(blocks, rest) + (EXTRA_CAUSE if rest else 0.0)
        added = blocks.log_odds_each(rest) + base
        taken = {names[number] for number in rest}
        new: dict[str, int] = {}
        for number in np.argsort(-added):
            if names[number] not in taken and names[number] not in new:
                new[names[number]] = int(number)
            if len(new) == _GROWN:
                break
        for number in new.values():
            grown = tuple(sorted((*rest, number)))
            if grown not in sets:
                sets[grown] = _odds(blocks, grown)
    whole = {m: odds for m, odds in sets.items() if not any(pair <= {names[n] for n in m} for pair in _NESTED)}
    return sorted(whole.items(), key=lambda one: -one[1])
