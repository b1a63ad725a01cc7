"""From the most probable causes to the verdict: names, parameters, rivals, what is left, and the views of each run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.special import expit

from gfimu.diagnosis.adequacy import LEFT_OVER_ODDS
from gfimu.diagnosis.causes import Cause, effects_of_run
from gfimu.diagnosis.data.prepared_runs import PreparedRuns
from gfimu.diagnosis.explanation import Explanation
from gfimu.diagnosis.fit import Fit, segments_at
from gfimu.diagnosis.loose_calibration import LooseCalibration
from gfimu.diagnosis.named_causes import capped, contested, fault_causes, name_cause
from gfimu.diagnosis.naming import (
    MOST_CERTAIN,
    TEMPERATURE,
    cause_parameters,
    channel_share,
    conflicting,
    probabilities,
    rival_list,
)
from gfimu.diagnosis.report.wording import verdict_sentences
from gfimu.diagnosis.residual_tests import LeftOver
from gfimu.diagnosis.search import MOST_CAUSES
from gfimu.diagnosis.segment import Segment
from gfimu.diagnosis.signatures import ANGLES
from gfimu.diagnosis.stochastic import LoudestChannel, Walk, loudest_channel, white_factor
from gfimu.diagnosis.verdict.verdict import Diagnosis, Gain, NamedCause, Residual, RunView, Unexplained
from gfimu.generic_basis import ripple_order
from gfimu.geometry.array import AccelerometerArray
from gfimu.world_model import Effect, WorldModel

__all__ = ["Described", "conclude", "is_dominant", "is_unknown", "without_causes"]

_DOMINANT = 0.03
_INEXACTNESS = 2.5e-3
_OF_RIPPLE = 0.25  # nats that a rough ripple leaves at its own order, by the misfit that it takes off: half of it
_OTHER_SERVO = 2.0  # of a ripple's size: off by so much, as the drive follows most of it
_BESIDE_DRIVE = "motion"  # place of effects that the drive can stand in for
_TURNS = ANGLES | {"phase_rad"}
_CLOSE_RESIDUE = 4.0  # log odds against a residue of the calibration in place of a cause, below which it is told
_BEYOND_CHANCE = 4.0  # standard deviations of the misfit of noise


def conclude(
    prepared: PreparedRuns,
    model: WorldModel,
    explanation: Explanation,
    walk: Walk | None,
    loose: LooseCalibration | None,
    left: LeftOver,
    gain: Gain,
    withdrawn: Sequence[str],
    described: Described | None = None,
    refuted: str = "",
) -> Diagnosis:
    """Put everything together.

    ``described`` holds the surrogate of an unknown; ``refuted`` says why the causes found must not stand, where the
    gate withdrew them.
    """
    array = model.array
    fit = explanation.fit
    found = [
        *fault_causes((effect for effects in prepared.effects for effect in effects), prepared.why),
        *_stochastic_causes(explanation, walk),
    ]
    likely = probabilities(explanation)
    rivals = conflicting(explanation)
    named = _named(explanation, fit, likely, array, left)
    dominant = described is not None or bool(refuted) or is_unknown(explanation, left, gain)
    believed = explanation
    if described is not None and described.carried is not None:
        believed = described.carried
    elif described is not None or refuted:
        believed = without_causes(explanation)
    loudest = loudest_channel(believed.segments, believed.fit, believed.fixed)
    significant = dominant or _stands_out(explanation, left) or loudest.stands_out
    runs = tuple(_view(prepared, number, believed) for number in range(len(prepared.runs)))
    extends = not dominant or (described is not None and described.carried is not None)
    extension = effects_of_run(believed.fit.causes, array, 0) if extends else []
    residue = () if loose is None else loose.effects
    twin = model.extended([*_library_effects(model, found), *residue, *extension])
    if dominant:
        verdict, causes = "unknown", tuple(found)
    elif rivals:
        verdict = "ambiguous"
        others: dict[str, NamedCause] = {}
        for rival in rivals:
            for cause in _named(explanation, rival, likely, array, left):
                others.setdefault(cause.effect, cause)
        every = [*named, *(other for name, other in others.items() if name not in fit.names)]
        causes = (*found, *contested(every, [fit, *rivals], model.families()))
    elif named or found:
        verdict, causes = "explained", (*found, *named)
    else:
        verdict, causes = "unknown" if loudest.stands_out else "nothing_found", ()
    surrogate = left.surrogate if described is None else _coefficients(described.whole.fit.causes, array)
    shown = left.signature if (dominant and not refuted) or _stands_out(explanation, left) else ""
    unexplained = Unexplained(
        significant,
        "; ".join(part for part in (refuted, shown, _slow_noise_signature(loudest)) if part),
        left.log_odds,
        surrogate,
        described is not None and described.carried is not None,
        0 if described is None else described.left_out,
    )
    residual = Residual.of_views(runs, array.channels, _noise_floor(runs, believed.segments[0]))
    levels = believed.segments[0].levels
    expected = model.expected_noise(1.0 / prepared.runs[0].sample_period)
    noise: dict[str, Any] = {
        "white_over_data_sheet": float(np.median(levels.white[:-1] / expected.white)),
        "bias_instability_m_s2": float(np.median(levels.flicker[:-1])),
        "bias_instability_largest_m_s2": loudest.level,
        "bias_instability_largest_channel": loudest.name,
        "reference_white": float(levels.white[-1]),
        "calibration_residue": 0.0 if loose is None else loose.scale,
    }
    words = verdict_sentences(
        verdict,
        causes,
        residual,
        gain,
        unexplained,
        withdrawn,
        residue=0.0 if loose is None else loose.scale,
        unreferenced=sum(run.unreferenced for run in prepared.runs),
        terms=len(believed.fit.causes) if dominant and extends else 0,
        loudest=(loudest.name, loudest.level, loudest.ratio),
        rest=left.signature if left.log_odds > LEFT_OVER_ODDS else "",
    )
    return Diagnosis(verdict, causes, residual, gain, unexplained, rival_list(explanation), twin, runs, words, noise)


@dataclass(frozen=True)
class Described:
    """A surrogate of what has no name.

    Parameters
    ----------
    whole : Explanation
        All its terms.
    carried : Explanation, optional
        Those that go into the extended twin: functions of the motion and the angle, and of absolute time where
        another recording confirms them; None where none is left.
    """

    whole: Explanation
    carried: Explanation | None

    @property
    def left_out(self) -> int:
        """How many terms do not go into the extended twin."""
        return len(self.whole.fit.causes) - (0 if self.carried is None else len(self.carried.fit.causes))


def without_causes(explanation: Explanation) -> Explanation:
    """Return an explanation that names nothing, its drives at their best without."""
    nothing = explanation.nothing
    return replace(explanation, fit=nothing, segments=tuple(segments_at(explanation.segments, nothing)))


def _slow_noise_signature(loudest: LoudestChannel) -> str:
    """Return what a channel with far more slow noise than the others looks like; empty where none has."""
    if not loudest.stands_out:
        return ""
    return (
        f"the slow noise of channel {loudest.name} is {loudest.ratio:.1f} times the median of the other channels: "
        "something else is in it"
    )


def is_unknown(explanation: Explanation, left: LeftOver, gain: Gain) -> bool:
    """Tell whether the causes are not to be believed, their gain on held-out data being known."""
    # Several causes that together still miss something, and a share of held-out data, coincide by chance.
    missed = len(explanation.fit.causes) > 1 and gain.share_of_excess_removed < 1.0 - _DOMINANT
    untold = missed or _is_cut_short(explanation) or is_dominant(explanation, left)
    # A ripple that the drive follows so well that its model predicts worse than none is no explanation.
    plain = left.log_odds > LEFT_OVER_ODDS
    useless = plain and _is_of_ripple(explanation.fit.causes, left) and gain.log_likelihood_per_sample < 0.0
    return (untold and _stands_out(explanation, left)) or useless


def is_dominant(explanation: Explanation, left: LeftOver) -> bool:
    """Tell whether what is left weighs too much against what the causes explain for these to be believed."""
    removed = explanation.nothing.objective - explanation.fit.objective
    large = left.instead or 2 * left.log_odds > _DOMINANT * max(removed, 0.0)
    return large and _stands_out(explanation, left)


def _stands_out(explanation: Explanation, left: LeftOver) -> bool:
    """Tell whether what is left is no chance, nor the inexactness that every model has."""
    removed = explanation.nothing.objective - explanation.fit.objective
    if left.instead or _is_cut_short(explanation):
        return left.log_odds > LEFT_OVER_ODDS
    share = _OF_RIPPLE if _is_of_ripple(explanation.fit.causes, left) else _INEXACTNESS
    return left.log_odds > max(LEFT_OVER_ODDS, share * removed)


def _is_of_ripple(causes: Sequence[Cause], left: LeftOver) -> bool:
    """Tell whether what is left turns as often per revolution as a ripple whose model is a rough one.

    The drive follows most of a ripple, and of the table's answer to it what the model has; what the table's own servo
    does otherwise stays, and may be much of the little that is seen.
    """
    order = ripple_order(left.dependence)
    return order is not None and any(
        cause.family.inexactness > 0.0 and cause.shape.get("order") == order for cause in causes
    )


def _is_cut_short(explanation: Explanation) -> bool:
    """Tell whether the causes are as many as a set may have, none of which has a rough model.

    Wide causes enough describe anything: where something is left that asks for one more, it is likely none of them.
    """
    causes = explanation.fit.causes
    return len(causes) >= MOST_CAUSES and all(cause.family.inexactness == 0.0 for cause in causes)


def _named(
    explanation: Explanation, fit: Fit, likely: dict[str, float], array: AccelerometerArray, left: LeftOver
) -> list[NamedCause]:
    """Return the causes of a fit as the verdict names them, the largest contribution first."""
    segment = explanation.segments[0]
    known = explanation.fixed[0]
    runs = len({one.index for one in explanation.segments})
    misfit = _misfit(explanation, fit)
    whole = segment.predict([*known, *effects_of_run(fit.causes, array, segment.index)])
    entries = []
    for cause in fit.causes:
        others = [other for other in fit.causes if other.name != cause.name]
        change = whole - segment.predict([*known, *effects_of_run(others, array, segment.index)])
        share = channel_share(change[:, :-1] * segment.weight_mask[:, :-1], array.channels)
        entry = name_cause(explanation, fit, cause, likely, array, share)
        why = entry.why + _other_runs(cause, array, runs) + _or_residue(explanation, cause)
        entry = capped(replace(entry, why=why, std=_widened(entry, cause, misfit, left)), cause.shape)
        entries.append((float(sum(value**2 for value in share.values())), entry))
    return [entry for _, entry in sorted(entries, key=lambda pair: -pair[0])]


def _misfit(explanation: Explanation, fit: Fit) -> tuple[float, float]:
    """Return the misfit beyond chance as a share of the noise, and of what the causes explain."""
    observations = sum(int(segment.weight_mask.sum()) for segment in explanation.segments)
    left = max(fit.objective - observations - _BEYOND_CHANCE * np.sqrt(2.0 * observations), 0.0)
    removed = max(explanation.nothing.objective - fit.objective, 1.0)
    return float(left / observations), float(left / (left + removed))


def _widened(named: NamedCause, cause: Cause, misfit: tuple[float, float], left: LeftOver) -> dict[str, float]:
    """Widen standard deviations where a cause does not fit to the noise: all by the root of the misfit.

    Where the model of the effect is a rough one, the misfit may be its own: a share ε of what a parameter explains is
    what an error of √ε of that parameter leaves. Where such an effect moves the table, the drive takes up what its
    model gets wrong, and nothing is seen of it. Where a ripple leaves what only another servo does, its size is known
    by order of magnitude.
    """
    over, share = misfit
    inexactness = cause.family.inexactness
    hidden = inexactness if cause.family.place == _BESIDE_DRIVE else 0.0
    rough = np.sqrt(share + hidden) if inexactness > 0.0 else 0.0
    if left.log_odds > LEFT_OVER_ODDS and _is_of_ripple((cause,), left):
        rough = _OTHER_SERVO
    values = {key: 1.0 if key in _TURNS else float(named.parameters.get(key, 0.0)) for key in named.std}
    return {key: float(np.hypot(std * np.sqrt(1.0 + over), rough * values[key])) for key, std in named.std.items()}


def _or_residue(explanation: Explanation, cause: Cause) -> str:
    """Tell where a calibration that is a little off everywhere would leave nothing of a cause."""
    other = explanation.beside_residue
    if other is None or cause.name in other.names:
        return ""
    if other.log_posterior < explanation.fit.log_posterior - _CLOSE_RESIDUE:
        return ""
    return "; a calibration that is a little off in all its numbers would do as well: calibrate the unit anew"


def _other_runs(cause: Cause, array: AccelerometerArray, runs: int) -> str:
    """Tell the sizes in the other runs of a cause that each mounting has anew."""
    if not cause.family.per_run or runs < 2:
        return ""
    parts = []
    for run in range(1, runs):
        values, _ = cause_parameters(cause, array, run)
        numbers = ", ".join(f"{key} = {value:.3g}" for key, value in values.items() if isinstance(value, float))
        parts.append(f"run {run + 1}: {numbers}")
    return f"; the values are those of the first run ({'; '.join(parts)})"


def _stochastic_causes(explanation: Explanation, walk: Walk | None) -> list[NamedCause]:
    """Return wandering biases and excess noise."""
    causes = []
    families = explanation.segments[0].model.families()
    if walk is not None and "bias_random_walk" in families:
        causes.append(
            NamedCause(
                "bias_random_walk",
                {"strength_m_s2_rts": walk.strength},
                {"strength_m_s2_rts": walk.std},
                min(float(expit(walk.log_odds / TEMPERATURE)), MOST_CERTAIN),
                why="the slow part of every channel grows like a random walk, beyond bias instability",
                log_odds=walk.log_odds,
            )
        )
    excess = white_factor(explanation.segments)
    if excess is not None and "noise" in families:
        factor, std = excess
        causes.append(
            NamedCause(
                "noise",
                {"factor": factor},
                {"factor": std},
                MOST_CERTAIN,
                why=f"the white noise of all channels is {factor:.2f} times the data sheet's",
            )
        )
    return causes


def _library_effects(model: WorldModel, causes: Sequence[NamedCause]) -> list[Effect]:
    families = model.families()
    return [families[cause.effect](cause.parameters) for cause in causes if cause.effect in families]


def _coefficients(surrogate: Sequence[Cause], array: AccelerometerArray) -> dict[str, float]:
    """Return the coefficients of a surrogate's terms by what they are of, with its unit, and by function."""
    return {
        f"{size.key}: {cause.effect(array).parameters['dependence']}": float(value)
        for cause in surrogate
        for size, value in zip(cause.family.sizes(array), cause.sizes(array, 0), strict=True)
        if value
    }


def _view(prepared: PreparedRuns, number: int, explanation: Explanation) -> RunView:
    """Collect one run for pictures: before is the given twin driven by the reference alone."""
    run = prepared.runs[number]
    mine = [
        (segment, known)
        for segment, known in zip(explanation.segments, explanation.fixed, strict=True)
        if segment.index == number
    ]
    before, after, states = [], [], []
    for segment, known in mine:
        array = segment.model.array
        effects = [*known, *effects_of_run(explanation.fit.causes, array, segment.index)]
        after.append(segment.predict(effects))
        states.append(segment.motion(effects).at(segment.run.t))
        before.append(segment.reference_prediction([]))
    first, second = np.concatenate(before), np.concatenate(after)
    return RunView(
        run.name,
        run.t,
        run.readings,
        run.valid,
        first[:, :-1],
        second[:, :-1],
        run.reference,
        first[:, -1],
        second[:, -1],
        np.concatenate([state.angle for state in states]),
        np.concatenate([state.rate for state in states]),
        np.concatenate([state.acceleration for state in states]),
        run.temperature,
        mine[0][0].levels.white[:-1],
    )


def _noise_floor(runs: Sequence[RunView], segment: Segment) -> float:
    """Return the rms of the noise of all channels: white, slow, a random walk from the start on, and rounding."""
    levels = segment.levels
    floor = levels.white[:-1] ** 2 + 0.6 * levels.flicker[:-1] ** 2 + segment.rounding.channels**2 / 12.0
    floor = floor + 0.5 * levels.walk**2 * np.mean([run.t[-1] - run.t[0] for run in runs])
    count = np.maximum(np.sum([run.valid.sum(axis=0) for run in runs], axis=0), 1)
    return float(np.sqrt(np.sum(floor * count) / count.sum()))
