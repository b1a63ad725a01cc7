"""Noise of the channels, block by block: the level they share, and channels that are noisier than the others."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from gfimu.rate.health.policy import MonitorPolicy
from gfimu.rate.health.recursion.blocks import Blocks, scatter

__all__ = ["BlockNoise"]


class BlockNoise:
    """Noise of the blocks for one set of channels in use; blocks are added at the end and dropped from the front.

    A channel is noisy where 2 log LR = ν (q − 1 − ln q) exceeds the threshold, and that of the next channel by the
    margin of isolation; q is its variance over the level, averaged with a memory, and ν the degrees of freedom in it.
    Where the level exceeds the stated noise by model errors (a share u of it), those may differ between channels by
    factors of e^±u, and the spread of ln q is √(2/ν + u²) in place of √(2/ν).

    Parameters
    ----------
    null_rows : ndarray, shape (d, c)
        Z of the channels in use, whitened; zero columns for the others.
    block_s : float
        Length of a block, s.
    threshold : float
        Statistic from which a fault counts as detected.
    policy : MonitorPolicy
        Memory and margins.

    Attributes
    ----------
    levels : ndarray, shape (m,)
        Variance of the null space over the stated one, the median of the channels; 1 at least.
    """

    def __init__(self, null_rows: NDArray[np.float64], block_s: float, threshold: float, policy: MonitorPolicy) -> None:
        self._null_rows, self._block_s, self._threshold, self._policy = null_rows, block_s, threshold, policy
        self._seen = np.flatnonzero(np.sum(null_rows**2, axis=0) > 0.0)
        directions = null_rows[:, self._seen] / np.linalg.norm(null_rows[:, self._seen], axis=0)
        # Share of a channel's variance along another's direction, (s, s).
        self._overlap = (directions.T @ directions) ** 2
        self._forget = min(1.0, block_s / policy.noise_memory_s)
        self._smooth = np.append(np.ones(len(self._seen)), 0.0)  # means over the memory so far
        self._count = 0  # blocks so far, those that were dropped included
        self.levels = np.zeros(0)
        self._noisy = np.zeros(0, dtype=np.int64)  # channel that is noisier than all others in each block, else −1
        self._loud = np.zeros((0, null_rows.shape[1]), dtype=np.bool_)

    def __len__(self) -> int:
        return len(self.levels)

    def extend(self, blocks: Blocks, rows: slice) -> None:
        """Add the noise of some blocks."""
        ratios, freedom = scatter(blocks, rows, self._null_rows)
        count = len(ratios)
        whole = ~blocks.missing[rows].any(axis=1, keepdims=True)
        loud = whole & (ratios > chdtri(freedom, 1.0 - self._policy.quiet) / freedom)
        levels, noisy = np.ones(count), np.full(count, -1, dtype=np.int64)
        if count and len(self._seen) > 1:
            counted = np.where(whole, ratios, 1.0)[:, self._seen]
            loudest = np.argmax(counted, axis=1)
            beside = self._overlap[loudest] * np.maximum(np.max(counted, axis=1) - 1.0, 0.0)[:, None]
            # Without what the loudest channel does to the directions of others.
            shared = np.median(counted - beside, axis=1)
            shared = np.where(shared > self._sudden(freedom), shared, 1.0)  # level of this block alone
            foreign = 1.0 - 1.0 / shared  # share that the stated noise does not explain, and no channel is known to own
            largest = np.maximum(counted.max(axis=1), 1.0)
            counted = counted * np.minimum(1.0, self._policy.largest_scatter * shared / largest)[:, None]
            forget = self._forget
            columns = np.column_stack([counted / shared[:, None], foreign**2])
            smooth = np.empty_like(columns)
            for row, values in enumerate(columns):
                self._smooth = self._smooth + forget * (values - self._smooth)
                smooth[row] = self._smooth
            smooth, foreign_square = smooth[:, :-1], smooth[:, -1]
            common = np.maximum(1.0, np.median(smooth, axis=1))
            levels = common * shared
            number = self._count + np.arange(count)
            memory = np.minimum(number + 1, 2.0 / forget - 1.0) * freedom
            excess = np.maximum(smooth / common[:, None], 1.0)
            statistic = memory[:, None] * (excess - 1.0 - np.log(excess))
            statistic /= (1.0 + 0.5 * memory * (foreign_square + self._doubt(freedom)))[:, None]
            top = np.partition(statistic, -2, axis=1)
            found = (number * self._block_s > self._policy.noise_settled_s) & (top[:, -1] > self._threshold)
            found &= top[:, -1] - top[:, -2] > self._policy.isolation
            noisy = np.where(found, self._seen[np.argmax(statistic, axis=1)], -1)
        self._count += count
        self.levels = np.concatenate([self.levels, levels])
        self._noisy = np.concatenate([self._noisy, noisy])
        self._loud = np.concatenate([self._loud, loud])

    def _sudden(self, freedom: int) -> float:
        """Return the level of one block that noise alone hardly ever reaches."""
        total = freedom * int(np.linalg.matrix_rank(self._null_rows))
        return float(chdtri(total, 1.0 - self._policy.calm) / total)

    def _doubt(self, freedom: int) -> float:
        """Return the variance of ln q that noise has which was measured in a rest at the start."""
        policy = self._policy
        measured = policy.live_rest_s / self._block_s * freedom / np.pi  # 1/variance of the logarithm of a median
        return float(1.0 / (measured + policy.noise_spread**-2))

    def drop(self, count: int) -> None:
        """Forget the first blocks."""
        self.levels, self._noisy, self._loud = self.levels[count:], self._noisy[count:], self._loud[count:]

    @property
    def noisy(self) -> NDArray[np.int64]:
        """Channel that is noisier than all others in each block, −1 where none is, shape (m,)."""
        return self._noisy

    def first_from(self, block: int) -> tuple[int, int]:
        """Return the first block from ``block`` on at which a channel is noisy, and that channel; m and −1 if none."""
        found = np.flatnonzero(self._noisy[block:] >= 0)
        if not found.size:
            return len(self.levels), -1
        place = block + int(found[0])
        return place, int(self._noisy[place])

    def onset(self, channel: int, block: int) -> int:
        """Return the block at which the noise of a channel that is noisy at ``block`` began."""
        loud = self._loud[: block + 1, channel]
        quiet = np.flatnonzero(~loud[1:] & ~loud[:-1])  # two quiet blocks in a row
        return min(block, int(quiet[-1]) + 2) if quiet.size else 0
