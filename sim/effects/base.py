"""What an effect is: a field name, SI parameters with physical priors, and one method that changes the world."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError
from gfimu.model.own_rig.places import Pattern, Size, channel_patterns, chip_patterns
from sim.world import World

__all__ = ["LARGEST_TURN", "Effect", "Pattern", "Size", "channel_patterns", "chip_patterns"]

LARGEST_TURN = np.pi / 9
"""Bound of a turn, rad: 20°. Soldering and mounting leave a degree or two; what is turned further is another unit."""


class Effect(ABC):
    """One thing that is so in the world and missing in the simulation.

    The docstring of each effect holds the words of its page in the catalogue (`sim.effects.description`).

    Parameters
    ----------
    parameters : mapping
        Values by contract key (units at the end of each key); what is left out is zero.
    """

    name: ClassVar[str]
    """Name in the contract."""
    summary: ClassVar[str]
    """What is wrong, in one line."""
    place: ClassVar[str]
    """Where it changes the chain: geometry, motion, timing, sensing, reference, noise or data."""
    separated_by: ClassVar[str] = "a run at two or more speeds in both directions"
    """Excitation that separates it from its usual rivals."""
    per_run: ClassVar[bool] = False
    """True where another mounting or another day has its own value."""
    inexactness: ClassVar[float] = 0.0
    """Share of what it explains that its model may get wrong; beside it a further cause must explain more than that."""
    other_units: ClassVar[Mapping[str, str]] = {}
    """Unit of each parameter that is no size, by key; `gfimu.model.parameter_units.RATIO`, ``NUMBER`` or ``NAME``."""
    starts: ClassVar[tuple[float, ...]] = ()
    """Values in units of the prior to start from where a large size is far from linear; none by default."""
    whole: ClassVar[frozenset[str]] = frozenset()
    """Shape parameters that are whole numbers, chosen from a grid and not refined."""
    shape_limits: ClassVar[Mapping[str, tuple[float, float]]] = {}
    """Least and largest value of shape parameters."""
    needs_temperature: ClassVar[bool] = False
    """True where it shows only in recordings with a temperature."""
    tolerance: ClassVar[float] = 0.0
    """Standard deviation of each size that a good calibration leaves, in the unit of the sizes."""
    level_error: ClassVar[float] = 0.0
    """Standard deviation to which a level of a reading is found at best, in units of the reading's white noise."""
    of_one_recording: ClassVar[bool] = False
    """True where it goes with absolute time, of which no other recording needs to share phase or start."""
    of_wiring: ClassVar[bool] = False
    """True for a fault of the samples that changes a prediction without noise: it carries readings elsewhere or scales
    them."""
    alike_by_lot: ClassVar[bool] = False
    """True where chips of one lot have nearly the same: equal sizes are no coincidence."""
    of_pose: ClassVar[bool] = False
    """True where it depends on the specific force alone: while a body rests it is constant, as slow noise nearly is."""
    contained_in: ClassVar[frozenset[str]] = frozenset()
    """Effects that can do all that it does: beside one of them it has no size of its own."""

    drive_sources: ClassVar[frozenset[str]] = frozenset({"tacho", "angle", "command"})
    """Drives of the twins that look for it, of an effect that another package adds (``gyro``: a free body,
    ``carriage`` and so on: a linear axis)."""
    rarity: ClassVar[float] = 1.0
    """How many times rarer it is than a usual effect, before any data."""

    def __init__(self, parameters: Mapping[str, Any]) -> None:
        self.parameters: dict[str, Any] = dict(parameters)

    @property
    def memory_s(self) -> float:
        """How long a reading depends on the drive before it, s, where that is longer than a probe can measure."""
        return 0.0

    @classmethod
    @abstractmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """Return the linear coordinates for an array."""

    @classmethod
    def patterns(cls, array: AccelerometerArray) -> tuple[Pattern, ...]:
        """Return the places and structures it can take, the freest first."""
        return (Pattern("", np.eye(len(cls.sizes(array)))),)

    @classmethod
    def reach(cls, array: AccelerometerArray) -> NDArray[np.bool_] | None:
        """Return which channels each size changes, shape (m, c), or None where all may change.

        Sizes that reach different channels share one finite difference.
        """
        return None

    @classmethod
    def shapes(cls, duration: float, sample_rate: float) -> tuple[dict[str, float], ...]:
        """Return the grid of shape parameters (frequency, order, time constant) to screen over."""
        return ({},)

    @classmethod
    def from_sizes(
        cls, array: AccelerometerArray, values: Sequence[float] | NDArray[np.float64], shape: Mapping[str, float]
    ) -> Effect:
        """Build the effect from its linear coordinates and shape parameters."""
        keys = [size.key for size in cls.sizes(array)]
        return cls({**{key: float(value) for key, value in zip(keys, values, strict=True)}, **shape})

    def size_values(self, array: AccelerometerArray) -> NDArray[np.float64]:
        """Return the linear coordinates of this effect, the inverse of `from_sizes`."""
        return np.array([float(self.parameters.get(size.key, 0.0)) for size in self.sizes(array)])

    def shape_values(self) -> dict[str, float]:
        """Return the shape parameters of this effect."""
        keys = self.shapes(60.0, 100.0)[0].keys()
        return {key: float(self.parameters[key]) for key in keys if key in self.parameters}

    @abstractmethod
    def apply(self, world: World) -> World:
        """Return the world with this effect in it."""

    def value(self, key: str, default: float = 0.0) -> float:
        """Return one parameter as a number; raises `InputError` naming effect and key."""
        try:
            return float(self.parameters.get(key, default))
        except (TypeError, ValueError):
            raise InputError(f"effect {self.name!r}: parameter {key} is not a number") from None

    def vector(self, keys: Sequence[str]) -> NDArray[np.float64]:
        """Return several parameters as an array; missing ones are zero."""
        return np.array([self.value(key) for key in keys])

    @classmethod
    def parameter_units(cls, array: AccelerometerArray) -> dict[str, str]:
        """Return the unit of each parameter by key: of the sizes, then of the others."""
        return {**{size.key: size.unit for size in cls.sizes(array)}, **cls.other_units}

    @classmethod
    def parameter_keys(cls, array: AccelerometerArray) -> tuple[str, ...]:
        """Return the keys a parameter table may have."""
        return tuple(cls.parameter_units(array))

    def check(self, array: AccelerometerArray) -> None:
        """Raise `InputError` if a parameter key does not belong to this effect."""
        valid = self.parameter_keys(array)
        for key in self.parameters:
            if key not in valid:
                raise InputError(f"effect {self.name!r}: unknown parameter {key!r}; valid: {', '.join(valid)}")
