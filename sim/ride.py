"""A board that rides a scenario: specific force, temperature and references at any time, chips at any output data rate.

What `sim.simulation.simulate` computes for a whole run at once, here for a board whose chips convert at instants of
their own. MuJoCo gives the specific force on a regular grid, in batches; splines carry it to the instants asked for.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from gfimu.base.errors import InputError
from gfimu.model import world_model
from sim import forward
from sim.chips.adxl345 import Sensor, conversion_offsets
from sim.chips.data_sheet import DataSheet
from sim.motions.motion import SpinMotion, SpinState
from sim.rigs.driven import drive
from sim.rigs.turntable import prescribed_readings
from sim.scenarios import Scenario
from sim.world import SampleContext

__all__ = ["Ride"]

GRID_HZ = 1000.0
_SEGMENT = 4000  # grid points per batch
_MARGIN = 16  # points on either side, so that a spline's ends do not show


class Ride:
    """One scenario as a board experiences it; after its end the last instant goes on.

    Parameters
    ----------
    scenario : Scenario, str or Path
        The scenario, or its name or file.
    seed : int
        Seed of the chips' errors and of the noise; the chips are those of `sim.simulation.simulate`.

    Raises
    ------
    InputError
        If an effect changes digital samples: on a board nothing does that behind the firmware's back.
    """

    def __init__(self, scenario: Scenario | str | Path, *, seed: int = 0) -> None:
        run = scenario if isinstance(scenario, Scenario) else Scenario.load(scenario)
        self.world = run.world
        if self.world.data_steps:
            names = ", ".join(effect.name for effect in run.effects)
            raise InputError(f"scenario {run.name!r}: among {names} is one that changes digital samples; leave it out")
        self.seed = seed
        self.array = run.array
        self._command = run.motion
        if run.driven and not run.free:
            driven = drive(self.world, _spin(run.motion), run.duration + 1.0, step=run.physics_step, motor=run.motor)
            run = replace(run, motion=driven.motion)
        self.scenario = run
        self._motion = run.motion
        if not run.free:
            t = np.arange(0.0, run.duration, 1.0 / GRID_HZ)
            for step in (*self.world.motion_steps, *self.world.mount_steps):
                self._motion = step(_spin(self._motion), t)
        self._sheet = DataSheet.load(run.part or run.array.chips[0].part, run.array.part_files)
        self._sensors: dict[float, Sensor] = {}
        self._segments: dict[int, CubicSpline] = {}

    @property
    def duration(self) -> float:
        """Length of the scenario, s."""
        return self.scenario.duration

    @property
    def lsb(self) -> float:
        """Size of a full-resolution count, m/s²."""
        return float(self._sheet.lsb)

    @property
    def noise_factor(self) -> float:
        """White noise against the data sheet's."""
        return self.world.noise_factor

    @property
    def bias_walk(self) -> float:
        """Random walk of the offsets, m/s²/√s."""
        return self.world.bias_walk

    @property
    def metadata(self) -> dict[str, Any]:
        """What a recording of this ride should say about it."""
        return {
            "scenario": self.scenario.name,
            "seed": self.seed,
            "mounting_rotvec_rad": list(self.scenario.mounting_rotvec),
            **self.scenario.place,
        }

    def force(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Specific force along the sensing axes (n, c), m/s², at board times (n,), s, increasing; before the chips."""
        clipped = np.clip(t, 0.0, self.duration)
        number = (clipped * GRID_HZ // _SEGMENT).astype(int)
        if number[0] == number[-1]:
            return np.asarray(self._segment(int(number[0]))(clipped))
        result = np.empty((len(t), self.array.n_channels))
        for segment in np.unique(number):
            rows = number == segment
            result[rows] = self._segment(int(segment))(clipped[rows])
        return result

    def _segment(self, number: int) -> CubicSpline:
        """Spline of one batch of grid points; only the newest two are kept."""
        if number in self._segments:
            return self._segments[number]
        if self.world.sensing_steps:  # these may remember the past: one batch holds the whole run
            t = np.arange(-_MARGIN, round(self.duration * GRID_HZ) + _MARGIN) / GRID_HZ
            force = prescribed_readings(self.world, self._motion, t)
            force = self.world.sense(force, SampleContext(t, self._spin_at(t), self.temperature(t)))
            last = int(self.duration * GRID_HZ // _SEGMENT)
            self._segments = dict.fromkeys(range(last + 1), CubicSpline(t, force))
        else:
            t = np.arange(number * _SEGMENT - _MARGIN, (number + 1) * _SEGMENT + _MARGIN) / GRID_HZ
            force = prescribed_readings(self.world, self._motion, t)
            kept = {n: spline for n, spline in self._segments.items() if n == number - 1}
            self._segments = kept | {number: CubicSpline(t, force)}
        return self._segments[number]

    def _spin_at(self, t: NDArray[np.float64]) -> world_model.SpinState:
        if self.scenario.free:
            nan = np.full(len(t), np.nan)
            return SpinState(nan, nan, nan)
        return _spin(self._motion).at(t / (1.0 + self.world.clock_ratio))

    def temperature(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Board temperature at times (n,), °C."""
        start, final, time_constant = self.scenario.temperature
        return np.asarray(final + (start - final) * np.exp(-np.maximum(t, 0.0) / time_constant))

    def sensor(self, output_data_rate: float) -> Sensor:
        """Return the sensing chain at an output data rate, Hz; the chips' errors are the same at every rate.

        The firmware sets the rate of every chip, so that one of the array file is not used here.
        """
        if output_data_rate not in self._sensors:
            run = self.scenario
            settings = replace(run.sensor, output_data_rate=output_data_rate)
            chips = run.chips_seed if run.chips_seed is not None else np.random.SeedSequence(self.seed).spawn(4)[0]
            chips_of_one_rate = tuple(replace(chip, output_data_rate=None) for chip in run.array.chips)
            self._sensors[output_data_rate] = Sensor.build(
                replace(run.array, chips=chips_of_one_rate), settings, np.random.default_rng(chips), part=run.part
            )
        return self._sensors[output_data_rate]

    def conversion_offsets(self, output_data_rate: float) -> NDArray[np.float64]:
        """When the conversions behind one sample take place, against the sample, s."""
        return conversion_offsets(self.sensor(output_data_rate).settings, self._sheet)

    def references(self, t: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Return what other instruments read at board times (n,), by column name; a free body has no table."""
        columns = {"temperature_degC": self.temperature(t)}
        if not self.scenario.free:
            chance = np.random.default_rng([self.seed, 1])
            clipped = np.clip(t, 0.0, self.duration)
            table = _spin(self.scenario.motion)
            tacho = forward.reference(self.world, table, clipped, self.temperature(t))
            for step in self.world.motion_steps:
                table = step(table, clipped)
            columns["tacho_rad_s"] = tacho + chance.normal(size=len(t)) * self.scenario.reference.tacho_noise_std_rad_s
            columns["command_rad_s"] = _spin(self._command).at(clipped).rate
            columns["angle_rad"] = table.at(clipped - self.world.tacho_delay).angle
        return columns


def _spin(motion: Any) -> SpinMotion:
    """Narrow the type of a table's motion."""
    turning: SpinMotion = motion
    return turning
