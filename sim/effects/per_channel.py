"""What effects inside the sensing chain share: one size per channel, and a step of the chain."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.model.parameter_units import RATIO
from sim.effects.base import Effect, Pattern, Size, channel_patterns
from sim.world import SensingStep, World

__all__ = ["PerChannel", "with_step"]


def with_step(world: World, step: SensingStep) -> World:
    """Return a world whose sensing chain has one more step."""
    return world.changed(sensing_steps=(*world.sensing_steps, step))


class PerChannel(Effect):
    """One size per channel, keyed ``channel + suffix``."""

    place = "sensing"
    suffix = ""
    unit = RATIO
    prior_std = 1.0
    bound = np.inf

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """Return one size per channel."""
        return tuple(
            Size(f"{channel}{cls.suffix}", cls.unit, cls.prior_std, bound=cls.bound) for channel in array.channels
        )

    @classmethod
    def patterns(cls, array: AccelerometerArray) -> tuple[Pattern, ...]:
        """Return all channels free, chips, sensing axes, and single channels."""
        return channel_patterns(array)

    @classmethod
    def reach(cls, array: AccelerometerArray) -> NDArray[np.bool_]:
        """Return that each size changes its own channel."""
        return np.eye(array.n_channels, dtype=bool)

    def per_channel(self, array: AccelerometerArray) -> NDArray[np.float64]:
        """Return the size of each channel, (c,)."""
        return self.vector([f"{channel}{self.suffix}" for channel in array.channels])
