"""Diagnosis from end to end: recordings and a twin in, a verdict out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gfimu.array import AccelerometerArray
from gfimu.diagnosis.adequacy import LEFT_OVER_ODDS, left_over
from gfimu.diagnosis.causes import Cause, effects_of_run
from gfimu.diagnosis.coloured_noise import NoiseLevels
from gfimu.diagnosis.engine import LEAST_EXTRA_ODDS, Explanation, make_segments, prune
from gfimu.diagnosis.free_body.diagnose import diagnose_body
from gfimu.diagnosis.holdout import Holdout, gate_gains, held_out_gain, split_segments
from gfimu.diagnosis.integrity import IntegrityReport, check_integrity
from gfimu.diagnosis.long_run import explain_any_length
from gfimu.diagnosis.model import Effect, WorldModel
from gfimu.diagnosis.naming import (
    cause_parameters,
    channel_share,
    conflicting,
    describe,
    mimics,
    probabilities,
    rival_list,
)
from gfimu.diagnosis.refinement import Fit, refine
from gfimu.diagnosis.residual_tests import LeftOver
from gfimu.diagnosis.run import Run, prepare_run
from gfimu.diagnosis.segment import Segment, known_walk
from gfimu.diagnosis.stochastic import UNEQUAL_WALK, WALK_ODDS, Walk, noise_log_determinant, walk_strength, white_factor
from gfimu.diagnosis.verdict import Diagnosis, Gain, NamedCause, Residual, RunView, Unexplained
from gfimu.diagnosis.wording import verdict_sentences
from gfimu.errors import InputError
from gfimu.recording import Recording

__all__ = ["diagnose"]

Report = Callable[[float, str], None]

LEAST_GAIN = 2.0
"""Log predictive gain on held-out blocks below which a cause is withdrawn."""
_DOMINANT = 0.03
_INEXACTNESS = 2.5e-3
_ROUNDING = ("coarse_resolution", "saturation")
_WALK_ROUNDS = 3
_WIRING = ("axis_swap", "sign_flip", "wrong_range")
_SLOW = frozenset(
    {"bias", "warm_up", "bias_temperature", "gain_drift", "scale_factor", "quadratic", "gravity", "cross_axis"}
)


def diagnose(
    recordings: Sequence[Recording],
    model: WorldModel,
    *,
    held_out: Sequence[Recording] = (),
    names: Sequence[str] | None = None,
    report: Report | None = None,
) -> Diagnosis:
    """Show what a simulation gets wrong, name the cause, extend the model, measure the gain.

    Parameters
    ----------
    recordings : sequence of Recording
        One or several runs of the same unit; each may have its own mounting in its metadata.
    model : WorldModel
        What the simulation believes.
    held_out : sequence of Recording
        Runs that are kept for the gate and the gain.
    names : sequence of str, optional
        Names of the runs, for people.
    report : callable, optional
        Called with the share done (0 to 1) and a line of text.

    Returns
    -------
    Diagnosis
        The verdict with its numbers.

    Raises
    ------
    InputError
        If a recording is too short or lacks the reference that drives the twin.
    """
    if not recordings:
        raise InputError("no recording to diagnose; give at least one")
    tell = report or (lambda share, text: None)
    labels = list(names) if names is not None else [f"run {number + 1}" for number in range(len(recordings))]
    if model.drive_source == "gyro":
        return diagnose_body(recordings, model, held_out=held_out, names=labels, report=tell)
    tell(0.02, "read")
    prepared = _Prepared.build(recordings, model, labels)
    explanation, walk = _explain(prepared, model, tell)
    tell(0.92, "hold out")
    pairs, label = _holdouts(explanation, prepared, held_out, model)
    halves = split_segments(explanation.segments, explanation.fixed, duration=np.inf)
    explanation, withdrawn = _gate(explanation, pairs if held_out else halves, other_recording=bool(held_out))
    left = left_over(
        explanation.segments, explanation.fit, explanation.fixed, prepared.spikes, rounded=prepared.rounded
    )
    tell(0.97, "measure the gain")
    gain = _gain(prepared, explanation, pairs, label)
    return _verdict(prepared, model, explanation, walk, left, gain, withdrawn)


def _gain(prepared: _Prepared, explanation: Explanation, pairs: Sequence[Holdout], label: str) -> Gain:
    if not explanation.fit.causes and not any(explanation.fixed):
        return Gain()
    constant = [effect for effects in explanation.fixed for effect in effects]
    return held_out_gain(explanation.fit.causes, pairs, constant, label=label)


@dataclass(frozen=True)
class _Prepared:
    """Runs after the integrity check, with the effects it found in each."""

    runs: list[Run]
    effects: list[list[Effect]]
    why: dict[str, str]
    spikes: int
    rounded: bool
    """Whether readings are clipped or coarse, so that their error follows the motion."""

    @classmethod
    def build(cls, recordings: Sequence[Recording], model: WorldModel, names: Sequence[str]) -> _Prepared:
        runs, effects, why, spikes = [], [], {}, 0
        for recording, name in zip(recordings, names, strict=True):
            run = prepare_run(recording, model, name=name)
            checked = _check(model, run)
            runs.append(checked.run)
            effects.append(list(checked.effects))
            why.update(checked.why)
            spikes += checked.spikes
        rounded = any(effect.name in _ROUNDING for known in (model.effects, *effects) for effect in known)
        return cls(runs, effects, why, spikes, rounded)

    def segments(self, model: WorldModel) -> tuple[list[Segment], list[list[Effect]]]:
        """Return the segments and the effects known in each."""
        segments = make_segments(model, self.runs)
        for segment in segments:
            for effect in self.effects[segment.index]:
                if effect.name == "coarse_resolution":
                    segment.round_to(float(effect.parameters["step_m_s2"]))
        return segments, [_acting(self.effects[segment.index]) for segment in segments]


def _check(model: WorldModel, run: Run) -> IntegrityReport:
    prediction = np.concatenate([segment.predict([])[:, :-1] for segment in make_segments(model, [run])])
    return check_integrity(model, run, prediction)


def _acting(effects: Sequence[Effect]) -> list[Effect]:
    """Return the faults that change a noise-free prediction."""
    return [effect for effect in effects if effect.name in _WIRING]


def _explain(prepared: _Prepared, model: WorldModel, tell: Report) -> tuple[Explanation, Walk | None]:
    """Search for causes; where biases may wander, search again with a random walk in the noise and compare."""
    segments, fixed = prepared.segments(model)
    runs = len(prepared.runs)
    plain = explain_any_length(segments, fixed, runs, report=lambda share, text: tell(0.05 + 0.7 * share, text))
    # A walk passes for anything slow, so it is looked for in what the other causes leave.
    quick = [cause for cause in plain.fit.causes if cause.name not in _SLOW]
    same = len(quick) == len(plain.fit.causes)
    base = plain.fit if same else refine(segments, quick, fixed, drives=plain.fit.drives)
    plain_value = plain.fit.log_posterior + noise_log_determinant(segments)
    found: tuple[Explanation, Walk] | None = None
    odds = 0.0
    before = segments
    for _ in range(_WALK_ROUNDS):
        walk = walk_strength(before, base, fixed)
        if found is None and (walk.log_odds < WALK_ODDS or known_walk(model) > 0):
            break
        if found is not None and abs(walk.strength - found[1].strength) < walk.std:
            found = found[0], walk
            break
        tell(0.8, "wandering biases")
        other, _ = prepared.segments(model)
        for segment, old in zip(other, before, strict=True):
            segment.adopt(old)
            segment.levels = NoiseLevels(old.levels.white, old.levels.flicker, walk.strength)
        wandering = explain_any_length(other, fixed, runs, start=base.causes)
        odds = wandering.fit.log_posterior + noise_log_determinant(other) - np.log(len(model.families())) - plain_value
        found = wandering, walk
        before, base = other, wandering.fit
    if found is None or odds < LEAST_EXTRA_ODDS or found[1].unequal > UNEQUAL_WALK:
        return plain, None
    return found[0], replace(found[1], log_odds=float(odds))


def _holdouts(
    explanation: Explanation, prepared: _Prepared, held_out: Sequence[Recording], model: WorldModel
) -> tuple[list[Holdout], str]:
    """Pair fitted and held-out data for the gain: other recordings where given, blocks of the run otherwise."""
    if not held_out:
        return split_segments(
            explanation.segments, explanation.fixed
        ), "blocks of the recording, odd and even from each other"
    other = _Prepared.build(held_out, model, [f"held out {n + 1}" for n in range(len(held_out))])
    segments, known = other.segments(model)
    for segment in segments:
        segment.set_levels(explanation.segments[0].levels)
        segment.prepare_weights()
        segment.index = 0
    fitted = list(explanation.segments)
    return [Holdout(fitted, [list(f) for f in explanation.fixed], segments, known)], "another recording"


def _gate(
    explanation: Explanation, pairs: Sequence[Holdout], *, other_recording: bool
) -> tuple[Explanation, list[str]]:
    """Withdraw causes that do not predict held-out data; returns what is left and the names withdrawn."""
    fit, without = explanation.fit, explanation.without
    withdrawn: list[str] = []
    while fit.causes:
        gains = gate_gains(fit, without, pairs, other_recording=other_recording)
        worst = min(gains, key=lambda name: gains[name])
        if gains[worst] >= LEAST_GAIN:
            break
        withdrawn.append(worst)
        fit, without = prune(explanation.segments, without[worst], explanation.fixed)
    for segment, drive in zip(explanation.segments, fit.drives, strict=True):
        segment.coefficients = drive
    return replace(explanation, fit=fit, without=without), withdrawn


def _verdict(
    prepared: _Prepared,
    model: WorldModel,
    explanation: Explanation,
    walk: Walk | None,
    left: LeftOver,
    gain: Gain,
    withdrawn: Sequence[str],
) -> Diagnosis:
    """Put everything together."""
    array = model.array
    fit = explanation.fit
    found = [*_integrity_causes(prepared), *_stochastic_causes(explanation, walk)]
    likely = probabilities(explanation)
    rivals = conflicting(explanation)
    named = _named(explanation, fit, likely, array)
    removed = explanation.nothing.objective - fit.objective
    # No model is exact: what is left must also stand out against what the causes explain.
    significant = left.log_odds > (LEFT_OVER_ODDS if left.instead else max(LEFT_OVER_ODDS, _INEXACTNESS * removed))
    dominant = significant and (left.instead or 2 * left.log_odds > _DOMINANT * max(removed, 0.0))
    runs = tuple(_view(prepared, number, explanation, found) for number in range(len(prepared.runs)))
    extension = [cause.effect(array) for cause in fit.causes] if not dominant else []
    twin = model.extended([*_library_effects(model, found), *extension])
    if dominant:
        verdict, causes = "unknown", tuple(found)
    elif rivals:
        verdict = "ambiguous"
        others = [cause for rival in rivals for cause in _named(explanation, rival, likely, array)]
        causes = _mutual([*named, *(other for other in others if other.effect not in fit.names)], fit, rivals)
        causes = (*found, *causes)
    elif named or found:
        verdict, causes = "explained", (*found, *named)
    else:
        verdict, causes = "nothing_found", ()
    unexplained = Unexplained(significant, left.signature if significant else "", left.log_odds, left.surrogate)
    residual = _residual(runs, explanation)
    levels = explanation.segments[0].levels
    expected = model.expected_noise(1.0 / prepared.runs[0].sample_period)
    noise = {
        "white_over_data_sheet": float(np.median(levels.white[:-1] / expected.white)),
        "bias_instability_m_s2": float(np.median(levels.flicker[:-1])),
        "reference_white": float(levels.white[-1]),
    }
    words = verdict_sentences(verdict, causes, residual, gain, unexplained, withdrawn)
    return Diagnosis(verdict, causes, residual, gain, unexplained, rival_list(explanation), twin, runs, words, noise)


def _named(explanation: Explanation, fit: Fit, likely: dict[str, float], array: AccelerometerArray) -> list[NamedCause]:
    """Return the causes of a fit as the verdict names them, the largest contribution first."""
    segment = explanation.segments[0]
    known = explanation.fixed[0]
    whole = segment.predict([*known, *effects_of_run(fit.causes, array, segment.index)])
    entries = []
    for cause in fit.causes:
        others = [other for other in fit.causes if other.name != cause.name]
        change = whole - segment.predict([*known, *effects_of_run(others, array, segment.index)])
        share = channel_share(change[:, :-1] * segment.weight_mask[:, :-1], array.channels)
        parameters, std = cause_parameters(cause, array)
        same = mimics(explanation, cause) if fit is explanation.fit else []
        odds = (
            float(fit.log_posterior - explanation.without[cause.name].log_posterior)
            if cause.name in explanation.without
            else 0.0
        )
        entry = NamedCause(
            cause.name,
            parameters,
            std,
            likely.get(cause.name, 0.0),
            cause.pattern,
            tuple(same),
            str(cause.family.separated_by) if same else "",
            describe(cause, array, share) + _other_runs(cause, array, len({s.index for s in explanation.segments})),
            odds,
        )
        entries.append((float(sum(value**2 for value in share.values())), entry))
    return [entry for _, entry in sorted(entries, key=lambda pair: -pair[0])]


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


def _mutual(named: Sequence[NamedCause], fit: Fit, rivals: Sequence[Fit]) -> tuple[NamedCause, ...]:
    """Let each cause that may be another list the others."""
    shared = frozenset.intersection(fit.names, *(rival.names for rival in rivals))
    contested = list(dict.fromkeys(cause.effect for cause in named if cause.effect not in shared))
    out = []
    for cause in named:
        if cause.effect in shared:
            out.append(cause)
            continue
        others = tuple(dict.fromkeys([*(n for n in contested if n != cause.effect), *cause.not_distinguishable_from]))
        text = cause.would_be_separated_by or "several speeds in both directions, and the cube remounted on its side"
        out.append(replace(cause, not_distinguishable_from=others, would_be_separated_by=text))
    return tuple(out)


def _integrity_causes(prepared: _Prepared) -> list[NamedCause]:
    """Return the faults seen in the samples, each once."""
    causes: dict[str, NamedCause] = {}
    for effects in prepared.effects:
        for effect in effects:
            if effect.name not in causes:
                causes[effect.name] = NamedCause(
                    str(effect.name), dict(effect.parameters), {}, 0.999, why=prepared.why.get(effect.name, "")
                )
    return list(causes.values())


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
                0.99,
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
                0.999,
                why=f"the white noise of all channels is {factor:.2f} times the data sheet's",
            )
        )
    return causes


def _library_effects(model: WorldModel, causes: Sequence[NamedCause]) -> list[Effect]:
    families = model.families()
    return [families[cause.effect](cause.parameters) for cause in causes if cause.effect in families]


def _view(prepared: _Prepared, number: int, explanation: Explanation, found: Sequence[NamedCause]) -> RunView:
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
        states.append(segment.spin.at(segment.run.t))
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


def _residual(runs: Sequence[RunView], explanation: Explanation) -> Residual:
    """Measure the residual before and after over valid samples."""
    channels = explanation.segments[0].model.array.channels
    use = np.concatenate([run.valid for run in runs])
    measured = np.concatenate([run.measured for run in runs])
    before = np.where(use, measured - np.concatenate([run.before for run in runs]), 0.0)
    after = np.where(use, measured - np.concatenate([run.after for run in runs]), 0.0)
    count = np.maximum(use.sum(axis=0), 1)
    levels = explanation.segments[0].levels
    floor = levels.white[:-1] ** 2 + 0.6 * levels.flicker[:-1] ** 2 + explanation.segments[0].rounding ** 2 / 12.0
    return Residual(
        float(np.sqrt(np.sum(before**2) / count.sum())),
        float(np.sqrt(np.sum(after**2) / count.sum())),
        float(np.sqrt(np.sum(floor * count) / count.sum())),
        dict(zip(channels, map(float, np.sqrt(np.sum(before**2, axis=0) / count)), strict=True)),
        dict(zip(channels, map(float, np.sqrt(np.sum(after**2, axis=0) / count)), strict=True)),
    )
