"""Shipped model files as plain data: what `tests/sim/test_shipped_models.py` compares with its stored copy.

``python tests/shipped_models.py`` writes the copy anew. Do that only where a shipped file was meant to change.
"""

import dataclasses
import json
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from gfimu import AccelerometerArray
from gfimu.array import Part, PartLimits
from gfimu.base import list_models
from sim import DataSheet, SplineSpin
from sim.effects import Effect
from sim.scenarios import Scenario
from sim.twin import Twin

STORED = Path(__file__).with_suffix(".json")

LOADERS = {
    "arrays": (AccelerometerArray.load,),
    "parts": (Part.load, DataSheet.load),
    "twins": (Twin.load, lambda name: Scenario.load(f"models/twins/{name}.toml")),
    "scenarios": (Scenario.load,),
    "limits": (lambda name: PartLimits.of(AccelerometerArray.load(name), 100.0),),
}
FOLDER = {"limits": "arrays"}


def plain(value: Any) -> Any:
    """Return an object as lists, numbers and texts; numbers keep every digit."""
    if dataclasses.is_dataclass(value):
        return {"": type(value).__name__} | {
            field.name: plain(getattr(value, field.name)) for field in dataclasses.fields(value)
        }
    if isinstance(value, msgspec.Struct):
        return {"": type(value).__name__} | {name: plain(getattr(value, name)) for name in value.__struct_fields__}
    if isinstance(value, Effect):
        return {"": type(value).__name__, "parameters": plain(value.parameters)}
    if isinstance(value, SplineSpin):
        state = value.at(np.linspace(-1.0, 61.0, 101))
        return {"": "SplineSpin", **{name: plain(getattr(state, name)) for name in ("angle", "rate", "acceleration")}}
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, dict):
        return {str(key): plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [plain(one) for one in value]
    if isinstance(value, np.generic):
        return value.item()
    assert value is None or isinstance(value, str | bool | int | float), value
    return value


def loaded(kind: str, name: str) -> list[Any]:
    """Return all that is read from one shipped file."""
    return [plain(load(name)) for load in LOADERS[kind]]


if __name__ == "__main__":
    found = {kind: {name: loaded(kind, name) for name in list_models(FOLDER.get(kind, kind))} for kind in LOADERS}
    STORED.write_text(json.dumps(found, separators=(",", ":")), encoding="utf-8")
