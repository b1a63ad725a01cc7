"""Names of the parameters of a calibration, and what kind each is of."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping

from gfimu.base.errors import InputError
from gfimu.calibration.error_model import free_elements

__all__ = ["KINDS", "cubic_names", "kind_of", "parameter_names", "quadratic_names"]

_AXES = "xyz"

_NAME = re.compile("(?s:.+)_(?:(M)_[xyz]{2}|([brqc])_[xyz]|(d))")

KINDS: Mapping[str, Callable[[str], bool]] = {
    "sensitivity": lambda name: kind_of(name) == "M" and name[-2] == name[-1],
    "cross-axis sensitivity": lambda name: kind_of(name) == "M" and name[-2] != name[-1],
    "bias": lambda name: kind_of(name) == "b",
    "position": lambda name: kind_of(name) == "r",
    "quadratic coefficient": lambda name: kind_of(name) == "q",
    "cubic coefficient": lambda name: kind_of(name) == "c",
    "delay": lambda name: kind_of(name) == "d",
}
"""Kinds of parameters by their names, each a panel of the picture."""


def kind_of(name: str) -> str:
    """Return the letter of a parameter's kind: M, b, r, q, c or d.

    Raises
    ------
    InputError
        If it is no name of a parameter.
    """
    found = _NAME.fullmatch(name)
    if found is None:
        raise InputError(f"{name!r:.60} is no parameter of a calibration; its names are such as a1_M_xy and a1_b_x")
    return str(found[found.lastindex or 0])


def parameter_names(chip: str, gauge: str) -> tuple[str, ...]:
    """Names of a triad's parameters, in the order of `ErrorModel.parameters`: ``a1_M_xx`` … ``a1_b_z``."""
    elements = [f"{chip}_M_{_AXES[i]}{_AXES[j]}" for i, j in free_elements(gauge)]
    return (*elements, *(f"{chip}_b_{axis}" for axis in _AXES))


def quadratic_names(chips: tuple[str, ...]) -> tuple[str, ...]:
    """Names of the quadratic coefficients of chips: ``a1_q_x`` …, three per chip."""
    return tuple(f"{chip}_q_{axis}" for chip in chips for axis in _AXES)


def cubic_names(chips: tuple[str, ...]) -> tuple[str, ...]:
    """Names of the cubic coefficients of chips: ``a1_c_x`` …, three per chip."""
    return tuple(f"{chip}_c_{axis}" for chip in chips for axis in _AXES)
