"""Scenarios: a motion, an array, sensors, a drive and effects in a TOML file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError
from gfimu.base.files.model_files import find_model, read_toml, set_key
from gfimu.base.short_repr import short_repr
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.model.located.effect import UNLISTED, LocatedEffect
from gfimu.model.located.rig_state import RigState
from gfimu.motion.body_drive import BodyDrive
from gfimu.motion.earth import EarthRotation
from sim.chips.adxl345 import SensorSettings
from sim.effects import NOT_OF_A_CARRIAGE, Effect, apply_effects
from sim.motions.carried import Carriage
from sim.motions.motion import BodyMotion, BodyState, SpinMotion
from sim.rigs.dc_motor import DcMotor
from sim.scenario_file import ReferenceTable, scenario_fields
from sim.world import World

__all__ = ["Scenario"]


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
    reference : ReferenceTable
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
    reference: ReferenceTable = field(default_factory=ReferenceTable)
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


def _refuse_turning(scenario: Scenario, source: str) -> None:
    """Raise for what a linear axis can't have: a motor of the table, or effects of something that turns."""
    if scenario.driven:
        raise InputError(f"{source}: a linear axis moves as commanded; set drive.mode to prescribed")
    for effect in scenario.effects:
        if effect.name in NOT_OF_A_CARRIAGE:
            raise InputError(f"{source}: effect {effect.name}: {NOT_OF_A_CARRIAGE[effect.name]}; leave it out")


def _still_body(array: AccelerometerArray) -> RigState:
    """Return the state of a free body at rest, to try errors on."""
    t, nothing = np.arange(8.0), np.zeros((8, 3))
    return RigState.of_body(array, BodyDrive(t, nothing, nothing), t, np.zeros((8, array.n_channels)), t)


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
    still = _still_body(scenario.array)
    for effect in scenario.effects:
        if effect.name == UNLISTED:
            try:
                LocatedEffect.of_parameters(effect.parameters, scenario.array).added(still)
            except InputError as error:
                raise InputError(f"{source}: {error}") from None
    if any(getattr(world, name) != getattr(nominal, name) for name in same) or any(
        not np.array_equal(getattr(world, name), getattr(nominal, name)) for name in moved
    ):
        names = ", ".join(effect.name for effect in scenario.effects)
        raise InputError(f"{source}: among the effects {names} some change the table, which a tumbling body has not")
