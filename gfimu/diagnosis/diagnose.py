"""Diagnosis from end to end: recordings and a twin in, a verdict out."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from gfimu.base.errors import InputError
from gfimu.diagnosis.data.body.prepared import prepare_bodies
from gfimu.diagnosis.data.prepared_runs import PreparedRuns
from gfimu.diagnosis.fit.learn import predicted_by_reference
from gfimu.diagnosis.fit.parallel import one_blas_thread
from gfimu.diagnosis.one_library import STAGES, WIDER, LibraryDiagnosis, Report, interrupted, stretches_of
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.search.nuisance_models import Understanding
from gfimu.diagnosis.time_limit import limited_to, unlimited, what_ended
from gfimu.diagnosis.verdict.library import with_wider_library
from gfimu.diagnosis.verdict.place import with_place
from gfimu.diagnosis.verdict.sample_notes import with_sample_notes
from gfimu.diagnosis.verdict.verdict import Diagnosis
from gfimu.model.world_model import WorldModel
from gfimu.rate.axis.axis_gyro import with_axis_gyro
from gfimu.recording import Recording
from gfimu.recording.carried_array import warn_of_other_array
from gfimu.recording.timing.reference_times import reference_on_rows

__all__ = ["diagnose", "prepare"]


def diagnose(
    recordings: Sequence[Recording],
    model: WorldModel,
    *,
    held_out: Sequence[Recording] = (),
    names: Sequence[str] | None = None,
    report: Report | None = None,
    policy: Policy | None = None,
    force: bool = False,
) -> Diagnosis:
    """Show what a simulation gets wrong, name the cause, extend the model, measure the gain.

    Parameters
    ----------
    recordings : sequence of Recording
        One or several runs of the same unit; each may have its own mounting in its metadata.
    model : WorldModel
        Assumptions of the simulation about the rig.
    held_out : sequence of Recording
        Runs that are kept for the gate and the gain.
    names : sequence of str, optional
        Names of the runs, for the report.
    report : callable, optional
        Called with the share done (0 to 1) and a line of text.
    policy : Policy, optional
        Other thresholds than the usual ones.
    force : bool
        Go on, with a warning, with a run that fits the simulation in another unit or the like only.

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
    progress = report or (lambda share, text: None)
    labels = list(names) if names is not None else [f"run {index + 1}" for index in range(len(recordings))]
    held_labels = [f"held-out run {number + 1}" for number in range(len(held_out))]
    for recording, label in zip((*recordings, *held_out), (*labels, *held_labels), strict=True):
        warn_of_other_array(recording.metadata, model.array, label)
    with one_blas_thread(), limited_to(np.inf):
        settings = policy or Policy()
        if model.drive_source == "gyro":
            settings = settings.of_body()
        progress(0.02, "read")
        with unlimited():  # without the samples nothing is known
            prepared = prepare(recordings, model, labels, settings, force=force)
            kept = prepare(held_out, model, held_labels, settings, force=force) if held_out else None
        try:
            found = _by_stages(prepared, kept, model, settings, progress)
        except np.linalg.LinAlgError as error:
            runs = ", ".join(labels)
            raise InputError(
                f"{runs}: the equations of this run have no solution ({error}); are the readings and the reference of "
                "the same run, in the units that the file says?"
            ) from error
        if not found.interrupted:
            try:
                found = with_place(found, stretches_of(model, prepared), prepared.runs, settings)
            except KeyboardInterrupt as stop:
                found = interrupted(found, STAGES[-1], what_ended(stop))
        return with_sample_notes(found, prepared.runs)


def prepare(
    recordings: Sequence[Recording],
    model: WorldModel,
    names: Sequence[str],
    policy: Policy = Policy(),
    *,
    force: bool = False,
) -> PreparedRuns:
    """Read recordings of a table or of a free body and find the faults of their samples."""
    if model.drive_source == "gyro":
        recordings = [with_axis_gyro(reference_on_rows(recording), model.array) for recording in recordings]
        return prepare_bodies(recordings, model, names, spike_share=policy.body_spike_share)
    return PreparedRuns.build(recordings, model, names, predicted_by_reference, force=force)


def _by_stages(
    prepared: PreparedRuns, kept: PreparedRuns | None, model: WorldModel, policy: Policy, report: Report
) -> Diagnosis:
    """Return the verdict by the usual library, or by the wider one where the evidence is for that.

    The wider library is searched where the usual one holds no answer, and where one of its effects is the more probable
    in a linear world, its prior included.
    """
    wide = model.searching(wide=True)
    further = wide.families().keys() - model.families().keys()
    end = 0.5 if further else 1.0  # of the progress that is reported
    usual = LibraryDiagnosis(prepared, kept, model, policy, lambda share, text: report(end * share, text))
    found, understanding = _verdict(usual)
    if found.interrupted or understanding is None or not further:
        return found
    wider = LibraryDiagnosis(
        prepared, kept, wide, policy, lambda share, text: report(end + (1.0 - end) * share, f"wider library: {text}")
    )
    try:
        least = policy.ambiguous - policy.worth_a_search
        if found.verdict != "unknown" and wider.promise(understanding, further) < least:
            return found
        # The biases and the calibration are the same ones: a model of them that lost will not win beside rarer causes.
        other, instead = _verdict(wider, {understanding.model})
    except KeyboardInterrupt as stop:
        return interrupted(found, WIDER, what_ended(stop))
    if other.interrupted is not None:
        return interrupted(found, WIDER, other.interrupted.by)
    if other.verdict == "nothing_found" or instead is None:
        return found
    if "unknown" in (found.verdict, other.verdict):
        better = _worth(other) > _worth(found)
    else:  # what the gate withdrew has no evidence
        better = any(cause.effect in further for cause in other.causes)
        better &= instead.log_posterior - understanding.log_posterior > policy.ambiguous
    return with_wider_library(other) if better else found


def _verdict(
    library: LibraryDiagnosis, models: Collection[str] | None = None
) -> tuple[Diagnosis, Understanding | None]:
    """Return the verdict by a library, and what its search found; where it is interrupted what is known by then."""
    understanding = None
    try:
        understanding = library.understood(models)
        by = understanding.explanation.interrupted
        if not by:
            return library.verdict(understanding), understanding
    except KeyboardInterrupt as stop:
        by = what_ended(stop)
    with unlimited():
        return library.so_far(understanding, by), understanding


def _worth(found: Diagnosis) -> float:
    """Return how far a verdict answers: the probability that the library holds the truth, less where it is unknown.

    Of two descriptions of what is unknown that counts which removes more of the error on validation data.
    """
    if found.verdict == "unknown":
        return min(float(np.nan_to_num(found.gain.share_of_excess_removed)), 1.0) - 2.0
    return 1.0 if np.isnan(found.library_probability) else found.library_probability
