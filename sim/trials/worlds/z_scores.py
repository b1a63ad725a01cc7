"""Estimated sizes of an effect against the true ones, in standard deviations."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

__all__ = ["z_scores"]

_TURN = 2 * math.pi


def z_scores(
    estimated: Mapping[str, Any], std: Mapping[str, float | None], truth: Mapping[str, Any]
) -> dict[str, float]:
    """Return (estimate − truth)/std for every parameter with a standard deviation; angles are compared on the circle.

    Parameters
    ----------
    estimated : mapping
        Parameters by key; one that is missing counts as zero.
    std : mapping
        Standard deviations by key; parameters without a positive one are left out.
    truth : mapping
        True parameters; one that is missing counts as zero, one that is no number is left out.
    """
    # An axis wobble about the opposite direction with the opposite phase is the same wobble.
    direction, true_direction = (_number(one.get("direction_rad", 0.0)) or 0.0 for one in (estimated, truth))
    opposite = math.pi if math.cos(direction - true_direction) < 0 else 0.0
    scores = {}
    for key, sigma in std.items():
        value, true = _number(estimated.get(key, 0.0)), _number(truth.get(key, 0.0))
        if value is None or true is None or not sigma or sigma <= 0:
            continue
        error = value - true
        if key == "phase_rad":
            error = (error + opposite + math.pi) % _TURN - math.pi
        elif key == "direction_rad":
            error = (error + math.pi / 2) % math.pi - math.pi / 2
        scores[key] = error / sigma
    return scores


def _number(value: Any) -> float | None:
    return float(value) if isinstance(value, int | float) else None
