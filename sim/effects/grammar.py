"""A grammar behind the list of effects: a place in the chain times a dependence, for what has no name of its own.

A point of the grammar enters the forward model at its physical place, so that all it does downstream is computed: a
reference that reads wrong changes no channel; an array that leans moves its chips and turns their axes; a supply that
sags lowers the gain of every chip. Each is a small class: a place (its base) and a function of the motion.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from gfimu.model.world_model import SpinState
from sim.effects.base import Effect

__all__ = [
    "ACCELERATION",
    "CONSTANT",
    "KELVIN",
    "LOAD",
    "RATE",
    "RATE_CUBED",
    "RATE_SQUARED",
    "SIGNED_SQUARE",
    "SPEED",
    "TURNS",
    "USUAL_RATE",
    "Dependence",
    "Unlisted",
]

USUAL_RATE, _ACCELERATION, _ANGLE, KELVIN = 10.0, 20.0, 20.0, 3.0  # rad/s, rad/s², rad and K of an ordinary run
_READ = {"rad": "rad", "rad_s": "rad/s", "rad2_s2": "rad²/s²", "rad3_s3": "rad³/s³", "rad_s2": "rad/s²"}
"""Units of keys as people read them."""


@dataclass(frozen=True)
class Dependence:
    """A function of the table's motion.

    Parameters
    ----------
    name : str
        As in ``verdict.json``, such as ``"omega^3"``.
    words : str
        For people, such as ``"rate³"``.
    unit : str
        Its unit in keys, such as ``"rad3_s3"``; empty for a constant.
    usual : float
        Its value in an ordinary run, in that unit.
    function : callable, optional
        The function of the spin, shape (n,); None where it is one of something else.
    """

    name: str
    words: str
    unit: str
    usual: float
    function: Callable[[SpinState], NDArray[np.float64]] | None = None

    def of(self, spin: SpinState) -> NDArray[np.float64]:
        """Return the function of a spin, (n,); zeros where it is one of something else."""
        return np.zeros_like(spin.rate) if self.function is None else self.function(spin)

    def key(self, quantity: str) -> str:
        """Return the key of a coefficient: what is changed, per unit of the function."""
        return f"{quantity}_per_{self.unit}" if self.unit else quantity

    def per(self, unit: str) -> str:
        """Return the unit of a coefficient as people read it."""
        return f"{unit}/({_READ[self.unit]})" if self.unit else unit


CONSTANT = Dependence("1", "a constant", "", 1.0, lambda spin: np.ones_like(spin.rate))
SPEED = Dependence("|omega|", "|rate|", "rad_s", USUAL_RATE, lambda spin: np.abs(spin.rate))
RATE = Dependence("omega", "rate", "rad_s", USUAL_RATE, lambda spin: spin.rate)
RATE_SQUARED = Dependence("omega^2", "rate²", "rad2_s2", USUAL_RATE**2, lambda spin: spin.rate**2)
SIGNED_SQUARE = Dependence(
    "omega|omega|", "rate · |rate|", "rad2_s2", USUAL_RATE**2, lambda spin: spin.rate * abs(spin.rate)
)
RATE_CUBED = Dependence("omega^3", "rate³", "rad3_s3", USUAL_RATE**3, lambda spin: spin.rate**3)
ACCELERATION = Dependence("alpha", "angular acceleration", "rad_s2", _ACCELERATION, lambda spin: spin.acceleration)
LOAD = Dependence("|alpha|", "|angular acceleration|", "rad_s2", _ACCELERATION, lambda spin: np.abs(spin.acceleration))
TURNS = Dependence("theta", "the angle turned", "rad", _ANGLE, lambda spin: spin.angle)


class Unlisted(Effect):
    """A point of the grammar: what it changes is its base's, what it goes with is its dependence."""

    grammar_place: ClassVar[str]
    """Place in the grammar: reference, array on the table, supply, channel."""
    dependence: ClassVar[Dependence]
    separated_by = "runs at several speeds and accelerations, in both directions"
    rarity = 30.0  # by choice: all points together are as probable as one usual effect
