"""Diagnosis from end to end: recordings and a twin in, a verdict out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from gfimu.diagnosis.adequacy import LEFT_OVER_ODDS, left_over
from gfimu.diagnosis.causes import effects_of_run
from gfimu.diagnosis.conclusion import Described, conclude, is_dominant, is_unknown
from gfimu.diagnosis.data.prepared_runs import PreparedRuns
from gfimu.diagnosis.explanation import Explanation
from gfimu.diagnosis.free_body.diagnose import diagnose_body
from gfimu.diagnosis.gate import impossible_sizes, judge, measurable
from gfimu.diagnosis.holdout import Holdout, gate_gains, held_out_gain, split_segments
from gfimu.diagnosis.long_run import explain_any_length
from gfimu.diagnosis.loose_calibration import LooseCalibration, loosen, relearned
from gfimu.diagnosis.naming import conflicting
from gfimu.diagnosis.nuisances import sharpen_drives, tune_drives
from gfimu.diagnosis.parallel import one_blas_thread
from gfimu.diagnosis.pruning import prune
from gfimu.diagnosis.refinement import refine
from gfimu.diagnosis.residual_tests import LeftOver
from gfimu.diagnosis.stochastic import UNEQUAL_WALK, WALK_ODDS, Walk, walk_strength
from gfimu.diagnosis.surrogate import surrogates
from gfimu.diagnosis.verdict.sample_notes import with_sample_notes
from gfimu.diagnosis.verdict.verdict import Diagnosis, Gain, NamedCause
from gfimu.diagnosis.wandering_biases import wanders, with_walk
from gfimu.errors import InputError
from gfimu.recording import Recording
from gfimu.recording.carried_array import warn_of_other_array
from gfimu.world_model import Effect, WorldModel, is_of_one_recording

__all__ = ["diagnose"]

Report = Callable[[float, str], None]

LEAST_GAIN = 2.0
"""Log predictive gain on held-out blocks below which a cause is withdrawn."""


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
    held_labels = [f"held-out run {number + 1}" for number in range(len(held_out))]
    for recording, label in zip((*recordings, *held_out), (*labels, *held_labels), strict=True):
        warn_of_other_array(recording.metadata, model.array, label)
    with one_blas_thread():
        if model.drive_source == "gyro":
            return diagnose_body(recordings, model, held_out=held_out, names=labels, report=tell)
        return _diagnose_table(recordings, model, held_out, labels, tell)


def _diagnose_table(
    recordings: Sequence[Recording],
    model: WorldModel,
    held_out: Sequence[Recording],
    labels: Sequence[str],
    tell: Report,
) -> Diagnosis:
    """Diagnose a unit on a table, whose drive is one smooth unknown."""
    tell(0.02, "read")
    prepared = PreparedRuns.build(recordings, model, labels)
    return with_sample_notes(_diagnose_prepared(prepared, model, held_out, tell), prepared.runs)


def _diagnose_prepared(
    prepared: PreparedRuns, model: WorldModel, held_out: Sequence[Recording], tell: Report
) -> Diagnosis:
    """Diagnose runs that have been read and checked."""
    explanation, walk, loose = _explain(prepared, model, tell)
    tell(0.92, "hold out")
    pairs, label = _holdouts(explanation, held_out, model, () if loose is None else loose.effects)
    left = _left_over(explanation, prepared)
    if not is_dominant(explanation, left):
        if explanation.given_up:  # too early
            explanation = _pruned(explanation)
            left = _left_over(explanation, prepared)
            loose = None if loose is None else replace(loose, explanation=explanation, held=explanation)
        if loose is None:  # beside a residue nothing is large
            explanation, left = _without_faint(explanation, left, prepared)
    withdrawn: list[str] = []
    # Where too much is left for any cause to be believed there is nothing to withdraw.
    if explanation.fit.causes and not is_dominant(explanation, left):
        judged = explanation if loose is None else loose.held
        if not held_out:
            unseen = split_segments(explanation.segments, explanation.fixed, explanation.fit.causes, duration=np.inf)
        else:
            unseen = pairs
        gated, withdrawn = _gate(judged, unseen, other_recording=bool(held_out))
        if withdrawn:
            explanation, left = gated, _left_over(gated, prepared)
    tell(0.97, "measure the gain")
    gain = Gain()
    if not is_dominant(explanation, left):
        if loose is not None:
            pairs = relearned(loose, explanation.fit.causes, pairs)
        gain = _gain(explanation, pairs, label)
    refuted = ""
    if not is_unknown(explanation, left, gain):
        found = conclude(prepared, model, explanation, walk, loose, left, gain, withdrawn)
        causes = [cause for cause in found.causes if cause.effect in _fitted(explanation)]
        refuted = _impossible(explanation, causes, model)
        if refuted:  # nothing that such a twin leaves is worth a description
            return conclude(prepared, model, explanation, walk, loose, left, Gain(), withdrawn, refuted=refuted)
        refuted = judge(gain, found.residual, causes).why
        if not refuted:
            told = measurable(gain)
            if told is gain:
                return found
            return conclude(prepared, model, explanation, walk, loose, left, told, withdrawn)
    described, gain = _describe(explanation, left, held_out, model, () if loose is None else loose.effects)
    walk = None if walk is None or described is None else _left_wandering(described.whole, walk)
    return conclude(prepared, model, explanation, walk, loose, left, gain, withdrawn, described, refuted)


def _fitted(explanation: Explanation) -> frozenset[str]:
    """Return the names of the causes that were fitted, and of those in their place that the data can't tell apart."""
    return frozenset().union(explanation.fit.names, *(rival.names for rival in explanation.rivals))


def _impossible(explanation: Explanation, causes: Sequence[NamedCause], model: WorldModel) -> str:
    """Return the signature where every set of causes that the data can't tell apart holds a size beyond physics."""
    sets = [explanation.fit.names, *(rival.names for rival in conflicting(explanation))]
    found = [
        impossible_sizes([cause for cause in causes if cause.effect in names], model.families(), model.array)
        for names in sets
    ]
    return found[0] if all(found) else ""


def _left_wandering(described: Explanation, walk: Walk) -> Walk | None:
    """Return a walk if one is left where what has no name is described: that passes for a walk too."""
    left = walk_strength(described.segments, described.fit, described.fixed)
    return walk if left.log_odds > WALK_ODDS and left.unequal < UNEQUAL_WALK else None


def _pruned(explanation: Explanation) -> Explanation:
    """Judge the causes of a search that was given up, its drives at what is left of them."""
    fit, without = prune(explanation.segments, explanation.fit, explanation.fixed)
    for segment, drive in zip(explanation.segments, fit.drives, strict=True):
        segment.coefficients = drive
    return replace(explanation, fit=fit, without=without, given_up=False)


def _describe(
    explanation: Explanation,
    left: LeftOver,
    held_out: Sequence[Recording],
    model: WorldModel,
    residue: Sequence[Effect],
) -> tuple[Described | None, Gain]:
    """Describe what has no name by a surrogate, and keep it where it predicts data that its fit never saw.

    Terms of absolute time have the phase of one recording: only another one can confirm them.
    """
    found = surrogates(explanation.segments, explanation.nothing, explanation.fixed, left.hints)
    # The richest that predicts; if that was too rich, the poorest.
    for surrogate in [*found[-1:], *found[:-1][:1]]:
        whole = replace(explanation, fit=surrogate.fit, segments=surrogate.segments)
        pairs, label = _holdouts(whole, held_out, model, residue)
        gain = _gain(whole, pairs, label)
        kept = tuple(cause for cause in whole.fit.causes if not is_of_one_recording(cause.family))
        carried = replace(whole, fit=replace(whole.fit, causes=kept)) if kept else None
        if len(kept) < len(whole.fit.causes) and held_out:
            alone = _gain(carried, pairs, label) if carried is not None else Gain()
            samples = sum(len(segment.run.t) for pair in pairs for segment in pair.test)
            better = gain.log_likelihood_per_sample - float(np.nan_to_num(alone.log_likelihood_per_sample))
            if better * samples > LEAST_GAIN:
                carried = whole
            else:
                gain = alone
        elif carried is not None and gain.share_in_any_recording <= 0.0:
            carried = None
        if gain.log_likelihood_per_sample > 0.0:
            return Described(whole, carried), gain
    return None, Gain()


def _without_faint(explanation: Explanation, left: LeftOver, prepared: PreparedRuns) -> tuple[Explanation, LeftOver]:
    """Leave out causes that explain less than what nothing explains: beside a large one they are made of its rest."""
    fit, without = explanation.fit, explanation.without
    while left.log_odds > LEFT_OVER_ODDS and len(fit.causes) > 1:
        worth = {name: fit.log_posterior - other.log_posterior for name, other in without.items()}
        largest = max(worth, key=worth.__getitem__)
        kept = [cause for cause in fit.causes if cause.name == largest or worth[cause.name] > left.log_odds]
        if len(kept) == len(fit.causes):
            break
        smaller = refine(explanation.segments, kept, explanation.fixed, drives=fit.drives)
        fit, without = prune(explanation.segments, smaller, explanation.fixed)
        for segment, drive in zip(explanation.segments, fit.drives, strict=True):
            segment.coefficients = drive
        rivals = tuple(rival for rival in explanation.rivals if rival.log_posterior < fit.log_posterior)
        explanation = replace(explanation, fit=fit, without=without, rivals=rivals)
        left = _left_over(explanation, prepared)
    return explanation, left


def _left_over(explanation: Explanation, prepared: PreparedRuns) -> LeftOver:
    return left_over(
        explanation.segments, explanation.fit, explanation.fixed, prepared.spikes, rounded=prepared.rounded
    )


def _gain(explanation: Explanation, pairs: Sequence[Holdout], label: str) -> Gain:
    """Measure what all that was found is worth on data the fit never saw."""
    if not explanation.fit.causes and not any(explanation.fixed):
        return Gain()
    constant = [effect for pair in pairs for known in pair.train_fixed for effect in known]
    return held_out_gain(explanation.fit.causes, pairs, constant, label=label)


def _explain(
    prepared: PreparedRuns, model: WorldModel, tell: Report
) -> tuple[Explanation, Walk | None, LooseCalibration | None]:
    """Search for causes, then again with a calibration residue and with wandering biases, and compare."""
    segments, fixed = prepared.segments(model)
    runs = len(prepared.runs)

    def told(share: float, text: str) -> None:
        tell(0.05 + 0.7 * share, text)

    plain = explain_any_length(segments, fixed, runs, instead=wanders, report=told)
    loose = None
    if plain.left_for == "walk":
        found = with_walk(plain, prepared, model, given_up=False, report=lambda text: tell(0.6, text))
        if found is not None:
            return (*found, None)
    elif plain.left_for == "residue":
        tell(0.6, "calibration residue")
        loose, _ = loosen(plain, prepared, model)
    if plain.left_for and loose is None:
        segments, fixed = prepared.segments(model)
        plain = explain_any_length(segments, fixed, runs, report=told)
    if loose is None:
        tell(0.76, "calibration residue")
        loose, plain = loosen(plain, prepared, model)
    judged = plain
    if loose is not None:
        plain, judged = loose.explanation, loose.held
    found = with_walk(judged, prepared, model, given_up=plain.given_up, report=lambda text: tell(0.8, text))
    if found is None:
        return plain, None, loose
    wandering, walk = found
    if loose is not None:
        loose = replace(loose, explanation=wandering, held=wandering)
    return wandering, walk, loose


def _holdouts(
    explanation: Explanation, held_out: Sequence[Recording], model: WorldModel, residue: Sequence[Effect]
) -> tuple[list[Holdout], str]:
    """Pair fitted and held-out data for the gain: other recordings where given, blocks of the run otherwise."""
    if not held_out:
        return split_segments(
            explanation.segments, explanation.fixed, explanation.fit.causes
        ), "blocks of the recording, odd and even from each other"
    other = PreparedRuns.build(held_out, model, [f"held out {n + 1}" for n in range(len(held_out))])
    segments, known = other.segments(model)
    for segment, effects in zip(segments, known, strict=True):
        segment.set_levels(explanation.segments[0].levels)
        segment.prepare_weights()
        segment.index, segment.ringing = 0, explanation.segments[0].ringing
        segment.reach_out([*effects, *effects_of_run(explanation.fit.causes, model.array, segment.index)])
    fitted = list(explanation.segments)
    kept = [[*effects, *residue] for effects in known]
    # Its drive is no less free than those that were fitted.
    fit = refine(segments, explanation.fit.causes, kept, shapes=False)
    tune_drives(segments, fit, kept)
    for segment, drive in zip(segments, sharpen_drives(segments, fit, kept).drives, strict=True):
        segment.coefficients = drive
    return [Holdout(fitted, [list(f) for f in explanation.fixed], segments, kept)], "another recording"


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
