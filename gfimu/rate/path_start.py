"""Start of the path of a body: its attitude at the first sample, and the world in which it is counted."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.base.units import STANDARD_GRAVITY
from gfimu.rate.path import TILT, VELOCITY, PathTuning

if TYPE_CHECKING:
    from gfimu.rate.filter_state import Carried

__all__ = ["PathPolicy", "PathStart", "levelled", "settled", "upright", "with_attitude"]


@dataclass(frozen=True)
class PathPolicy:
    """Uncertainty of the attitude at the start, and of rest.

    Parameters
    ----------
    level_s : float
        Time from the start over which the specific force shows what is up, s, at most.
    level_turn : float
        How far the bias of α may turn what is up in that time, rad.
    unknown_tilt_std : float
        Uncertainty of an attitude that is levelled at rest, before gravity is measured there, rad: it decides nothing.
    lost_tilt_std, lost_heading_std : float
        Uncertainty of tilt or heading, rad, from which a rest levels the body anew: gravity would move a tilt of 9° too
        far for a linear step, and noise turned by 18° of heading would seem to show it.
    mounting_std : float
        Uncertainty of a stated mounting, and of a levelled table under it, rad per axis: one degree.
    stop_std : float
        How far the velocity at rest may be from zero, m/s: the least rate that rest allows, on a lever of 0.2 m.
    still_std : float
        How far the mean acceleration over a block of rest may be from zero, m/s²: 0.1 mg.
    """

    level_s: float = 1.0
    level_turn: float = 0.05
    unknown_tilt_std: float = 0.3
    lost_tilt_std: float = 0.16
    lost_heading_std: float = 0.32
    mounting_std: float = 0.0175
    stop_std: float = 1e-3
    still_std: float = 1e-3


@dataclass(frozen=True)
class PathStart:
    """Attitude at the first sample, and the world in which attitude, velocity and position are counted.

    Parameters
    ----------
    attitude : ndarray, shape (4,), optional
        Attitude (w, x, y, z) at the first sample, body to world. By default the mean of p over the first second points
        up, and the heading is zero.
    attitude_std : float
        Its uncertainty about each axis, rad.
    axis : ndarray, shape (3,)
        Axis about which the angle is counted, body axes.
    gravity : float
        Local gravity, m/s².
    earth : ndarray, shape (3,)
        Rate of the Earth, world axes, rad/s; zeros for a world that does not turn.
    policy : PathPolicy
        What is relied on at rest.
    """

    attitude: NDArray[np.float64] | None = None
    attitude_std: float = 0.0
    axis: NDArray[np.float64] = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    gravity: float = STANDARD_GRAVITY
    earth: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    policy: PathPolicy = PathPolicy()

    def tuning(self, rest_window: int) -> PathTuning:
        """Return the numbers for a run whose blocks of rest have so many samples."""
        policy = self.policy
        axis = np.asarray(self.axis, dtype=float) / np.linalg.norm(self.axis)
        earth = np.asarray(self.earth, dtype=float)
        return PathTuning(
            axis, earth, self.gravity, policy.stop_std**2, policy.still_std**2, rest_window,
            policy.unknown_tilt_std**2, policy.lost_tilt_std**2, policy.lost_heading_std**2,
        )  # fmt: skip


def with_attitude(carried: Carried, attitude: NDArray[np.float64]) -> Carried:
    """Return a state whose attitude is counted from another one (w, x, y, z), in place."""
    here = Rotation.from_rotvec(carried.x[TILT:VELOCITY]) * _rotation(carried.attitude)
    carried.x[TILT:VELOCITY] = (here * _rotation(attitude).inv()).as_rotvec()
    carried.attitude[:] = attitude
    return carried


def settled(carried: Carried) -> NDArray[np.float64]:
    """Return the attitude (w, x, y, z) of a state with its error taken in."""
    here = Rotation.from_rotvec(carried.x[TILT:VELOCITY]) * _rotation(carried.attitude)
    return here.as_quat()[[3, 0, 1, 2]]


def _rotation(attitude: NDArray[np.float64]) -> Rotation:
    return Rotation.from_quat(attitude[[1, 2, 3, 0]])


def upright(up: NDArray[np.float64], heading: float = 0.0) -> NDArray[np.float64]:
    """Return the attitude (w, x, y, z), body to world, in which a direction (3,) of the body points up.

    ``heading`` is the angle of the body's x-axis about the world's z, rad.
    """
    roll, pitch = np.arctan2(up[1], up[2]), np.arctan2(-up[0], np.hypot(up[1], up[2]))
    return Rotation.from_euler("ZYX", [heading, pitch, roll]).as_quat()[[3, 0, 1, 2]]


def levelled(
    t: NDArray[np.float64], alpha: NDArray[np.float64], force: NDArray[np.float64], omega: NDArray[np.float64]
) -> tuple[NDArray[np.float64], float]:
    """Return the attitude (4,) in which the mean of p points up, heading zero, and the uncertainty of tilt, rad.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Times, s.
    alpha, force : ndarray, shape (n, 3)
        α, rad/s², and p, m/s², body axes.
    omega : ndarray, shape (3,)
        Rate at the first sample, rad/s.
    """
    steps = np.diff(t, prepend=t[0])[:, None]
    rates = omega + np.cumsum(steps * alpha, axis=0)
    up, turn = np.empty_like(force), Rotation.identity()
    for k, (step, rate) in enumerate(zip(steps, rates, strict=True)):
        turn = turn * Rotation.from_rotvec(step * rate)
        up[k] = turn.apply(force[k])
    mean = up.mean(axis=0)
    size = float(np.linalg.norm(mean))
    if not size > 0.0:
        return np.array([1.0, 0.0, 0.0, 0.0]), np.pi
    attitude = upright(mean)
    across = up - up @ mean[:, None] / size**2 * mean
    return attitude, float(np.sqrt(np.mean(np.sum(across**2, axis=1)) / 2.0)) / size
