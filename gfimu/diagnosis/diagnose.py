"""Diagnosis from end to end: recordings and a twin in, a verdict out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gfimu.base.errors import InputError
from gfimu.diagnosis.data.body.prepared import prepare_bodies
from gfimu.diagnosis.data.prepared_runs import PreparedRuns
from gfimu.diagnosis.fit.learn import predicted_by_reference
from gfimu.diagnosis.fit.parallel import one_blas_thread
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.steps import Report, Steps, stretches_of
from gfimu.diagnosis.time_limit import limited_to, unlimited, what_ended
from gfimu.diagnosis.verdict.likely_mistakes import with_mistake
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
        steps = Steps(prepared, kept, model, settings, progress)
        try:
            found = _verdict(steps)
            if not found.interrupted:
                found = with_mistake(found, stretches_of(model, prepared), prepared.runs)
        except np.linalg.LinAlgError as error:
            runs = ", ".join(labels)
            raise InputError(
                f"{runs}: the equations of this run have no solution ({error}); are the readings and the reference of "
                "the same run, in the units that the file says?"
            ) from error
        return with_sample_notes(found, prepared.runs)


def _verdict(steps: Steps) -> Diagnosis:
    """Return the verdict; where it is interrupted what is known by then."""
    understanding = None
    try:
        understanding = steps.understood()
        by = understanding.explanation.interrupted
        if not by:
            understanding = steps.challenged(understanding)
            return steps.verdict(understanding)
    except KeyboardInterrupt as stop:
        by = what_ended(stop)
    with unlimited():
        return steps.so_far(understanding, by)


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
