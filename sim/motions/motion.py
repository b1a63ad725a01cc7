"""Motion as a function of time: the spin of a table about its axis, and free motion of a body.

Anything that can be asked for its state at arbitrary times is a motion, so that chips sampled one after another,
clocks that run fast and late references are all evaluations of the same motion at other times.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import BSpline, CubicSpline, PPoly

from gfimu.model.world_model import Spin

__all__ = ["BodyMotion", "BodyState", "SpinMotion", "SpinState", "SplineSpin"]


@dataclass(frozen=True)
class SpinState:
    """Spin of the table about its axis at given times; every field has shape (n,).

    Parameters
    ----------
    angle : ndarray
        Table angle θ, rad.
    rate : ndarray
        Rate, rad/s.
    acceleration : ndarray
        Angular acceleration, rad/s².
    """

    angle: NDArray[np.float64]
    rate: NDArray[np.float64]
    acceleration: NDArray[np.float64]


SpinMotion = Spin
"""Spin of the table as a function of time; the world model's name for it is `Spin`."""


@dataclass(frozen=True)
class BodyState:
    """Motion of a free body at given times.

    Parameters
    ----------
    position : ndarray, shape (n, 3)
        Position of the body origin in the world, m.
    rotation : ndarray, shape (n, 3, 3)
        Rotation matrix from body to world axes.
    acceleration : ndarray, shape (n, 3)
        Acceleration of the body origin in world axes, m/s².
    velocity : ndarray, shape (n, 3)
        Velocity of the body origin in world axes, m/s.
    omega, alpha : ndarray, shape (n, 3)
        Angular rate, rad/s, and acceleration, rad/s², in body axes.
    """

    position: NDArray[np.float64]
    rotation: NDArray[np.float64]
    velocity: NDArray[np.float64]
    acceleration: NDArray[np.float64]
    omega: NDArray[np.float64]
    alpha: NDArray[np.float64]


class BodyMotion(Protocol):
    """Free motion of a body as a function of time."""

    def at(self, t: ArrayLike) -> BodyState:
        """State of the body at times ``t``, s, shape (n,)."""
        ...


class SplineSpin:
    """Spin from a spline of the rate: angle and angular acceleration are its exact integral and derivative.

    Parameters
    ----------
    rate : BSpline, PPoly or CubicSpline
        Rate as a function of time, rad/s, at least twice continuously differentiable.
    start : float
        Time at which the angle is ``angle_at_start``, s.
    angle_at_start : float
        Table angle at ``start``, rad.
    """

    def __init__(self, rate: BSpline | PPoly | CubicSpline, *, start: float = 0.0, angle_at_start: float = 0.0) -> None:
        self._rate = rate
        self._angle = rate.antiderivative()
        self._acceleration = rate.derivative()
        self._offset = angle_at_start - float(self._angle(start))

    @classmethod
    def through(cls, t: ArrayLike, rate: ArrayLike, *, angle_at_start: float = 0.0) -> SplineSpin:
        """Spin whose rate is the cubic spline through samples (n,) of the rate at times ``t``, s."""
        times = np.asarray(t, dtype=float)
        return cls(CubicSpline(times, rate), start=float(times[0]), angle_at_start=angle_at_start)

    def at(self, t: ArrayLike) -> SpinState:
        """State of the spin at times ``t``, s, shape (n,)."""
        times = np.asarray(t, dtype=float)
        return SpinState(self._angle(times) + self._offset, self._rate(times), self._acceleration(times))
