"""The twin: assumptions of a simulation about a rig, and its predictions for a recording."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import tomli_w
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.array.array import AccelerometerArray
from gfimu.array.parts.part_file import PartFile
from gfimu.array.turning_axis import TurningAxis
from gfimu.base.errors import InputError
from gfimu.base.files.model_files import find_model, read_toml
from gfimu.base.files.schema import read
from gfimu.base.short_repr import short_repr
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.model.world_model import (
    BodyModel,
    ExpectedNoise,
    PlacedArray,
    Spin,
    is_linear,
    reads_place,
)
from gfimu.model.world_model import Effect as AnyEffect
from gfimu.motion.body_drive import BodyDrive
from sim import forward
from sim.body import body_channels
from sim.effects import (
    BODY_EFFECTS,
    CARRIAGE_EFFECTS,
    ENCODER_EFFECTS,
    INCLINED_EFFECTS,
    TABLE_EFFECTS,
    Effect,
    added_effects,
    apply_effects,
)
from sim.effects.mechanical import Misalignment
from sim.effects.unlisted import Unlisted
from sim.twin_file import TwinFile
from sim.world import World

__all__ = ["Twin"]

_UP = np.array([0.0, 0.0, 1.0])
_REMEMBERED = 16  # numerical: worlds that a twin keeps


@dataclass(frozen=True)
class Twin:
    """A simulation's assumptions about a rig: array, mounting, drive, sensors, effects.

    Parameters
    ----------
    array : AccelerometerArray
        Geometry of the sensors in the body frame.
    gravity : float
        Local gravity, m/s².
    cube_offset : ndarray, shape (3,)
        Cube centre from the point of the axis at table height, table frame, m.
    sample_rate : float
        Nominal sample rate, Hz.
    drive_source : str
        What drives the simulated table: ``tacho``, ``angle``, ``command``; ``gyro`` for a free body; ``carriage``,
        ``carriage_speed``, ``carriage_acceleration`` for a linear axis.
    part : str
        Name of the sensor part.
    range_g : float
        Configured range, in units of standard gravity.
    full_resolution : bool
        Whether the chips run in full resolution.
    effects : tuple of Effect
        Extensions of the model; a nominal twin has none.
    array_name : str
        Array as named in the file.
    axis_inclination : float
        Angle between the table's axis and the vertical, rad: 0 of a level table, π/2 of a wheel or a pendulum. The
        axis leans about the world's x axis; at the angle zero that is the table's x axis too.
    axis : TurningAxis, optional
        How the array sits on the table's axis, in place of upright by ``cube_offset``.
    carriage_axis : tuple of float
        Direction of positive places of a linear axis, in the world.

    Examples
    --------
    >>> import gfimu
    >>> twin = gfimu.Twin.load("cube12_turntable")
    >>> twin.array.name, twin.drive_source
    ('cube12', 'tacho')
    """

    array: AccelerometerArray
    gravity: float = STANDARD_GRAVITY
    cube_offset: NDArray[np.float64] = field(default_factory=lambda: np.array([0.0, 0.0, 0.06]))
    sample_rate: float = 100.0
    drive_source: str = "tacho"
    part: str = "adxl345"
    range_g: float = 16.0
    full_resolution: bool = True
    effects: tuple[Effect, ...] = ()
    array_name: str = ""
    axis_inclination: float = 0.0
    axis: TurningAxis | None = None
    carriage_axis: tuple[float, float, float] = (1.0, 0.0, 0.0)

    __repr__ = short_repr

    @classmethod
    def load(cls, name: str | Path) -> Twin:
        """Load a twin by name (in ``models/twins``) or from a TOML file.

        Raises
        ------
        InputError
            If the file or a key in it is wrong; the message lists the valid keys.
        """
        path = find_model("twins", name)
        return cls.from_dict(read_toml(path), source=str(path), beside=path.parent)

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], *, source: str = "twin", beside: Path | None = None) -> Twin:
        """Build a twin from the content of a twin file (`sim.twin_file.TwinFile`)."""
        file = read(data, TwinFile, source)
        array = AccelerometerArray.load(file.array, beside=beside)
        array, part = array.with_part_file(file.sensor.part or array.chips[0].part, beside=beside)
        PartFile.load(part, array.part_files)
        axis = _axis(file, array, data, source)
        return cls(
            array=array if axis is None else replace(array, turning_axis=axis),
            gravity=file.gravity_m_s2,
            cube_offset=np.array(file.cube_offset_m),
            sample_rate=file.sample_rate_hz,
            drive_source=file.drive.source,
            part=part,
            range_g=file.sensor.range_g,
            full_resolution=file.sensor.full_resolution,
            effects=tuple(table.effect(array, source) for table in file.effect),
            array_name=file.array,
            axis_inclination=file.axis_inclination_rad if axis is None else axis.inclination or 0.0,
            axis=axis,
            carriage_axis=file.carriage_axis,
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the content of the twin file."""
        data: dict[str, Any] = {
            "array": self.array_name or self.array.name,
            "gravity_m_s2": self.gravity,
            "cube_offset_m": [float(value) for value in self.cube_offset],
            "sample_rate_hz": self.sample_rate,
            "drive": {"source": self.drive_source},
            "sensor": {"part": self.part, "range_g": self.range_g, "full_resolution": self.full_resolution},
        }
        if self.axis is not None:
            del data["cube_offset_m"]
            data["mounting"] = self.axis.to_mounting()
        elif self.axis_inclination:
            data["axis_inclination_rad"] = self.axis_inclination
        if is_linear(self):
            data["carriage_axis"] = list(self.carriage_axis)
        if self.effects:
            data["effect"] = [{"name": effect.name, "parameters": effect.parameters} for effect in self.effects]
        return data

    def to_toml(self) -> str:
        """Return the text of the twin file."""
        return tomli_w.dumps(self.to_dict())

    def world(
        self,
        effects: Sequence[AnyEffect] = (),
        mounting: NDArray[np.float64] | None = None,
        start: float | None = None,
    ) -> World:
        """Return the world of the twin with more effects added.

        Parameters
        ----------
        effects : sequence of Effect
            Effects beyond the twin's own.
        mounting : ndarray, shape (3,), optional
            Rotation vector by which the cube was turned from upright before the run, rad.
        start : float, optional
            Board time at which the recording began, s; by default the first time asked for.
        """
        turned, offset = np.zeros(3) if mounting is None else mounting, self.cube_offset
        if self.axis is not None:
            turn = Rotation.from_rotvec(turned) * Rotation.align_vectors([_UP], [self.axis.direction])[0]
            turned, offset = turn.as_rotvec(), -turn.apply(self.axis.point)
        nominal = World(
            self.array,
            gravity=self.gravity,
            cube_offset=offset,
            mount_rotvec=turned,
            axis_rotvec=np.array([self.axis_inclination, 0.0, 0.0]),
            slide=np.array(self.carriage_axis) if is_linear(self) else None,
            start=start,
        )
        return apply_effects(nominal, self._effects_with(effects))

    def _placed(
        self, effects: Sequence[AnyEffect], mounting: NDArray[np.float64] | None, start: float | None
    ) -> tuple[World, forward.TableGeometry]:
        """Return the world with some effects and its geometry: a derivative asks hundreds of times for the same."""
        key = (*(id(effect) for effect in effects), None if mounting is None else mounting.tobytes(), start)
        known = self._recent.get(key)
        if known is None:
            world = self.world(effects, mounting, start)
            known = (tuple(effects), world, forward.table_geometry(world))  # the effects keep their identity
            if len(self._recent) >= _REMEMBERED:
                self._recent.clear()
            self._recent[key] = known
        return known[1], known[2]

    @cached_property
    def _recent(self) -> dict[tuple[Any, ...], tuple[Any, World, forward.TableGeometry]]:
        return {}

    @property
    def local_gravity(self) -> float:
        """Magnitude of the specific force at rest, m/s²."""
        return self.gravity

    def placed(self, mounting: NDArray[np.float64] | None = None) -> PlacedArray:
        """Return the array as it stands on the table, turned by a rotation vector from upright."""
        _, geometry = self._placed((), mounting, None)
        return PlacedArray(geometry.axes, geometry.places, self.gravity * geometry.up)

    def families(self) -> Mapping[str, type[Effect]]:
        """Return the library of effects: of a table with its kind of reference, a linear axis, or a free body."""
        if is_linear(self):
            return self._of_carriage()
        own = {"gyro": BODY_EFFECTS, "angle": ENCODER_EFFECTS}.get(self.drive_source, TABLE_EFFECTS)
        added = {name: one for name, one in added_effects().items() if self.drive_source in one.drive_sources}
        inclined = INCLINED_EFFECTS if self.axis_inclination and self.drive_source == "angle" else {}
        return {**own, **inclined, **added}

    def _of_carriage(self) -> dict[str, type[Effect]]:
        """Return the effects of a linear axis; a single chip's misalignment is that of its mounting."""
        added = {name: one for name, one in added_effects().items() if self.drive_source in one.drive_sources}
        same = {Misalignment.name} if len(self.array.chips) == 1 else set()
        return {name: one for name, one in (CARRIAGE_EFFECTS | added).items() if name not in same}

    def described(self, parameters: Mapping[str, object]) -> Effect:
        """Return an error without a name as an effect, from the parameters of `Unlisted`."""
        return Unlisted(parameters)

    def predict(
        self,
        spin: Spin,
        t: NDArray[np.float64],
        *,
        effects: Sequence[AnyEffect] = (),
        temperature: NDArray[np.float64] | None = None,
        mounting: NDArray[np.float64] | None = None,
        start: float | None = None,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Predict noise-free channels (n, c), m/s², and the reference (n,) for a spin of the table.

        Wiring, ranges and clipping are applied to the prediction; noise, quantisation, frozen and lost samples are
        not, as they have no noise-free form.
        """
        world, geometry = self._placed(effects, mounting, start)
        if world.motion_steps:  # once for the channels and the reference
            for step in world.motion_steps:
                spin = step(spin, t)
            world = world.changed(motion_steps=())
        readings = forward.channels(world, spin, t, temperature, geometry)
        if world.data_steps:
            readings = self._digital(readings, self._effects_with(effects), world, t)
        if reads_place(self):
            return readings, spin.at(t - world.tacho_delay).angle + world.angle_zero
        return readings, forward.reference(world, spin, t, temperature)

    def predict_body(
        self,
        drive: BodyDrive,
        t: NDArray[np.float64],
        *,
        effects: Sequence[AnyEffect] = (),
        temperature: NDArray[np.float64] | None = None,
        start: float | None = None,
    ) -> NDArray[np.float64]:
        """Predict noise-free channels (n, c), m/s², of a free body from its gyro and its specific force."""
        world = self.world(effects).changed(start=start)
        readings = body_channels(world, drive, t, temperature)
        return self._digital(readings, self._effects_with(effects), world, t) if world.data_steps else readings

    def _effects_with(self, effects: Sequence[AnyEffect]) -> tuple[Effect, ...]:
        return (*self.effects, *_own(effects))

    def _digital(
        self, readings: NDArray[np.float64], effects: Sequence[Effect], world: World, t: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        silent = {"stuck_channel", "dropped_frames", "coarse_resolution"}
        rng = np.random.default_rng(0)
        for effect in effects:
            if effect.place == "data" and effect.name not in silent:
                for step in effect.apply(world.changed(data_steps=())).data_steps:
                    readings = step(t, readings, rng)
        return readings

    def sample_times(self, t: NDArray[np.float64], effects: Sequence[AnyEffect] = ()) -> NDArray[np.float64]:
        """Return the true time that each chip's reading and, last, the reference belong to, shape (n, k + 1)."""
        world = self.world(effects)
        return np.column_stack([world.chip_times(t), t - world.tacho_delay])

    def reference_gain(self, effects: Sequence[AnyEffect] = ()) -> float:
        """Return what the reference reads per unit of motion once effects are added, relative to the twin's own."""
        if reads_place(self):
            return 1.0
        return float(math.prod(1.0 + e.value("ratio") for e in _own(effects) if e.name == "tacho_scale"))

    def expected_noise(self, sample_rate: float) -> ExpectedNoise:
        """Return white noise and quantisation of the part at a sample rate, as the data sheet has them."""
        if sample_rate not in self._noise:
            self._noise[sample_rate] = self._noise_of_part(sample_rate)
        return self._noise[sample_rate]

    @cached_property
    def _noise(self) -> dict[float, ExpectedNoise]:
        return {}  # read once: it is asked for in every world that is simulated

    def _noise_of_part(self, sample_rate: float) -> ExpectedNoise:
        part = PartFile.load(self.part, self.array.part_files, needs=() if self.full_resolution else ("range_g",))
        quantum = lsb = part.lsb_m_s2
        if not self.full_resolution:
            quantum *= max(self.range_g / (part.range_g or (1,))[0], 1.0)
        for effect in self.effects:
            if effect.name == "coarse_resolution":
                quantum = effect.value("step_m_s2")
        rms = np.array(part.noise_lsb_rms_100_hz) * lsb
        axis = np.concatenate([np.arange(len(chip.axes)) for chip in self.array.chips])
        rms = rms[axis] * np.sqrt(np.maximum(self.array.output_data_rates(sample_rate), 100.0) / 100.0)
        factor = math.prod(effect.value("factor", 1.0) for effect in self.effects if effect.name == "noise")
        # The data sheet's noise is that of the codes, its own quantisation included.
        analogue = rms**2 - lsb**2 / 12.0
        white = np.sqrt(np.maximum(analogue, 0.0) * factor**2 + quantum**2 / 12.0)
        return ExpectedNoise(white, quantum, self.range_g * STANDARD_GRAVITY)

    def extended(self, effects: Sequence[AnyEffect]) -> Twin:
        """Return the twin with these effects added to its own."""
        return replace(self, effects=self._effects_with(effects))

    def with_array(self, array: AccelerometerArray) -> Twin:
        """Return the twin of another array with the same channels."""
        return replace(self, array=array, array_name="")


if TYPE_CHECKING:

    def _proof(twin: Twin) -> BodyModel:
        """Let the type checker prove that a twin is a world model, of a table and of a free body."""
        return twin


def _axis(file: TwinFile, array: AccelerometerArray, data: Mapping[str, Any], source: str) -> TurningAxis | None:
    """Return how the array sits on its axis: by the twin file, or by the array file unless the twin places it upright.

    A linear axis has none. A wheel's hub moves: its twin is a free body, whose axis gives the direction of the rate
    alone.
    """
    if file.drive.source.startswith("carriage"):
        if file.mounting is not None:
            raise InputError(f"{source}: [mounting] gives an axis that turns; a linear axis has carriage_axis")
        return None
    placed = [key for key in ("cube_offset_m", "axis_inclination_rad") if key in data]
    if file.mounting is not None:
        if placed:
            raise InputError(f"{source}: {placed[0]} and [mounting] both place the array; leave one out")
        return TurningAxis.from_mounting(file.mounting, source=source)
    own = array.turning_axis
    return own if own is not None and own.hub == "fixed" and not placed else None


def _own(effects: Sequence[AnyEffect]) -> list[Effect]:
    """Return effects as those of this simulation; raises `InputError` for those of another one."""
    own = [effect for effect in effects if isinstance(effect, Effect)]
    if len(own) < len(effects):
        foreign = ", ".join(effect.name for effect in effects if not isinstance(effect, Effect))
        raise InputError(f"not effects of this simulation: {foreign}; build them with sim.effects.make_effect")
    return own
