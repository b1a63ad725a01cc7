"""Test for rest: whether a block of samples is consistent with a body that doesn't turn.

A block of W samples is taken for rest if none of five statistics is larger than rest explains:

============  ====================================================================  ==============
statistic     of                                                                    distribution
============  ====================================================================  ==============
scatter       the readings about their means within the block                       χ²(c (W − 1))
halves        the means of the second half against those of the first               χ²(c)
alpha         mean α against its bias as known when the block began                  χ²(3)
null space    mean z against its bias as known when the block began                  χ²(d)
rate          ω when the block began against zero                                    χ²(3)
============  ====================================================================  ==============

Noise is what the block's own null space shows about the means of its halves, as no steady motion adds to that, or what
is stated, whichever is larger (`shown_variance`).

Each is tested at a fifth of the stated false-alarm rate, so that a block at rest fails in at most that share of cases.
The mean α of the last 2, 4, 8 … blocks in a row is tested as well, against its bias as known when they began: it shows
a departure too slow for one block.

Amid a rest one failure is a doubt, because blocks fail by chance: ω = 0 is not used, and the filter takes the block
before back as well (both, where the mean of two raised the doubt). The doubt is over when the next block passes and the
mean α since it began is what rest explains. The rest ends with a second failed block in a row, with the fifth block in
doubt, or at once where a block, the rate when it began, or the mean of 2, 4, 8 … fails at the level ``loss``.

Until a slow departure shows it has been taken for rest. Therefore where a rest ends the filter takes back the block
before, and the two, four … before when it was their mean that showed it: it goes back to its state before them and
filters those samples again without ω = 0.

Turning steadily about the vertical changes no reading; it is distinguished from rest by the null space (down to about
√(3 σ_b/h), σ_b the uncertainty of the null-space bias) and by the rate that the filter remembers, which is why a block
only counts if ω was known to ``largest_rate_std`` when it began. A start in the dark, with ω unknown, is never taken
for rest. And a rate that passes slowly through zero looks like rest for a while: after a motion, rest begins only when
blocks have passed in a row for ``entry_s`` and neither their mean α nor the rate is farther from zero than rest
explains at a level of 20 % and 5 %. Too strict costs another block of waiting; too lax would be a wrong rate. Behind a
rest that a single block ended, ``retry_s`` and 5 % for both are enough: the biases are known then.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray
from scipy.special import chdtri

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError
from gfimu.rate.sensing import ChannelTables, SensorErrors

__all__ = ["HISTORY_BLOCKS", "KEPT_BLOCKS", "RUN_BLOCKS", "RestTest", "constant_readings"]

RUN_BLOCKS = 16
"""Blocks over which the mean of α is followed."""

KEPT_BLOCKS = 5
"""States kept during a rest: all but one of these blocks can be taken back."""

HISTORY_BLOCKS = KEPT_BLOCKS + 3
"""Blocks of samples kept for that, with room for blocks in doubt between them."""


@dataclass(frozen=True)
class RestTest:
    """Settings of the test.

    Parameters
    ----------
    window_s : float
        Length of a block, s.
    false_alarm : float
        Largest probability that a block at rest is not recognised; a hundredth of it for the first block of a run that
        is said to start at rest, because everything after hangs on that.
    loss : float
        Probability at which a block, or the mean of several, ends a rest at once, without waiting for the next block.
    rate_std : float
        How far from zero the rate may be at rest, rad/s (standard deviation).
    largest_rate_std : float
        A block counts only if ω was known at least this well when it began, rad/s.
    entry_s : float
        How long a body must be still after a motion before that counts as rest, s.
    retry_s : float
        The same right behind a single block that was no rest, s.
    """

    window_s: float = 0.5
    false_alarm: float = 0.01
    loss: float = 1e-6
    rate_std: float = 5e-3
    largest_rate_std: float = 0.2
    entry_s: float = 5.0
    retry_s: float = 1.5

    def __post_init__(self) -> None:
        for name in ("false_alarm", "loss"):
            if not 0 < getattr(self, name) < 1:
                raise InputError(f"{name} = {getattr(self, name)!r}: must lie between 0 and 1")
        for name in ("window_s", "rate_std", "largest_rate_std", "entry_s", "retry_s"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise InputError(f"{name} = {getattr(self, name)!r}: must be a positive number")

    def window(self, period: float) -> int:
        """Return the samples per block, at least four."""
        return max(4, round(self.window_s / period))

    def limits(
        self, n_channels: int, n_null: int, period: float, false_alarm: float | None = None
    ) -> NDArray[np.float64]:
        """Return the limits of the five statistics, the largest variance of ω, and of α and ω at entry, shape (8,)."""
        false_alarm = self.false_alarm if false_alarm is None else false_alarm
        freedom = np.array([n_channels * (self.window(period) - 1), n_channels, 3, max(n_null, 1), 3])
        largest = chdtri(freedom, false_alarm / len(freedom))
        return np.array([*largest, self.largest_rate_std**2, *chdtri(3, [0.2, 0.05])])

    def all_limits(self, n_channels: int, n_null: int, period: float) -> NDArray[np.float64]:
        """Return the limits for a block, for the first one, and those that end a rest at once, shape (3, 8)."""
        levels = (self.false_alarm, self.false_alarm / 100.0, min(self.loss, self.false_alarm))
        return np.array([self.limits(n_channels, n_null, period, level) for level in levels])

    def entry_blocks(self, period: float) -> tuple[int, int]:
        """Return how many blocks in a row begin a rest, and resume one, at most `RUN_BLOCKS`."""
        block = self.window(period) * period
        entry, retry = (min(max(1, round(time / block)), RUN_BLOCKS) for time in (self.entry_s, self.retry_s))
        return entry, retry


@njit(cache=True, error_model="numpy")
def shown_variance(z):  # type: ignore[no-untyped-def]
    """Variance of the noise over the stated one that the null space z (window, d) of a block shows, 1 or more."""
    window, d = z.shape
    first = window // 2
    squares = 0.0
    for j in range(d):
        for begin, end in ((0, first), (first, window)):
            origin = z[begin, j]
            total = 0.0
            square = 0.0
            for k in range(begin, end):
                change = z[k, j] - origin
                total += change
                square += change * change
            squares += square - total * total / (end - begin)
    return max(1.0, squares / max(1, d * (window - 2)))


def constant_readings(
    array: AccelerometerArray, readings: ArrayLike, noise_std: ArrayLike, period: float
) -> NDArray[np.bool_]:
    """Blocks whose readings are constant: the part of the test that needs no filter (scatter and halves).

    Necessary for rest, not sufficient: turning steadily about the vertical is constant too.

    Parameters
    ----------
    array : AccelerometerArray
        The array, with c channels.
    readings : array_like, shape (n, c)
        Specific force, m/s².
    noise_std : array_like, shape (c,) or scalar
        White noise of each channel per sample, m/s².
    period : float
        Sample period, s.

    Returns
    -------
    ndarray of bool, shape (n,)
        True in the blocks that pass; False in an incomplete last block and where a reading is missing.
    """
    settings = RestTest()
    rows = np.asarray(readings, dtype=float) / np.broadcast_to(np.asarray(noise_std, dtype=float), (array.n_channels,))
    null = ChannelTables(array, SensorErrors.uniform(array, noise_std)).null_rows[0] * noise_std
    window = settings.window(period)
    blocks = len(rows) // window
    limits = settings.limits(array.n_channels, 0, period)
    block = rows[: blocks * window].reshape(blocks, window, array.n_channels)
    noise = np.array([shown_variance(z) for z in block @ null.T])
    scatter = ((block - block.mean(axis=1, keepdims=True)) ** 2).sum(axis=(1, 2))
    half = window // 2
    difference = block[:, half:].mean(axis=1) - block[:, :half].mean(axis=1)  # (blocks, c)
    halves = (difference**2).sum(axis=1) / (1.0 / half + 1.0 / (window - half))
    passed = (scatter <= limits[0] * noise) & (halves <= limits[1] * noise)  # False where NaN
    return np.append(np.repeat(passed, window), np.zeros(len(rows) - blocks * window, dtype=bool))
