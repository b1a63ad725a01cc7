"""Physics for the emulated board: what each conversion of each chip yields when the board rides a scenario.

MuJoCo gives the specific force along the sensing axes on a regular grid, in batches; splines carry it to the instants
at which each chip, on its own clock, converts. The sensing chain is that of `sim.adxl345`, up to the point where the
register-level chip takes over: range, resolution and justification are applied there, when a register is read.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from firmware_bridge.adxl345_device import RAW_PER_COUNT, TICKS_PER_SECOND
from gfimu.errors import InputError
from gfimu.recording import Recording
from sim import forward
from sim.adxl345 import Sensor, conversion_offsets
from sim.data_sheet import DataSheet
from sim.motion import SpinMotion
from sim.scenarios import Scenario
from sim.turntable import drive, prescribed_readings
from sim.world import SampleContext

__all__ = ["Conversions", "RestPhysics", "ScenarioPhysics"]

GRID_HZ = 2000.0
_SEGMENT = 8000  # grid points per batch
_MARGIN = 16  # points on either side, so that a spline's ends do not show
_LARGEST_RAW = 1 << 24
_FASTEST_CODE = 15


class Conversions(Protocol):
    """Gives the board what its chips convert."""

    def __call__(self, sensor: int, first: int, period: int, count: int, bw_rate: int) -> NDArray[np.int32]:
        """Return raw conversions (count, 3) of a sensor (from 0), from tick ``first`` on, ``period`` ticks apart."""
        ...


class RestPhysics:
    """A board that lies still: 1 g along z, no noise."""

    def __call__(self, sensor: int, first: int, period: int, count: int, bw_rate: int) -> NDArray[np.int32]:
        """Return the same conversion over and over."""
        return np.tile(np.array([0, 0, 256 * RAW_PER_COUNT], dtype=np.int32), (count, 1))


class ScenarioPhysics:
    """The physics of one scenario.

    Parameters
    ----------
    scenario : Scenario, str or Path
        The scenario, or its name or file. After its end the last instant goes on.
    seed : int
        Seed of the chips' errors and of the noise, as in `sim.scenarios.simulate`.

    Raises
    ------
    InputError
        If the array is not of four three-axis chips, or an effect changes digital samples: on a real board nothing
        does that behind the firmware's back.
    """

    def __init__(self, scenario: Scenario | str | Path, *, seed: int = 0) -> None:
        run = scenario if isinstance(scenario, Scenario) else Scenario.load(scenario)
        world = run.world
        if run.array.n_channels != 12 or len(run.array.chips) != 4:
            raise InputError(f"array {run.array.name!r}: the board carries four three-axis chips; name such an array")
        if world.data_steps:
            names = ", ".join(effect.name for effect in run.effects)
            raise InputError(f"scenario {run.name!r}: among {names} is one that changes digital samples; leave it out")
        self.seed = seed
        self.world = world
        self._command = run.motion
        if run.driven and not run.free:
            run = replace(run, motion=drive(world, run.motion, run.duration + 1.0, step=run.physics_step).motion)  # type: ignore[arg-type]
        self.scenario = run
        self._motion = run.motion
        if not run.free:
            for step in (*world.motion_steps, *world.mount_steps):
                self._motion = step(self._motion, np.arange(0.0, run.duration, 1.0 / GRID_HZ))  # type: ignore[arg-type]
        self._sheet = DataSheet.load(run.part or run.array.chips[0].part)
        self._sensors: dict[int, Sensor] = {}
        self._noise = [np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(4)]
        self._walk = np.zeros((4, 3))
        self._segments: dict[int, CubicSpline] = {}
        self._columns = [np.flatnonzero(run.array.chip_of_channel == chip) for chip in range(4)]

    @property
    def lsb(self) -> float:
        """Size of a full-resolution count, m/s²."""
        return float(self._sheet.lsb)

    def force(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Specific force along the sensing axes (n, 12), m/s², at board times (n,), s, before the chips."""
        last = self.scenario.duration
        clipped = np.clip(t, 0.0, last)
        number = np.floor_divide(clipped * GRID_HZ, _SEGMENT).astype(int)
        if number[0] == number[-1]:
            return np.asarray(self._segment(int(number[0]))(clipped))
        result = np.empty((len(t), 12))
        for segment in np.unique(number):
            rows = number == segment
            result[rows] = self._segment(int(segment))(clipped[rows])
        return result

    def _segment(self, number: int) -> CubicSpline:
        """Spline of one batch of grid points; only the newest two are kept."""
        if number not in self._segments:
            whole = bool(self.world.sensing_steps)  # these may remember the past: one batch holds the whole run
            if whole:
                places = np.arange(-_MARGIN, round(self.scenario.duration * GRID_HZ) + _MARGIN)
            else:
                places = np.arange(number * _SEGMENT - _MARGIN, (number + 1) * _SEGMENT + _MARGIN)
            t = places / GRID_HZ
            force = prescribed_readings(self.world, self._motion, t)
            if whole:
                spin = self._spin(t)
                force = self.world.sense(force, SampleContext(t, spin, self._temperature(t)))
            spline = CubicSpline(t, force)
            if whole:
                last = int(self.scenario.duration * GRID_HZ // _SEGMENT)
                self._segments = dict.fromkeys(range(last + 1), spline)
            else:
                self._segments = {n: s for n, s in self._segments.items() if n >= number - 1} | {number: spline}
        return self._segments[number]

    def _spin(self, t: NDArray[np.float64]) -> object:
        if self.scenario.free:
            from sim.motion import SpinState

            nan = np.full(len(t), np.nan)
            return SpinState(nan, nan, nan)
        return self._motion.at(t / (1.0 + self.world.clock_ratio))

    def _temperature(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        start, final, time_constant = self.scenario.temperature
        return np.asarray(final + (start - final) * np.exp(-np.maximum(t, 0.0) / time_constant))

    def _sensor(self, code: int) -> Sensor:
        """The sensing chain at an output data rate; the chips' errors are the same at every rate."""
        if code not in self._sensors:
            rate = self._sheet.rate_max / 2.0 ** (_FASTEST_CODE - code)
            settings = replace(self.scenario.sensor, output_data_rate=rate)
            chips = np.random.SeedSequence(self.seed).spawn(4)[0]
            chance = np.random.default_rng(self.scenario.chips_seed if self.scenario.chips_seed is not None else chips)
            self._sensors[code] = Sensor.build(self.scenario.array, settings, chance, part=self.scenario.part)
        return self._sensors[code]

    def __call__(self, sensor: int, first: int, period: int, count: int, bw_rate: int) -> NDArray[np.int32]:
        """Return raw conversions (count, 3) of a sensor (from 0), from tick ``first`` on, ``period`` ticks apart."""
        t = (first + period * np.arange(count, dtype=np.int64)) / TICKS_PER_SECOND
        chain = self._sensor(bw_rate & 15)
        offsets = conversion_offsets(chain.settings, self._sheet)
        force = np.mean([self.force(t + offset) for offset in offsets], axis=0)  # (count, 12)
        columns = self._columns[sensor]
        reading = chain.errors.distort(force, self._temperature(t))[:, columns]
        if self.world.bias_walk:
            steps = (
                self._noise[sensor].normal(size=(count, 3)) * self.world.bias_walk * np.sqrt(period / TICKS_PER_SECOND)
            )
            walk = self._walk[sensor] + np.cumsum(steps, axis=0)
            self._walk[sensor] = walk[-1]
            reading = reading + walk
        spread = chain.noise_std[columns] * self.world.noise_factor
        if spread.any():
            reading = reading + self._noise[sensor].normal(size=(count, 3)) * spread
        raw = np.floor(reading / self.lsb * RAW_PER_COUNT + 0.5)
        return np.clip(raw, -_LARGEST_RAW, _LARGEST_RAW).astype(np.int32)

    def add_references(self, recording: Recording) -> Recording:
        """Return a recording of this board with what the table's own instruments read at the same times.

        Adds ``tacho_rad_s``, ``command_rad_s`` and ``angle_rad`` (not for a free body) and the board's temperature.
        """
        t = recording.t_s
        columns = {"temperature_degC": self._temperature(t)}
        if not self.scenario.free:
            quality, chance = self.scenario.reference, np.random.default_rng([self.seed, 1])
            table: SpinMotion = self.scenario.motion  # type: ignore[assignment]
            clipped = np.clip(t, 0.0, self.scenario.duration)
            tacho = forward.reference(self.world, table, clipped) + chance.normal(size=len(t)) * quality.tacho_noise_std
            for step in self.world.motion_steps:
                table = step(table, clipped)
            columns["tacho_rad_s"] = tacho
            columns["command_rad_s"] = self._command.at(clipped).rate  # type: ignore[union-attr]
            columns["angle_rad"] = table.at(clipped - self.world.tacho_delay).angle
        return replace(
            recording,
            reference={**recording.reference, **columns},
            metadata={
                **recording.metadata,
                "scenario": self.scenario.name,
                "seed": self.seed,
                "mounting_rotvec_rad": list(self.scenario.mounting_rotvec),
            },
        )
