"""An error without a name, as a diagnosis describes it: a function at a place, added to channels and reference."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.model.located.effect import OF_REFERENCE, UNLISTED, LocatedEffect
from gfimu.model.located.rig_state import RigState
from gfimu.model.parameter_units import NAME, NUMBER
from gfimu.model.world_model import PlacedArray
from sim import forward
from sim.effects.base import Effect, Size
from sim.world import SampleContext, World

__all__ = ["Unlisted"]


class Unlisted(Effect):
    """An error that no effect of the library is: an unknown function at a place of the rig.

    A diagnosis describes by it what has no name, and writes it into ``twin.toml``. It is added to channels and
    reference as the first order of a small error at its place.

    Notes
    -----
    :formula: y = f + A·φ + B·dφ/dt + C·d²φ/dt², φ = Σ coefficients·functions
    :symbols: A, B and C are those of the place (`gfimu.model.located.operators`); the functions are of what
        ``dependence`` names.
    :size: as usual errors at each place, by choice.
    :experiment: Record another run with another motion: the function stays the same where its place is right.
    :rivals: A diagnosis compares it with every effect that has a name; these have the larger prior.
    """

    name = UNLISTED
    summary = "a function at a place of the rig that no effect of the library is"
    place = "sensing"
    separated_by = "another run with another motion"
    other_units: ClassVar = {
        **dict.fromkeys(("place", "what", "pattern", "series", "dependence", "text"), NAME),
        **dict.fromkeys(("of_angle", "numbers", "coefficients", "function"), NUMBER),
    }

    def __init__(self, parameters: Mapping[str, Any]) -> None:
        super().__init__(parameters)
        if parameters.get("what") in OF_REFERENCE:
            self.place = "reference"  # type: ignore[misc]

    @classmethod
    def sizes(cls, array: AccelerometerArray) -> tuple[Size, ...]:
        """Return none: it is no hypothesis of the library."""
        del array
        return ()

    def check(self, array: AccelerometerArray) -> None:
        """Raise `InputError` for a key, a place, a dependence or coefficients that there are not."""
        super().check(array)
        LocatedEffect.of_parameters(self.parameters, array)

    def apply(self, world: World) -> World:
        """Add what the error changes to the readings and to the reference."""
        at_place = _AtPlace(LocatedEffect.of_parameters(self.parameters, world.array), world)
        return world.changed(
            sensing_steps=(*world.sensing_steps, at_place.sense),
            reference_errors=(*world.reference_errors, at_place.refer),
        )


class _AtPlace:
    """The error in a world."""

    def __init__(self, effect: LocatedEffect, world: World) -> None:
        self._effect, self._world = effect, world

    @cached_property
    def _placed(self) -> PlacedArray:
        geometry = forward.table_geometry(self._world)
        return PlacedArray(geometry.axes, geometry.places, self._world.gravity * geometry.up)

    def sense(self, readings: NDArray[np.float64], context: SampleContext) -> NDArray[np.float64]:
        """Return readings (n, c) with the error of the channels."""
        added = self._added(readings, context)
        return np.asarray(readings + added[:, :-1])

    def refer(self, reading: NDArray[np.float64], context: SampleContext) -> NDArray[np.float64]:
        """Return the reference (n,) with its error."""
        empty = np.zeros((len(reading), self._world.array.n_channels))
        return np.asarray(reading + self._added(empty, context)[:, -1])

    def _added(self, readings: NDArray[np.float64], context: SampleContext) -> NDArray[np.float64]:
        t, warm = self._world.since_start(context.t), context.temperature
        if context.body is not None:
            return self._effect.added(RigState.of_body(self._world.array, context.body, t, readings, warm))
        period = float(np.median(np.diff(t))) if len(t) > 1 else 1.0
        return self._effect.added(RigState(t, context.spin, readings, warm, period, self._placed))
