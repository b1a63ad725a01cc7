"""Derivative of a prediction with respect to the drive: by its state at each instant, and by what is remembered of it.

Readings depend on angle, rate and acceleration of their own instant, which finite differences of the model give. What
remembers earlier ones has a derivative of its own: the sensing chain's lag, a mode that rings, a play that holds, a
torque ripple that the servo takes back.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.drive import AngleSpline, ShiftedSpin
from gfimu.diagnosis.drive_jacobian import DriveJacobian, lagged
from gfimu.diagnosis.ringing import Ringing
from gfimu.diagnosis.rippling import Rippling
from gfimu.diagnosis.simulation import Simulation
from gfimu.world_model import (
    Effect,
    Mode,
    ModelWithModes,
    ModelWithPlay,
    ModelWithRipple,
    Play,
    Ripple,
    Spin,
    WorldModel,
)

__all__ = ["Remembered", "differentiate", "felt_modes", "felt_play", "felt_ripple"]

_STATE_STEPS = (1e-5, 1e-4, 1e-3)
_SAME_PHASE = 0.1  # rad of a mode between the first chip and the last
_FELT_PLAY = 2.0  # standard deviations of the noise
_FELT_STEEPNESS = 0.1


@dataclass(frozen=True)
class Remembered:
    """What a derivative is to know of earlier instants; it is the dearer for each.

    Parameters
    ----------
    play : Play, optional
        What holds a share of the readings.
    modes : sequence of Mode
        What rings between the table and the array.
    ripple : bool
        Whether it knows how a strong torque ripple answers the drive.
    """

    play: Play | None = None
    modes: Sequence[Mode] = ()
    ripple: bool = False


def felt_modes(model: WorldModel, effects: Sequence[Effect]) -> Sequence[Mode]:
    """Return what rings between the table and the array."""
    return model.modes(effects) if isinstance(model, ModelWithModes) else ()


def felt_play(model: WorldModel, effects: Sequence[Effect], noise: float) -> Play | None:
    """Return what holds a share of the readings, where that is more than their noise, m/s²."""
    play = model.play(effects) if isinstance(model, ModelWithPlay) else None
    return None if play is None or play.lost < _FELT_PLAY * noise else play


def felt_ripple(model: WorldModel, effects: Sequence[Effect]) -> Ripple | None:
    """Return what the table ripples by, where that holds the table by more than a little of what the servo does."""
    ripple = model.ripple(effects) if isinstance(model, ModelWithRipple) else None
    return None if ripple is None or ripple.steepness < _FELT_STEEPNESS else ripple


def differentiate(
    simulation: Simulation,
    effects: Sequence[Effect],
    spline: AngleSpline,
    drive: Spin,
    base: NDArray[np.float64],
    remembered: Remembered,
    weights: NDArray[np.float64],
    row_weight: NDArray[np.float64],
) -> DriveJacobian:
    """Differentiate a prediction with respect to the coefficients of the drive's spline.

    Parameters
    ----------
    simulation : Simulation
        What predicts.
    effects : sequence of Effect
        What the simulation holds besides.
    spline, drive : AngleSpline and Spin
        The drive.
    base : ndarray, shape (n, c + 1)
        The prediction.
    remembered : Remembered
        What the derivative is to know of earlier instants.
    weights : ndarray, shape (c + 1,)
        One over the variance of each observation.
    row_weight : ndarray, shape (n, c + 1)
        Weight of every sample.
    """
    run, play = simulation.run, remembered.play
    # The state of the instant moves what a play lets through, that of an earlier one what it holds.
    model, moving = (simulation.model, effects) if play is None else (play.model, play.effects)
    same = play is None and (simulation.run_up is None or not simulation.remembers(effects))
    unheld = base if same else simulation.of_motion(moving, simulation.motion(effects, drive), model)
    ripple = felt_ripple(model, moving) if remembered.ripple else None
    slopes, rippling = np.empty((3, *base.shape)), None
    if ripple is None:
        shifted = [
            simulation.motion(effects, ShiftedSpin(drive, place, step)) for place, step in enumerate(_STATE_STEPS)
        ]
    else:
        # The state of the instant is that of the table, which the drive of earlier ones moves too.
        model, moving = ripple.model, ripple.effects
        table, gain = ripple.motion(simulation.motion(effects, drive), run.t), simulation.gain(effects)
        rippling = Rippling(spline, table)
        shifted = [ShiftedSpin(table, place, step / gain) for place, step in enumerate(_STATE_STEPS)]
    for place, (motion, step) in enumerate(zip(shifted, _STATE_STEPS, strict=True)):
        slopes[place] = (simulation.of_motion(moving, motion, model) - unheld) / step
    times = simulation.model.sample_times(run.t, effects)
    chips = np.append(simulation.model.array.chip_of_channel, times.shape[1] - 1)
    lag = simulation.model.sensing_lag(effects)
    delay = partial(lagged, samples=lag / run.sample_period) if lag > 0 else None
    modes = remembered.modes
    ringing = [Ringing(spline, mode, float(run.t[0])) for mode in modes]
    if modes and np.ptp(times[:, :-1], axis=1).max() * max(mode.natural for mode in modes) < _SAME_PHASE:
        times[:, :-1] = times[:, :-1].mean(axis=1, keepdims=True)  # one ringing for all chips, not one for each
    if play is not None:
        held = (play.share, play.sources(unheld[:, :-1]))
        return DriveJacobian.held(spline, slopes, times, chips, weights, row_weight, held, delay, ringing, rippling)
    return DriveJacobian.build(spline, slopes * row_weight, times, chips, weights, delay, ringing, rippling)
