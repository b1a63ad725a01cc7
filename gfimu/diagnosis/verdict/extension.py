"""What a diagnosis extends a twin with, and what of its finds does not enter the twin."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from gfimu.diagnosis.data.body.stretch import BodyStretch
from gfimu.diagnosis.data.prepared_runs import PreparedRuns
from gfimu.diagnosis.data.stretch import NoPredictionError
from gfimu.diagnosis.fit.gauss_newton import Fit
from gfimu.diagnosis.fit.learn import predicted_by_reference
from gfimu.diagnosis.fit.linear import linearise
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.search.explain import Explanation
from gfimu.diagnosis.terms.located.term import is_located
from gfimu.diagnosis.verdict.located import located_cause
from gfimu.diagnosis.verdict.parts import NamedCause
from gfimu.model.located.effect import UNLISTED
from gfimu.model.world_model import Effect, WorldModel, is_of_one_recording

__all__ = ["Extension", "extension", "that_predict"]

_NOT_PREDICTED = (
    "{} is not all in the extended twin: from the reference alone the simulation predicts these data better without it."
)


@dataclass(frozen=True)
class Extension:
    """An extended twin, and sentences on what of a diagnosis is not in it."""

    twin: WorldModel
    sentences: tuple[str, ...]


def extension(
    explanation: Explanation,
    believed: Fit,
    faults: Sequence[NamedCause],
    prepared: PreparedRuns,
    policy: Policy,
    *,
    confirmed: bool,
) -> Extension:
    """Extend the twin of an explanation.

    Causes of absolute time stay out where nothing confirms them, and so do errors without a name, and what was fitted
    beside causes of absolute time, with which the reference alone predicts the runs worse.

    Parameters
    ----------
    explanation : Explanation
        What the search found.
    believed : Fit
        The causes that extend the twin.
    faults : sequence of NamedCause
        Faults of the samples, and causes that are noise.
    prepared : PreparedRuns
        The runs.
    policy : Policy
        Thresholds.
    confirmed : bool
        Whether another recording confirms the causes.
    """
    model = explanation.stretches[0].model
    of_time = [cause for cause in believed.causes if is_of_one_recording(cause.family) and not confirmed]
    named, described = [], []
    for cause in believed.causes:
        if cause in of_time:
            continue
        effect = cause.effect(model.array, 0)
        if is_located(cause):
            found = located_cause(explanation, believed, cause, policy).unlisted
            assert found is not None
            table = {} if found.function is None else {"function": found.function.to_dict()}
            described.append(model.described({**effect.parameters, "text": found.text, **table}))
        else:
            named.append(effect)
    twin = model.extended([*_library_effects(model, faults), *_residue(explanation)])
    is_body = isinstance(explanation.stretches[0], BodyStretch)  # of which no reference gives the specific force
    # A size that was fitted beside what is left out may be wrong without it.
    doubted = [*named, *described] if of_time else described
    sure = [] if of_time else named
    kept = doubted if is_body else that_predict(twin.extended(sure), doubted, prepared)
    sentences = (
        [_of_absolute_time(_said(UNLISTED if is_located(cause) else cause.name for cause in of_time))]
        if of_time
        else []
    )
    if lost := _said(effect.name for effect in doubted if effect not in kept):
        sentences.append(_NOT_PREDICTED.format(" and ".join(lost)))
    return Extension(twin.extended([*sure, *kept]), tuple(sentences))


def that_predict(twin: WorldModel, doubted: Sequence[Effect], prepared: PreparedRuns) -> list[Effect]:
    """Return the effects with which a twin predicts the runs, from their reference alone, best.

    A function of what a reference does not tell is right and yet of no use for another recording, such as many waves
    per revolution where the reference gives the angle to some degrees, or where a tachometer stands still.
    """

    def squares(some: Sequence[Effect]) -> float:
        model = twin.extended(list(some))
        try:
            misses = [run.readings - predicted_by_reference(model, run) for run in prepared.runs]
        except NoPredictionError:
            return np.inf
        return sum(float(np.sum(miss[run.valid] ** 2)) for miss, run in zip(misses, prepared.runs, strict=True))

    kept = list(doubted)
    least = squares(kept) if kept else 0.0
    while kept:
        fewer = [[other for other in kept if other is not one] for one in kept]
        sums = [squares(some) for some in fewer]
        if min(sums) >= least:
            break
        least = min(sums)
        kept = fewer[sums.index(least)]
    return kept


def _said(names: Iterable[str]) -> list[str]:
    """Return names of causes or effects, each once; those of places are no names."""
    return [*dict.fromkeys("What has no name" if name == UNLISTED else name for name in names)]


def _of_absolute_time(names: Sequence[str]) -> str:
    go, are, them = ("goes", "is", "it") if len(names) == 1 else ("go", "are", "them")
    every = " and ".join(names)
    return (
        f"{every} {go} with absolute time and {are} not in the extended twin: another recording has "
        f"another phase or start, and none confirms {them}."
    )


def _library_effects(model: WorldModel, causes: Sequence[NamedCause]) -> list[Effect]:
    families = model.families()
    return [families[cause.effect](cause.parameters) for cause in causes if cause.effect in families]


def _residue(explanation: Explanation) -> tuple[Effect, ...]:
    """Return the most probable residue of the calibration as effects; none where none was admitted."""
    point = explanation.best.point
    if point.residue is None:
        return ()
    return point.residue.effects(explanation.stretches[0], linearise(explanation.stretches, point).residue)
