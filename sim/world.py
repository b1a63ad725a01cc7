"""The world as data: geometry, mounting, gravity, motion, sampling, sensing, reference.

Channels = sensing(effects(rigid body(motion, geometry))). A `World` holds what each stage needs; an effect
(`sim.effects`) returns a changed world; the analytic forward model (`sim.forward`) and the MuJoCo rig
(`sim.rigs.turntable`) both read the same world, so every effect is carried by both.

Frames: the world has z up. The axis frame is the world turned by ``axis_rotvec`` (the table's axis not vertical)
and by the nod; the table frame is the axis frame turned by the angle θ about its z; the cube frame is the table
frame turned by ``mount_rotvec``, with its origin at ``cube_offset`` (table frame).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.array.array import AccelerometerArray
from gfimu.array.turning_axis import TurningAxis
from gfimu.base.short_repr import short_repr
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.model.world_model import SpinState
from gfimu.motion.body_drive import BodyDrive
from sim.motions.motion import SpinMotion

__all__ = ["DataStep", "Lean", "MotionStep", "Nod", "ReferenceStep", "SampleContext", "SensingStep", "Shake", "World"]

_LEANING = 0.2  # rad: an axis that leans less is that of a table
_ONE_LINE = 1e-9  # of the square of a nod: what rounding leaves of an area


@dataclass(frozen=True)
class SampleContext:
    """What a sensing step may look at besides the readings.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Time on the board's clock, s.
    spin : SpinState
        Spin of the cube at these times; NaN-filled for a free body.
    temperature : ndarray, shape (n,)
        Board temperature, °C (25 where not recorded).
    body : BodyDrive, optional
        Motion of a free body.
    """

    t: NDArray[np.float64]
    spin: SpinState
    temperature: NDArray[np.float64]
    body: BodyDrive | None = None


class MotionStep(Protocol):
    """A change of the table's motion before it reaches the cube (cogging, resonance)."""

    def __call__(self, motion: SpinMotion, t: NDArray[np.float64]) -> SpinMotion:
        """Return the changed motion; ``t`` is the time span that will be asked for, s."""
        ...


class SensingStep(Protocol):
    """A change of the readings inside the sensing chain, in order of application."""

    def __call__(self, readings: NDArray[np.float64], context: SampleContext) -> NDArray[np.float64]:
        """Return changed readings, shape (n, c), m/s²."""
        ...


class ReferenceStep(Protocol):
    """A change of the reference (tachometer) between the table and the file."""

    def __call__(self, reading: NDArray[np.float64], spin: SpinState, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the changed reference reading, shape (n,), rad/s; ``spin`` is the table's at these times ``t``, s."""
        ...


class Shake(Protocol):
    """An acceleration of the whole rig in the room (bench, floor, bearing)."""

    def __call__(self, spin: SpinState, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return it in world axes, shape (n, 3), m/s²; ``spin`` is the table's at these times ``t``, s."""
        ...


class DataStep(Protocol):
    """A change of the digital samples (wiring, wrong range, stuck channel, lost frames); may need chance."""

    def __call__(
        self, t: NDArray[np.float64], readings: NDArray[np.float64], rng: np.random.Generator
    ) -> NDArray[np.float64]:
        """Return changed readings, shape (n, c); rows that are all NaN are lost frames."""
        ...


@dataclass(frozen=True)
class Nod:
    """Nod of the table's axis once per revolution: a horizontal rotation vector cosine·cos θ + sine·sin θ.

    Parameters
    ----------
    cosine, sine : tuple of float
        Its parts along the world's x and y, rad.
    """

    cosine: tuple[float, float] = (0.0, 0.0)
    sine: tuple[float, float] = (0.0, 0.0)

    @classmethod
    def about(cls, direction: float, amplitude: float, phase: float) -> Nod:
        """Return amplitude·cos(θ + phase) along (cos direction, sin direction, 0), all in rad."""
        x, y = amplitude * np.cos(direction), amplitude * np.sin(direction)
        cos, sin = np.cos(phase), -np.sin(phase)
        return cls((float(x * cos), float(y * cos)), (float(x * sin), float(y * sin)))

    def __bool__(self) -> bool:
        return any((*self.cosine, *self.sine))

    def __add__(self, other: Nod) -> Nod:
        (a, b), (c, d) = np.add(self.cosine, other.cosine), np.add(self.sine, other.sine)
        return Nod((float(a), float(b)), (float(c), float(d)))

    @property
    def direction(self) -> float | None:
        """Of the horizontal line that it nods about, rad; None where it does not keep to one."""
        (a, b), (c, d) = self.cosine, self.sine
        size = np.hypot(np.hypot(a, b), np.hypot(c, d))
        if abs(a * d - b * c) > _ONE_LINE * size**2:
            return None
        return float(np.arctan2(b, a) if np.hypot(a, b) > np.hypot(c, d) else np.arctan2(d, c))

    def lean(self, spin: SpinState) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return the rotation vector and its first two derivatives for a spin of the table, each (n, 3)."""
        part = np.array([[*self.cosine, 0.0], [*self.sine, 0.0]])
        waves = np.column_stack([np.cos(spin.angle), np.sin(spin.angle)])
        slopes = np.column_stack([-waves[:, 1], waves[:, 0]])
        rate, acceleration = spin.rate[:, None], spin.acceleration[:, None]
        return waves @ part, (slopes * rate) @ part, (slopes * acceleration - waves * rate**2) @ part


@dataclass(frozen=True)
class Lean:
    """A lean of the cube about the point where the axis meets the table: a rotation vector that follows the motion.

    Parameters
    ----------
    vector : ndarray, shape (3,)
        Rotation vector in the table frame where the function is 1, rad.
    function : callable
        The function of the spin, shape (n,).
    """

    vector: NDArray[np.float64]
    function: Callable[[SpinState], NDArray[np.float64]]


@dataclass(frozen=True)
class World:
    """Everything that decides what twelve channels and a tachometer read, except the drive and the noise.

    Parameters
    ----------
    array : AccelerometerArray
        True geometry of the chips in the cube frame.
    gravity : float
        Local gravity, m/s².
    earth_rate : ndarray, shape (3,), optional
        Rate of the world against the stars, world axes, rad/s; MuJoCo's readings hold it (`sim.earth`), the analytic
        ones do not.
    cube_offset : ndarray, shape (3,)
        Cube centre from the point of the axis at table height, table frame, m.
    mount_rotvec : ndarray, shape (3,)
        Rotation vector of the cube in the table frame, rad.
    axis_rotvec : ndarray, shape (3,)
        Rotation vector of the table's axis in the world, rad.
    slide : ndarray, shape (3,), optional
        Direction, axis frame, along which a carriage moves in place of the turning table. Angle, rate and angular
        acceleration of a spin are then its place (m), speed (m/s) and acceleration (m/s²).
    angle_zero : float
        What an encoder reads at the angle zero, rad.
    nod : Nod
        Nod of the axis.
    stretch : float
        Relative stretch of the arms per rate squared, s²/rad²: arm × (1 + stretch·ω²).
    moving_arms : bool
        Whether readings hold what the stretching itself is: the Coriolis and radial acceleration of a growing arm.
    leans : tuple of Lean
        Leans of the cube against the table.
    shakes : tuple
        Accelerations of the whole rig in the room.
    chip_delay : ndarray, shape (k,)
        How late each chip is sampled after the time stamp, s.
    clock_ratio : float
        The board's clock shows (1 + ratio) of the reference's time since ``start``.
    tacho_delay : float
        How late the reference is, s.
    gyro_matrix : ndarray, shape (3, 3)
        What the reference gyro reads is this matrix times the angular rate.
    motion_steps : tuple
        Changes of the table's motion, seen by the cube and the tachometer.
    mount_steps : tuple
        Changes of the cube's motion against the table's, seen by the cube alone.
    sensing_steps, reference_steps, data_steps : tuple
        Changes at their places in the chain, in order.
    reference_errors : tuple
        The same of the reference after these, which may depend on the temperature.
    noise_factor : float
        White noise of the chips against the part's figure.
    bias_walk : float
        Random walk of every channel's bias, m/s² per √s.
    temperature : float
        Board temperature where none is recorded, °C.
    start : float, optional
        Board time at which the recording began (power-on), s; by default the first time asked for, of clocks zero.
    """

    array: AccelerometerArray
    gravity: float = STANDARD_GRAVITY
    earth_rate: NDArray[np.float64] | None = None
    cube_offset: NDArray[np.float64] = field(default_factory=lambda: np.array([0.0, 0.0, 0.06]))
    mount_rotvec: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    axis_rotvec: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    slide: NDArray[np.float64] | None = None
    angle_zero: float = 0.0
    nod: Nod = Nod()
    stretch: float = 0.0
    moving_arms: bool = False
    leans: tuple[Lean, ...] = ()
    shakes: tuple[Shake, ...] = ()
    chip_delay: NDArray[np.float64] | None = None
    clock_ratio: float = 0.0
    tacho_delay: float = 0.0
    gyro_matrix: NDArray[np.float64] = field(default_factory=lambda: np.eye(3))
    motion_steps: tuple[MotionStep, ...] = ()
    mount_steps: tuple[MotionStep, ...] = ()
    sensing_steps: tuple[SensingStep, ...] = ()
    reference_steps: tuple[ReferenceStep, ...] = ()
    reference_errors: tuple[SensingStep, ...] = ()
    data_steps: tuple[DataStep, ...] = ()
    noise_factor: float = 1.0
    bias_walk: float = 0.0
    temperature: float = 25.0
    start: float | None = None

    __repr__ = short_repr

    def true_times(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the true (reference) times of board times ``t``, s; both clocks agree when the recording begins."""
        start = 0.0 if self.start is None else self.start
        return start + (t - start) / (1.0 + self.clock_ratio)

    def chip_times(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the true (reference) times at which each chip is sampled, shape (n, k), for board times ``t``, s."""
        true = self.true_times(t)
        delay = np.zeros(len(self.array.chips)) if self.chip_delay is None else self.chip_delay
        return true[:, None] + delay

    def sense(self, readings: NDArray[np.float64], context: SampleContext) -> NDArray[np.float64]:
        """Apply the sensing steps to ideal readings, shape (n, c), m/s²."""
        for step in self.sensing_steps:
            readings = step(readings, context)
        return readings

    def leaning_axis(self) -> TurningAxis | None:
        """Return the axis of a pendulum or a wheel in the body frame; None of a table, which hardly leans."""
        lean = float(np.linalg.norm(self.axis_rotvec))
        if self.slide is not None or lean < _LEANING:
            return None
        to_body = Rotation.from_rotvec(self.mount_rotvec).inv()
        return TurningAxis(to_body.apply([0.0, 0.0, 1.0]), to_body.apply(-self.cube_offset), inclination=lean)

    def since_start(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the time since the recording began, s, shape (n,)."""
        return t - (t[0] if self.start is None else self.start)

    def changed(self, **fields: Any) -> World:
        """Return this world with some fields replaced."""
        return replace(self, **fields)
