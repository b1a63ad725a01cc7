"""From the most probable causes to the verdict: names, parameters, rivals, lack of fit, and the views of each run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from gfimu.diagnosis.criticism.gain import Gain
from gfimu.diagnosis.criticism.lack_of_fit import LackOfFit
from gfimu.diagnosis.criticism.slow_noise import LoudestChannel, loudest_channel, white_factor
from gfimu.diagnosis.criticism.views.body_view import body_noise_floor
from gfimu.diagnosis.criticism.views.run_view import RunView
from gfimu.diagnosis.criticism.views.run_views import run_views
from gfimu.diagnosis.data.body.stretch import BodyStretch
from gfimu.diagnosis.data.prepared_runs import PreparedRuns
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.fit.gauss_newton import Fit
from gfimu.diagnosis.fit.random_walk import Walk
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.search.explain import Explanation
from gfimu.diagnosis.search.nuisance_models import Understanding
from gfimu.diagnosis.search.undetermined import undetermined, undetermined_sentence
from gfimu.diagnosis.terms.cause import Cause, effects_of
from gfimu.diagnosis.terms.located.term import is_located
from gfimu.diagnosis.verdict.extension import extension
from gfimu.diagnosis.verdict.located import located_cause, of_free_time
from gfimu.diagnosis.verdict.naming import (
    capped,
    channel_share,
    conflicting,
    contested,
    fault_causes,
    name_cause,
    probabilities,
    rival_list,
)
from gfimu.diagnosis.verdict.parts import NamedCause, NoiseLevels, Residual, Unexplained
from gfimu.diagnosis.verdict.verdict import Diagnosis
from gfimu.diagnosis.verdict.wording import Notes, verdict_sentences

__all__ = ["conclude", "is_dominant", "is_unknown", "named_causes"]

_OF_NOISE = frozenset({"noise", "bias_random_walk"})
_TURNS = ("direction_rad", "phase_rad")  # compared on the circle: a relative error means nothing


def removed(explanation: Explanation) -> float:
    """Return how much the causes take off the misfit."""
    return max(explanation.nothing.objective - explanation.best.objective, 0.0)


def stands_out(explanation: Explanation, left: LackOfFit, policy: Policy) -> bool:
    """Whether a lack of fit is no chance, nor the inexactness that every model has."""
    return left.noise_odds > policy.lack_odds or _depends(explanation, left, policy)


def _depends(explanation: Explanation, left: LackOfFit, policy: Policy) -> bool:
    """Return the same of all but noise that grows with the motion, which speaks against no cause."""
    if _is_full(explanation, policy):
        return left.log_odds > policy.lack_odds
    return left.log_odds > max(policy.lack_odds, policy.inexactness * removed(explanation))


def is_dominant(explanation: Explanation, left: LackOfFit, policy: Policy) -> bool:
    """Whether the lack of fit weighs too much against what the causes explain for these to be believed."""
    if not explanation.best.causes:
        return stands_out(explanation, left, policy)
    share = policy.least_share if left.free else policy.dominant
    large = 2.0 * left.log_odds > share * removed(explanation)
    return large and _depends(explanation, left, policy)


def is_unknown(explanation: Explanation, left: LackOfFit, gain: Gain, policy: Policy) -> bool:
    """Whether the causes are not to be believed, their gain on held-out data being known."""
    # Several causes that together still miss something, and a share of held-out data, coincide by chance. Real hands
    # leave more beside what is right.
    missed = (
        not policy.free_body
        and len(explanation.best.causes) > 1
        and gain.share_of_excess_removed < 1.0 - policy.dominant
    )
    doubtful = missed or _is_full(explanation, policy) or is_dominant(explanation, left, policy)
    if not explanation.best.causes:
        return doubtful
    # The slow noise of one channel takes what smooth functions would show.
    loud = loudest_channel(explanation.stretches, explanation.best.point, policy).stands_out(policy)
    return doubtful and (_depends(explanation, left, policy) or loud)


def _is_full(explanation: Explanation, policy: Policy) -> bool:
    """Whether the causes are as many as a set may have: wide causes enough describe anything."""
    causes = explanation.best.causes
    return len(causes) >= policy.most_causes and all(cause.family.inexactness == 0.0 for cause in causes)


def named_causes(explanation: Explanation, fit: Fit, policy: Policy, left: LackOfFit | None = None) -> list[NamedCause]:
    """Return the causes of a fit as the verdict names them, the largest contribution first."""
    stretch, array = explanation.stretches[0], explanation.stretches[0].model.array
    spin = fit.point.drives[0].spin
    likely = probabilities(explanation, policy)
    whole = stretch.predict(effects_of(fit.causes, array, stretch.index), spin)
    runs = len({one.index for one in explanation.stretches})
    entries = []
    for cause in fit.causes:
        others = [other for other in fit.causes if other is not cause]
        change = (whole - stretch.predict(effects_of(others, array, stretch.index), spin)) * stretch.mask
        share = channel_share(_seen(stretch, change[:, :-1]), array.channels)
        if is_located(cause):
            entry = located_cause(explanation, fit, cause, policy)
        else:
            entry = name_cause(explanation, fit, cause, likely, array, share, policy)
            why = entry.why + _other_runs(cause, stretch, runs)
            entry = replace(entry, why=why, std=_widened(explanation, fit, entry, cause, policy, left))
            entry = capped(entry, policy, cause.shape)
        entries.append((float(sum(value**2 for value in share.values())), entry))
    return [entry for _, entry in sorted(entries, key=lambda pair: -pair[0])]


def _seen(stretch: Stretch, change: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return what is seen of a change (n, c): of a free body not what passes for its specific force."""
    axes = stretch.model.array.axes
    return change - (change @ np.linalg.pinv(axes).T) @ axes.T if isinstance(stretch, BodyStretch) else change


def _widened(
    explanation: Explanation, fit: Fit, named: NamedCause, cause: Cause, policy: Policy, left: LackOfFit | None
) -> dict[str, float]:
    """Widen standard deviations where a cause does not fit to the noise.

    All by the root of the misfit over the noise; where the model of the effect is a rough one, by the share of what it
    explains that it may leave: a share ε of it is what an error of √ε of a parameter leaves. What is left is what all
    squares together show, or the lack of fit, which sees less. A level of a reading is not found better than the
    reading that gets there.
    """
    observations = sum(stretch.observations for stretch in explanation.stretches)
    beyond = fit.objective - observations - policy.excess_stds * np.sqrt(2.0 * observations)
    beyond = max(beyond, 0.0)
    unexplained = 2.0 * left.log_odds if left is not None and left.log_odds > policy.lack_odds else 0.0
    unexplained = max(beyond, unexplained)
    share = unexplained / (unexplained + max(explanation.nothing.objective - fit.objective, 1.0))
    rough = np.sqrt(share + cause.family.inexactness) if cause.family.inexactness > 0.0 else 0.0
    values = {key: 1.0 if key in _TURNS else float(named.parameters.get(key, 0.0)) for key in named.std}
    wider = np.sqrt(1.0 + beyond / observations)
    white = float(np.median(fit.point.levels[0].white[:-1])) if cause.family.inexactness > 0.0 else 0.0
    level = getattr(cause.family, "level_error", 0.0) * white
    return {
        key: float(np.linalg.norm([std * wider, rough * values[key], level if key in cause.free_shape else 0.0]))
        for key, std in named.std.items()
    }


def _other_runs(cause: Cause, stretch: Stretch, runs: int) -> str:
    """Return the sizes in the other runs of a cause that each mounting has anew."""
    if not cause.family.per_run or runs < 2:
        return ""
    parts = []
    for run in range(1, runs):
        values = cause.effect(stretch.model.array, run).parameters
        numbers = ", ".join(f"{key} = {value:.3g}" for key, value in values.items() if isinstance(value, float))
        parts.append(f"run {run + 1}: {numbers}")
    return f"; the values are those of the first run ({'; '.join(parts)})"


def conclude(
    prepared: PreparedRuns,
    understanding: Understanding,
    left: LackOfFit,
    gain: Gain,
    policy: Policy,
    *,
    withdrawn: Sequence[str] = (),
    refuted: str = "",
    unknown: bool = False,
) -> Diagnosis:
    """Put everything together.

    Parameters
    ----------
    prepared : PreparedRuns
        The runs and the faults that were found in them.
    understanding : Understanding
        Causes and nuisance model.
    left : LackOfFit
        What they leave.
    gain : Gain
        What they are worth on held-out data.
    policy : Policy
        Thresholds.
    withdrawn : sequence of str
        Causes that held-out data withdrew.
    refuted : str
        Why the causes must not stand, where the gate withdrew them.
    unknown : bool
        Whether the causes are not believed.
    """
    explanation = understanding.explanation
    first = explanation.stretches[0]
    model, array = first.model, first.model.array
    found = [
        *fault_causes((effect for effects in prepared.effects for effect in effects), prepared.why, policy),
        # What has no name may look like noise, or a random walk: beside it none is claimed.
        *([] if unknown else _noise_causes(understanding.walk, understanding, policy)),
    ]
    rivals = conflicting(explanation, policy)
    named = named_causes(explanation, explanation.best, policy, left)
    described = bool(named) and all(map(is_located, explanation.best.causes)) and not (refuted or left.free)
    believed = explanation.best if described or not unknown else explanation.nothing
    loudest = loudest_channel(explanation.stretches, believed.point, policy)
    apart = stands_out(explanation, left, policy)
    runs = run_views(prepared, explanation.stretches, believed)
    levels = believed.point.levels[0]
    floor = body_noise_floor(first, levels) if isinstance(first, BodyStretch) else _noise_floor(runs, first, believed)
    residual = Residual.of_views(runs, array.channels, floor)
    without_name = [cause for cause in named if cause.unlisted is not None]
    if unknown or (not named and loudest.stands_out(policy)):
        verdict = "unknown"
        places = [of_free_time(left.free, policy)] if left.free else without_name
        causes = (*(one for one in found if one.effect not in _OF_NOISE), *places)
    elif rivals:
        verdict = "ambiguous"
        others = {c.effect: c for rival in reversed(rivals) for c in named_causes(explanation, rival, policy)}
        every = [*named, *(other for name, other in others.items() if name not in explanation.best.names)]
        verdict_causes = contested(every, [explanation.best, *rivals], model.families())
        causes = _by_contribution(found, verdict_causes, residual, levels)
    elif named or found:
        verdict = "unknown" if named and named[0].unlisted is not None else "explained"
        causes = _by_contribution(found, named, residual, levels)
    else:
        verdict, causes = "nothing_found", ()
    shown = left.signature if (unknown and not refuted) or apart else ""
    words_of = "; ".join(cause.why for cause in without_name) if verdict == "unknown" and not refuted else ""
    unexplained = Unexplained(
        unknown or apart or loudest.stands_out(policy) or bool(without_name),
        "; ".join(dict.fromkeys(part for part in (refuted, words_of, shown, _loud(loudest, policy)) if part)),
        max(left.log_odds, left.noise_odds),
    )
    extended = extension(explanation, believed, found, prepared, policy, confirmed=gain.of_other_recording)
    expected = model.expected_noise(first.run.output_data_rate)
    body = first.run if isinstance(first, BodyStretch) else None
    noise = NoiseLevels(
        white_over_data_sheet=float(np.median(levels.white[:-1] / expected.white)),
        bias_instability_m_s2=float(np.median(levels.flicker[:-1])),
        bias_instability_largest_m_s2=loudest.level,
        bias_instability_largest_channel=loudest.name,
        reference_white=float(levels.white[-1]) if body is None else None,
        calibration_residue=understanding.residue,
        disagreement_s=None if body is None else levels.agitation,
        gyro_bias_rad_s=None if body is None else float(np.linalg.norm(body.gyro_bias)),
    )
    notes = Notes(
        residue=understanding.residue,
        unreferenced=sum(run.unreferenced for run in prepared.runs),
        loudest=(loudest.name, loudest.level, loudest.ratio),
        rest=left.signature if left.log_odds > policy.lack_odds else "",
    )
    words = verdict_sentences(verdict, causes, residual, gain, unexplained, withdrawn, notes)
    weaker = rival_list(explanation, policy)
    # Of a table those of the causes alone: it could have many others, each with something that it does not show.
    looked_at = None if policy.free_body else {cause.effect for cause in causes}
    screening = explanation.screening
    open_ones = () if screening is None else undetermined(screening, array, policy.least_share, looked_at)
    unsure = (undetermined_sentence(open_ones),) if open_ones else ()
    return Diagnosis(
        verdict=verdict,
        causes=causes,
        residual=residual,
        gain=gain,
        unexplained=unexplained,
        rivals=weaker,
        twin=extended.twin,
        runs=runs,
        sentences=(*words, *unsure, *extended.sentences),
        noise=noise,
        undetermined=open_ones,
    )


def _by_contribution(
    faults: Sequence[NamedCause], inferred: Sequence[NamedCause], residual: Residual, levels: Any
) -> tuple[NamedCause, ...]:
    """Return faults of the samples before what was inferred, but after it those that change less than it explains."""
    explained = np.sqrt(max(residual.rms_before**2 - residual.rms_after**2, 0.0)) if inferred else 0.0
    white = float(np.median(levels.white[:-1]))
    sizes = {
        "coarse_resolution": lambda one: one["step_m_s2"] / np.sqrt(12.0),
        "noise": lambda one: white * np.sqrt(max(1.0 - one["factor"] ** -2, 0.0)),
    }
    small = [one for one in faults if one.effect in sizes and float(sizes[one.effect](one.parameters)) < explained]
    return (*(fault for fault in faults if fault not in small), *inferred, *small)


def _loud(loudest: LoudestChannel, policy: Policy) -> str:
    if not loudest.stands_out(policy):
        return ""
    return (
        f"the bias instability of channel {loudest.name} is {loudest.ratio:.1f} times the median of the other "
        "channels: something else is in it"
    )


def _noise_causes(walk: Walk | None, understanding: Understanding, policy: Policy) -> list[NamedCause]:
    """Return a random walk of the biases and excess noise as causes."""
    causes, stretches = [], understanding.explanation.stretches
    families = stretches[0].model.families()
    if walk is not None and "bias_random_walk" in families:
        causes.append(
            NamedCause(
                "bias_random_walk",
                {"strength_m_s2_rts": walk.strength},
                {"strength_m_s2_rts": walk.std},
                min(float(expit(walk.log_odds / policy.temperature)), policy.most_certain),
                why="the slow part of every channel grows like a random walk, beyond bias instability",
                log_odds=walk.log_odds,
            )
        )
    body = isinstance(stretches[0], BodyStretch)  # whose channels' noise can't be distinguished well
    excess = None if body else white_factor(stretches, understanding.explanation.best.point.levels)
    if excess is not None and "noise" in families:
        factor, std = excess
        why = f"the white noise of all channels is {factor:.2f} times the data sheet's"
        causes.append(NamedCause("noise", {"factor": factor}, {"factor": std}, policy.most_certain, why=why))
    return causes


def _noise_floor(runs: Sequence[RunView], stretch: Stretch, believed: Fit) -> float:
    """Return the rms of the noise of all channels: white, slow, a random walk from the start on, and rounding."""
    levels = believed.point.levels[0]
    floor: NDArray[np.float64] = levels.white[:-1] ** 2 + 0.6 * levels.flicker[:-1] ** 2
    floor = floor + stretch.steps.channels**2 / 12.0
    floor = floor + 0.5 * levels.walk**2 * np.mean([run.t[-1] - run.t[0] for run in runs])
    count = np.maximum(np.sum([run.valid.sum(axis=0) for run in runs], axis=0), 1)
    return float(np.sqrt(np.sum(floor * count) / count.sum()))
