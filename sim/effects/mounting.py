"""Effects of how the array sits on the table and the table in the room: offsets, tilts, a nodding axis, gravity."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.array.array import AccelerometerArray
from sim.effects.base import LARGEST_TURN, Effect, Pattern, Size
from sim.world import Nod, World

__all__ = ["AxisWobble", "Eccentricity", "Gravity", "MountTilt", "MountTurn", "RailTilt", "TableTilt"]

_DEGREE = np.pi / 180.0


class _TwoAxes(Effect):
    """Two sizes across the axis."""

    unit = "rad"
    prior_std = 0.5 * _DEGREE
    bound = LARGEST_TURN

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        return tuple(Size(f"{axis}_{cls.unit}", cls.unit, cls.prior_std, bound=cls.bound) for axis in "xy")

    def across(self) -> NDArray[np.float64]:
        return np.array([self.value(f"x_{self.unit}"), self.value(f"y_{self.unit}"), 0.0])


class Eccentricity(_TwoAxes):
    """The whole array off the table's axis.

    The array is bolted to the table some millimetres off the axis, so the radii of all chips differ from the drawing.

    Notes
    -----
    :formula: y = f + a·(α·z×e + ω²·z×(z×e))
    :symbols: e = {x,y}_m
    :size: 1 mm, by choice: a hole pattern drilled by hand.
    :example: x_m = 0.003, y_m = -0.002
    :experiment: Remount the array, turned by 90° on its side, and spin again: the offset changes with the mounting,
        the places of chips do not. In one mounting it is exactly a common displacement of all chips.
    """

    name = "eccentricity"
    summary = "the whole array is off the table's axis"
    place = "geometry"
    unit = "m"
    prior_std = 1e-3
    bound = np.inf  # an arm may be mounted anywhere
    per_run = True
    separated_by = "the array remounted on its side: an eccentric mounting changes with it, a chip's place does not"

    def apply(self, world: World) -> World:
        """Move the array across the axis."""
        return world.changed(cube_offset=world.cube_offset + self.across())


class MountTilt(_TwoAxes):
    """The array not square to the table's axis.

    The array is tilted on the table: a chip of metal under a corner of the foot, a bracket that is not square. It turns
    about the cube's centre; F is the specific force at the chip, ρ its place from the centre.

    Notes
    -----
    :formula: y = f + (n×a)·F + a·(α·z×(n×ρ) + ω²·z×(z×(n×ρ)))
    :symbols: n = {x,y}_rad
    :size: 0.5°, by choice: 0.9 mm under one edge of a 100 mm cube.
    :example: x_rad = 0.01, y_rad = -0.006
    :experiment: Remount the array on its side: the tilt changes with the mounting, misaligned chips do not. At
        rest alone it is the same as an axis out of level, until the table is turned by half a turn.
    """

    name = "mount_tilt"
    summary = "the array is not square to the table's axis"
    place = "geometry"
    per_run = True
    separated_by = "the array remounted on its side: a tilted mounting changes with it, a chip's misalignment does not"

    def apply(self, world: World) -> World:
        """Turn the array in the table frame."""
        turn = Rotation.from_rotvec(self.across()) * Rotation.from_rotvec(world.mount_rotvec)
        return world.changed(mount_rotvec=turn.as_rotvec())


class MountTurn(Effect):
    """The array turned against a linear axis.

    The array on a carriage, such as an accelerometer on a printer's toolhead, is turned against the axis that carries
    it. F is the specific force.

    Notes
    -----
    :formula: y = f + (n×a)·F
    :symbols: n = {x,y,z}_rad
    :size: 1°, by choice: a board that is clipped or taped to the toolhead.
    :example: x_rad = 0.006, y_rad = 0.01, z_rad = -0.008
    :experiment: Move the carriage with strong accelerations both ways: a turned array shows a share of them across the
        axis. Then remount it on its side: the turn of the mounting is new, a pick-up between channels stays.
    """

    name = "mount_turn"
    summary = "the array is turned against the axis that carries it"
    place = "geometry"
    per_run = True
    contained_in = frozenset({"misalignment"})
    separated_by = "the array remounted on its side: a turned mounting changes with it, a chip's misalignment does not"

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """Rotation vector of the array in the frame of the axis."""
        return tuple(Size(f"{axis}_rad", "rad", _DEGREE, bound=LARGEST_TURN) for axis in "xyz")

    @classmethod
    def patterns(cls, array: AccelerometerArray) -> tuple[Pattern, ...]:
        """Return a turn about all axes, or about one of them, as of an array that lies flat but askew."""
        unit = np.eye(3)
        single = (Pattern(f"about {axis}", unit[:, [index]]) for index, axis in enumerate("xyz"))
        return (Pattern("", unit), *single)

    def apply(self, world: World) -> World:
        """Turn the array on its carriage."""
        turn = Rotation.from_rotvec(self.vector([f"{axis}_rad" for axis in "xyz"]))
        return world.changed(mount_rotvec=(turn * Rotation.from_rotvec(world.mount_rotvec)).as_rotvec())


class TableTilt(_TwoAxes):
    """The table's axis not vertical: gravity turns once per revolution in x and y.

    The table stands on a bench that is not level, so that its axis leans by n and gravity goes round in the turning
    array.

    Notes
    -----
    :formula: y = f − g·a·turn(n×z, −θ)
    :symbols: n = {x,y}_rad
    :size: 0.3°, by choice: 5 mm per metre, a bench that was not levelled.
    :example: x_rad = 0.004, y_rad = -0.002
    :experiment: Turn slowly through several whole turns. The residual of the channels across the axis is a sine of the
        table's angle whose amplitude, g times the lean, does not depend on
        the rate.
    """

    name = "table_tilt"
    summary = "the table's axis is not vertical: gravity turns once per revolution in x and y"
    place = "geometry"
    prior_std = 0.3 * _DEGREE
    per_run = True
    separated_by = "slow rotation through several turns"

    def apply(self, world: World) -> World:
        """Turn the table's axis in the world."""
        turn = Rotation.from_rotvec(self.across()) * Rotation.from_rotvec(world.axis_rotvec)
        return world.changed(axis_rotvec=turn.as_rotvec())


class RailTilt(TableTilt):
    """A linear axis that is not where the twin has it: gravity has other parts along the array's axes.

    The carriage's axis is out of level, so that gravity has another part along each sensing axis, the same all the
    time.

    Notes
    -----
    :formula: y = f − g·a·(n×z)
    :symbols: n = {x,y}_rad
    :size: 0.3°, by choice.
    :example: x_rad = 0.004, y_rad = -0.002
    :experiment: Remount the array on its side: an offset of a channel stays with the channel, a part of gravity goes to
        other channels.
    """

    summary = "the linear axis is out of level: gravity has other parts along the sensing axes, the same all the time"
    separated_by = "the array remounted on its side: an offset of a channel stays, a part of gravity changes channels"


class AxisWobble(Effect):
    """The axis nods once per revolution (bearing runout).

    The axis itself nods about a horizontal line once per revolution, as with runout of a bearing or a bent shaft; ψ is
    the angle of that line from the room's x. Rate and acceleration then have parts across the axis.

    Notes
    -----
    :formula: n = A·cos(θ + φ)·turn(x, ψ);
        w = turn(ṅ + ω·z, −θ);
        b = turn(n̈ + α·z + ω·ṅ×z, −θ);
        y = a·(g·turn(z − n×z, −θ) + b×r + w×(w×r))
    :symbols: A = amplitude_rad; φ = phase_rad; ψ = direction_rad
    :size: 0.1°, by choice: 0.2 mm of runout on a radius of 100 mm.
    :example: amplitude_rad = 0.002, phase_rad = 0.5, direction_rad = 0.0
    :experiment: Spin at two or more speeds. In the turning array the change is a constant and a line at two cycles per
        revolution, of which the part of gravity keeps its size and the rest grows with ω². An axis that only leans has
        one line, at one cycle per revolution, of constant size.
    """

    name = "axis_wobble"
    summary = "the axis nods once per revolution (bearing runout)"
    place = "geometry"
    separated_by = "rotation at two or more speeds"
    other_units: ClassVar = {"amplitude_rad": "rad", "phase_rad": "rad", "direction_rad": "rad"}

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """Cosine and sine amplitudes of the nod."""
        return tuple(Size(f"{wave}_rad", "rad", 0.1 * _DEGREE, bound=LARGEST_TURN) for wave in ("cosine", "sine"))

    @classmethod
    def shapes(cls, duration: float, sample_rate: float) -> tuple[dict[str, float], ...]:
        """Return horizontal directions of the nod axis from the world's x, an eighth of a turn apart."""
        return tuple({"direction_rad": float(psi)} for psi in (0.0, 0.25 * np.pi, 0.5 * np.pi, 0.75 * np.pi))

    @classmethod
    def from_sizes(cls, array, values, shape) -> Effect:  # type: ignore[no-untyped-def]
        """Turn cosine and sine into amplitude and phase: A cos(θ + φ)."""
        cosine, sine = (float(v) for v in values)
        return cls(
            {"amplitude_rad": float(np.hypot(cosine, sine)), "phase_rad": float(np.arctan2(-sine, cosine)), **shape}
        )

    def size_values(self, array: AccelerometerArray) -> NDArray[np.float64]:
        """Return cosine and sine amplitudes."""
        amplitude, phase = self.value("amplitude_rad"), self.value("phase_rad")
        return amplitude * np.array([np.cos(phase), -np.sin(phase)])

    @classmethod
    def parameter_units(cls, array: AccelerometerArray) -> dict[str, str]:
        """Return the units of the contract's keys, amplitude and phase instead of the sizes."""
        return dict(cls.other_units)

    def apply(self, world: World) -> World:
        """Let the axis nod."""
        nod = Nod.about(self.value("direction_rad"), self.value("amplitude_rad"), self.value("phase_rad"))
        return world.changed(nod=world.nod + nod)


class Gravity(Effect):
    """Local gravity other than assumed.

    The twin has standard gravity, the laboratory has another value; u is up, in the table's frame.

    Notes
    -----
    :formula: y = f + Δ·a·u
    :symbols: Δ = delta_m_s2
    :size: 0.015 m/s². Gravity at sea level goes from 9.780 m/s² at the equator to 9.832 m/s² at the poles (WGS 84),
        standard gravity is 9.80665 m/s².
    :example: delta_m_s2 = 0.01
    :experiment: Compute it: the latitude and height of the laboratory give it to 0.001 m/s². From data alone, tilt the
        array so that other channels see gravity. For a unit at rest a common gain of all channels stays confounded with
        it.
    """

    name = "gravity"
    summary = "local gravity is other than assumed"
    place = "geometry"
    separated_by = "the array remounted on its side, so that other channels see gravity"

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """One difference."""
        return (Size("delta_m_s2", "m/s²", 0.015),)

    def apply(self, world: World) -> World:
        """Change gravity."""
        return world.changed(gravity=world.gravity + self.value("delta_m_s2"))
