"""Motions of bodies that are carried: by a linear axis, a wheel on a moving hub, and a hand."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import make_interp_spline
from scipy.spatial.transform import Rotation

from gfimu.base.errors import InputError
from gfimu.base.files.schema import NotNegative, Positive, Table, about
from gfimu.model import world_model
from sim.motions.motion import BodyMotion, BodyState, SpinMotion

__all__ = ["Carriage", "HandTable", "Wheel"]

_AXLE = np.array([0.0, 1.0, 0.0])  # of a wheel, in the world: it rolls along x

_MOST_KNOTS = 1e6  # numerical: of the movement of a hand
_WIDEST = 1e3  # numerical: rad and m, of the same


@dataclass(frozen=True)
class Carriage:
    """A carriage on a linear axis: a printer's toolhead or bed.

    Parameters
    ----------
    course : SpinMotion
        Commanded place, m, speed, m/s, and acceleration, m/s², in place of angle, rate and angular acceleration.
    axis : tuple of float
        Direction of positive places in the world.
    """

    course: SpinMotion
    axis: tuple[float, float, float] = (1.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if not 0.0 < np.linalg.norm(self.axis) < np.inf:
            raise InputError(f"carriage axis {self.axis}: give a direction, such as [1, 0, 0]")

    def at(self, t: ArrayLike) -> world_model.SpinState:
        """State of the carriage at times ``t``, s, shape (n,)."""
        return self.course.at(t)


@dataclass(frozen=True)
class Wheel:
    """A wheel that rolls along the world's x axis; its axle is level, its hub shakes over the ground.

    Parameters
    ----------
    spin : SpinMotion
        Angle about the axle, rad; positive angles roll forwards.
    radius : float
        Rolling radius, m; 0 for a wheel on a stand.
    axis : tuple of float
        Direction of the axle in the body.
    shake : float
        Rms acceleration of the hub up and down, and along x besides rolling, m/s².
    shake_frequency : float
        About its highest frequency, Hz.
    seed : int
        Seed of the ground.
    """

    spin: SpinMotion
    radius: float = 0.0
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    shake: float = 0.0
    shake_frequency: float = 5.0
    seed: int = 0

    def __post_init__(self) -> None:
        if self.radius < 0 or self.shake < 0 or self.shake_frequency <= 0:
            raise InputError("wheel: radius_m and shake_m_s2 must not be negative, shake_hz must be positive")
        if not 0.0 < np.linalg.norm(self.axis) < np.inf:
            raise InputError(f"wheel axis {self.axis}: give a direction, such as [0, 0, 1]")

    def at(self, t: ArrayLike) -> BodyState:
        """State of the wheel at times ``t``, s, shape (n,)."""
        times = np.asarray(t, dtype=float)
        state = self.spin.at(times)
        axis = np.asarray(self.axis) / np.linalg.norm(self.axis)
        upright = Rotation.align_vectors([_AXLE], [axis])[0]
        turned = (Rotation.from_rotvec(np.outer(state.angle, _AXLE)) * upright).as_matrix()
        place, speed, push = (self._ground(times, order) for order in range(3))
        for column, rolled in zip((place, speed, push), (state.angle, state.rate, state.acceleration), strict=True):
            column[:, 0] += self.radius * rolled
        return BodyState(place, turned, speed, push, np.outer(state.rate, axis), np.outer(state.acceleration, axis))

    @cached_property
    def _waves(self) -> NDArray[np.float64]:
        """Angular frequency, rad/s, and phases of the shaking along x and z, rad, (3, k)."""
        rng = np.random.default_rng(self.seed)
        frequencies = 2.0 * np.pi * self.shake_frequency * rng.uniform(0.2, 1.0, 24)
        return np.vstack([frequencies, rng.uniform(0.0, 2.0 * np.pi, (2, 24))])

    def _ground(self, t: NDArray[np.float64], order: int) -> NDArray[np.float64]:
        """Return a derivative of the hub's place by the ground, (n, 3), m, m/s or m/s²."""
        out = np.zeros((len(t), 3))
        omega, *phases = self._waves
        size = self.shake * np.sqrt(2.0 / len(omega))
        for axis, phase in zip((0, 2), phases, strict=True):
            waves = np.exp(1j * (np.outer(t, omega) + phase)) * (1j * omega) ** (order - 2)
            out[:, axis] = size * waves.real.sum(axis=1)
        return out


class HandTable(Table, frozen=True, dict=True, tag_field="kind", tag="hand"):
    """A hand turns and moves a body at random, with rests at both ends."""

    # Euler angles (z, y, x) and the place are quintic splines through random knots, at rest at first and at the end; a
    # hand needs about half a second there and back.
    duration_s: Annotated[Positive, about("Length of the motion.", "s", example=40.0)]
    turn_rad: Annotated[NotNegative, about("Rms of the angles.", "rad")] = 0.7
    sway_m: Annotated[NotNegative, about("Rms of the place along each axis.", "m")] = 0.15
    pace_s: Annotated[Positive, about("Time between two knots of the motion.", "s")] = 0.4
    rest_s: Annotated[NotNegative, about("Rest at the start and at the end.", "s")] = 2.0
    seed: Annotated[int, about("Seed of the motion.")] = 0

    def motion(self) -> BodyMotion:
        """Return the motion of the body, which this is; raises `InputError` where the numbers allow none."""
        if self.duration_s < 2.0 * self.rest_s + 4.0 * self.pace_s:
            raise InputError(
                f"hand: {self.duration_s:g} s are too short for rest_s = {self.rest_s:g} at both ends and a few "
                f"movements of pace_s = {self.pace_s:g}; give a longer duration_s"
            )
        if not (self.turn_rad <= _WIDEST and self.sway_m <= _WIDEST):
            raise InputError(
                f"hand: turn {self.turn_rad:g} rad, sway {self.sway_m:g} m: give numbers of at most {_WIDEST:g}"
            )
        if not self.duration_s / self.pace_s <= _MOST_KNOTS:
            raise InputError(f"hand: pace_s = {self.pace_s:g} gives more than {_MOST_KNOTS:g} movements; move slower")
        return self

    @property
    def length(self) -> float:
        """Length of the motion, s."""
        return self.duration_s

    @cached_property
    def _spline(self):  # type: ignore[no-untyped-def]
        count = int((self.duration_s - 2.0 * self.rest_s) / self.pace_s) + 1
        times = np.linspace(self.rest_s, self.duration_s - self.rest_s, count)
        knots = np.random.default_rng(self.seed).standard_normal((count, 6)) * ([self.turn_rad] * 3 + [self.sway_m] * 3)
        knots[[0, -1]] = 0.0
        flat = [(1, np.zeros(6)), (2, np.zeros(6))]
        return make_interp_spline(times, knots, k=5, bc_type=(flat, flat))

    def at(self, t: ArrayLike) -> BodyState:
        """State of the body at times ``t``, s, shape (n,)."""
        times = np.asarray(t, dtype=float)
        moving = np.clip(times, self.rest_s, self.duration_s - self.rest_s)
        inside = ((times > self.rest_s) & (times < self.duration_s - self.rest_s))[:, None]
        value, slope, bend = self._spline(moving), *(self._spline(moving, order) * inside for order in (1, 2))
        omega, alpha = _euler_rates(value[:, :3], slope[:, :3], bend[:, :3])
        turned = Rotation.from_euler("ZYX", value[:, :3]).as_matrix()
        return BodyState(value[:, 3:], turned, slope[:, 3:], bend[:, 3:], omega, alpha)


def _euler_rates(
    angle: NDArray[np.float64], rate: NDArray[np.float64], bend: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return rate and angular acceleration in body axes of Euler angles yaw ψ, pitch θ, roll φ, each (n, 3).

    ω = (φ̇ − ψ̇ sin θ, θ̇ cos φ + ψ̇ cos θ sin φ, −θ̇ sin φ + ψ̇ cos θ cos φ) (Titterton & Weston, Strapdown Inertial
    Navigation Technology, 2nd ed., 3.48, inverted); α is its derivative.
    """
    (_, pitch, roll), (yaw_1, pitch_1, roll_1), (yaw_2, pitch_2, roll_2) = angle.T, rate.T, bend.T
    sp, cp, sr, cr = np.sin(pitch), np.cos(pitch), np.sin(roll), np.cos(roll)
    omega = [roll_1 - yaw_1 * sp, pitch_1 * cr + yaw_1 * cp * sr, -pitch_1 * sr + yaw_1 * cp * cr]
    flat, flat_1 = yaw_1 * cp, yaw_2 * cp - yaw_1 * sp * pitch_1
    alpha = [
        roll_2 - yaw_2 * sp - yaw_1 * cp * pitch_1,
        pitch_2 * cr - pitch_1 * sr * roll_1 + flat_1 * sr + flat * cr * roll_1,
        -pitch_2 * sr - pitch_1 * cr * roll_1 + flat_1 * cr - flat * sr * roll_1,
    ]
    return np.stack(omega, axis=-1), np.stack(alpha, axis=-1)
