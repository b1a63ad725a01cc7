"""Recordings made ready for the search: checked for faults of the samples, cut into stretches."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gfimu.base.errors import InputError, warn
from gfimu.diagnosis.data.integrity import IntegrityReport, check_integrity
from gfimu.diagnosis.data.plausibility import refuse_implausible
from gfimu.diagnosis.data.run import Run, prepare_run, smooth_rate
from gfimu.diagnosis.data.samples import reference_spikes
from gfimu.diagnosis.data.table.settling import settled
from gfimu.model.world_model import Effect, WorldModel, reads_place
from gfimu.recording import Recording

__all__ = ["PreparedRuns"]

_ROUNDING = ("coarse_resolution", "saturation")
Predict = Callable[[WorldModel, Run], NDArray[np.float64]]


@dataclass(frozen=True)
class PreparedRuns:
    """Runs after the integrity check, with the effects it found in each.

    Parameters
    ----------
    runs : list of Run
        The runs, what faults spoiled marked invalid.
    effects : list of list of Effect
        Faults of each run.
    why : dict of str to str
        One sentence per effect name.
    spikes : int
        Isolated samples and values of the reference far off their neighbours, over all runs.
    rounded : bool
        Whether readings are clipped or coarse, so that their error follows the motion.
    """

    runs: list[Run]
    effects: list[list[Effect]]
    why: dict[str, str]
    spikes: int
    rounded: bool

    @classmethod
    def build(
        cls,
        recordings: Sequence[Recording],
        model: WorldModel,
        names: Sequence[str],
        predict: Predict,
        *,
        force: bool = False,
    ) -> PreparedRuns:
        """Read, check and label recordings (`prepare_run`, `check_integrity`).

        Parameters
        ----------
        recordings : sequence of Recording
            The runs.
        model : WorldModel
            Assumptions of the simulation about the rig.
        names : sequence of str
            Names of the runs, for people.
        predict : callable
            From a model and a run to the channels (n, c) that its reference alone predicts, m/s².
        force : bool
            Warn where a run would be refused as implausible.
        """
        runs, effects, spikes = [], [], 0
        why: dict[str, str] = {}
        for recording, name in zip(recordings, names, strict=True):
            run = prepare_run(recording, model, name=name)
            wrong = reference_spikes(run)
            run = replace(
                run, reference=np.where(wrong, 0.0, run.reference), reference_valid=run.reference_valid & ~wrong
            )
            if run.conversions is not None:
                rate = smooth_rate(run, is_angle=reads_place(model))
                run = settled(run, predict(model, run), model.array.chip_of_channel, rate)
            checked = _check(model, run, predict, force=force)
            runs.append(checked.run)
            effects.append(list(checked.effects))
            why = {**checked.why, **why}  # of the run whose numbers are stated, the first
            spikes += checked.spikes + int(wrong.sum())
        rounded = any(effect.name in _ROUNDING for known in (model.effects, *effects) for effect in known)
        return cls(runs, effects, why, spikes, rounded)


def _check(model: WorldModel, run: Run, predict: Predict, *, force: bool) -> IntegrityReport:
    prediction = predict(model, run)
    try:
        refuse_implausible(model, run, prediction, lambda other: predict(model, other))
    except InputError as error:
        if not force:
            raise InputError(f"{error}; --force (force=True) goes on nevertheless") from None
        warn(str(error))
    return check_integrity(model, run, prediction)
