"""Readings as means of blocks, with the scatter within each block as the null space sees it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gfimu.base.short_repr import short_repr

__all__ = ["Blocks", "block_means", "detrended_variance", "scatter"]


@dataclass(frozen=True)
class Blocks:
    """Means of blocks of B samples in a row.

    Parameters
    ----------
    samples : int
        B.
    t : ndarray, shape (m,)
        Mean time of each block, s.
    means : ndarray, shape (m, c)
        Mean readings, m/s²; 0 where the block lacks a reading of the channel.
    missing : ndarray of bool, shape (m, c)
        Channels that lack a reading in the block.
    readings : ndarray, shape (m, B, c)
        The readings themselves; 0 where missing.
    """

    samples: int
    t: NDArray[np.float64]
    means: NDArray[np.float64]
    missing: NDArray[np.bool_]
    readings: NDArray[np.float64]

    __repr__ = short_repr

    def __len__(self) -> int:
        return len(self.t)

    def rows(self, part: slice) -> Blocks:
        """Return some of the blocks, as views."""
        return Blocks(self.samples, self.t[part], self.means[part], self.missing[part], self.readings[part])

    def joined(self, later: Blocks) -> Blocks:
        """Return these blocks and those behind them."""
        return Blocks(
            self.samples,
            np.concatenate([self.t, later.t]),
            np.concatenate([self.means, later.means]),
            np.concatenate([self.missing, later.missing]),
            np.concatenate([self.readings, later.readings]),
        )

    def samples_of(self, period: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return times (m B,), a sample period apart within a block, and readings (m B, c), NaN in missing blocks."""
        place = (np.arange(self.samples) - (self.samples - 1) / 2.0) * period
        rows = np.where(self.missing[:, None, :], np.nan, self.readings)
        return (self.t[:, None] + place).ravel(), rows.reshape(-1, rows.shape[2])


def block_means(
    t: NDArray[np.float64], readings: NDArray[np.float64], limits: NDArray[np.float64], samples: int
) -> Blocks:
    """Cut readings (n, c) into blocks; the last samples that fill none are left. Saturated readings are missing."""
    count = len(t) // samples
    used = count * samples
    rows = readings[:used]
    absent = ~(np.abs(rows) < limits)  # NaN is not below either
    missing: NDArray[np.bool_] = np.asarray(absent.reshape(count, samples, -1).any(axis=1))
    whole = np.where(absent, 0.0, rows).reshape(count, samples, -1)
    return Blocks(
        samples,
        t[:used].reshape(count, samples).mean(axis=1),
        np.where(missing, 0.0, whole.mean(axis=1)),
        missing,
        whole,
    )


def detrended_variance(blocks: Blocks) -> tuple[NDArray[np.float64], int]:
    """Return the variance of each channel's readings within blocks, shape (m, c), (m/s²)², and its degrees of freedom.

    Mean, slope and curvature are taken out of each block, as a fast turn has them; B − 3 degrees of freedom remain.
    """
    freedom = blocks.samples - 3
    left = _without_motion(blocks.samples) @ blocks.readings  # (m, B, c)
    return np.asarray(np.sum(left**2, axis=1) / freedom), freedom


def scatter(blocks: Blocks, rows: slice, null_rows: NDArray[np.float64]) -> tuple[NDArray[np.float64], int]:
    """Return the variance within blocks along each channel's direction in the null space, over the stated one.

    Mean, slope and curvature are taken out of each block, as a fast turn has them; B − 3 degrees of freedom remain.

    Parameters
    ----------
    blocks : Blocks
        The blocks.
    rows : slice
        Those to use, m of them.
    null_rows : ndarray, shape (d, c)
        Z, whitened; zero columns for channels that are not used.

    Returns
    -------
    tuple of (ndarray, int)
        Ratios, shape (m, c), zero for channels that are not used, and their degrees of freedom.
    """
    samples = blocks.samples
    white = _without_motion(samples) @ (blocks.readings[rows] @ null_rows.T)  # (m, B, d)
    length = np.sum(null_rows**2, axis=0)  # (c,)
    along = white @ null_rows  # (m, B, c)
    energy = np.sum(along**2, axis=1) / (samples - 3)
    return np.where(length > 0.0, energy / np.maximum(length, 1e-30), 0.0), samples - 3


@lru_cache(maxsize=16)
def _without_motion(samples: int) -> NDArray[np.float64]:
    """Return the projection, shape (B, B), that takes mean, slope and curvature out of B samples."""
    place = np.arange(samples) - (samples - 1) / 2.0
    motion, _ = np.linalg.qr(np.column_stack([np.ones(samples), place, place**2]))
    return np.asarray(np.eye(samples) - motion @ motion.T)
