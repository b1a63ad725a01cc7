"""Effects as factors of a campaign: ``EFFECT.KEY`` is a parameter, ``EFFECT.std_UNIT`` draws all sizes of an effect."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from gfimu.base.errors import InputError
from gfimu.model.parameter_units import KEY_ENDINGS
from sim.effects import EFFECTS, Effect, make_effect

if TYPE_CHECKING:
    from gfimu.array.array import AccelerometerArray
    from sim.trials.sweep.plan import Value

__all__ = ["FORMS", "drawn_effects", "names_effect"]

FORMS = ("EFFECT.KEY", "EFFECT.std_UNIT")
"""Names of such factors, for messages."""

_STD = "std"


def names_effect(factor: str) -> bool:
    """Return whether a factor is a parameter of an effect, or the spread of its sizes."""
    effect, dot, _ = factor.partition(".")
    return bool(dot) and effect in EFFECTS


def drawn_effects(
    values: Mapping[str, Value], array: AccelerometerArray, rng: np.random.Generator
) -> tuple[Effect, ...]:
    """Return the effects that factors name, in the order of the factors.

    Parameters
    ----------
    values : mapping of str to value
        Factors of a case; those that name no effect are passed over.
    array : AccelerometerArray
        The array, whose channels and chips some effects have a size for.
    rng : numpy.random.Generator
        Source of the sizes that are drawn.

    Raises
    ------
    InputError
        If a parameter is unknown, or the sizes of an effect have another unit.
    """
    given: dict[str, dict[str, Value]] = {}
    for name, value in values.items():
        if names_effect(name):
            effect, _, key = name.partition(".")
            given.setdefault(effect, {})[key] = value
    return tuple(
        make_effect(effect, _drawn(effect, parameters, array, rng), array) for effect, parameters in given.items()
    )


def _drawn(
    effect: str, parameters: Mapping[str, Value], array: AccelerometerArray, rng: np.random.Generator
) -> dict[str, Value]:
    """Return the parameters of an effect, its sizes drawn where their standard deviation is given."""
    found = {key: value for key, value in parameters.items() if not key.startswith(_STD)}
    sizes = EFFECTS[effect].sizes(array)
    for key, value in parameters.items():
        if key.startswith(_STD):
            valid = {f"{_STD}_{KEY_ENDINGS.get(size.unit, size.unit)}" for size in sizes}
            if valid != {key}:
                raise InputError(
                    f"{effect}.{key}: sizes of {effect} are drawn by {' or '.join(sorted(valid)) or 'none'}"
                )
            if isinstance(value, str | bool):
                raise InputError(f"{effect}.{key} = {value!r} is no number")
            draws = float(value) * rng.standard_normal(len(sizes))
            found |= {size.key: float(one) for size, one in zip(sizes, draws, strict=True)}
    return found
