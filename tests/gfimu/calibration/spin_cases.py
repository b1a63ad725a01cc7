"""Chips, poses and runs on a turntable with all that a table adds, by the simulation's forward model."""

from dataclasses import dataclass, replace

import numpy as np
from calibration_cases import calibrate

from gfimu import AccelerometerArray, specific_force
from gfimu.base import STANDARD_GRAVITY
from gfimu.calibration import SpinPolicy
from gfimu.calibration.spin import spin
from gfimu.recording import Recording, array_metadata
from sim import PoseSequence, Sensor, SensorSettings, speed_sweep, spin_profile
from sim.forward import leaning, rigid_readings, table_geometry
from sim.world import Lean, World

RATE = 100.0
SPEEDS = (8.0, 14.0, 19.0, 23.0, 27.0, 30.0, -11.0, -17.0, -25.0, -30.0)
UPRIGHT, ON_ITS_SIDE = (0.0, 0.0, 0.0), (np.pi / 2, 0.0, 0.0)
CUBE = AccelerometerArray.load("cube12")
FULL_RANGE, NONLINEARITY = 156.9064, 0.005  # of the ADXL345's data sheet


def level_poses(array=CUBE):
    """Times and ideal readings of 18 poses of 6 s."""
    motion = PoseSequence("faces_edges")
    t = np.arange(round(motion.duration * RATE)) / RATE
    state = motion.at(t)
    return t, specific_force(array, STANDARD_GRAVITY * state.rotation[:, 2], state.alpha, state.omega)


POSES = level_poses()


@dataclass(frozen=True)
class Unit:
    """An array of real chips, in real places."""

    sensor: Sensor
    array: AccelerometerArray

    @classmethod
    def draw(cls, rng, settings=None, policy=SpinPolicy()):
        """Chips from their data sheet, bends from the prior, places within the tolerance."""
        sensor = Sensor.build(CUBE, settings or SensorSettings(), rng)
        cubic = rng.normal(size=12) * NONLINEARITY / FULL_RANGE**2
        sensor = replace(sensor, errors=replace(sensor.errors, cubic=cubic))
        places = CUBE.chip_positions + policy.radius_std_m * rng.normal(size=(4, 3))
        return cls(sensor, CUBE.with_geometry(places, [chip.axes for chip in CUBE.chips]))

    @property
    def truth(self):
        """q and c of each channel: of u − q u² − c u³ = g p for u = g (p + Q p² + C p³)."""
        errors, gain = self.sensor.errors, 1.0 + self.sensor.errors.scale
        q = errors.quadratic / gain
        return {"q": q, "c": errors.cubic / gain**2 - 2.0 * q**2}

    def read(self, force, t, rng, reference=None):
        """Record ideal readings."""
        readings = self.sensor.sense(force, np.full(len(t), 25.0), rng)
        metadata = {**array_metadata(CUBE), "part": "adxl345", "lsb_m_s2": float(self.sensor.lsb[0])}
        return Recording(t, readings, CUBE.channels, reference or {}, metadata)

    def static(self, rng):
        """Calibrate from the poses."""
        t, force = POSES
        return calibrate("array", self.read(force, t, rng), array=CUBE)

    def switched_on_again(self, rng):
        """Return the unit with other biases."""
        errors = self.sensor.errors
        return replace(
            self, sensor=replace(self.sensor, errors=replace(errors, bias=errors.bias + rng.normal(size=12) * 0.03))
        )

    def turn(
        self,
        rng,
        mounting=UPRIGHT,
        speeds=SPEEDS,
        hold=6.0,
        policy=SpinPolicy(),
        tacho_noise=0.005,
        stretch=None,
        lean_std=5e-3,
    ):
        """Record a run on a table that leans, stretches and tilts the array, drawn from the priors."""
        motion = spin_profile(speed_sweep(speeds, hold=hold))
        t = np.arange(int((2 * 2.0 + len(speeds) * (hold + 1.0) + 1.0) * RATE)) / RATE
        levelling = policy.dynamic_levelling_std_s2_rad * rng.normal(size=2)
        world = World(
            self.array,
            cube_offset=np.array([*rng.normal(size=2) * 2e-3, 0.06]),
            mount_rotvec=np.array(mounting) + rng.normal(size=3) * 0.01,
            axis_rotvec=np.array([*rng.normal(size=2) * lean_std, 0.0]),
            stretch=policy.stretch_std_s2_rad2 * rng.normal() if stretch is None else stretch,
            leans=(
                Lean(
                    np.array([*levelling, 0.0]) / np.linalg.norm(levelling),
                    lambda s: np.linalg.norm(levelling) * s.rate**2,
                ),
            ),
        )
        geometry = table_geometry(world)
        state = motion.at(t)
        force = rigid_readings(world, state, geometry) + leaning(world, motion, t, geometry)
        scale = 1.0 + policy.tacho_scale_std * rng.normal()
        tacho = state.rate * scale + tacho_noise * rng.normal(size=len(t))
        return self.read(force, t, rng, {"tacho_rad_s": tacho})


def normalised_errors(seed, sides=(UPRIGHT, ON_ITS_SIDE), settings=None):
    """Errors of q and c over their standard deviations after runs on some sides, and the latter, each (12,)."""
    rng = np.random.default_rng([836, seed])
    unit = Unit.draw(rng, settings)
    result = unit.static(rng)
    for side in sides:
        unit = unit.switched_on_again(rng)
        result = spin(unit.turn(rng, side), CUBE, start=result)
    found = {}
    for kind, truth in unit.truth.items():
        names = [f"{chip}_{kind}_{axis}" for chip in result.chips for axis in "xyz"]
        std = np.array([result.std_of(name) for name in names])
        found[kind] = (np.array([result.value(name) for name in names]) - truth) / std, std
    return found
