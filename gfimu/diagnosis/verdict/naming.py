"""Causes as a verdict names them: parameters, probability, rivals, and a sentence why."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import softmax
from scipy.stats import chi2

from gfimu.array.array import AccelerometerArray
from gfimu.diagnosis.fit.gauss_newton import Fit
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.search.explain import Explanation
from gfimu.diagnosis.terms.cause import Cause
from gfimu.diagnosis.terms.located.term import is_located
from gfimu.diagnosis.verdict.parts import NamedCause, Rival
from gfimu.model.world_model import Effect, EffectFamily

__all__ = [
    "capped",
    "cause_parameters",
    "channel_share",
    "conflicting",
    "contested",
    "fault_causes",
    "mimics",
    "name_cause",
    "probabilities",
    "rival_list",
]


_ANOTHER_RUN = "another run with another motion"


def probabilities(explanation: Explanation, policy: Policy) -> dict[str, float]:
    """Return the probability of each effect to be among the causes, over all sets and models that were fitted."""
    every = (explanation.nothing, *explanation.without.values(), *explanation.rivals, explanation.best)
    fits = [*{one.key: one for one in every}.values(), *explanation.elsewhere]
    weight = softmax(np.array([fit.log_posterior for fit in fits]) / policy.temperature)
    names = frozenset().union(*(one.names for one in fits))
    summed = {name: sum(w for w, one in zip(weight, fits, strict=True) if name in one.names) for name in names}
    return {name: float(np.clip(value, 0.0, policy.most_certain)) for name, value in summed.items()}


def cause_parameters(cause: Cause, array: AccelerometerArray, run: int = 0) -> tuple[dict[str, Any], dict[str, float]]:
    """Return the contract parameters of a cause and their standard deviations (delta method)."""
    parameters = cause.effect(array, run).parameters
    numbers = [key for key, value in parameters.items() if isinstance(value, float)]
    slopes = np.zeros((len(numbers), len(cause.coordinates)))
    for index in range(len(cause.coordinates)):
        step = 1e-4 * max(1.0, float(np.abs(cause.coordinates).max()))  # numerical
        moved = cause.coordinates.copy()
        moved[index] += step
        other = cause.at(moved).effect(array, run).parameters
        slopes[:, index] = [(_unwrapped(key, other[key], parameters[key]) - parameters[key]) / step for key in numbers]
    variance = np.einsum("ik,kl,il->i", slopes, cause.covariance, slopes)
    std = {key: float(np.sqrt(max(v, 0.0))) for key, v in zip(numbers, variance, strict=True)}
    std |= {key: value for key, value in cause.shape_std.items() if key in parameters}
    kept = {
        key: value
        for key, value in parameters.items()
        if key in cause.shape or not isinstance(value, float) or value != 0.0 or std.get(key, 0.0) > 0.0
    }
    fixed = set(cause.shape) - set(cause.free_shape)
    return kept, {key: value for key, value in std.items() if key in kept and key not in fixed}


def _unwrapped(key: str, value: float, near: float) -> float:
    return near + float(np.angle(np.exp(1j * (value - near)))) if key == "phase_rad" else value


def mimics(explanation: Explanation, cause: Cause, policy: Policy) -> list[str]:
    """Return effects that could stand for a cause in these data, however unlikely they are.

    An effect is confounded with another where hardly any of the other's energy remains after the best fit by it (twice
    the distinguishability D of Eriksson, Frisk and Krysander, Automatica 49, 2013).
    """
    screening = explanation.screening
    if screening is None:
        return []
    mine = next((signature for signature in screening.signatures if signature.family.name == cause.name), None)
    if mine is None:
        return []
    vector = np.zeros(len(screening.score))
    vector[mine.columns] = cause.mixing @ cause.coordinates
    pull = screening.gram @ vector
    energy = float(vector @ pull)
    found: dict[str, None] = {}
    for other in screening.signatures if energy >= 2.0 * policy.mimic_energy else ():
        name = str(other.family.name)
        if name in found or name in explanation.best.names:
            continue
        inner, right = screening.gram[np.ix_(other.columns, other.columns)], pull[other.columns]
        ridge = 1e-9 * (1.0 + float(inner.diagonal().max()))  # numerical
        explained = float(right @ np.linalg.solve(inner + ridge * np.eye(len(right)), right))
        if energy - explained < policy.mimic_energy:
            found[name] = None
    return list(found)


def conflicting(explanation: Explanation, policy: Policy) -> list[Fit]:
    """Return rival sets with other named causes that the data can't separate from the best one."""
    best = explanation.best
    named = _named(best)
    return [
        rival
        for rival in explanation.rivals
        if best.causes
        and _named(rival) != named
        and len(rival.causes) <= len(best.causes)
        and rival.log_posterior > best.log_posterior - policy.ambiguous
    ]


def _named(fit: Fit) -> frozenset[str]:
    return frozenset(cause.name for cause in fit.causes if not is_located(cause))


def rival_list(explanation: Explanation, policy: Policy) -> tuple[Rival, ...]:
    """Return the other explanations and why they lost."""
    best, rivals = explanation.best, []
    for one in [*explanation.rivals[: policy.beam], *([explanation.nothing] if best.causes else [])]:
        odds, worse = one.log_posterior - best.log_posterior, one.objective - best.objective
        more = sum(len(c.coordinates) for c in one.causes) - sum(len(c.coordinates) for c in best.causes)
        if odds > 0.0:
            why = f"it is more probable, but its further causes bring less than a cause must (χ² {worse:+.0f})"
        elif not one.causes:
            why = f"without any cause the misfit is larger by {worse:.0f} (χ²)"
        elif worse > 2.0 * abs(odds):
            why = f"it fits worse: χ² is larger by {worse:.0f}"
        elif more > 0:
            why = f"it fits as well (χ² {worse:+.0f}) but needs {more} more free numbers to coincide"
        else:
            why = f"it is less probable (χ² {worse:+.0f})"
        rivals.append(Rival(tuple(sorted(one.names)) or ("nothing",), float(odds), why))
    return tuple(rivals)


def fault_causes(effects: Iterable[Effect], why: Mapping[str, str], policy: Policy) -> list[NamedCause]:
    """Return the faults seen in the samples of all runs, each kind once; ``why`` has a sentence by name."""
    kinds: dict[str, Effect] = {}
    for effect in effects:
        kinds.setdefault(str(effect.name), effect)
    return [
        NamedCause(name, dict(effect.parameters), {}, policy.most_certain, why=why.get(name, ""))
        for name, effect in kinds.items()
    ]


def name_cause(
    explanation: Explanation,
    fit: Fit,
    cause: Cause,
    likely: Mapping[str, float],
    array: AccelerometerArray,
    share: Mapping[str, float],
    policy: Policy,
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
    policy : Policy
        Thresholds.
    """
    parameters, std = cause_parameters(cause, array)
    same = mimics(explanation, cause, policy) if fit is explanation.best else []
    without = explanation.without.get(cause.name)
    why = _sentence(cause, array, share) + _or_other_nuisances(explanation, cause, policy)
    probability, ends = likely.get(cause.name, 0.0), cause.at_limits(array)
    if ends:
        probability = min(probability, 1.0 - policy.small)
        why += f"; {' and '.join(ends)} stands at the end of its range, so that its size is not known"
    named = NamedCause(
        cause.name,
        parameters,
        std,
        probability,
        cause.place,
        tuple(same),
        str(cause.family.separated_by) if same else "",
        why,
        0.0 if without is None else float(fit.log_posterior - without.log_posterior),
    )
    return capped(named, policy, cause.shape)


def _or_other_nuisances(explanation: Explanation, cause: Cause, policy: Policy) -> str:
    """Say so where other nuisance parameters, small errors of all numbers or slow noise, would do as well."""
    near = explanation.best.log_posterior - policy.ambiguous
    if not any(cause.name not in other.names and other.log_posterior > near for other in explanation.elsewhere):
        return ""
    return (
        "; small errors of all numbers of the calibration, or biases that drift, would do as well: calibrate the unit "
        "anew"
    )


def capped(cause: NamedCause, policy: Policy, shape: Container[str] = ()) -> NamedCause:
    """Return a cause no surer than 0.9 if none of its sizes stands out from its uncertainty.

    A parameter of its ``shape`` (the frequency of a mode, a time constant) is never near zero and says nothing of
    whether the effect is there; phases and directions are compared with nothing. A cause without standard deviations,
    as a fault of the samples, stays as it is.
    """
    numbers = [key for key, std in cause.std.items() if std > 0.0 and not key.startswith(("phase", "direction"))]
    judged = [key for key in numbers if key not in shape] or numbers
    if not judged or any(abs(float(cause.parameters[key])) > policy.stds * cause.std[key] for key in judged):
        return cause
    return replace(cause, probability=min(cause.probability, 1.0 - policy.small))


def contested(
    named: Sequence[NamedCause], fits: Sequence[Fit], families: Mapping[str, EffectFamily]
) -> tuple[NamedCause, ...]:
    """Let each cause that may be another list the others; ``fits`` are the sets that the data can't distinguish."""
    shared = frozenset.intersection(*(fit.names for fit in fits))
    open_names = list(dict.fromkeys(cause.effect for cause in named if cause.effect not in shared))
    out = []
    for cause in named:
        if cause.effect in shared:
            out.append(cause)
            continue
        others = [*(name for name in open_names if name != cause.effect), *cause.not_distinguishable_from]
        family = families.get(cause.effect)
        text = cause.would_be_separated_by or str(_ANOTHER_RUN if family is None else family.separated_by)
        out.append(replace(cause, not_distinguishable_from=tuple(dict.fromkeys(others)), would_be_separated_by=text))
    return tuple(out)


def channel_share(change: NDArray[np.float64], channels: Sequence[str]) -> dict[str, float]:
    """Return the rms per channel of what a cause changes, (n, c), m/s²."""
    return {name: float(np.sqrt(np.mean(change[:, index] ** 2))) for index, name in enumerate(channels)}


def _sentence(cause: Cause, array: AccelerometerArray, share: Mapping[str, float]) -> str:
    """Return one sentence: what it is, where it acts and which channels show it."""
    strongest = sorted(share, key=lambda name: -share[name])[:3]
    where = f" ({cause.place})" if cause.place and not cause.place.startswith("all ch") else ""
    shows = f"; it shows most in {', '.join(strongest)}" if strongest and share[strongest[0]] > 0 else ""
    note = _common_to_all_chips(cause, array)
    return f"{cause.family.summary}{where}{shows}" + (f"; {note}" if note else "")


def _common_to_all_chips(cause: Cause, array: AccelerometerArray) -> str:
    """Say so where the sizes of every chip are the same within their uncertainty: a common cause is more likely."""
    chips, count = len(array.chips), len(cause.coordinates)
    if chips < 2 or count < 2 * chips or count != len(cause.mixing) or count % chips or count == array.n_channels * 3:
        return ""
    if not cause.place.startswith("all chips"):
        return ""
    per_chip = count // chips
    weight = np.linalg.pinv(cause.covariance)
    common = np.tile(np.eye(per_chip), (chips, 1))
    inner = common.T @ weight @ common
    mean = np.linalg.lstsq(inner, common.T @ weight @ cause.coordinates, rcond=None)[0]
    rest = cause.coordinates - common @ mean
    misfit, total = float(rest @ weight @ rest), float(cause.coordinates @ weight @ cause.coordinates)
    freedom = max(np.linalg.matrix_rank(weight) - np.linalg.matrix_rank(inner), 1)
    if misfit < chi2.ppf(0.99, freedom) and total > 10 * freedom:
        return (
            "all chips show the same: a cause common to the whole array (its mounting on the table) is more likely "
            "than as many coinciding chips"
        )
    return ""
