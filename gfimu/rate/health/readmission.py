"""Whether an excluded channel behaves again: it reads what the others predict, and is quiet."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gfimu.rate.health.policy import MonitorPolicy
from gfimu.rate.health.recursion.blocks import Blocks, scatter
from gfimu.rate.health.recursion.monitor_filter import MonitorFilter
from gfimu.rate.health.recursion.prediction import omega_products, prediction_row

__all__ = ["behaves"]

_SIGMAS = 3.0  # numerical: of the mean difference of each second


def behaves(
    follower: MonitorFilter,
    blocks: Blocks,
    omega: NDArray[np.float64],
    channel: int,
    watched: NDArray[np.bool_],
    policy: MonitorPolicy,
) -> bool:
    """Return whether a channel agreed with the others in all of these blocks.

    Parameters
    ----------
    follower : MonitorFilter
        Biases and their covariance.
    blocks : Blocks
        The last m blocks.
    omega : ndarray, shape (m, 3)
        Angular rate in them, rad/s.
    channel : int
        The excluded channel.
    watched : ndarray of bool, shape (c,)
        Channels in use.
    policy : MonitorPolicy
        How much scatter a quiet channel has.
    """
    if blocks.missing.any():
        return False
    array, state = follower.array, follower.state
    row = prediction_row(array, channel, watched)
    residual = (blocks.means - state.x[3:]) @ row - omega_products(omega) @ (row @ array.centripetal_matrix)
    noise = float(np.sum(row**2 * follower.errors.noise_std**2))
    bias = float(row @ state.covariance[3:, 3:] @ row) + follower.model_errors()[channel] ** 2
    second = max(1, round(1.0 / follower.block_s))
    means = residual[: len(residual) // second * second].reshape(-1, second).mean(axis=1)
    near = np.abs(means) < _SIGMAS * np.sqrt(noise / (blocks.samples * second) + bias)
    ratios, _ = scatter(blocks, slice(None), row[None] / np.sqrt(noise))
    return bool(near.all() and ratios[:, channel].mean() < policy.sound_scatter)
