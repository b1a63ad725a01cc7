"""Names of the parameters of a calibration, and what kind each is of."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from gfimu.calibration.error_model import free_elements

__all__ = ["KINDS", "cubic_names", "parameter_names", "quadratic_names"]

_AXES = "xyz"

KINDS: Mapping[str, Callable[[list[str]], bool]] = {
    "sensitivity": lambda parts: parts[1] == "M" and parts[2][0] == parts[2][1],
    "cross-axis sensitivity": lambda parts: parts[1] == "M" and parts[2][0] != parts[2][1],
    "bias": lambda parts: parts[1] == "b",
    "position": lambda parts: parts[1] == "r",
    "quadratic coefficient": lambda parts: parts[1] == "q",
    "cubic coefficient": lambda parts: parts[1] == "c",
    "delay": lambda parts: parts[1] == "d",
}
"""Kinds of parameters by the parts of their names, each a panel of the picture."""


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
