"""Causes as a verdict names them: with parameters, probability, what could be in their place, and a sentence why."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import replace

from gfimu.diagnosis.causes import Cause
from gfimu.diagnosis.explanation import Explanation
from gfimu.diagnosis.fit import Fit
from gfimu.diagnosis.naming import MOST_CERTAIN, cause_parameters, describe, mimics
from gfimu.diagnosis.signatures import ANGLES
from gfimu.diagnosis.verdict.verdict import NamedCause
from gfimu.geometry.array import AccelerometerArray
from gfimu.world_model import Effect, EffectFamily

__all__ = ["capped", "contested", "fault_causes", "name_cause"]

_SEEN = 2.0  # standard deviations from which a parameter stands out
_UNSEEN_AT_MOST = 0.9


def fault_causes(effects: Iterable[Effect], why: Mapping[str, str]) -> list[NamedCause]:
    """Return the faults seen in the samples of all runs, each kind once; ``why`` has a sentence by name."""
    kinds: dict[str, Effect] = {}
    for effect in effects:
        kinds.setdefault(str(effect.name), effect)
    return [
        NamedCause(name, dict(effect.parameters), {}, MOST_CERTAIN, why=why.get(name, ""))
        for name, effect in kinds.items()
    ]


def name_cause(
    explanation: Explanation,
    fit: Fit,
    cause: Cause,
    likely: Mapping[str, float],
    array: AccelerometerArray,
    share: Mapping[str, float],
) -> NamedCause:
    """Return a fitted cause as the verdict names it.

    Parameters
    ----------
    explanation : Explanation
        What the search ended with.
    fit : Fit
        The set that the cause belongs to: the best one or a rival.
    cause : Cause
        The cause.
    likely : mapping
        Probability of each effect.
    array : AccelerometerArray
        The array.
    share : mapping
        What the cause changes in each channel, rms, m/s².
    """
    parameters, std = cause_parameters(cause, array)
    same = mimics(explanation, cause) if fit is explanation.fit else []
    without = explanation.without.get(cause.name)
    named = NamedCause(
        cause.name,
        parameters,
        std,
        likely.get(cause.name, 0.0),
        cause.pattern,
        tuple(same),
        str(cause.family.separated_by) if same else "",
        describe(cause, array, share),
        0.0 if without is None else float(fit.log_posterior - without.log_posterior),
    )
    return capped(named, cause.shape)


def capped(cause: NamedCause, shape: Container[str] = ()) -> NamedCause:
    """Return a cause no surer than 0.9 if none of its sizes stands out from its uncertainty.

    A parameter of its ``shape`` (the frequency of a mode, a time constant) is never near zero and says nothing of
    whether the effect is there; phases and directions are compared with nothing. A cause without standard deviations,
    as a fault of the samples, stays as it is.
    """
    numbers = [key for key, std in cause.std.items() if std > 0.0 and key not in ANGLES and not key.startswith("phase")]
    judged = [key for key in numbers if key not in shape] or numbers
    if not judged or any(abs(float(cause.parameters[key])) > _SEEN * cause.std[key] for key in judged):
        return cause
    return replace(cause, probability=min(cause.probability, _UNSEEN_AT_MOST))


def contested(
    named: Sequence[NamedCause], fits: Sequence[Fit], families: Mapping[str, EffectFamily]
) -> tuple[NamedCause, ...]:
    """Let each cause that may be another list the others; ``fits`` are the sets that the data can't tell apart."""
    shared = frozenset.intersection(*(fit.names for fit in fits))
    open_names = list(dict.fromkeys(cause.effect for cause in named if cause.effect not in shared))
    out = []
    for cause in named:
        if cause.effect in shared:
            out.append(cause)
            continue
        others = [*(name for name in open_names if name != cause.effect), *cause.not_distinguishable_from]
        text = cause.would_be_separated_by or str(families[cause.effect].separated_by)
        out.append(replace(cause, not_distinguishable_from=tuple(dict.fromkeys(others)), would_be_separated_by=text))
    return tuple(out)
