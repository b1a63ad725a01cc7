"""Mechanical effects: geometry of the array, its mounting, the table, gravity, and the motion itself."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.geometry.array import AccelerometerArray
from gfimu.units import NUMBER, RATIO
from sim.effects.base import LARGEST_TURN, Effect, Pattern, Size, chip_patterns
from sim.effects.scans import mode_shapes, order_shapes, per_acceleration
from sim.effects.table_dynamics import Mode, RippledSpin, TwistingSpin
from sim.motion import SpinMotion
from sim.world import Nod, World

__all__ = [
    "AxisWobble",
    "CentrifugalFlex",
    "Cogging",
    "Eccentricity",
    "Gravity",
    "Misalignment",
    "MountTilt",
    "MountTurn",
    "RailTilt",
    "Resonance",
    "SensorPosition",
    "TableTilt",
]

_DEGREE = np.pi / 180.0

_WHOLE_INERTIA = 1.25
"""Participation beyond which nothing hangs on one spring; a little more than 1 for the inexactness of an estimate."""


class Misalignment(Effect):
    """A chip's sensing axes turned against the body.

    A chip is soldered or glued askew, so that its three axes are turned together by a small rotation vector against the
    drawing. Here F is the specific force at the chip.

    Notes
    -----
    :formula: y = f + (n×a)·F
    :symbols: n = {chip}_{axis}_rad
    :size: 0.5°, what soldering leaves of a package of 3 to 5 mm. The ADXL345's own axes are within 0.1° of square (data
        sheet).
    :example: a1_x_rad = 0.01, a1_z_rad = -0.008, a3_y_rad = 0.006
    :experiment: Put the unit at rest on six faces: each chip then shows gravity in its own axes. Chips against each
        other are certain; a common turn of all chips needs the faces of the cube as a reference.
    :recordings: MIMU4444: chips turned on the board by some tenths of a degree; the diagnosis states it as
        `cross_axis`, which contains a turn.
    """

    name = "misalignment"
    summary = "input-axis misalignment: a chip's sensing axes are turned against the body"
    tolerance = float(np.deg2rad(0.02))
    place = "geometry"
    contained_in = frozenset({"cross_axis"})
    separated_by = "the array remounted on its side, or static poses on several sides"

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """Rotation vector of each chip in the body frame."""
        return tuple(
            Size(f"{chip.name}_{axis}_rad", "rad", 0.5 * _DEGREE, bound=LARGEST_TURN)
            for chip in array.chips
            for axis in "xyz"
        )

    @classmethod
    def reach(cls, array: AccelerometerArray) -> NDArray[np.bool_]:
        """Return the channels of each chip."""
        return np.repeat(np.arange(len(array.chips)), 3)[:, None] == array.chip_of_channel

    @classmethod
    def patterns(cls, array: AccelerometerArray) -> tuple[Pattern, ...]:
        """Return all chips free, or one chip."""
        return chip_patterns(array, 3)

    def apply(self, world: World) -> World:
        """Turn each chip's axes by its rotation vector."""
        chips = []
        for chip in world.array.chips:
            turn = Rotation.from_rotvec(self.vector([f"{chip.name}_{axis}_rad" for axis in "xyz"]))
            chips.append(replace(chip, axes=turn.apply(chip.axes)))
        return world.changed(array=replace(world.array, chips=tuple(chips)))


class SensorPosition(Effect):
    """A chip that is not where the drawing says.

    The sensing element is displaced against the drawing: by the placement of the package, or within the package.

    Notes
    -----
    :formula: y = f + a·(α·z×d + ω²·z×(z×d))
    :symbols: d = {chip}_{axis}_m
    :size: 1 mm, by choice: hand assembly. The place of the element in a package of 3 to 5 mm is seldom stated.
    :example: a1_x_m = 0.002, a2_y_m = -0.0015
    :experiment: Spin upright and with the array on its side. The displacement of an eccentric mounting changes with the
        mounting, that of a chip goes with the chip. No spin about an axis shows a displacement along it.
    :recordings: MIMU4444: up to 0.3 mm, about (0.3, 0.3, 0.1) mm in each chip's own axes, mirrored on the lower side of
        the board: the element is not in the middle of its package. Two recordings agree within 0.1 mm.
    """

    name = "sensor_position"
    summary = "a chip is not where the drawing says"
    tolerance = 5e-5  # m
    place = "geometry"
    separated_by = "the array remounted on its side: an eccentric mounting changes with it, a chip's place does not"

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """Displacement of each chip in the body frame, at most as far as the chips are apart."""
        places = np.array([chip.position for chip in array.chips])
        extent = float(np.linalg.norm(places[:, None] - places, axis=2).max())
        bound = extent if extent > 0.0 else np.inf
        return tuple(Size(f"{chip.name}_{axis}_m", "m", 1e-3, bound=bound) for chip in array.chips for axis in "xyz")

    @classmethod
    def reach(cls, array: AccelerometerArray) -> NDArray[np.bool_]:
        """Return the channels of each chip."""
        return np.repeat(np.arange(len(array.chips)), 3)[:, None] == array.chip_of_channel

    @classmethod
    def patterns(cls, array: AccelerometerArray) -> tuple[Pattern, ...]:
        """Return all chips free, or one chip."""
        return chip_patterns(array, 3)

    def apply(self, world: World) -> World:
        """Move each chip by its displacement."""
        chips = tuple(
            replace(chip, position=chip.position + self.vector([f"{chip.name}_{axis}_m" for axis in "xyz"]))
            for chip in world.array.chips
        )
        return world.changed(array=replace(world.array, chips=chips))


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

    The array is bolted to the table some millimetres off the axis, so that all chips are on other radii than drawn.

    Notes
    -----
    :formula: y = f + a·(α·z×e + ω²·z×(z×e))
    :symbols: e = {x,y}_m
    :size: 1 mm, by choice: a hole pattern drilled by hand.
    :example: x_m = 0.003, y_m = -0.002
    :experiment: Remount the array, turned by 90° on its side, and spin again: the offset is new in the new mounting,
        places of chips stay. In one mounting it is exactly a common displacement of all chips.
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

    The array stands askew on the table: a chip under a corner of the foot, a bracket that is not square. It turns about
    the cube's centre; F is the specific force at the chip, ρ its place from the centre.

    Notes
    -----
    :formula: y = f + (n×a)·F + a·(α·z×(n×ρ) + ω²·z×(z×(n×ρ)))
    :symbols: n = {x,y}_rad
    :size: 0.5°, by choice: 0.9 mm under one edge of a 100 mm cube.
    :example: x_rad = 0.01, y_rad = -0.006
    :experiment: Remount the array on its side: a tilted mounting is new then, misaligned chips stay as they are. At
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
        single = (Pattern(f"about {axis}", unit[:, [place]]) for place, axis in enumerate("xyz"))
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
    :size: 0.3°, by choice: 5 mm per metre, a bench that nobody levelled.
    :example: x_rad = 0.004, y_rad = -0.002
    :experiment: Turn slowly through several whole turns. The residual of the channels across the axis is a sine of the
        table's angle whose amplitude g |n| does not depend on the rate.
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

    The axis itself nods about a horizontal line once per revolution, as with runout of a bearing or a bent shaft; e is
    that line in the room. The rate and the acceleration then have parts across the axis.

    Notes
    -----
    :formula: n = A·cos(θ + φ)·turn(x, ψ);
        w = turn(ṅ + ω·z, −θ);
        b = turn(n̈ + α·z + ω·ṅ×z, −θ);
        y = a·(g·turn(z − n×z, −θ) + b×r + w×(w×r))
    :symbols: A = amplitude_rad; φ = phase_rad; ψ = direction_rad
    :size: 0.1°, by choice: 0.2 mm of runout on a radius of 100 mm.
    :example: amplitude_rad = 0.002, phase_rad = 0.5, direction_rad = 0.0
    :experiment: Spin at two or more speeds. The part of gravity keeps its size, the rest grows with ω² and has lines at
        one and two cycles per revolution; an axis that only leans has a single line of constant size.
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

    The twin has standard gravity, the lab another one; u is up, in the table's frame.

    Notes
    -----
    :formula: y = f + Δ·a·u
    :symbols: Δ = delta_m_s2
    :size: 0.015 m/s². Gravity at sea level goes from 9.780 m/s² at the equator to 9.832 m/s² at the poles (WGS 84),
        standard gravity is 9.80665 m/s².
    :example: delta_m_s2 = 0.01
    :experiment: Look it up: the latitude and height of the lab give it to 0.001 m/s². From data alone, tilt the array
        so that other channels see gravity: a gain that all channels share stays confounded with it for a unit at rest.
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


class CentrifugalFlex(Effect):
    """Arms that stretch with ω² across the axis, where the load is: each is as long as the present rate makes it.

    The arms that carry the chips give way to their centrifugal load and grow by the share kω². With μ = 1
    (``moving_arms``) the growth is a motion of its own.

    With ``moving_arms`` = 1 it also moves while it grows, as a soft rig does, which adds Coriolis and radial
    acceleration; without, the arm of the moment turns as if rigid.

    Notes
    -----
    :formula: s = k·ω²;
        y = f + s·a·(α·z×r + ω²·z×(z×r)) + μ·a·(2·ω·ṡ·z×r − s̈·z×(z×r))
    :symbols: k = stretch_s2_rad2; μ = moving_arms
    :size: 2.5e-5 s²/rad², by choice: 0.6 % at 15 rad/s, a printed plastic frame.
    :example: stretch_s2_rad2 = 5e-5, moving_arms = 1
    :experiment: Spin at several high speeds, upright and with the array on its side: the stretch is of what lies across
        the axis in that mounting, a non-linearity is of the channel. Stiffen the frame and see it go.
    """

    name = "centrifugal_flex"
    summary = "arm stretch: radii grow with the rate squared"
    place = "geometry"
    separated_by = "the array remounted on its side, and several high speeds"
    other_units: ClassVar = {"moving_arms": NUMBER}
    whole = frozenset({"moving_arms"})

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """One stretch, never negative."""
        return (Size("stretch_s2_rad2", "s²/rad²", 2.5e-5, positive=True),)

    @classmethod
    def shapes(cls, duration: float, sample_rate: float) -> tuple[dict[str, float], ...]:
        """Arms that move, and arms that turn as if rigid."""
        return ({"moving_arms": 1.0}, {"moving_arms": 0.0})

    def shape_values(self) -> dict[str, float]:
        """Return whether the arms move: not unless it is said."""
        return {"moving_arms": float(self.parameters.get("moving_arms", 0.0))}

    def apply(self, world: World) -> World:
        """Stretch the arms."""
        moving = world.moving_arms or self.value("moving_arms") != 0.0
        return world.changed(stretch=world.stretch + self.value("stretch_s2_rad2"), moving_arms=moving)


_CHANCE = 0.2
"""Log evidence that a mode gains by chance, nats per second of data: measured with nothing hidden, and a third more."""


class Cogging(Effect):
    """Torque ripple locked to the table's angle.

    The motor's torque has n cycles per revolution (poles, slots, gear teeth), which the speed loop takes back only in
    part. δ is the error of the angle against the command; the servo is taken to have ω₀ = 2π rad/s and ζ = 0.7, and
    friction to hold the table below ω₁ = 0.3 rad/s.

    Notes
    -----
    :formula: δ̈ = A·ω²/(ω² + ω₁²)·sin(n·(θ + δ) + φ) − 2·ζ·ω₀·δ̇ − ω₀²·δ
    :symbols: A = amplitude_rad_s2; n = order; φ = phase_rad
    :size: 1 rad/s², by choice: 1 mN m on 10⁻³ kg m².
    :example: amplitude_rad_s2 = 1.0, order = 6, phase_rad = 0.3
    :experiment: Turn slowly and steadily at two speeds. The tangential channels and the reference both show lines at n
        cycles per revolution; a ripple of the reference alone leaves the channels at rest.
    """

    name = "cogging"
    summary = "torque ripple locked to the table's angle (n cycles per revolution)"
    place = "motion"
    separated_by = "slow steady rotation at two speeds"
    other_units: ClassVar = {"amplitude_rad_s2": "rad/s²", "order": NUMBER, "phase_rad": "rad"}
    whole = frozenset({"order"})
    inexactness = 0.02  # motor, friction and speed loop of a table are not as simple as this servo

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """Sine and cosine amplitudes."""
        return (Size("sine_rad_s2", "rad/s²", 1.0), Size("cosine_rad_s2", "rad/s²", 1.0))

    @classmethod
    def shapes(cls, duration: float, sample_rate: float) -> tuple[dict[str, float], ...]:
        """Return one order; the scan over orders finds it."""
        return ({"order": 6.0},)

    @classmethod
    def scan(cls, left, duration, sample_rate):  # type: ignore[no-untyped-def]
        """Return the strongest orders of an angular acceleration."""
        return order_shapes(left, 4, per_acceleration)

    @classmethod
    def from_sizes(cls, array, values, shape) -> Effect:  # type: ignore[no-untyped-def]
        """Turn sine and cosine into amplitude and phase."""
        sine, cosine = (float(v) for v in values)
        return cls(
            {"amplitude_rad_s2": float(np.hypot(sine, cosine)), "phase_rad": float(np.arctan2(cosine, sine)), **shape}
        )

    def size_values(self, array: AccelerometerArray) -> NDArray[np.float64]:
        """Return sine and cosine amplitudes."""
        amplitude, phase = self.value("amplitude_rad_s2"), self.value("phase_rad")
        return amplitude * np.array([np.cos(phase), np.sin(phase)])

    @classmethod
    def parameter_units(cls, array: AccelerometerArray) -> dict[str, str]:
        """Return the units of the contract's keys, amplitude and phase instead of the sizes."""
        return dict(cls.other_units)

    def rippled(self, motion: SpinMotion, t: NDArray[np.float64]) -> RippledSpin:
        """Return the table's motion under a command over times (n,), s."""
        return RippledSpin(motion, t, self.value("amplitude_rad_s2"), self.value("order", 1.0), self.value("phase_rad"))

    def apply(self, world: World) -> World:
        """Add the ripple to the table's motion."""
        return world.changed(motion_steps=(*world.motion_steps, self.rippled))


class Resonance(Effect):
    """A mode of the mounting: torsion on a table, belt and frame of a linear axis; excited by its acceleration.

    Array and foot are an inertia on a torsional spring, which the table's angular acceleration α excites; κ is the
    share of the twist that the array takes part in. On a linear axis belt and frame are the spring.

    Notes
    -----
    :formula: φ̈ + 2·ζ·ω₀·φ̇ + ω₀²·φ = −α;
        θ′ = θ + κ·φ
    :symbols: κ = gain; ω₀ = 2π·frequency_hz; ζ = damping_ratio
    :size: 0.3 of the inertia, by choice; 1 is all of it behind one spring. Damping ratios of bolted metal are 0.01 to
        0.05.
    :example: gain = 0.4, frequency_hz = 9.0, damping_ratio = 0.04
    :experiment: Stop quickly and rest: the mode decays alone, at its own frequency, in the tangential channels. A lag
        of the sensing chain has no oscillation after the stop.
    """

    name = "resonance"
    summary = "a mode between the drive and the array, excited by acceleration"
    place = "motion"
    separated_by = "fast ramps followed by rest, in which the mode decays alone"
    other_units: ClassVar = {"frequency_hz": "Hz", "damping_ratio": RATIO}
    shape_limits: ClassVar = {"damping_ratio": (1e-3, 0.3)}

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """Participation: 1 is the whole inertia behind one spring."""
        return (Size("gain", RATIO, 0.3, positive=True, most=_WHOLE_INERTIA),)

    @classmethod
    def shapes(cls, duration: float, sample_rate: float) -> tuple[dict[str, float], ...]:
        """Return frequencies to a little below the Nyquist frequency, and two dampings."""
        top = 0.45 * sample_rate
        frequencies = np.geomspace(2.0, max(top, 2.5), 16)
        return tuple({"frequency_hz": float(f), "damping_ratio": zeta} for f in frequencies for zeta in (0.02, 0.1))

    @classmethod
    def scan(cls, left, duration, sample_rate):  # type: ignore[no-untyped-def]
        """Return the modes that follow the residual best, and the grid."""
        shapes, looks = mode_shapes(left, 5)
        # A mode bends the functions that the drive can follow and so fits noise as one parameter alone can't.
        return (*shapes, *cls.shapes(duration, sample_rate)), looks * float(np.exp(_CHANCE * duration))

    @property
    def memory_s(self) -> float:
        """Return how long it takes the mode to decay to a three-hundredth."""
        mode = self.mode
        return float(np.log(300.0) / (mode.damping * mode.natural))

    @property
    def mode(self) -> Mode:
        """Participation, natural frequency, rad/s, and damping ratio."""
        natural = 2 * np.pi * self.value("frequency_hz", 10.0)
        return Mode(self.value("gain"), natural, self.value("damping_ratio", 0.03))

    def apply(self, world: World) -> World:
        """Let the array twist."""
        mode = self.mode

        def step(motion: SpinMotion, t: NDArray[np.float64]) -> SpinMotion:
            return TwistingSpin(motion, t, mode)

        return world.changed(mount_steps=(*world.mount_steps, step))
