"""Regressors: quantities that an error may go with, from the state of a rig."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from gfimu.model.located.rig_state import RigState

__all__ = [
    "ACCELERATION",
    "ANGLE",
    "FORCES",
    "NOTHING",
    "RATE",
    "RATE_SQUARED",
    "REGRESSORS",
    "TEMPERATURE",
    "TIME",
    "WARMING",
    "WITHIN_REVOLUTION",
    "Regressor",
]

_Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Regressor:
    """A quantity that an error may go with.

    Parameters
    ----------
    name : str
        As in ``verdict.json``: omega, alpha, theta, t, T.
    words : str
        For people.
    unit : str
        Its unit.
    of : callable
        From the state of a rig to its values (n,).
    """

    name: str
    words: str
    unit: str
    of: Callable[[RigState], _Floats]


RATE = Regressor("omega", "the rate", "rad/s", lambda state: state.spin.rate)
ACCELERATION = Regressor("alpha", "the angular acceleration", "rad/s²", lambda state: state.spin.acceleration)
ANGLE = Regressor("theta", "the angle turned", "rad", lambda state: state.spin.angle)
WITHIN_REVOLUTION = Regressor(
    "theta mod 2 pi", "the angle within a revolution", "rad", lambda state: np.mod(state.spin.angle, 2.0 * np.pi)
)
TIME = Regressor("t", "time", "s", lambda state: state.t)
NOTHING = Regressor("1", "nothing", "", lambda state: np.ones_like(state.t))


def _rate_squared(state: RigState) -> _Floats:
    return np.asarray(state.spin.rate**2)


def _force_along_x(state: RigState) -> _Floats:
    """Return the force of an unbalance along x of the room, over its mass and arm, (n,), rad²/s²."""
    angle = state.spin.angle
    return np.asarray(_rate_squared(state) * np.cos(angle) + state.spin.acceleration * np.sin(angle))


def _force_along_y(state: RigState) -> _Floats:
    """Return the same along y."""
    angle = state.spin.angle
    return np.asarray(_rate_squared(state) * np.sin(angle) - state.spin.acceleration * np.cos(angle))


RATE_SQUARED = Regressor("omega^2", "the rate squared", "rad²/s²", _rate_squared)
FORCES = (
    Regressor("unbalance x", "an unbalance", "rad²/s²", _force_along_x),
    Regressor("unbalance y", "an unbalance", "rad²/s²", _force_along_y),
)


def _temperature(state: RigState) -> _Floats:
    if state.temperature is None:
        raise ValueError("the recording has no temperature")
    return state.temperature


TEMPERATURE = Regressor("T", "the temperature", "°C", _temperature)


def _warming(state: RigState) -> _Floats:
    """Return how fast the temperature changes over two seconds, K/s."""
    smooth = uniform_filter1d(_temperature(state), max(int(2.0 / state.period), 3))
    return np.asarray(np.gradient(smooth, state.period))


WARMING = Regressor("dT/dt", "the rate of change of the temperature", "K/s", _warming)


REGRESSORS = {
    one.name: one for one in (RATE, ACCELERATION, ANGLE, TIME, NOTHING, RATE_SQUARED, *FORCES, TEMPERATURE, WARMING)
}
"""By name."""
