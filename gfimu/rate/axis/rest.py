"""Whether a body on a known axis begins at rest: still readings may also be those of a steady spin about a vertical."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.turning_axis import TurningAxis
from gfimu.base.errors import InputError
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.rate.axis.channels import AxisChannels
from gfimu.rate.rest_test import RestTest, begins_still
from gfimu.rate.sensing import SensorErrors

__all__ = ["begins_at_rest"]

_SPINS = 4.0  # standard deviations, by the biases, from which Ω² counts: once in 3e4 rests


def begins_at_rest(
    y: NDArray[np.float64],
    array: AccelerometerArray,
    axis: TurningAxis,
    noise_std: NDArray[np.float64],
    period: float,
    metadata: Mapping[str, Any] = MappingProxyType({}),
) -> bool:
    """Return whether the first half second of readings (n, c), m/s², is rest.

    Still readings fit any Ω². The one that fits their mean best, beside an unknown specific force, or beside gravity
    where few channels can't tell them apart and the axis is known to be vertical, is compared with what biases make of
    it, as a calibration in the recording's ``metadata`` or the parts' data sheets state them. Without that it is rest.
    """
    if not begins_still(y, noise_std, period):
        return False
    try:
        bias_std = SensorErrors.of_recording(array, metadata, 1.0 / period).bias_std
    except InputError:  # a part without a data sheet
        return True
    channels = AxisChannels.of(array, axis)
    first = y[: RestTest().window(period)]
    mean = np.where(np.isfinite(first), first, 0.0).sum(axis=0) / np.maximum(np.isfinite(first).sum(axis=0), 1)
    seen = np.isfinite(first).any(axis=0) & (bias_std > 0.0)
    columns = np.column_stack([channels.by_square, channels.force])
    if np.linalg.matrix_rank(columns[seen]) < 4:
        if axis.hub != "fixed" or axis.inclination is None or np.sin(axis.inclination) > 0.0:
            return True
        mean = mean - channels.force[:, 0] * STANDARD_GRAVITY * np.cos(axis.inclination)
        columns = columns[:, :1]
    white = columns[seen] / bias_std[seen, None]
    if np.linalg.matrix_rank(white) < white.shape[1]:
        return True
    covariance = np.linalg.inv(white.T @ white)
    square = (covariance @ white.T @ (mean[seen] / bias_std[seen]))[0]
    return bool(square < _SPINS * np.sqrt(covariance[0, 0]))
