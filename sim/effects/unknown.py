"""What nothing in the library explains, as data: one function of the motion, the angle or time, sized per channel."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.model.generic_basis import OF_READING, UNIT_KEYS, BasisUnits, Motion, basis_function, is_of_time
from gfimu.model.parameter_units import NAME
from gfimu.model.world_model import SpinState
from sim.effects.base import Effect, Size
from sim.world import SampleContext, World

__all__ = ["Unknown"]

_REFERENCE = Size("reference_rad_s", "rad/s", 0.1)
_USUAL = 0.1  # m/s²


class Unknown(Effect):
    """A dependence without a name: the function ``dependence`` times a coefficient per channel and of the reference.

    It describes an error that no effect of the library explains. h is a function of rate, acceleration, angle or time.

    Notes
    -----
    :formula: y = f + c·h
    :symbols: c = {channel}_m_s2
    :size: 0.1 m/s² per channel and 0.1 rad/s of the reference where the function is 1, by choice.
    :example: dependence = 'rate', rate_unit_rad_s = 10.0, a11_m_s2 = 0.1, a22_m_s2 = -0.05
    :experiment: Record another run with another motion. What stays the same function of the motion is in the rig or the
        sensors; what does not is an event.
    :rivals: A diagnosis describes what has no name by ``unlisted``.
    """

    name = "unknown"
    summary = "a dependence that the data show and nothing in the library explains"
    place = "sensing"
    separated_by = "another run with another motion: what stays is in the rig or the sensors"
    other_units: ClassVar = {"dependence": NAME, **UNIT_KEYS}

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """One coefficient per channel, and one of the reference."""
        return (*(Size(f"{channel}_m_s2", "m/s²", _USUAL) for channel in array.channels), _REFERENCE)

    @property
    def units(self) -> BasisUnits:
        """What rate, acceleration and time are divided by."""
        return BasisUnits(*(self.value(key, 1.0) for key in UNIT_KEYS))

    def check(self, array: AccelerometerArray) -> None:
        """Raise `InputError` for a wrong key, a function that isn't there or a unit that is not positive."""
        super().check(array)
        self._function()
        for key in UNIT_KEYS:
            value = self.value(key, 1.0)
            if not (math.isfinite(value) and value > 0):
                raise InputError(f"effect {self.name!r}: {key} must be a positive number, not {value!r}")
        name = str(self.parameters["dependence"])
        if self.value(_REFERENCE.key) and (name == OF_READING or is_of_time(name)):
            raise InputError(f"effect {self.name!r}: {_REFERENCE.key} needs a function of the motion or the angle")

    def _function(self) -> Any:
        name = str(self.parameters.get("dependence", ""))
        if name == OF_READING:
            return None
        try:
            return basis_function(name)
        except InputError as error:
            raise InputError(f"effect {self.name!r}: {error}") from None

    def apply(self, world: World) -> World:
        """Add coefficient · function to the readings and to the reference."""
        keys = [f"{channel}_m_s2" for channel in world.array.channels]
        sizes, of_reference = self.vector(keys), self.value(_REFERENCE.key)
        function, units = self._function(), self.units

        def sense(readings: NDArray[np.float64], context: SampleContext) -> NDArray[np.float64]:
            if function is None:
                return readings + sizes * (readings / STANDARD_GRAVITY) ** 3
            values = function(Motion.of(context.spin, world.since_start(context.t), units))
            return readings + np.outer(values, sizes)

        def refer(reading: NDArray[np.float64], spin: SpinState, t: NDArray[np.float64]) -> NDArray[np.float64]:
            return reading + of_reference * function(Motion.of(spin, np.zeros(len(reading)), units))

        if sizes.any():
            world = world.changed(sensing_steps=(*world.sensing_steps, sense))
        if of_reference:
            world = world.changed(reference_steps=(*world.reference_steps, refer))
        return world
