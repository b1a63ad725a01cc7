"""A described error: a function with its coefficients at a place of the forward model, as twin files hold it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError
from gfimu.model.located.dependences.by_name import dependence_of
from gfimu.model.located.dependences.dependence import Dependence
from gfimu.model.located.operators import Place, body_places, channel_place, rig_places
from gfimu.model.located.rig_state import AddedEffect, RigState

__all__ = ["OF_REFERENCE", "UNLISTED", "LocatedEffect"]

_Floats = NDArray[np.float64]
UNLISTED = "unlisted"
"""The word of the contract for an effect without a name."""
OF_REFERENCE = ("reads", "late", "turns", "twists")
"""What an error is that changes the reference."""


class LocatedEffect(AddedEffect):
    """A function of a dependence at a place, with its coefficients.

    Parameters
    ----------
    where : Place
        The place.
    dependence : Dependence
        What the function is of.
    pattern : str
        Which series share it: ``one`` channel, those of one ``chip``, each its ``own``, or ``all``.
    coefficients : ndarray, shape (P,)
        Of the functions, component by component, in the unit of the place.
    """

    name = UNLISTED
    acts_back = False

    def __init__(self, where: Place, dependence: Dependence, pattern: str, coefficients: _Floats) -> None:
        self.where, self.dependence, self.pattern, self.coefficients = where, dependence, pattern, coefficients
        self.place = "reference" if where.what in OF_REFERENCE else "located"

    @classmethod
    def of_parameters(cls, parameters: Mapping[str, Any], array: AccelerometerArray) -> LocatedEffect:
        """Return the effect from its `parameters`, as a twin file holds them.

        Raises
        ------
        InputError
            If a place, a dependence or a series is unknown, or a number is missing or none.
        """
        try:
            what, series = str(parameters["what"]), [str(one) for one in parameters.get("series", ())]
            where = _place(what, str(parameters["place"]), series, array, is_angle=bool(parameters.get("of_angle")))
            dependence = dependence_of(str(parameters["dependence"]), dict(parameters["numbers"]))
            coefficients = np.array(parameters["coefficients"], dtype=float)
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(
                f"effect {UNLISTED!r}: {error} is missing, unknown or no number; take the table as it was written"
            ) from None
        expected = (len(where.components), dependence.count)
        if coefficients.shape != expected or not np.isfinite(coefficients).all():
            raise InputError(
                f"effect {UNLISTED!r}: coefficients have shape {coefficients.shape}; give {expected[0]} × "
                f"{expected[1]} numbers, a row for each of the series"
            )
        return cls(where, dependence, str(parameters.get("pattern", "all")), coefficients.ravel())

    @property
    def parameters(self) -> dict[str, Any]:
        """Place, dependence and coefficients, as a twin file holds them."""
        series = {"series": list(self.where.components)} if any(self.where.components) else {}
        return {
            "place": self.where.name,
            "what": self.where.what,
            "pattern": self.pattern,
            **series,
            "dependence": self.dependence.name,
            **({"of_angle": True} if self.where.of_angle else {}),
            "numbers": self.dependence.numbers,
            "coefficients": self.coefficients.reshape(len(self.where.components), -1).tolist(),
        }

    @property
    def memory_s(self) -> float:
        """How long it remembers the drive, s."""
        return self.dependence.memory_s

    def size_values(self, array: AccelerometerArray) -> _Floats:
        """Return the coefficients."""
        del array
        return self.coefficients

    def functions(self, state: RigState) -> _Floats:
        """Return the error of each component at the samples, (m, n), or (m, c + 1, n) where each has its own."""
        basis, parts = self.dependence.values(state), len(self.where.components)
        return np.stack([basis @ part for part in np.split(self.coefficients, parts)])

    def added(self, state: RigState) -> _Floats:
        """Return what it adds to channels and reference, shape (n, c + 1)."""
        total = np.zeros((len(state.t), state.readings.shape[1] + 1))
        for operator, function in zip(self.where.operators(state), self.functions(state), strict=True):
            total += operator.added(np.atleast_2d(function).T, state.period)  # of (n, 1) or (n, c + 1)
        return total


def _place(what: str, name: str, series: Sequence[str], array: AccelerometerArray, *, is_angle: bool) -> Place:
    """Return a place by what the error there is; of channels with the series that it is of."""
    places = rig_places(is_angle=is_angle) | body_places()
    if what in places and places[what].name == name:  # the gain of all channels is of the supply
        return places[what]
    members: dict[str, tuple[int, ...]] = {channel: (index,) for index, channel in enumerate(array.channels)}
    for index, chip in enumerate(array.chips):
        members[chip.name] = tuple(np.flatnonzero(array.chip_of_channel == index).tolist())
    return channel_place(name, what, tuple(members[one] for one in series), series)
