"""A stranger's simulator: a pendulum with two accelerometers, which takes part in a diagnosis.

Nothing of gfimu's own simulation is used. Two tri-axial chips ride on an arm that swings about a fixed pivot; an
encoder reads the angle from the lowest position. The chips' x axes point along the arm, y axes along the motion.

    python pendulum.py run.csv                                          # a recording with a mistake hidden in it
    gfimu diagnose run.csv --twin pendulum.py:twin --out diagnosis      # which one?
"""

import sys

import numpy as np

import gfimu
from gfimu.model.own_rig import Cause, Parameter, SimulatorModel, bias_cause, gain_cause

GRAVITY = 9.80665
NEAR, FAR = 0.20, 0.45  # m from the pivot
ARRAY = gfimu.AccelerometerArray(
    "pendulum",
    tuple(gfimu.Chip(name, np.array([r, 0.0, 0.0]), np.eye(3), "generic") for name, r in (("a1", NEAR), ("a2", FAR))),
)


def simulate(motion, t, wrong):
    """Return what the chips and the encoder read; ``wrong`` holds differences from what I believe of the rig."""
    theta = motion.angle + wrong["encoder_zero_rad"]
    readings = []
    for radius in (NEAR + wrong["pivot_offset_m"], FAR + wrong["pivot_offset_m"]):
        along = -GRAVITY * np.cos(theta) - motion.rate**2 * radius  # x: outwards, the chip accelerates inwards
        across = GRAVITY * np.sin(theta) + motion.acceleration * radius  # y: along growing angle
        sideways = GRAVITY * wrong["pivot_lean_rad"] * np.ones_like(theta)  # z: along the pivot
        readings += [along, across, sideways]
    encoder = motion.angle + wrong["encoder_bend_rad"] * np.sin(2.0 * motion.angle)
    return np.column_stack(readings), encoder


def twin():
    """Return what I believe of the pendulum, and what I may have wrong."""
    return SimulatorModel(
        ARRAY,
        simulate,
        (
            Cause("encoder_zero", "the encoder's zero is not at the lowest position",
                  (Parameter("encoder_zero_rad", "rad", 0.02),), place="reference"),
            Cause("pivot_offset", "the pivot is not where the drawing has it along the arm",
                  (Parameter("pivot_offset_m", "m", 0.005),)),
            Cause("pivot_lean", "the pivot's axis is not level",
                  (Parameter("pivot_lean_rad", "rad", 0.02),)),
            Cause("encoder_bend", "the encoder reads off twice per turn",
                  (Parameter("encoder_bend_rad", "rad", 0.01),), place="reference"),
            bias_cause(ARRAY),
            gain_cause(ARRAY),
        ),
        noise_std=0.03,
        drive_source="angle",
    )  # fmt: skip


class Swing:
    """Decaying swings of 1.2 rad."""

    def __init__(self, t):
        decay, omega = 0.02, 4.7
        wave = 1.2 * np.exp((1j * omega - decay) * t)
        self.angle = wave.real
        self.rate = (wave * (1j * omega - decay)).real
        self.acceleration = (wave * (1j * omega - decay) ** 2).real


def record(file, **wrong):
    """Write a recording of a pendulum that has something wrong."""
    rng = np.random.default_rng(1)
    t = np.arange(0.0, 40.0, 0.01)
    nothing = {one.key: 0.0 for cause in twin().causes for one in cause.parameters}
    readings, encoder = simulate(Swing(t), t, nothing | wrong)
    readings = readings + 0.03 * rng.standard_normal(readings.shape)
    encoder = encoder + 1e-3 * rng.standard_normal(t.shape)
    metadata = {"array": ARRAY.name, "array_toml": ARRAY.to_toml()}
    gfimu.Recording(t, readings, ARRAY.channels, {"angle_rad": encoder}, metadata).write(file)


if __name__ == "__main__":
    record(sys.argv[1], pivot_offset_m=0.004)
