"""Input range of an array as an angular sensor: where its first channel saturates."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gfimu.array.parts.limits import PartLimits
from gfimu.base.errors import InputError
from gfimu.calibration.certificate.angular.response import Response
from gfimu.calibration.result import Calibration

__all__ = ["acceleration_range", "rate_range", "specific_force_limits"]

Floats = NDArray[np.float64]


def specific_force_limits(calibration: Calibration, limits: PartLimits) -> tuple[Floats, Floats]:
    """Return the specific force at which each channel saturates, and its standard deviation, each (c,), m/s².

    The reading K1 a + b ends at the full range of the part, on the side that the bias is on.
    """
    count = limits.lsb if calibration.unit == "lsb" else np.ones(len(limits.lsb))
    models = list(calibration.models.values())
    gain = count * np.concatenate([np.diag(model.sensitivity) for model in models])
    bias = count * np.concatenate([model.bias for model in models])
    axes = [(chip, axis) for chip in calibration.chips for axis in "xyz"]
    of_gain = count * np.array([calibration.std_of(f"{chip}_M_{axis}{axis}") for chip, axis in axes])
    of_bias = count * np.array([calibration.std_of(f"{chip}_b_{axis}") for chip, axis in axes])
    limit = (limits.full_range - np.abs(bias)) / gain
    return limit, np.hypot(of_bias, limit * of_gain) / gain


def acceleration_range(found: Response, limit: tuple[Floats, Floats], gravity: float, axis: int) -> tuple[float, float]:
    """Return the largest |α| about a body axis at rest and its standard deviation, rad/s².

    In any attitude and starting from rest: a channel with the arm T reads T α, and up to g of gravity.
    """
    array = found.array
    arms = array.regression_matrix[:, axis]
    slope = np.cross(array.axes, np.eye(3)[axis])  # of T by the position: T = n · (r × θ) = r · (θ × n)
    return _first(arms, _spread(found, slope), limit, gravity)


def rate_range(found: Response, limit: tuple[Floats, Floats], gravity: float, axis: int) -> tuple[float, float]:
    """Return the largest constant rate about a body axis through the origin and its standard deviation, rad/s.

    In any attitude: a channel with the centripetal arm C reads C ω², and up to g of gravity.
    """
    array = found.array
    n = np.eye(3)[axis]
    arms = array.centripetal_about(n)
    slope = (array.axes @ n)[:, None] * n - array.axes
    square, std = _first(arms, _spread(found, slope), limit, gravity)
    return float(np.sqrt(square)), std / (2.0 * float(np.sqrt(square)))


def _spread(found: Response, slope: Floats) -> Floats:
    """Return the standard deviation of an arm by those of the positions, (c,), m."""
    return np.asarray(
        np.sqrt(np.sum((slope * found.position_std[found.array.chip_of_channel]) ** 2, axis=1)), dtype=np.float64
    )


def _first(arms: Floats, arms_std: Floats, limit: tuple[Floats, Floats], gravity: float) -> tuple[float, float]:
    """Return the least of (limit − g)/|arm| over the channels, and its standard deviation."""
    left, size = limit[0] - gravity, np.abs(arms)
    if not (left > 0.0).all():
        raise InputError("a channel saturates by gravity alone: its range is too small for any attitude")
    seen = size > 1e-9 * size.max(initial=0.0)
    if not seen.any():
        return float("inf"), 0.0
    ends = np.where(seen, left / np.where(seen, size, 1.0), np.inf)
    first = int(np.argmin(ends))
    relative = np.hypot(limit[1][first] / left[first], arms_std[first] / size[first])
    return float(ends[first]), float(ends[first] * relative)
