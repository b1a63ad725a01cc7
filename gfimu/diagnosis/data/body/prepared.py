"""Recordings of free bodies made ready for the search: the gyro smoothed, faults of the samples found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gfimu.base.errors import InputError
from gfimu.diagnosis.data.body.run import prepare_body_run
from gfimu.diagnosis.data.body.stretch import BodyStretch
from gfimu.diagnosis.data.integrity import check_integrity
from gfimu.diagnosis.data.prepared_runs import PreparedRuns
from gfimu.diagnosis.data.run import MINIMUM_SAMPLES, Run
from gfimu.model.world_model import BodyModel, Effect, WorldModel
from gfimu.motion.body_drive import BodyDrive
from gfimu.recording import Recording

__all__ = ["prepare_bodies", "robust_prediction"]

_SWEEPS = 12  # numerical: reweightings until the channels that disagree have no weight


def prepare_bodies(
    recordings: Sequence[Recording], model: WorldModel, names: Sequence[str], *, spike_share: float
) -> PreparedRuns:
    """Read, check and label recordings of free bodies.

    Parameters
    ----------
    recordings : sequence of Recording
        The runs.
    model : BodyModel
        Assumptions of the simulation about the rig.
    names : sequence of str
        Names of the runs, for people.
    spike_share : float
        Share of isolated bad samples beyond which they are no faults.

    Raises
    ------
    InputError
        If the simulation predicts no free body, or a recording has too few channels or samples, or no gyro.
    """
    if not isinstance(model, BodyModel):
        raise InputError("the simulation predicts no free body; drive it by tacho, angle or command, not by gyro")
    runs: list[Run] = []
    effects: list[list[Effect]] = []
    why: dict[str, str] = {}
    for index, (recording, name) in enumerate(zip(recordings, names, strict=True)):
        body = prepare_body_run(recording, model, name=name)
        stretch = BodyStretch(model, body, index, float(body.t[0]))
        _refuse_too_few(stretch, name)
        checked = check_integrity(model, body, robust_prediction(stretch))
        run = replace(body, valid=checked.run.valid)
        if checked.spikes > spike_share * run.valid.size:
            # So many are no faults: the hand moves faster than the samples follow.
            run = replace(run, valid=run.valid | body.valid & ~_lost_for_good(body, run.valid))
        _refuse_too_few(replace(stretch, run=run), name)
        runs.append(run)
        effects.append(list(checked.effects))
        why.update(checked.why)
    return PreparedRuns(runs, effects, why, 0, rounded=False)


def _refuse_too_few(stretch: BodyStretch, name: str) -> None:
    """Refuse channels that the unknown specific force follows exactly: those of one chip, or too few with values."""
    alive, valid = stretch.alive, stretch.run.valid
    if alive.sum() - np.linalg.matrix_rank(stretch.model.array.axes[alive]) < 1:
        raise InputError(
            f"{name}: {int(alive.sum())} channels with values leave nothing to compare, as the specific force of a "
            "free body is unknown; record the channels of two chips at least"
        )
    whole = int(valid[:, alive].all(axis=1).sum())
    if whole < MINIMUM_SAMPLES:
        raise InputError(
            f"{name}: {whole} samples have a value of every channel; a free body needs {MINIMUM_SAMPLES}: record again "
            "within the range of the sensors"
        )


def _lost_for_good(run: Run, valid: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Mark invalid stretches: those of a frozen or clipped channel, and no isolated samples."""
    lost = run.valid & ~valid
    return lost & (np.roll(lost, 1, axis=0) | np.roll(lost, -1, axis=0))


def robust_prediction(stretch: BodyStretch) -> NDArray[np.float64]:
    """Predict the channels with the specific force that most of them agree on, shape (n, c), m/s².

    A few exchanged or inverted channels must not draw the specific force their way: each channel is weighted by how
    well the others predict it, again and again.
    """
    run, axes, alive = stretch.run, stretch.model.array.axes, stretch.alive
    rigid = stretch.channels([], BodyDrive(run.t, run.rate, np.zeros((len(run.t), 3))))
    rest = np.where(run.valid, run.readings - rigid, 0.0)
    weight = alive.astype(float)
    rows = slice(None, None, max(1, len(run.t) // 4000))
    for _ in range(_SWEEPS):
        inverse = np.linalg.pinv(axes * weight[:, None]) * weight
        left = rest[rows] - (rest[rows] @ inverse.T) @ axes.T
        spread = np.median(np.abs(left), axis=0) + np.sqrt(np.mean(left**2, axis=0))
        typical = float(np.median(spread[alive]))
        weight = np.where(alive, 1.0 / (0.1 * typical + spread), 0.0)
        weight /= weight.max()
    return np.asarray(rigid + (rest @ inverse.T) @ axes.T)
