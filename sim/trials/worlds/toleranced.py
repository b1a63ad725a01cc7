"""Units of an array with errors drawn inside its tolerances, and what their boards record.

Each unit has its own places and rotations of the chips and its own chip errors; the physics is that of MuJoCo
(`sim.rigs.turntable.prescribed_readings`) with the array as built, so nothing here is linearised. Converter, bandwidth
and sampling are ideal: they are no tolerances.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError
from gfimu.base.short_repr import short_repr
from gfimu.budget.tolerances.calibrated import Poses
from gfimu.budget.tolerances.known_motion import KnownMotion
from gfimu.budget.tolerances.tolerances import Tolerances
from gfimu.recording import Recording
from gfimu.recording.carried_array import array_metadata
from sim.chips.adxl345 import SensorErrors
from sim.motions.motion import BodyState
from sim.motions.pose_sequence import POSE_SETS, PoseSequence
from sim.motions.profiles import Hold, Ramp, Segment, spin_profile
from sim.rigs.turntable import prescribed_readings
from sim.scenarios import Scenario
from sim.truth import cube_state

__all__ = [
    "CALIBRATED_AT",
    "ToleranceUnit",
    "calibration_poses",
    "draw_unit",
    "known_motion_of",
    "reference_motion",
    "tolerated_run",
]

Floats = NDArray[np.float64]

CALIBRATED_AT = 25.0
"""Temperature of the data sheets' figures and of a calibration, °C."""

_REST_S, _RAMP_S = 1.5, 0.5
"""Rest at the start of the reference motion, and the ramp that follows it, s."""

_LEAST_TIME_S = _REST_S + _RAMP_S
_USUAL_TIME_S = 3.0  # of the reference motion: a second at the rate, after rest and ramp
_MOST_SAMPLES = 6000  # numerical: memory of the first-order maps, 1 GB with 24 channels


@dataclass(frozen=True)
class ToleranceUnit:
    """One unit.

    Parameters
    ----------
    array : AccelerometerArray
        The array as built.
    errors : SensorErrors
        Errors of its chips.
    noise : ndarray, shape (c,)
        White noise of a sample of each channel, standard deviation, m/s².
    """

    array: AccelerometerArray
    errors: SensorErrors
    noise: Floats

    __repr__ = short_repr

    def record(self, scenario: Scenario, rng: np.random.Generator, *, temperature: float = CALIBRATED_AT) -> Recording:
        """Record the motion of a scenario; its sensors and effects are not looked at.

        Parameters
        ----------
        scenario : Scenario
            Motion, duration, sample rate, mounting and gravity.
        rng : numpy.random.Generator
            Source of the white noise.
        temperature : float
            Of the board, °C.

        Returns
        -------
        Recording
            Readings in m/s², with the array of the scenario, which is the drawing.
        """
        t = _times(scenario)
        built = replace(scenario, array=self.array)
        force = prescribed_readings(built.world, scenario.motion, t)  # type: ignore[arg-type]
        readings = self.errors.distort(force, np.full(len(t), temperature))
        readings += self.noise * rng.standard_normal(readings.shape)
        metadata = {**array_metadata(scenario.array), "mounting_rotvec_rad": list(scenario.mounting_rotvec)}
        return Recording(t, readings, scenario.array.channels, {}, metadata)


def draw_unit(array: AccelerometerArray, tolerances: Tolerances, rng: np.random.Generator) -> ToleranceUnit:
    """Draw a unit.

    Parameters
    ----------
    array : AccelerometerArray
        The drawing.
    tolerances : Tolerances
        Limits and standard deviations.
    rng : numpy.random.Generator
        Random number generator.
    """
    k, c = len(array.chips), array.n_channels

    def machined(limit: float, std: float) -> Floats:
        size = (k, 3)
        return rng.uniform(-limit, limit, size) if tolerances.shape == "uniform" else std * rng.standard_normal(size)

    places = array.chip_positions + machined(tolerances.placement_m, tolerances.placement_std)
    turns = Rotation.from_rotvec(machined(tolerances.angle_rad, tolerances.angle_std))
    axes = [turn.apply(chip.axes) for turn, chip in zip(turns, array.chips, strict=True)]
    same_chip = (array.chip_of_channel[:, None] == array.chip_of_channel) & ~np.eye(c, dtype=bool)
    errors = replace(
        SensorErrors.none(c),
        bias=tolerances.bias * rng.standard_normal(c),
        scale=tolerances.gain * rng.standard_normal(c),
        cross_axis=rng.standard_normal((c, c)) * tolerances.cross_axis[:, None] * same_chip,
        quadratic=tolerances.quadratic * rng.standard_normal(c),
        bias_temperature=tolerances.bias_tempco * rng.standard_normal(c),
        scale_temperature=tolerances.gain_tempco * rng.standard_normal(c),
    )
    return ToleranceUnit(array.with_geometry(places, axes), errors, tolerances.noise)


def reference_motion(array: AccelerometerArray, *, time: float, rate: float) -> Scenario:
    """Return the motion in which arrays are compared: level at rest, then spun up about the vertical and held.

    Parameters
    ----------
    array : AccelerometerArray
        The array, its origin on the axis.
    time : float
        Length, s, longer than rest and ramp.
    rate : float
        Rate that is held, rad/s.
    """
    pieces: list[Segment] = [Hold(_REST_S), Ramp(rate, _RAMP_S), Hold(time - _LEAST_TIME_S)]
    return Scenario("reference motion", array, spin_profile(pieces), time, 100.0, cube_offset=(0.0, 0.0, 0.0))


def tolerated_run(
    array: AccelerometerArray, scenario: Scenario | str | Path | None, *, duration: float | None, rate: float
) -> tuple[Scenario, str]:
    """Return the run for which errors are budgeted, with nothing wrong in it, and what it is in words.

    Parameters
    ----------
    array : AccelerometerArray
        The nominal array.
    scenario : Scenario, str or Path, optional
        Scenario, its name or file, of which array, sensors and effects are not used; by default `reference_motion`.
    duration : float, optional
        Length, s; by default that of the scenario, or 3 s.
    rate : float
        Rate of the reference motion, rad/s.

    Raises
    ------
    InputError
        If duration or rate are out of range, or the run has too few or too many samples.
    """
    if scenario is None:
        length = _USUAL_TIME_S if duration is None else duration
        if not _LEAST_TIME_S < length < math.inf:
            raise InputError(f"--duration {length:g}: the default motion is longer than {_LEAST_TIME_S:g} s; give more")
        if not 0.0 < abs(rate) <= 1e3:
            raise InputError(f"--speed-rad-s {rate:g}: give a rate of at most 1000 rad/s that is not zero")
        run = reference_motion(array, time=length, rate=rate)
        words = f"at rest for {_REST_S:g} s, then spun up to {rate:g} rad/s about the vertical, {length:g} s in all"
    else:
        chosen = scenario if isinstance(scenario, Scenario) else Scenario.load(scenario)
        length = chosen.duration if duration is None else duration
        if not 0.0 < length <= chosen.duration:
            lasts = f"scenario {chosen.name!r} lasts {chosen.duration:g} s"
            raise InputError(f"--duration {length:g}: {lasts}; give at most that")
        run = replace(chosen, array=array, part=None, duration=length, driven=False, effects=(), earth=None)
        words = f"scenario {chosen.name}, {length:g} s"
    samples = run.duration * run.sample_rate
    if not 10 <= round(samples) <= _MOST_SAMPLES:
        raise InputError(f"the run has {samples:.0f} samples; give a --duration with 10 to {_MOST_SAMPLES}")
    return run, words


def calibration_poses(run: Scenario) -> tuple[Scenario, Poses]:
    """Return the recording of a calibration from poses with the array of a run, and these poses for its prediction."""
    sequence = PoseSequence()
    period = sequence.rest + sequence.turn
    middles = np.arange(POSE_SETS[sequence.poses]) * period + 0.5 * sequence.rest
    up = sequence.at(middles).rotation[:, 2]  # (p, 3): the world's z in body axes
    posed = replace(run, motion=sequence, duration=sequence.duration, mounting_rotvec=(0.0, 0.0, 0.0))
    return posed, Poses(up, round(sequence.rest * run.sample_rate))


def known_motion_of(scenario: Scenario) -> KnownMotion:
    """Return the true motion of a scenario at its samples."""
    state = scenario.motion.at(t := _times(scenario))
    body = state if isinstance(state, BodyState) else cube_state(scenario.world, state)
    p = np.einsum("nji,nj->ni", body.rotation, body.acceleration + np.array([0.0, 0.0, scenario.gravity]))
    return KnownMotion(t, p, body.alpha, body.omega, body.rotation, scenario.gravity)


def _times(scenario: Scenario) -> Floats:
    return np.arange(round(scenario.duration * scenario.sample_rate)) / scenario.sample_rate
