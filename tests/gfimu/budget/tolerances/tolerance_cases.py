"""Arrays, motions and single errors that the tests of tolerances share."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from gfimu import AccelerometerArray, ChipErrors, Estimate
from gfimu.budget.tolerances.calibrated import Poses
from gfimu.budget.tolerances.known_motion import KnownMotion
from gfimu.budget.tolerances.tolerances import Tolerances
from gfimu.motion.estimation import estimate
from sim import PoseSequence, SensorErrors
from sim.scenarios import Scenario
from sim.trials.worlds.toleranced import ToleranceUnit, known_motion_of, reference_motion

NOTHING = ChipErrors(0.0, 0.0, 0.0, 0.0, 0.0)
"""Chips without any error."""

ONLY = {
    "placement": {"placement_m": 2e-4},
    "angles": {"angle_rad": 0.01},
    "bias": {"chip": replace(NOTHING, bias_m_s2=0.3)},
    "gain": {"chip": replace(NOTHING, gain=0.01)},
    "cross-axis": {"chip": replace(NOTHING, cross_axis=0.01)},
    "nonlinearity": {"chip": replace(NOTHING, nonlinearity=0.05)},
    "temperature": {"temperature_K": 10.0},
    "noise": {"chip": replace(NOTHING, noise_m_s2_rthz=0.003)},
}
"""Arguments of `only` by the one cause that acts."""


def only(array: AccelerometerArray, cause: str, *, share: float = 1.0) -> Tolerances:
    """Return tolerances of which one cause acts, or none; ``share`` scales it."""
    given = {"placement_m": 0.0, "angle_rad": 0.0, "chip": NOTHING, "temperature_K": 0.0} | ONLY.get(cause, {})
    scaled = {
        name: ChipErrors(*(share * one for one in vars(value).values())) if name == "chip" else share * value
        for name, value in given.items()
    }
    return Tolerances.of(array, 100.0, shape="normal", **scaled)


LENGTH = {"p2_face_centres": 2.2}
"""Length of the motion, s; 2.6 otherwise. What feeds itself through ω² is soon of second order."""


@cache
def run_of(name: str) -> Scenario:
    """Return the default motion of an array."""
    return reference_motion(AccelerometerArray.load(name), time=LENGTH.get(name, 2.6), rate=5.0)


@cache
def motion_of(name: str) -> KnownMotion:
    return known_motion_of(run_of(name))


@cache
def poses() -> Poses:
    """Return the poses of the default calibration."""
    sequence = PoseSequence()
    middles = np.arange(18) * (sequence.rest + sequence.turn) + 0.5 * sequence.rest
    return Poses(sequence.at(middles).rotation[:, 2], 600)


def perfect(array: AccelerometerArray) -> ToleranceUnit:
    c = array.n_channels
    return ToleranceUnit(array, SensorErrors.none(c), np.zeros(c))


def estimated(run: Scenario, readings: np.ndarray) -> Estimate:
    """Estimate by integration from a level start, as `gfimu estimate` does of a recording without a mounting."""
    recording = perfect(run.array).record(run, np.random.default_rng(0))
    metadata = {key: value for key, value in recording.metadata.items() if key != "mounting_rotvec_rad"}
    return estimate(
        replace(recording, readings=readings, metadata=metadata), run.array, with_position=True, findings=()
    )
