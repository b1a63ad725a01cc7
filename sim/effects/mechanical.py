"""Mechanical effects of array and drive: places and axes of the chips, arms that stretch, ripple, a mode."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.array.array import AccelerometerArray
from gfimu.model.parameter_units import NUMBER, RATIO
from sim.effects.base import LARGEST_TURN, Effect, Pattern, Size, chip_patterns
from sim.effects.scans import mode_shapes, order_shapes, per_acceleration
from sim.effects.table_dynamics import Mode, RippledSpin, TwistingSpin
from sim.motions.motion import SpinMotion
from sim.world import World

__all__ = ["CentrifugalFlex", "Cogging", "Misalignment", "Resonance", "SensorPosition"]

_DEGREE = np.pi / 180.0

_WHOLE_INERTIA = 1.25
"""Participation beyond which nothing hangs on one spring; a little more than 1 for the inexactness of an estimate."""


class Misalignment(Effect):
    """A chip's sensing axes turned against the body.

    A chip is soldered or glued at an angle: its three axes are turned together by a small rotation vector relative to
    the drawing. Here F is the specific force at the chip.

    Notes
    -----
    :formula: y = f + (n×a)·F
    :symbols: n = {chip}_{axis}_rad
    :size: 0.5°, what soldering leaves of a package of 3 to 5 mm. The ADXL345's own axes are within 0.1° of square (data
        sheet).
    :example: a1_x_rad = 0.01, a1_z_rad = -0.008, a3_y_rad = 0.006
    :experiment: Put the unit at rest on six faces: each chip then shows gravity in its own axes. Turns of chips
        relative to each other are certain; a common turn of all chips needs the faces of the cube as a reference.
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
        mounting, that of a chip stays with the chip. No spin about an axis shows a displacement along it.
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


class CentrifugalFlex(Effect):
    """Arms that stretch with ω² across the axis, where the load is: each is as long as the present rate makes it.

    The arms that carry the chips stretch under their centrifugal load by the share kω². With μ = 1
    (``moving_arms``) the growth is a motion of its own.

    With ``moving_arms`` = 1 the arm also moves while it grows, as in a compliant rig. That adds Coriolis and radial
    acceleration. With 0 the arm at each moment turns as if rigid.

    Notes
    -----
    :formula: s = k·ω²;
        y = f + s·a·(α·z×r + ω²·z×(z×r)) + μ·a·(2·ω·ṡ·z×r − s̈·z×(z×r))
    :symbols: k = stretch_s2_rad2; μ = moving_arms
    :size: 2.5e-5 s²/rad², by choice: 0.6 % at 15 rad/s, a printed plastic frame.
    :example: stretch_s2_rad2 = 5e-5, moving_arms = 1
    :experiment: Spin at several high speeds, upright and with the array on its side: the stretch belongs to the
        directions across the axis in that mounting, a non-linearity to the channel. A stiffer frame removes the
        stretch.
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

    The motor's torque has n cycles per revolution (poles, slots, gear teeth), which the speed loop compensates only in
    part. δ is the error of the angle against the command; the servo is assumed to have ω₀ = 2π rad/s and ζ = 0.7, and
    friction to stop the table below ω₁ = 0.3 rad/s.

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
