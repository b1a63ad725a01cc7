"""Diagnosis from end to end: recordings and a twin in, a verdict out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gfimu.diagnosis.data.body.prepared import prepare_bodies
from gfimu.diagnosis.data.prepared_runs import PreparedRuns
from gfimu.diagnosis.fit.learn import predicted_by_reference
from gfimu.diagnosis.fit.parallel import one_blas_thread
from gfimu.diagnosis.one_library import LibraryDiagnosis, Report, stretches_of
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.verdict.library import LibraryRule, with_wider_library
from gfimu.diagnosis.verdict.place import with_place
from gfimu.diagnosis.verdict.sample_notes import with_sample_notes
from gfimu.diagnosis.verdict.verdict import Diagnosis
from gfimu.errors import InputError
from gfimu.known_axis.axis_gyro import with_axis_gyro
from gfimu.recording import Recording
from gfimu.recording.carried_array import warn_of_other_array
from gfimu.recording.timing.reference_times import reference_on_rows
from gfimu.world_model import WorldModel

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
    labels = list(names) if names is not None else [f"run {number + 1}" for number in range(len(recordings))]
    held_labels = [f"held-out run {number + 1}" for number in range(len(held_out))]
    for recording, label in zip((*recordings, *held_out), (*labels, *held_labels), strict=True):
        warn_of_other_array(recording.metadata, model.array, label)
    with one_blas_thread():
        settings = policy or Policy()
        if model.drive_source == "gyro":
            settings = settings.of_body()
        progress(0.02, "read")
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
        found = with_place(found, stretches_of(model, prepared), prepared.runs, settings)
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
        recordings = [with_axis_gyro(reference_on_rows(one), model.array) for one in recordings]
        return prepare_bodies(recordings, model, names, spike_share=policy.body_spike_share)
    return PreparedRuns.build(recordings, model, names, predicted_by_reference, force=force)


def _by_stages(
    prepared: PreparedRuns, kept: PreparedRuns | None, model: WorldModel, policy: Policy, report: Report
) -> Diagnosis:
    """Return the verdict by the usual library; where that holds no good answer, by the wider one if it has a better.

    What is rare is searched for only where the usual effects fail: it would compete with them everywhere else.
    """
    wide = model.searching(wide=True)
    is_wider = wide.families().keys() > model.families().keys()
    end = 0.5 if is_wider else 1.0  # of the progress that is reported
    usual = LibraryDiagnosis(prepared, kept, model, policy, lambda share, text: report(end * share, text))
    understanding = usual.understood()
    if understanding.explanation.interrupted:
        return usual.so_far(understanding)
    found = usual.verdict(understanding)
    if not is_wider or _worth(found) >= LibraryRule.enough:
        return found
    wider = LibraryDiagnosis(
        prepared, kept, wide, policy, lambda share, text: report(end + (1.0 - end) * share, f"wider library: {text}")
    )
    # The biases and the calibration are the same ones: a model of them that lost will not win beside rarer causes.
    understanding = wider.understood({understanding.model})
    other = found if understanding.explanation.interrupted else wider.verdict(understanding)
    better = other.verdict != "nothing_found" and _worth(other) > _worth(found)
    return with_wider_library(other) if better else found


def _worth(found: Diagnosis) -> float:
    """Return how far a verdict answers: the probability that the library holds the truth, less where it is unknown.

    Of two descriptions of what is unknown that counts which removes more of the error on validation data.
    """
    if found.verdict == "unknown":
        return min(float(np.nan_to_num(found.gain.share_of_excess_removed)), 1.0) - 2.0
    return 1.0 if np.isnan(found.library_probability) else found.library_probability
