"""Noise of the channels, block by block: the level they share, and channels that are noisier than the others."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter
from scipy.stats import chi2

from gfimu.integrity.blocks import Blocks, scatter
from gfimu.integrity.policy import MonitorPolicy
from gfimu.short_repr import short_repr

__all__ = ["BlockNoise", "block_noise"]

_LARGEST = 6.0  # of the stated variance, counted in one block: a step inside it is no noise
_SETTLED_S = 0.3  # from the first block on, before a channel is called noisy
_QUIET = 0.99  # quantile of a sound channel's scatter in one block


@dataclass(frozen=True)
class BlockNoise:
    """Noise of m blocks of c channels, for one set of channels in use.

    Parameters
    ----------
    levels : ndarray, shape (m,)
        Variance of the null space over the stated one, the median of the channels; 1 at least.
    noisy : ndarray of int, shape (k,)
        Blocks at which one channel is noisier than all others.
    channels : ndarray of int, shape (k,)
        That channel.
    loud : ndarray of bool, shape (m, c)
        Blocks with more scatter than a sound channel has in one of a hundred.
    """

    levels: NDArray[np.float64]
    noisy: NDArray[np.int64]
    channels: NDArray[np.int64]
    loud: NDArray[np.bool_]

    __repr__ = short_repr

    def first_from(self, block: int) -> tuple[int, int]:
        """Return the first block from ``block`` on at which a channel is noisy, and that channel; m and −1 if none."""
        place = int(np.searchsorted(self.noisy, block))
        if place == len(self.noisy):
            return len(self.levels), -1
        return int(self.noisy[place]), int(self.channels[place])

    def onset(self, channel: int, block: int) -> int:
        """Return the block at which the noise of a channel that is noisy at ``block`` began."""
        loud = self.loud[: block + 1, channel]
        quiet = np.flatnonzero(~loud[1:] & ~loud[:-1])  # two quiet blocks in a row
        return min(block, int(quiet[-1]) + 2) if quiet.size else 0


def block_noise(
    blocks: Blocks, null_rows: NDArray[np.float64], block_s: float, threshold: float, policy: MonitorPolicy
) -> BlockNoise:
    """Return the noise of all blocks.

    A channel is noisy where 2 log LR = ν (q − 1 − ln q) exceeds the threshold, and that of the next channel by the
    margin of isolation; q is its variance over the level, averaged with a memory, and ν the degrees of freedom in it.

    Parameters
    ----------
    blocks : Blocks
        The blocks.
    null_rows : ndarray, shape (d, c)
        Z of the channels in use, whitened; zero columns for the others.
    block_s : float
        Length of a block, s.
    threshold : float
        Statistic from which a fault is believed.
    policy : MonitorPolicy
        Memory and margin.
    """
    count = len(blocks)
    ratios, freedom = scatter(blocks, slice(None), null_rows)
    whole = ~blocks.missing.any(axis=1, keepdims=True)
    loud: NDArray[np.bool_] = np.asarray(whole & (ratios > chi2.ppf(_QUIET, freedom) / freedom))
    seen = np.flatnonzero(np.sum(null_rows**2, axis=0) > 0.0)
    none = np.zeros(0, dtype=np.int64)
    if len(seen) < 2 or count == 0:
        return BlockNoise(np.ones(count), none, none, loud)
    counted = np.where(whole, ratios, 1.0)[:, seen]
    counted = counted * np.minimum(1.0, _LARGEST / np.maximum(counted.max(axis=1, keepdims=True), 1.0))
    forget = min(1.0, block_s / policy.noise_memory_s)
    smooth, _ = lfilter([forget], [1.0, forget - 1.0], counted, axis=0, zi=np.full((1, len(seen)), 1.0 - forget))
    levels = np.maximum(1.0, np.median(smooth, axis=1))
    memory = np.minimum(np.arange(count) + 1, 2.0 / forget - 1.0) * freedom
    excess = np.maximum(smooth / levels[:, None], 1.0)
    statistic = memory[:, None] * (excess - 1.0 - np.log(excess))
    largest = np.partition(statistic, -2, axis=1)
    found = (np.arange(count) * block_s > _SETTLED_S) & (largest[:, -1] > threshold)
    found &= largest[:, -1] - largest[:, -2] > policy.isolation
    noisy = np.flatnonzero(found)
    return BlockNoise(levels, noisy, seen[np.argmax(statistic[noisy], axis=1)] if noisy.size else none, loud)
