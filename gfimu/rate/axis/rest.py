"""Whether a body on a known axis begins at rest: still readings may also be those of a steady spin about a vertical."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gfimu.array.turning_axis import TurningAxis
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.rate.axis.channels import AxisChannels
from gfimu.rate.rest_test import RestTest, begins_still

__all__ = ["begins_at_rest"]

_SPINS = 4.0  # standard deviations, by the biases, from which Ω² counts: once in 3e4 rests


def begins_at_rest(
    y: NDArray[np.float64],
    channels: AxisChannels,
    axis: TurningAxis,
    noise_std: NDArray[np.float64],
    bias_std: NDArray[np.float64],
    period: float,
) -> bool:
    """Return whether the first half second of readings (n, c), m/s², is rest.

    Still readings fit any Ω². The one that fits their mean best, beside an unknown specific force, or beside gravity
    where few channels can't tell them apart and the axis is known to be vertical, is compared with what biases with the
    standard deviations ``bias_std`` (c,) make of it.
    """
    if not begins_still(y, noise_std, period):
        return False
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
