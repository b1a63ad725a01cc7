"""`dependence_of`: a dependence from its name and numbers, as a twin file holds them."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from typing import Any

from gfimu.model.located.dependences.curves import Curve, OfReading, Product
from gfimu.model.located.dependences.dependence import Dependence
from gfimu.model.located.dependences.forms import FORMS, VECTORS, Form, Step, VectorForm
from gfimu.model.located.dependences.memories import LowPassed, Memory, Mode
from gfimu.model.located.dependences.regressors import REGRESSORS, Regressor
from gfimu.model.located.dependences.waves import ENVELOPES, Revolution, Wave

__all__ = ["dependence_of"]


_FEWEST, _MOST = 4, 320  # numerical: functions of a dependence that a file may have
_MADE: tuple[tuple[str, Callable[[re.Match[str], Mapping[str, Any]], Dependence]], ...] = (
    (r"f\((\w+), (\w+)\)", lambda m, n: Product(_curve(m[1], n["first"]), _curve(m[2], n["second"]))),
    (r"f\(y\)|y\^([23])", lambda m, n: OfReading(_positive(n, "most"), int(m[1] or 0))),
    (r"f\((\w+)\)", lambda m, n: _curve(m[1], n)),
    (
        r"revolution.*",
        lambda m, n: Revolution(
            _one_of(m[0], ENVELOPES), _positive(n, "scale"), _count(n["harmonics"]), mean=n.get("mean", False) is True
        ),
    ),
    (r"order .*", lambda m, n: Wave(_positive(n, "cycles"), 1.0, fastest=_finite(n, "fastest"))),
    (r"step at .*", lambda m, n: Step(_finite(n, "at"), 1.0)),
    (r"memory of (.*)", lambda m, n: Memory(_regressor(m[1]), _positive(n, "scale"))),
    (r"(\w+) lagging", lambda m, n: LowPassed(_regressor(m[1]), _finite(n, "first"), _positive(n, "scale"))),
    (r"mode at .* of (.*)", lambda m, n: _mode(_regressor(m[1]), n)),
    (r"\w+ (?:vector|products|cubes|change)", lambda m, n: VectorForm(_one_of(m[0], VECTORS), _positive(n, "scale"))),
    (r".*", lambda m, n: Form(_one_of(m[0], FORMS), _positive(n, "scale"), _finite(n, "first"))),
)
"""Patterns of names, and what makes the dependence from its name and its numbers."""


def dependence_of(name: str, numbers: Mapping[str, Any]) -> Dependence:
    """Return a dependence from its name and its `Dependence.numbers`.

    Raises
    ------
    KeyError, TypeError, ValueError
        If there is none of that name, or a number is missing or none.
    """
    for pattern, made in _MADE:
        if match := re.fullmatch(pattern, name):
            return made(match, numbers)
    raise KeyError(name)


def _one_of(name: str, known: Mapping[str, Any]) -> str:
    known[name]
    return name


def _regressor(name: str) -> Regressor:
    return REGRESSORS[name]


def _curve(name: str, numbers: Mapping[str, Any]) -> Curve:
    low, high, warp = (_finite(numbers, key) for key in ("low", "high", "warp"))
    return Curve(_regressor(name), low, high, _count(numbers["functions"]), warp=warp)


def _count(value: Any) -> int:
    count = int(value)
    if not _FEWEST <= count <= _MOST:
        raise ValueError(f"{count} functions, not {_FEWEST} to {_MOST},")
    return count


def _mode(regressor: Regressor, numbers: Mapping[str, Any]) -> Mode:
    scale, frequency, damping = (_positive(numbers, key) for key in ("scale", "frequency_hz", "damping"))
    outputs = tuple(int(one) for one in numbers["outputs"])
    if not outputs or not set(outputs) <= {0, 1, 2}:
        raise ValueError(f"outputs = {outputs}")
    return Mode(regressor, scale, frequency, outputs, damping)


def _finite(numbers: Mapping[str, Any], key: str) -> float:
    value = float(numbers[key])
    if not math.isfinite(value):
        raise ValueError(f"{key} = {value}")
    return value


def _positive(numbers: Mapping[str, Any], key: str) -> float:
    value = _finite(numbers, key)
    if not value > 0.0:
        raise ValueError(f"{key} = {value}")
    return value
