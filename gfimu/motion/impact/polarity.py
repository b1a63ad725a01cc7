"""Polarity: whether the body was accelerated where it was meant to be, and whether every channel has its sign."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.kinematics import specific_force
from gfimu.motion.estimate import Estimate
from gfimu.motion.estimation import estimate
from gfimu.recording import Recording

__all__ = ["DIRECTIONS", "direction_remark", "moved", "sign_remark"]

DIRECTIONS = {f"{sign}{axis}": (k, 1.0 if sign == "+" else -1.0) for k, axis in enumerate("xyz") for sign in "+-"}
"""Directions along a body axis: its number and sign."""

_MISFIT = 0.05
"""Share of the readings that a rigid body may leave unexplained: gains off by a few percent, arms that bend."""
_BETTER = 3.0
"""A sign is reversed if reversing it makes the misfit smaller by this factor, at least."""
_ALIKE = 1.5
"""Reversals whose misfits differ by less than this factor are all named."""


def moved(zeroed: Recording, array: AccelerometerArray) -> Estimate:
    """Estimate the motion from channels that were zeroed before the impact, at rest at the first sample."""
    return estimate(zeroed, array, quaternion0=(1.0, 0.0, 0.0, 0.0), force=True, findings=())


def direction_remark(direction: str, change: NDArray[np.float64]) -> str:
    """Compare where the body was accelerated, by its change of velocity (3,), with where it was meant to be."""
    axis, sign = DIRECTIONS[direction]
    strongest = int(np.abs(change).argmax())
    if strongest == axis and sign * change[axis] > 0.0:
        return ""
    seen = f"{'+' if change[strongest] > 0 else '-'}{'xyz'[strongest]}"
    return f"polarity: the body is accelerated along {seen}, not {direction}; look at the signs of the axes"


def sign_remark(zeroed: Recording, array: AccelerometerArray, motion: Estimate) -> str:
    """Say whether the channels fit one rigid body, and whose reversal would make them fit; empty if they do."""
    misfit = _misfit(zeroed.readings, array, motion)
    if misfit < _MISFIT:
        return ""
    reversals = {}
    for index, name in enumerate(array.channels):
        readings = zeroed.readings.copy()
        readings[:, index] *= -1.0
        reversals[name] = _misfit(readings, array, moved(replace(zeroed, readings=readings), array))
    best = min(reversals.values())
    if best * _BETTER > misfit:
        return f"the channels do not fit one rigid body ({misfit:.0%} unexplained); look at places, axes and gains"
    names = [name for name, one in reversals.items() if one < _ALIKE * best]
    return f"polarity: turn the sign of {' or '.join(names)}; then all channels fit one rigid body"


def _misfit(readings: NDArray[np.float64], array: AccelerometerArray, motion: Estimate) -> float:
    """Return the share of the readings (n, c) that p, α and ω do not explain, by their root mean squares."""
    left = readings - specific_force(array, motion.p, motion.alpha, motion.omega)
    return float(np.sqrt((left**2).mean() / (readings**2).mean()))
