"""The judge: what an answer is worth, by the truth of the release alone.

It knows no method: names are compared with what is hidden and with the ties of the release, sizes with the true ones,
predictions with another motion of the same world.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import GfimuError, InputError
from sim.effects import Effect, make_effect
from sim.trials.benchmark.answer import Answer, CauseAnswer
from sim.trials.benchmark.drawing import fresh_motion, nominal_twin
from sim.trials.benchmark.judged import Judged
from sim.trials.benchmark.real import beyond_stated, held_out_recording, prediction_error, real_task
from sim.trials.benchmark.release import MEASURED, find_case
from sim.trials.benchmark.truth_file import Fixed, fixed_world
from sim.trials.benchmark.unlisted import GOES_WITH, PLACES_OF_LISTED, SAME_PLACE, quantities_of
from sim.trials.benchmark.world import FreshMotion, Truth
from sim.trials.worlds.z_scores import z_scores

__all__ = ["POINTS", "Claim", "claims_of", "judge", "outcome_of"]

POINTS = {
    "alone": 1.0,
    "quiet": 1.0,
    "set": 0.5,
    "part": 0.5,
    "unknown": 0.25,
    "missed": 0.0,
    "error": 0.0,
    "wrong": -1.0,
    "false_alarm": -1.0,
    "measured": math.nan,
    "contradicted": math.nan,
}
"""Points by outcome; of a set of k names at most 1/k; of ``unknown`` twice as many in the set ``unlisted``.

Somebody who is given a wrong name repairs the wrong part and still has a wrong simulation; ``unknown`` costs a further
look. With these points a single name pays from a probability of 5/8 on: p − (1 − p) > 1/4.
"""

LEAST_MOVED = 15.0
"""d′ that what is hidden must have in the fresh motion for its removal to be measured."""

_WHERE_NO_NAME_IS_RIGHT = 2.0  # times the points of ``unknown``
_NOT_A_NAME, _DESCRIBED = "unknown", "unlisted"


@dataclass(frozen=True)
class Claim:
    """One claim of an answer: that one of these names is a cause.

    Parameters
    ----------
    names : frozenset of str
        A single name, or a set that the method can't tell apart.
    causes : tuple of CauseAnswer
        The causes behind it.
    """

    names: frozenset[str]
    causes: tuple[CauseAnswer, ...]


def judge(answers: Iterable[Answer], data: str | Path = "") -> list[Judged]:
    """Judge answers by the truth of the release.

    Parameters
    ----------
    answers : iterable of Answer
        Any worlds, in any order.
    data : str or Path
        Folder of the measured data, for answers to worlds of the set ``real``.

    Raises
    ------
    InputError
        If a world is not of the release, an effect has a parameter that it doesn't have on that array, or measured data
        are needed and not there.
    """
    return [
        _judged_measured(answer, data)
        if find_case(answer.world).generator == MEASURED
        else _judged(answer, fixed_world(answer.world))
        for answer in answers
    ]


def _judged_measured(answer: Answer, data: str | Path) -> Judged:
    """Judge an answer for measured data: no truth, but what makers state, and the error on another recording."""
    claims, recording = claims_of(answer), held_out_recording(answer.world, data)
    twin = real_task(answer.world, data).twin
    hidden = _effects(answer, claims, twin.array)
    if answer.verdict == "error":
        outcome, removed, ratio = "error", math.nan, math.nan
    else:
        outcome = "contradicted" if beyond_stated(answer.causes) else "measured"
        before, after = (prediction_error(twin, effects, recording) for effects in ((), hidden))
        removed = max(1.0 - (after / before) ** 2, -1.0)
        ratio = math.nan if answer.expected_rms_m_s2 is None else answer.expected_rms_m_s2 / after
    said = tuple("|".join(sorted(claim.names)) for claim in claims) or (answer.verdict,)
    taken = math.nan if answer.processor_s is None else answer.processor_s
    return Judged(answer.world, answer.method, (), said, outcome, math.nan, (), removed, ratio, taken)


def _judged(answer: Answer, fixed: Fixed) -> Judged:
    truth, claims = fixed.truth, claims_of(answer)
    outcome, points = outcome_of(answer, fixed)
    removed, ratio = _prediction(answer, claims, fixed)
    return Judged(
        answer.world,
        answer.method,
        tuple(name for name, _ in truth.hidden),
        tuple("|".join(sorted(claim.names)) for claim in claims) or ((answer.verdict,)),
        outcome,
        points,
        tuple(_scores(claims, truth)),
        removed,
        ratio,
        math.nan if answer.processor_s is None else answer.processor_s,
    )


def name_of(cause: CauseAnswer) -> str:
    """Return the name by which a cause is judged; of a description without one its place."""
    if cause.effect == _DESCRIBED and not cause.name:
        return f"{_DESCRIBED}: {place_of(cause)}"
    return cause.name or cause.effect


def place_of(cause: CauseAnswer) -> str:
    """Return the place of a description in the words of `PLACES`."""
    return SAME_PLACE.get(cause.place, cause.place)


def claims_of(answer: Answer) -> list[Claim]:
    """Return the claims of an answer: causes that name each other as not distinguishable are one claim."""
    claims: list[Claim] = []
    for cause in answer.causes:
        if name_of(cause) == _NOT_A_NAME:
            continue
        names, causes = {name_of(cause), *cause.not_distinguishable_from}, [cause]
        for other in [claim for claim in claims if claim.names & names]:
            claims.remove(other)
            names |= other.names
            causes = [*other.causes, *causes]
        claims.append(Claim(frozenset(names), tuple(causes)))
    return claims


def outcome_of(answer: Answer, fixed: Fixed) -> tuple[str, float]:
    """Return the outcome of an answer for a drawn world and its points, by its names alone."""
    truth, unlisted = fixed.truth, fixed.case.set_name == "unlisted"
    claims = [claim for claim in claims_of(answer) if not claim.names <= set(truth.allowed)]
    nothing = not truth.hidden or truth.place == "nothing"
    if answer.verdict == "error":
        outcome = "error"
    elif not claims:
        silent = "quiet" if nothing else "missed"
        outcome = "unknown" if answer.verdict == "unknown" else silent
    elif nothing:
        outcome = "false_alarm"
    else:
        outcome = _outcome_of_unlisted(truth, claims) if unlisted else _outcome_of_listed(truth, claims)
    points = POINTS[outcome]
    if outcome == "set":
        points = min(points, 1.0 / max(len(claim.names) for claim in claims))
    if outcome == "unknown" and unlisted and not nothing:
        points *= _WHERE_NO_NAME_IS_RIGHT
    return outcome, points


def _outcome_of_listed(truth: Truth, claims: Sequence[Claim]) -> str:
    """Return the outcome by names; the place of a hidden effect, without its name, stands for it as a set does."""
    waiting = {name for name, _ in truth.hidden}
    described = {place_of(cause) for claim in claims for cause in claim.causes if cause.effect == _DESCRIBED}
    claims = [claim for claim in claims if not any(cause.effect == _DESCRIBED for cause in claim.causes)]
    alone = not described and all(len(claim.names) == 1 for claim in claims)
    others = []
    for claim in claims:
        found = waiting & claim.names
        if found:
            waiting.discard(min(found))
        else:
            others.append(claim)
    for claim in others:  # a tie stands for a hidden effect that no claim names itself
        tied = sorted(name for name in waiting if claim.names & set(truth.ties.get(name, ())))
        if not tied:
            return "wrong"
        waiting.discard(tied[0])
        alone = False
    for place in sorted(described):
        there = {name for name, _ in truth.hidden if place in PLACES_OF_LISTED.get(name, ())}
        if not there:
            return "wrong"
        waiting -= there
    if waiting:
        return "part"
    return "alone" if alone else "set"


def _outcome_of_unlisted(truth: Truth, claims: Sequence[Claim]) -> str:
    certain = True
    for claim in claims:
        placed = [cause for cause in claim.causes if _describes(cause, truth)]
        right = bool(claim.names & set(truth.right)) or any(_goes_with(cause, truth) for cause in placed)
        if not right and not placed and not claim.names & set(truth.near):
            return "wrong"
        certain = certain and right and len(claim.names) == 1
    return "alone" if certain else "set"


def _describes(cause: CauseAnswer, truth: Truth) -> bool:
    """Whether a cause describes what is hidden by its place; one that states a name is judged by that."""
    return cause.effect == _DESCRIBED and not cause.name and place_of(cause) == truth.place


def _goes_with(cause: CauseAnswer, truth: Truth) -> bool:
    """Whether a description goes with what is hidden; one that states no dependence is judged by its place alone."""
    known = GOES_WITH.get(truth.hidden[0][0], ())
    return not cause.dependence or not known or bool(quantities_of(cause.dependence) & set(known))


def _scores(claims: Sequence[Claim], truth: Truth) -> list[float]:
    """Return (estimate − truth)/std of the sizes of causes that are hidden."""
    hidden, scores = dict(truth.hidden), list[float]()
    for cause in (cause for claim in claims for cause in claim.causes if name_of(cause) in hidden):
        values = {key: one.value for key, one in cause.parameters.items()}
        stds = {key: one.std for key, one in cause.parameters.items()}
        scores += z_scores(values, stds, hidden[name_of(cause)]).values()
    return scores


def _prediction(answer: Answer, claims: Sequence[Claim], fixed: Fixed) -> tuple[float, float]:
    """Return the share of the squared distance that an answer removes in a fresh motion, and the ratio of errors."""
    twin = nominal_twin(fixed.case)
    effects, fresh = _effects(answer, claims, twin.array), _fresh(answer.world)
    if fresh is None or answer.verdict == "error":
        return math.nan, math.nan
    before, after, rms = fresh.distance(twin), math.inf, math.inf
    try:
        with np.errstate(all="ignore"):
            after, rms = fresh.distance(twin, effects), fresh.rms_error(twin, effects)
    except (ArithmeticError, ValueError):  # no simulation runs with absurd sizes: the answer removes nothing
        pass
    ratio = math.nan if answer.expected_rms_m_s2 is None else answer.expected_rms_m_s2 / rms
    if before < LEAST_MOVED:
        return math.nan, ratio
    return (max(1.0 - (after / before) ** 2, -1.0) if math.isfinite(after) else -1.0), ratio


def _effects(answer: Answer, claims: Sequence[Claim], array: AccelerometerArray) -> list[Effect]:
    """Return the effects of an answer, of each claim the first with parameters; a description predicts nothing.

    Raises
    ------
    InputError
        If a parameter is none of its effect on this array: it would change nothing, and pass for a small size.
    """
    found = []
    for claim in claims:
        sized = [cause for cause in claim.causes if cause.parameters and _is_effect(name_of(cause))]
        effects = []
        for cause in sized:
            values = {key: one.value for key, one in cause.parameters.items()}
            try:
                effects.append(make_effect(name_of(cause), values, array))
            except GfimuError as error:
                raise InputError(f"answer for {answer.world}: {error}") from None
        found += effects[:1]
    return found


def _is_effect(name: str) -> bool:
    try:
        make_effect(name)
    except GfimuError:
        return False
    return True


@functools.lru_cache(maxsize=512)
def _fresh(world: str) -> FreshMotion | None:
    fixed = fixed_world(world)
    return fresh_motion(fixed.case, fixed.truth, fixed.case.seed(fixed.attempt))
