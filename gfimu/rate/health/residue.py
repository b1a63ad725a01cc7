"""Errors of gains, axes and positions that a calibration leaves: how large they are, by how well the channels agree."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from gfimu.array.array import AccelerometerArray
from gfimu.rate.health.policy import MonitorPolicy
from gfimu.rate.health.recursion.blocks import Blocks
from gfimu.rate.health.recursion.monitor_filter import MonitorFilter
from gfimu.rate.health.recursion.noise import BlockNoise
from gfimu.rate.sensing import SensorErrors

__all__ = ["agree", "larger_errors", "moving_seconds", "with_residue", "without_noisy_channel"]

_LEAST_SCALE = 1e-4  # numerical: a ratio, where gains and axes are stated as exact
_LEAST_PLACE = 2e-5  # numerical: m, the same of positions


def with_residue(array: AccelerometerArray, errors: SensorErrors, policy: MonitorPolicy) -> SensorErrors:
    """Return errors of channels whose biases a rest showed, with at least what a good calibration leaves."""
    return replace(
        errors,
        bias_std=np.full(array.n_channels, policy.bias_std),
        scale_std=max(errors.gain_std, policy.gain_std),
        axis_std=0.0,
        placement_std=max(errors.placement_std, policy.place_std),
    )


def larger_errors(errors: SensorErrors, factor: float) -> SensorErrors:
    """Return the errors with those of gains, axes and positions larger by a factor."""
    if factor == 1.0:
        return errors
    return replace(
        errors,
        scale_std=factor * max(errors.gain_std, _LEAST_SCALE),
        axis_std=0.0,
        placement_std=factor * max(errors.placement_std, _LEAST_PLACE),
    )


def moving_seconds(follower: MonitorFilter, blocks: Blocks, policy: MonitorPolicy) -> NDArray[np.bool_]:
    """Return in which whole seconds of the blocks the array moves, shape (s,)."""
    per_second = max(1, round(1.0 / follower.block_s))
    count = len(blocks) // per_second
    means = blocks.means[: count * per_second].reshape(count, per_second, -1)
    spread = np.ptp(means, axis=1) / follower.noise_of_means
    return np.asarray(spread.max(axis=1, initial=0.0) > policy.moving)


def without_noisy_channel(
    follower: MonitorFilter, blocks: Blocks, watched: NDArray[np.bool_], policy: MonitorPolicy
) -> NDArray[np.bool_]:
    """Return in which blocks no channel is noisier than all others, shape (m,).

    Where one is, errors of the geometry are not what the innovations show.
    """
    noise = BlockNoise(follower.null_rows(watched), follower.block_s, follower.threshold, policy)
    noise.extend(blocks, slice(0, len(blocks)))
    return np.asarray(noise.noisy < 0)


def agree(
    follower: MonitorFilter,
    blocks: Blocks,
    innovations: NDArray[np.float64],
    policy: MonitorPolicy,
    *,
    judged: NDArray[np.bool_],
    fewest: int | None = None,
) -> bool:
    """Whether a share of all seconds of motion, and of rest, have innovations that the stated errors explain.

    Parameters
    ----------
    follower : MonitorFilter
        The filter.
    blocks : Blocks
        The blocks, m of them.
    innovations : ndarray, shape (m,)
        Normalised innovation squared per degree of freedom.
    policy : MonitorPolicy
        That share.
    judged : ndarray of bool, shape (m,)
        Blocks to judge by (`without_noisy_channel`).
    fewest : int, optional
        Seconds of motion, or of rest, from which they are judged by themselves; by default those of the policy.

    Returns
    -------
    bool
        True also where no second is left to judge by.
    """
    per_second = max(1, round(1.0 / follower.block_s))
    count = len(blocks) // per_second
    freedom = follower.sets.full.nulls * per_second
    if count == 0 or freedom == 0:
        return True
    nis = innovations[: count * per_second].reshape(count, per_second).mean(axis=1)
    moving = moving_seconds(follower, blocks, policy)
    whole = judged[: count * per_second].reshape(count, per_second).all(axis=1)
    nis, moving, count = nis[whole], moving[whole], int(whole.sum())
    limit = chdtri(freedom, policy.agreeing_share) / freedom
    parts = [nis[part] for part in (moving, ~moving) if part.sum() >= min(count, fewest or policy.fewest_seconds)]
    return all(bool(np.quantile(part, policy.agreeing_share) <= limit) for part in parts)
