"""Scenarios: a motion, an array, sensors, a drive and effects in a TOML file, and the recording they give."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import gfimu
from gfimu import world_model
from gfimu.errors import InputError
from gfimu.files.keys import set_key
from gfimu.files.model_files import find_model, read_toml
from gfimu.geometry.array import AccelerometerArray
from gfimu.motion.earth import EarthRotation
from gfimu.recording import Recording
from gfimu.recording.carried_array import array_metadata
from gfimu.short_repr import short_repr
from gfimu.units import STANDARD_GRAVITY
from sim import forward
from sim.chips.adxl345 import Sensor, SensorSettings
from sim.chips.conversions import conversion_groups
from sim.earth import earth_in_body
from sim.effects import NOT_OF_A_CARRIAGE, Effect, apply_effects
from sim.effects.unlisted import Unlisted
from sim.motions.carried import Carriage, Wheel
from sim.motions.motion import BodyMotion, BodyState, SpinMotion, SpinState
from sim.rigs.dc_motor import DcMotor
from sim.rigs.driven import drive
from sim.rigs.turntable import prescribed_readings
from sim.scenario_file import ReferenceSettings, scenario_fields
from sim.truth import cube_state, truth_columns
from sim.world import SampleContext, World

__all__ = ["ReferenceSettings", "Scenario", "simulate", "summarise"]

_BLOCK = 20_000  # samples between two reports of progress


@dataclass(frozen=True)
class Scenario:
    """A run to simulate: array, motion, sensors, effects.

    Parameters
    ----------
    name : str
        Name of the scenario.
    array : AccelerometerArray
        Nominal geometry.
    motion : SpinMotion or BodyMotion
        Motion of the table, or free motion of the body; the command when the table is driven.
    duration : float
        Length of the run, s.
    sample_rate : float
        Sample rate, Hz.
    sensor : SensorSettings
        How the chips are set up.
    part : str, optional
        Part of every chip, instead of those of the array.
    chips_seed : int, optional
        Which chips: the seed of their errors; by default it follows from the seed of the run.
    gravity : float
        Local gravity, m/s².
    earth : EarthRotation, optional
        The Earth's rotation at the place; without it the world does not turn.
    cube_offset : tuple of float
        Cube centre from the point of the axis at table height, table frame, m.
    mounting_rotvec : tuple of float
        Rotation vector by which the cube was turned from upright before the run, rad.
    axis_inclination : float
        Angle between the table's axis and the vertical, rad, about the world's x axis: π/2 of a wheel or a pendulum.
    driven : bool
        Whether the motor drives the table after the command; otherwise the motion is prescribed.
    motor : DcMotor, optional
        The motor of a driven table; by default a speed controller with limited torque.
    physics_step : float
        Step of the driven simulation, s.
    reference : ReferenceSettings
        Quality of the references.
    effects : tuple of Effect
        What is wrong in this world.
    temperature : tuple of float
        Board temperature at the start and in the end, °C, and the time constant between them, s.
    description : str
        Description, one line.

    Examples
    --------
    >>> import gfimu
    >>> scenario = gfimu.Scenario.load("paper_run", changes=["sensor.range_g=8"])
    >>> scenario.name, scenario.sample_rate
    ('paper_run', 100.0)
    """

    name: str
    array: AccelerometerArray
    motion: SpinMotion | BodyMotion
    duration: float
    sample_rate: float = 100.0
    sensor: SensorSettings = field(default_factory=SensorSettings)
    part: str | None = None
    chips_seed: int | None = None
    gravity: float = STANDARD_GRAVITY
    earth: EarthRotation | None = None
    cube_offset: tuple[float, float, float] = (0.0, 0.0, 0.06)
    mounting_rotvec: tuple[float, float, float] = (0.0, 0.0, 0.0)
    axis_inclination: float = 0.0
    driven: bool = False
    motor: DcMotor | None = None
    physics_step: float = 1e-3
    reference: ReferenceSettings = field(default_factory=ReferenceSettings)
    effects: tuple[Effect, ...] = ()
    temperature: tuple[float, float, float] = (25.0, 25.0, 600.0)
    description: str = field(default="", compare=False)

    __repr__ = short_repr

    @property
    def free(self) -> bool:
        """Whether the body moves freely, off the table."""
        return isinstance(self.motion.at(np.zeros(1)), BodyState)

    @property
    def place(self) -> dict[str, float]:
        """Metadata of a recording that say where it was made, gravity where it isn't standard, latitude and north."""
        if self.earth is None:
            return {} if self.gravity == STANDARD_GRAVITY else {"gravity_m_s2": self.gravity}
        return {**self.earth.to_dict(), "gravity_m_s2": self.gravity}

    @property
    def world(self) -> World:
        """The world of the run, with its effects."""
        nominal = World(
            self.array,
            gravity=self.gravity,
            earth_rate=None if self.earth is None else self.earth.rate,
            cube_offset=np.array(self.cube_offset),
            mount_rotvec=np.array(self.mounting_rotvec),
            axis_rotvec=np.array([self.axis_inclination, 0.0, 0.0]),
            slide=np.array(self.motion.axis) if isinstance(self.motion, Carriage) else None,
        )
        return apply_effects(nominal, self.effects)

    @classmethod
    def load(cls, name: str | Path, *, changes: Sequence[str] = ()) -> Scenario:
        """Load a scenario by name (in ``models/scenarios``) or from a TOML file.

        A twin file is a scenario too: its world, moved as in the scenario ``paper_run``.

        Parameters
        ----------
        name : str or Path
            Name or path.
        changes : sequence of str
            Changes to the file's keys, such as ``"sensor.range_g=8"``; values as in TOML.

        Raises
        ------
        InputError
            If the scenario is unknown (the message lists the names) or a key in it is wrong.
        """
        path = find_model("scenarios", name)
        data = read_toml(path)
        for change in changes:
            set_key(data, change, option="change", example="sensor.range_g=8")
        return cls.from_dict(data, source=str(path), beside=path.parent)

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], *, source: str = "scenario", beside: Path | None = None) -> Scenario:
        """Build a scenario from the keys of a scenario file; raises `InputError` naming the key."""
        scenario = cls(**scenario_fields(data, source, beside))
        if isinstance(scenario.motion, Carriage):
            _refuse_turning(scenario, source)
        if scenario.free:
            _refuse_table_keys(scenario, source)
        return scenario


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
    start, final, time_constant = run.temperature
    temperature = final + (start - final) * np.exp(-t / time_constant)
    command = run.motion
    if run.driven and not run.free:
        command_end = float(world.chip_times(t[-1:]).max()) + 2 / run.sample_rate
        driven = drive(world, _spin(command), command_end, step=run.physics_step, motor=run.motor)
        run = replace(run, motion=driven.motion)

    force, body = _rigid_body(run, world, t, progress)
    spin = _nothing(len(t)) if run.free else _cube_spin(run, world, t)
    force = world.sense(force, SampleContext(t, spin, temperature))
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


def summarise(scenario: Scenario, recording: Recording) -> dict[str, Any]:
    """Return what a person wants to know of a simulated recording, by quantity with unit."""
    rates = np.stack([recording.extra[f"truth_omega_{axis}_rad_s"] for axis in "xyz"])
    lsb = recording.metadata["lsb_m_s2"] if recording.unit == "lsb" else 1.0
    return {
        "scenario": scenario.name,
        "seed": recording.metadata["seed"],
        "samples": len(recording),
        "duration_s": recording.duration,
        "sample_rate_hz": scenario.sample_rate,
        "array": scenario.array.name,
        "channels": list(recording.channels),
        "drive": _drive_name(scenario),
        "effects": [effect.name for effect in scenario.effects],
        "peak_rate_rad_s": float(np.linalg.norm(rates, axis=0).max()),
        "peak_reading_m_s2": float(np.nanmax(np.abs(recording.readings)) * lsb),
    }


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


def _cube_spin(run: Scenario, world: World, t: NDArray[np.float64]) -> world_model.SpinState:
    """Spin of the cube at the samples, for the sensing steps."""
    motion = _spin(run.motion)
    for step in (*world.motion_steps, *world.mount_steps):
        motion = step(motion, t)
    return motion.at(t / (1.0 + world.clock_ratio))


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
        tacho = forward.reference(world, _spin(run.motion), t) + rng.normal(size=len(t)) * quality.tacho_noise_std
        columns["tacho_rad_s"] = _stepped(tacho, quality.tacho_resolution)
        columns["command_rad_s"] = _spin(command).at(t).rate
        columns["angle_rad"] = _stepped(
            table.at(t - world.tacho_delay).angle + world.angle_zero, quality.encoder_resolution
        )
    if isinstance(command, Wheel):
        late_spin = command.spin.at(t - world.tacho_delay)  # a tachometer has the reference's clock, as a table's
        noise = rng.normal(size=len(t)) * quality.tacho_noise_std
        columns["tacho_rad_s"] = _stepped(late_spin.rate + noise, quality.tacho_resolution)
    if quality.gyro_noise_std is not None:
        late = command.at(t / (1.0 + world.clock_ratio) - world.tacho_delay) if run.free else body
        rates = late.omega if isinstance(late, BodyState) else body.omega
        if world.earth_rate is not None:  # a gyro measures the rate against the stars
            rates = rates + earth_in_body(world.earth_rate, late if isinstance(late, BodyState) else body)
        gyro = rates @ world.gyro_matrix.T + rng.normal(size=body.omega.shape) * quality.gyro_noise_std
        columns |= {f"gyro_{axis}_rad_s": gyro[:, place] for place, axis in enumerate("xyz")}
    return columns


def _carriage(
    command: Carriage,
    world: World,
    t: NDArray[np.float64],
    quality: ReferenceSettings,
    rng: np.random.Generator,
) -> dict[str, NDArray[np.float64]]:
    """Return the commanded place, speed and acceleration of a carriage by column name, each (n,)."""
    state = command.at(t - world.tacho_delay)
    place = state.angle + rng.normal(size=len(t)) * quality.carriage_noise_std
    return {
        "carriage_m": _stepped(place, quality.carriage_resolution),
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
        "software_version": gfimu.__version__,
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


def _refuse_turning(scenario: Scenario, source: str) -> None:
    """Raise for what a linear axis can't have: a motor of the table, or effects of something that turns."""
    if scenario.driven:
        raise InputError(f"{source}: a linear axis moves as commanded; set drive.mode to prescribed")
    for effect in scenario.effects:
        if effect.name in NOT_OF_A_CARRIAGE:
            raise InputError(f"{source}: effect {effect.name}: {NOT_OF_A_CARRIAGE[effect.name]}; leave it out")


def _refuse_table_keys(scenario: Scenario, source: str) -> None:
    """Raise for what a free body can't have: a drive, or effects of the table."""
    if scenario.driven:
        raise InputError(f"{source}: a tumbling body has no motor; set drive.mode to prescribed")
    if any(scenario.mounting_rotvec):
        raise InputError(f"{source}: mounting_rotvec_rad belongs to the table; a tumbling body starts upright")
    world = scenario.world
    nominal = replace(scenario, effects=()).world
    same = ("nod", "stretch", "leans", "shakes", "motion_steps", "mount_steps", "reference_steps")
    moved = ("cube_offset", "mount_rotvec", "axis_rotvec")
    of_spin = any(isinstance(one, Unlisted) and one.dependence.function is not None for one in scenario.effects)
    if (
        of_spin
        or any(getattr(world, name) != getattr(nominal, name) for name in same)
        or any(not np.array_equal(getattr(world, name), getattr(nominal, name)) for name in moved)
    ):
        names = ", ".join(effect.name for effect in scenario.effects)
        raise InputError(f"{source}: among the effects {names} some change the table, which a tumbling body has not")
