"""The catalogue of effects: every effect that a scenario may have, where it acts, and what was computed of it.

The numbers are made by ``docs/scripts/make_effect_catalogue.py`` and stored with the models.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from typing import Any

from gfimu.files.model_files import models_directory
from sim.effects.base import Effect
from sim.effects.registry import (
    BODY_EFFECTS,
    CARRIAGE_EFFECTS,
    INCLINED_EFFECTS,
    SIMULATED_EFFECTS,
    TABLE_EFFECTS,
)
from sim.effects.unknown import Unknown

__all__ = ["PLACES", "STORE", "every_effect", "place_of", "stored_numbers"]

STORE = "effects/catalogue.json"
"""File of the stored numbers, below the folder of the models."""

PLACES = {
    "geometry": "where chips, axes and the table are",
    "motion": "how the table and the array move",
    "gravity": "what gravity adds along each axis",
    "sensing": "from the specific force to the analogue reading, in each chip",
    "sampling": "when chips and the reference are read, and what the reference reads",
    "data": "noise, and the samples in the file",
}
"""Places in the chain, in its order, and what is there."""

_OF_GRAVITY = frozenset({"gravity", "table_tilt"})
_PLACE = {"timing": "sampling", "reference": "sampling", "noise": "data"}
_MOVING = frozenset({"bearing_shake", "bench_sway", "centrifugal_flex"})


def every_effect() -> dict[str, type[Effect]]:
    """Return every effect of gfimu by name; of a name that a linear axis has too, that of the table."""
    known = CARRIAGE_EFFECTS | BODY_EFFECTS | TABLE_EFFECTS | INCLINED_EFFECTS | SIMULATED_EFFECTS
    known = {**known, Unknown.name: Unknown}
    first = [*TABLE_EFFECTS, *known]
    return {name: known[name] for name in dict.fromkeys(first)}


def place_of(effect: type[Effect]) -> str:
    """Return where an effect acts: a key of `PLACES`."""
    if effect.name in _OF_GRAVITY:
        return "gravity"
    moves = effect.name in _MOVING or effect.name.startswith("lean_")
    return "motion" if moves else _PLACE.get(effect.place, effect.place)


@cache
def stored_numbers() -> Mapping[str, Any]:
    """Return what was computed of each effect, by name; empty where nothing is stored."""
    file = models_directory() / STORE
    return json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
