"""Effects with exact equations that no library has, for worlds in which a name would be wrong."""

from __future__ import annotations

import numpy as np

from sim.effects.base import Effect
from sim.world import Lean


class _Nameless(Effect):
    """An effect with one number and a function of the spin."""

    def __init__(self, size, function):
        super().__init__({"size": size})
        self.size, self.function = size, function

    @classmethod
    def sizes(cls, array):
        """No linear coordinates: nothing fits it."""
        return ()


class Leaning(_Nameless):
    """The array leans about its foot by a rotation vector (3,) times a function of the spin."""

    name, place = "leaning", "geometry"

    def apply(self, world):
        """Let it lean."""
        return world.changed(leans=(*world.leans, Lean(np.array(self.size), self.function)))


class Sagging(_Nameless):
    """The gain of all channels grows by a size times a function of the spin."""

    name, place = "sagging", "sensing"

    def apply(self, world):
        """Multiply the readings."""

        def sense(readings, context):
            return readings * (1.0 + self.size * self.function(context.spin))[:, None]

        return world.changed(sensing_steps=(*world.sensing_steps, sense))


class Bent(_Nameless):
    """The reference reads a size times a function of the spin more."""

    name, place = "bent", "reference"

    def apply(self, world):
        """Bend the reading."""

        def refer(reading, spin, t):
            return reading + self.size * self.function(spin)

        return world.changed(reference_steps=(*world.reference_steps, refer))
