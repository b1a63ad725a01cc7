"""The ``[[effect]]`` tables of twin and scenario files."""

from __future__ import annotations

from typing import Annotated, Any

import msgspec

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError
from gfimu.base.files.schema import Table, about
from sim.effects import Effect, make_effect

__all__ = ["EffectTable"]


class EffectTable(Table, frozen=True):
    """An effect that the rig has (scenario), or that extends the simulation (twin)."""

    name: Annotated[str, about("Name of the effect (gfimu list effects).", example="table_tilt")]
    parameters: Annotated[
        dict[str, Any],
        about("Its parameters by key, the unit at the end of each key (see the catalogue of effects)."),
    ] = msgspec.field(default_factory=dict)

    def effect(self, array: AccelerometerArray, where: str) -> Effect:
        """Return the effect; raises `InputError` for an unknown name or parameter of this array."""
        try:
            return make_effect(self.name, self.parameters, array)
        except InputError as error:
            raise InputError(f"{where}: {error}") from None
