"""Simulation of a scenario in MuJoCo: the recording that its board would have made, and the truth beside it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from gfimu.base.declared import Declared, Table, figure
from gfimu.base.errors import InputError
from gfimu.base.version import __version__
from gfimu.model import world_model
from gfimu.motion.body_drive import BodyDrive
from gfimu.recording import Recording
from gfimu.recording.carried_array import array_metadata
from sim import forward
from sim.chips.adxl345 import Sensor
from sim.chips.conversions import conversion_groups
from sim.earth import earth_in_body
from sim.motions.carried import Carriage, Wheel
from sim.motions.motion import BodyMotion, BodyState, SpinMotion, SpinState
from sim.rigs.driven import drive
from sim.rigs.turntable import prescribed_readings
from sim.scenario_file import ReferenceTable
from sim.scenarios import Scenario
from sim.truth import cube_state, truth_columns
from sim.world import SampleContext, World

__all__ = ["Simulated", "memory_of", "simulate", "summarise"]

_PER_SAMPLE, _PER_READING = 250, 80  # numerical: bytes of memory, measured: 950 to 1150 a sample of twelve channels
_PER_STEP = 64  # numerical: the same of a step of the driven table
_BLOCK = 20_000  # samples between two reports of progress


def simulate(
    scenario: Scenario | str | Path,
    *,
    seed: int = 0,
    out: str | Path | None = None,
    raw: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Recording:
    """Simulate a scenario in MuJoCo and return what its board would have recorded.

    Parameters
    ----------
    scenario : Scenario, str or Path
        The scenario, or its name or file.
    seed : int
        Seed of all random numbers.
    out : str or Path, optional
        Recording to write, ``.csv`` or ``.parquet``.
    raw : bool
        Keep the readings as counts of the converter (columns ``…_lsb``).
    progress : callable, optional
        Called with the share done, 0 to 1.

    Returns
    -------
    Recording
        Readings, references (``tacho_rad_s``, ``command_rad_s``, ``angle_rad``, or ``gyro_…``), temperature, and the
        truth in columns ``truth_…`` (motion of the cube at the true time of each sample).
    """
    run = scenario if isinstance(scenario, Scenario) else Scenario.load(scenario)
    world = run.world
    chance = [np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(4)]
    chips_chance, noise_chance, reference_chance, data_chance = chance
    if run.chips_seed is not None:
        chips_chance = np.random.default_rng(run.chips_seed)
    sensor = Sensor.build(run.array, run.sensor, chips_chance, part=run.part)
    if raw and (not run.sensor.quantisation or np.ptp(sensor.lsb)):
        raise InputError(
            "raw counts need one quantised part: leave out --raw, or perfect, quantisation and mixed parts"
        )

    t = np.arange(round(run.duration * run.sample_rate)) / run.sample_rate
    temperature = _temperature(run, t)
    command = run.motion
    if run.driven and not run.free:
        command_end = float(world.chip_times(t[-1:]).max()) + 2 / run.sample_rate
        driven = drive(world, _spin(command), command_end, step=run.physics_step, motor=run.motor)
        run = replace(run, motion=driven.motion)

    force, body = _rigid_body(run, world, t, progress)
    spin = _nothing(len(t)) if run.free else _cube_spin(run, world, t)
    drive_of_body = _drive_of_body(body, t, world.gravity) if run.free else None
    force = world.sense(force, SampleContext(t, spin, temperature, drive_of_body))
    force = force + _walk(force.shape, world.bias_walk / np.sqrt(run.sample_rate), noise_chance)
    readings = sensor.sense(force, temperature, noise_chance, noise_factor=world.noise_factor)
    for step in world.data_steps:
        readings = step(t, readings, data_chance)

    reference = _references(run, world, command, body, t, reference_chance)
    recording = Recording(
        t,
        np.round(readings / sensor.lsb) if raw else readings,
        run.array.channels,
        {**reference, "temperature_degC": temperature},
        _metadata(run, sensor, seed),
        truth_columns(body, world.gravity),
        "lsb" if raw else "m_s2",
    )
    recording = _without_lost_frames(recording)
    if out is not None:
        recording.write(out)
    return recording


def memory_of(run: Scenario) -> float:
    """Return the memory that a simulation needs, bytes."""
    steps = run.duration / run.physics_step if run.driven else 0.0
    return run.duration * run.sample_rate * (_PER_SAMPLE + _PER_READING * run.array.n_channels) + steps * _PER_STEP


@dataclass(frozen=True)
class Simulated(Declared):
    """A simulated recording."""

    recording: Recording
    description: str
    scenario: Annotated[str, figure("Name of the scenario.")]
    seed: Annotated[int, figure("Seed of all random numbers.", head="seed")]
    samples: Annotated[int, figure("Samples.", head="samples")]
    duration_s: Annotated[float, figure("Length.", "s", head="duration", form=".2f")]
    sample_rate_hz: Annotated[float, figure("Sample rate.", "Hz", head="sample rate", form="g")]
    array: Annotated[str, figure("Name of the array.", head="array")]
    channels: Annotated[tuple[str, ...], figure("Channels.")]
    drive: Annotated[str, figure("What moves the body, in words.", head="motion")]
    effects: Annotated[tuple[str, ...], figure("Effects that were simulated.", head="effects")]
    peak_rate_rad_s: Annotated[float, figure("Fastest turn.", "rad/s", head="fastest turn", form=".3f")]
    peak_reading_m_s2: Annotated[float, figure("Largest reading.", "m/s²", head="largest reading", form=".2f")]

    @property
    def n_channels(self) -> Annotated[int, figure("Channels.", head="channels", in_json=False, before="drive")]:
        """Number of channels."""
        return len(self.channels)

    def shown(self) -> Iterator[Table]:
        """Yield the table that people read."""
        no_effects = [] if self.effects else [("effects", "none")]
        yield Table(self.scenario, ("quantity", "value"), [*self.facts(), *no_effects], self.description)


def summarise(scenario: Scenario, recording: Recording) -> Simulated:
    """Return a simulated recording with what a person wants to know of it."""
    rates = np.stack([recording.extra[f"truth_omega_{axis}_rad_s"] for axis in "xyz"])
    lsb = recording.metadata["lsb_m_s2"] if recording.unit == "lsb" else 1.0
    return Simulated(
        recording,
        scenario.description,
        scenario.name,
        recording.metadata["seed"],
        len(recording),
        recording.duration,
        scenario.sample_rate,
        scenario.array.name,
        recording.channels,
        _drive_name(scenario),
        tuple(effect.name for effect in scenario.effects),
        float(np.linalg.norm(rates, axis=0).max()),
        float(np.nanmax(np.abs(recording.readings)) * lsb),
    )


def _drive_name(scenario: Scenario) -> str:
    if scenario.free:
        return "free body"
    if not scenario.driven:
        return "prescribed"
    return "driven" if scenario.motor is None else f"dcmotor, {scenario.motor.control}"


def _rigid_body(
    run: Scenario, world: World, t: NDArray[np.float64], progress: Callable[[float], None] | None
) -> tuple[NDArray[np.float64], BodyState]:
    """Return ideal readings (n, c), averaged over the conversions of a sample, and the true motion at the samples."""
    motion = run.motion
    if not run.free:
        for step in (*world.motion_steps, *world.mount_steps):
            motion = step(_spin(motion), t)
    array = run.array if run.part is None else run.array.with_part(run.part)
    groups = conversion_groups(array, run.sensor)
    force = np.empty((len(t), run.array.n_channels))
    for first in range(0, len(t), _BLOCK):
        block = slice(first, first + _BLOCK)
        for offsets, columns in groups:
            conversions = prescribed_readings(world, motion, (offsets[:, None] + t[block]).ravel())
            mean = conversions.reshape(len(offsets), -1, run.array.n_channels).mean(axis=0)
            force[block, columns] = mean[:, columns]
        if progress is not None:
            progress(min((first + _BLOCK) / len(t), 1.0))
    true_time = t / (1.0 + world.clock_ratio)
    state = motion.at(true_time)
    return force, state if isinstance(state, BodyState) else cube_state(world, state)


def _drive_of_body(body: BodyState, t: NDArray[np.float64], gravity: float) -> BodyDrive:
    """Return the rate of a free body and its specific force, in its axes."""
    force = np.einsum("nji,nj->ni", body.rotation, body.acceleration + np.array([0.0, 0.0, gravity]))
    return BodyDrive(t, body.omega, force)


def _cube_spin(run: Scenario, world: World, t: NDArray[np.float64]) -> world_model.SpinState:
    """Spin of the cube at the samples, for the sensing steps."""
    motion = _spin(run.motion)
    for step in (*world.motion_steps, *world.mount_steps):
        motion = step(motion, t)
    return motion.at(t / (1.0 + world.clock_ratio))


def _temperature(run: Scenario, t: NDArray[np.float64]) -> NDArray[np.float64]:
    start, final, time_constant = run.temperature
    return np.asarray(final + (start - final) * np.exp(-t / time_constant))


def _references(
    run: Scenario,
    world: World,
    command: SpinMotion | BodyMotion,
    body: BodyState,
    t: NDArray[np.float64],
    rng: np.random.Generator,
) -> dict[str, NDArray[np.float64]]:
    """Return the references by column name, each (n,)."""
    columns: dict[str, NDArray[np.float64]] = {}
    quality = run.reference
    if isinstance(command, Carriage):
        columns |= _carriage(command, world, t, quality, rng)
    elif not run.free:
        table = _spin(run.motion)
        for step in world.motion_steps:
            table = step(table, t)
        tacho = forward.reference(world, _spin(run.motion), t, _temperature(run, t))
        tacho = tacho + rng.normal(size=len(t)) * quality.tacho_noise_std_rad_s
        columns["tacho_rad_s"] = _stepped(tacho, quality.tacho_resolution_rad_s)
        columns["command_rad_s"] = _spin(command).at(t).rate
        columns["angle_rad"] = _stepped(
            table.at(t - world.tacho_delay).angle + world.angle_zero, quality.encoder_resolution_rad
        )
    if isinstance(command, Wheel):
        late_spin = command.spin.at(t - world.tacho_delay)  # a tachometer has the reference's clock, as a table's
        noise = rng.normal(size=len(t)) * quality.tacho_noise_std_rad_s
        columns["tacho_rad_s"] = _stepped(late_spin.rate + noise, quality.tacho_resolution_rad_s)
    if quality.gyro_noise_std_rad_s is not None:
        late = command.at(t / (1.0 + world.clock_ratio) - world.tacho_delay) if run.free else body
        rates = late.omega if isinstance(late, BodyState) else body.omega
        if world.earth_rate is not None:  # a gyro measures the rate against the stars
            rates = rates + earth_in_body(world.earth_rate, late if isinstance(late, BodyState) else body)
        gyro = rates @ world.gyro_matrix.T + rng.normal(size=body.omega.shape) * quality.gyro_noise_std_rad_s
        columns |= {f"gyro_{axis}_rad_s": gyro[:, index] for index, axis in enumerate("xyz")}
    return columns


def _carriage(
    command: Carriage,
    world: World,
    t: NDArray[np.float64],
    quality: ReferenceTable,
    rng: np.random.Generator,
) -> dict[str, NDArray[np.float64]]:
    """Return the commanded place, speed and acceleration of a carriage by column name, each (n,)."""
    state = command.at(t - world.tacho_delay)
    place = state.angle + rng.normal(size=len(t)) * quality.carriage_noise_std_m
    return {
        "carriage_m": _stepped(place, quality.carriage_resolution_m),
        "carriage_speed_m_s": np.asarray(state.rate),
        "carriage_acceleration_m_s2": np.asarray(state.acceleration),
    }


def _metadata(run: Scenario, sensor: Sensor, seed: int) -> dict[str, Any]:
    errors = dict(zip(run.array.channels, sensor.errors.bias.tolist(), strict=True))
    gains = dict(zip(run.array.channels, sensor.errors.scale.tolist(), strict=True))
    return {
        **array_metadata(run.array if run.part is None else run.array.with_part(run.part)),
        "part": run.part or run.array.chips[0].part,
        "sample_rate_hz": run.sample_rate,
        "scenario": run.name,
        "seed": seed,
        "software_version": __version__,
        "mounting_rotvec_rad": list(run.mounting_rotvec),
        **run.place,
        **_rig_axis(run),
        "lsb_m_s2": float(sensor.lsb[0]),
        "effects": [{"name": effect.name, "parameters": effect.parameters} for effect in run.effects],
        "truth_bias_m_s2": errors,
        "truth_scale_factor": gains,
    }


def _rig_axis(run: Scenario) -> dict[str, Any]:
    """Return the axis of a pendulum, where the array file does not say it: pictures draw the rig from it."""
    axis = None if run.free or run.array.turning_axis is not None else run.world.leaning_axis()
    if axis is None:
        return {}
    return {"rig_axis": replace(axis, hub="free" if isinstance(run.motion, Wheel) else "fixed").to_dict()}


def _without_lost_frames(recording: Recording) -> Recording:
    """Leave out the samples of which no channel arrived."""
    lost = np.isnan(recording.readings).all(axis=1)
    if not lost.any():
        return recording
    kept = ~lost
    return replace(
        recording,
        t_s=recording.t_s[kept],
        readings=recording.readings[kept],
        reference={name: values[kept] for name, values in recording.reference.items()},
        extra={name: values[kept] for name, values in recording.extra.items()},
    )


def _walk(shape: tuple[int, ...], step: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Random walk of every channel, (n, c), m/s²; drawn only where there is one."""
    return np.cumsum(rng.normal(size=shape) * step, axis=0) if step else np.zeros(shape)


def _stepped(values: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    return np.round(values / step) * step if step else values


def _nothing(n: int) -> SpinState:
    """Spin of a free body: there is none."""
    nan = np.full(n, np.nan)
    return SpinState(nan, nan, nan)


def _spin(motion: SpinMotion | BodyMotion) -> SpinMotion:
    """Narrow the type of a table's motion."""
    return motion  # type: ignore[return-value]
