"""Readings without error of an array that turns about an axis: what predictions run the filter on."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gfimu.base.units import STANDARD_GRAVITY
from gfimu.rate.axis.channels import AxisChannels

__all__ = ["SPUN_UP", "gravity_of", "readings_of", "spun_up"]

SPUN_UP = 0.1
"""Share of a predicted run that is rest, and again that is spent on a gain of speed; by choice."""


def gravity_of(inclination: float) -> NDArray[np.float64]:
    """Return gravity along the axis and across it, shape (2,), m/s²."""
    return STANDARD_GRAVITY * np.array([np.cos(inclination), np.sin(inclination)])


def readings_of(
    channels: AxisChannels,
    inclination: float,
    angle: NDArray[np.float64],
    rate: NDArray[np.float64],
    acceleration: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return what the channels read without noise, shape (n, c), m/s².

    Parameters
    ----------
    channels : AxisChannels
        The channels.
    inclination : float
        Angle between axis and vertical, rad.
    angle, rate, acceleration : ndarray, shape (n,)
        θ, rad, Ω, rad/s, and α, rad/s².
    """
    along, across = gravity_of(inclination)
    force = np.column_stack([np.full(len(angle), along), across * np.cos(angle), -across * np.sin(angle)])
    turned = np.outer(rate**2, channels.by_square) + np.outer(acceleration, channels.by_acceleration)
    return np.asarray(force @ channels.force.T + turned + channels.offset)


def spun_up(
    t: NDArray[np.float64], rate: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return θ, Ω and α (n,) of a run that rests, gains speed without a jump of α and then turns steadily.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Times from 0, s.
    rate : float
        The steady rate, rad/s.
    """
    takes = SPUN_UP * t[-1]
    part = np.clip((t - takes) / takes, 0.0, 1.0)  # of the gain of speed, along half a wave of a cosine
    turned = 0.5 * rate * takes * (part - np.sin(np.pi * part) / np.pi) + rate * np.maximum(t - 2.0 * takes, 0.0)
    gained = 0.5 * rate * np.pi / takes * np.sin(np.pi * part)
    return turned, 0.5 * rate * (1.0 - np.cos(np.pi * part)), gained
