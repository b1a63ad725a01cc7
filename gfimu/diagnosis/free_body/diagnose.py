"""Diagnosis of a free body from end to end: recordings with a gyro and a twin in, a verdict out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.diagnosis.adequacy import LEFT_OVER_ODDS
from gfimu.diagnosis.causes import Cause, effects_of_run
from gfimu.diagnosis.data.integrity import check_integrity
from gfimu.diagnosis.data.run import Run
from gfimu.diagnosis.explanation import Explanation
from gfimu.diagnosis.fit import Fit
from gfimu.diagnosis.free_body.engine import explain, without_cause
from gfimu.diagnosis.free_body.holdout import (
    BodyHoldout,
    gate_gains,
    held_out_gain,
    other_recording,
    stretches,
)
from gfimu.diagnosis.free_body.left_over import motion_noise, structure_left
from gfimu.diagnosis.free_body.run import BodyRun, prepare_body_run
from gfimu.diagnosis.free_body.segment import BodySegment
from gfimu.diagnosis.free_body.undetermined import undetermined, undetermined_sentence
from gfimu.diagnosis.gate import impossible_sizes, judge
from gfimu.diagnosis.named_causes import contested, fault_causes, name_cause
from gfimu.diagnosis.naming import channel_share, conflicting, probabilities, rival_list
from gfimu.diagnosis.report.wording import verdict_sentences
from gfimu.diagnosis.residual_tests import LeftOver
from gfimu.diagnosis.verdict.sample_notes import with_sample_notes
from gfimu.diagnosis.verdict.verdict import Diagnosis, Gain, NamedCause, Residual, RunView, Unexplained
from gfimu.errors import InputError
from gfimu.motion.attitude import from_rotation, integrate_attitude, to_rotation
from gfimu.recording import Recording
from gfimu.world_model import BodyModel, Effect, WorldModel

__all__ = ["diagnose_body"]

Report = Callable[[float, str], None]

_LEAST_GAIN = 2.0
_DOMINANT = 0.1
_INEXACTNESS = 2.5e-3
_WIRING = ("axis_swap", "sign_flip", "wrong_range")
_SWEEPS = 12
_MOST_SPIKES = 2e-3
_ALIVE = 0.5  # of the samples, with a value
_FEWEST = 80  # samples


def diagnose_body(
    recordings: Sequence[Recording],
    model: WorldModel,
    *,
    held_out: Sequence[Recording] = (),
    names: Sequence[str],
    report: Report,
) -> Diagnosis:
    """Diagnose recordings of a body that moves freely, its rate from a gyro, its specific force unknown.

    Parameters
    ----------
    recordings, model, held_out, names, report
        As `gfimu.diagnosis.diagnose.diagnose` has them; the twin's drive source is ``gyro``.
    """
    if not isinstance(model, BodyModel):
        raise InputError("the simulation predicts no free body; drive it by tacho, angle or command, not by gyro")
    report(0.02, "read")
    prepared = _Prepared.build(recordings, model, names)
    segments, fixed = prepared.segments, prepared.fixed
    explanation = explain(segments, fixed, report=lambda share, text: report(0.03 + 0.8 * share, text))
    report(0.85, "hold out")
    kept = None
    if held_out:
        kept = _Prepared.build(held_out, model, [f"held out {n + 1}" for n in range(len(held_out))])
    pairs = _pairs(prepared, kept, explanation)
    withdrawn: list[str] = []
    while explanation.fit.causes:
        gains = gate_gains(explanation.fit.causes, pairs)
        worst = min(gains, key=lambda name: gains[name])
        if gains[worst] >= _LEAST_GAIN:
            break
        withdrawn.append(worst)
        explanation = without_cause(segments, explanation.fit.causes, fixed, worst)
    report(0.92, "look at what is left")
    noise = motion_noise(segments)
    structure, tone = structure_left(segments, explanation.fit.causes, fixed)
    report(0.96, "measure the gain")
    gain, over_noise = Gain(), float("nan")
    if explanation.fit.causes or any(fixed):
        constant = [effect for effects in fixed for effect in effects]
        label = "another recording" if kept else "stretches of the recording, each from the others"
        gain, over_noise = held_out_gain(explanation.fit.causes, pairs, constant, label)
    found = _verdict(prepared, explanation, (structure, tone, noise), gain, withdrawn, over_noise)
    return with_sample_notes(found, [segment.run for segment in segments])


@dataclass(frozen=True)
class _Prepared:
    """Runs after the integrity check, with the faults found in each."""

    model: BodyModel
    segments: list[BodySegment]
    faults: list[list[Effect]]
    why: dict[str, str]

    @classmethod
    def build(cls, recordings: Sequence[Recording], model: BodyModel, names: Sequence[str]) -> _Prepared:
        segments, faults, why = [], [], {}
        for number, (recording, name) in enumerate(zip(recordings, names, strict=True)):
            body = prepare_body_run(recording, model, name=name)
            _refuse_too_few(body.run, model, name)
            checked = check_integrity(model, body.run, robust_prediction(BodySegment(model, body, number)))
            run = checked.run
            if checked.spikes > _MOST_SPIKES * run.valid.size:
                # So many are no faults: the hand moves faster than the samples follow.
                run = replace(run, valid=run.valid | body.run.valid & ~_lost_for_good(body, run.valid))
            _refuse_too_few(run, model, name)
            segments.append(BodySegment(model, replace(body, run=run), number))
            faults.append(list(checked.effects))
            why.update(checked.why)
        return cls(model, segments, faults, why)

    @property
    def fixed(self) -> list[list[Effect]]:
        """Faults of the wiring, which change a noise-free prediction."""
        return [[effect for effect in effects if effect.name in _WIRING] for effects in self.faults]


def _refuse_too_few(run: Run, model: BodyModel, name: str) -> None:
    """Refuse channels that the unknown specific force follows exactly: those of one chip, or too few with values."""
    alive = run.valid.mean(axis=0) > _ALIVE
    if alive.sum() - np.linalg.matrix_rank(model.array.axes[alive]) < 1:
        raise InputError(
            f"{name}: {int(alive.sum())} channels with values leave nothing to compare, as the specific force of a "
            "free body is unknown; record the channels of two chips at least"
        )
    whole = int(run.valid[:, alive].all(axis=1).sum())
    if whole < _FEWEST:
        raise InputError(
            f"{name}: {whole} samples have a value of every channel; a free body needs {_FEWEST}: record again "
            "within the range of the sensors"
        )


def _lost_for_good(body: BodyRun, valid: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Mark invalid stretches: those of a frozen or clipped channel, and no isolated samples."""
    lost = body.run.valid & ~valid
    return lost & (np.roll(lost, 1, axis=0) | np.roll(lost, -1, axis=0))


def robust_prediction(segment: BodySegment) -> NDArray[np.float64]:
    """Predict the channels with the specific force that most of them agree on, shape (n, c), m/s².

    A few exchanged or inverted channels must not draw the specific force their way: each channel is weighted by how
    well the others predict it, again and again.
    """
    array, run = segment.model.array, segment.run
    rigid = segment.predict([], segment.drive.with_force(np.zeros_like(segment.drive.force)))
    rest = np.where(run.valid, run.readings - rigid, 0.0)
    axes = array.axes
    weight = segment.alive.astype(float)
    rows = slice(None, None, max(1, len(run.t) // 4000))
    for _ in range(_SWEEPS):
        inverse = np.linalg.pinv(axes * weight[:, None]) * weight
        left = rest[rows] - (rest[rows] @ inverse.T) @ axes.T
        spread = np.median(np.abs(left), axis=0) + np.sqrt(np.mean(left**2, axis=0))
        typical = float(np.median(spread[segment.alive]))
        weight = np.where(segment.alive, 1.0 / (0.1 * typical + spread), 0.0)
        weight /= weight.max()
    return np.asarray(rigid + (rest @ inverse.T) @ axes.T)


def _pairs(prepared: _Prepared, kept: _Prepared | None, explanation: Explanation) -> list[BodyHoldout]:
    if kept is None:
        return stretches(prepared.segments, prepared.fixed)
    for segment in kept.segments:
        segment.index = 0
    return other_recording(prepared.segments, prepared.fixed, kept.segments, kept.fixed, explanation.fit.causes)


def _verdict(
    prepared: _Prepared,
    explanation: Explanation,
    left: tuple[LeftOver, LeftOver, LeftOver],
    gain: Gain,
    withdrawn: Sequence[str],
    over_noise: float,
) -> Diagnosis:
    """Put everything together; ``over_noise`` is the share of the held-out misfit over all noise that is removed."""
    model, segments = prepared.model, prepared.segments
    fit = explanation.fit
    removed = max(explanation.nothing.objective - fit.objective, 0.0)
    # No model is exact: what follows the motion must also stand out against what the causes explain.
    thresholds = (max(LEFT_OVER_ODDS, _INEXACTNESS * removed), LEFT_OVER_ODDS, LEFT_OVER_ODDS)
    told = [one for one, threshold in zip(left, thresholds, strict=True) if one.log_odds > threshold]
    dominant = any(2 * one.log_odds > _DOMINANT * removed for one in told if one is not left[-1])
    found = fault_causes((effect for effects in prepared.faults for effect in effects), prepared.why)
    likely = probabilities(explanation)
    named = [_named(explanation, fit, cause, likely, segments[0]) for cause in fit.causes]
    rivals = conflicting(explanation)
    families = model.families()
    views = _views(prepared, fit.causes)
    residual = Residual.of_views(views, model.array.channels, segments[0].noise_floor)
    refuted = _refuted(named, residual, replace(gain, share_of_excess_removed=over_noise), model)
    if refuted or dominant:
        views = _views(prepared, ())
        residual = Residual.of_views(views, model.array.channels, segments[0].noise_floor)
        gain = Gain()  # nothing stands that could be worth something
    dominant = dominant or bool(refuted)
    extension = [] if dominant else [cause.effect(model.array) for cause in fit.causes]
    faults = [families[cause.effect](cause.parameters) for cause in found if cause.effect in families]
    causes: tuple[NamedCause, ...] = (*found, *named)
    if dominant or (told and not causes):
        verdict, causes = "unknown", tuple(found)
    elif rivals:
        verdict = "ambiguous"
        others = {cause.name: (rival, cause) for rival in rivals for cause in rival.causes}
        every = [
            *named,
            *(_named(explanation, *at, likely, segments[0]) for name, at in others.items() if name not in fit.names),
        ]
        causes = (*found, *contested(every, [fit, *rivals], families))
    else:
        verdict = "explained" if causes else "nothing_found"
    unexplained = Unexplained(
        bool(told) or bool(refuted),
        "; ".join([*([refuted] if refuted else []), *(one.signature for one in told)]),
        max(one.log_odds for one in left),
        {key: value for one in told for key, value in one.surrogate.items()},
    )
    unseen = undetermined(explanation.signatures, model.array)
    words = verdict_sentences(verdict, causes, residual, gain, unexplained, withdrawn)
    words = (*words, undetermined_sentence(unseen)) if unseen else words
    first = segments[0]
    expected = model.expected_noise(1.0 / first.run.sample_period)
    alive = first.alive
    levels = {
        "white_over_data_sheet": float(np.median(first.noise.white[alive] / expected.white[alive])),
        "bias_instability_m_s2": first.noise.flicker,
        "disagreement_s": first.noise.agitation,
        "gyro_bias_rad_s": float(np.linalg.norm(first.body.gyro_bias)),
    }
    twin = model.extended([*faults, *extension])
    combinations = tuple(one.to_dict() for one in unseen)
    rivals_told = rival_list(explanation)
    return Diagnosis(
        verdict, causes, residual, gain, unexplained, rivals_told, twin, views, words, levels, undetermined=combinations
    )


def _refuted(named: Sequence[NamedCause], residual: Residual, gain: Gain, model: BodyModel) -> str:
    """Return why causes must not stand, or nothing: the gate's word, or sizes that no part can have."""
    beyond = impossible_sizes(named, model.families(), model.array)
    return beyond or judge(gain, residual, named).why


def _views(prepared: _Prepared, causes: Sequence[Cause]) -> tuple[RunView, ...]:
    pairs = zip(prepared.segments, prepared.fixed, strict=True)
    return tuple(_view(segment, known, causes) for segment, known in pairs)


def _named(
    explanation: Explanation, fit: Fit, cause: Cause, likely: dict[str, float], segment: BodySegment
) -> NamedCause:
    array = segment.model.array
    change = segment.predict([cause.effect(array, segment.index)]) - segment.predict([])
    seen = change - (change @ segment.projection.to_force.T) @ array.axes.T
    return name_cause(explanation, fit, cause, likely, array, channel_share(seen, array.channels))


def _view(segment: BodySegment, known: Sequence[Effect], causes: Sequence[Cause]) -> RunView:
    """Collect a run for pictures: the motion, as far as the gyro doesn't hold it, is fitted before and after alike."""
    run = segment.run
    measured = np.where(run.valid, run.readings, 0.0)
    predictions = []
    for effects in ([], [*known, *effects_of_run(causes, segment.model.array, segment.index)]):
        line = segment.linearise(effects)
        predictions.append(measured - segment.motion_removed(line))
    rate, acceleration = line.drive.rate_at()
    speed = np.linalg.norm(rate, axis=1)
    valid = run.valid & segment.use[:, None] & segment.alive
    white = np.where(segment.alive, segment.noise.white, segment.noise.typical)
    return RunView(
        run.name,
        run.t,
        run.readings,
        valid,
        predictions[0],
        predictions[1],
        np.linalg.norm(segment.body.gyro, axis=1),
        speed,
        speed,
        np.full(len(run.t), np.nan),
        speed,
        np.linalg.norm(acceleration, axis=1),
        run.temperature,
        white,
        _attitude(segment, rate),
    )


def _attitude(segment: BodySegment, rate: NDArray[np.float64]) -> NDArray[np.float64]:
    """Integrate the rate from the run's first rest, or its start, with gravity along z there; shape (n, 4)."""
    t, rest = segment.run.t, np.flatnonzero(segment.body.rest)
    up = segment.drive.force[rest[0] if len(rest) else 0]
    turned = to_rotation(integrate_attitude(t, rate))
    here = turned[int(rest[0]) if len(rest) else 0]
    level, _ = Rotation.align_vectors([[0.0, 0.0, 1.0]], [here.apply(up)])
    return from_rotation(level * turned)
