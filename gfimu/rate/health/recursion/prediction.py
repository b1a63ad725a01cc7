"""What the other channels predict a channel to read."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray

__all__ = ["omega_products", "prediction_row"]


def prediction_row(array: AccelerometerArray, channel: int, used: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the row N, shape (c,), with N (y − Q s(ω)) a channel's reading less what others predict.

    Parameters
    ----------
    array : AccelerometerArray
        The array, with c channels; y = J [α; p] + Q s(ω).
    channel : int
        The channel.
    used : ndarray of bool, shape (c,)
        Channels that may predict it; the channel itself does not.
    """
    matrix = array.regression_matrix / np.array([array.length_unit] * 3 + [1.0] * 3)
    others = used.copy()
    others[channel] = False
    row = np.zeros(array.n_channels)
    row[channel] = 1.0
    row[others] = -matrix[channel] @ np.linalg.pinv(matrix[others])
    return row


def omega_products(omega: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return s(ω), shape (n, 6), of rates (n, 3): xx, yy, zz, xy, xz, yz."""
    x, y, z = omega.T
    return np.column_stack([x * x, y * y, z * z, x * y, x * z, y * z])
