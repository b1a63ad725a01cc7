"""Whether the body rests: the one definition of rest for recordings and streams.

A block of half a second is *still* where its readings are constant within their noise: their scatter about the mean,
and the mean of the second half against that of the first, are what noise explains. Rest is still, and so is a steady
spin about the vertical. The null space tells them apart, as it shows the products of the rate: a block is rest where
the products at rate zero explain it nearly as well as those of the best rate do (`gfimu.rate.start`).
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import chdtri

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError

__all__ = ["DOUBTED", "MOVES", "RESTS", "RestJudge", "RestTest", "begins_still", "constant_readings", "still_blocks"]


@dataclass(frozen=True)
class RestTest:
    """When a body counts as resting.

    Parameters
    ----------
    window_s : float
        Length of a block, s.
    false_alarm : float
        Probability that scatter, or halves, of a block at rest are larger than the limit.
    start_false_alarm : float
        The same at the first block: a rest taken for a motion costs the sign and the biases of the whole run.
    scatter_margin, halves_margin : float
        By how much the variance of the noise may be larger than stated: it is measured to some percent, and steps of
        the readings and a table's hum add to it.
    rate_std : float
        How far from zero the rate may be at rest, rad/s (standard deviation).
    rate_limit : float
        χ² of the rate's three components up to which a filter's rate may be zero: once in a thousand.
    alpha_false_alarm : float
        Probability that the mean α of the last blocks of a rest is farther from that of the blocks before than its
        noise explains. A block lost costs little, a departure taken for rest a wrong rate.
    alpha_loss : float
        The same from which the two blocks before are no rest either.
    entry_s : float
        How long a body must be still after a motion before that counts as rest, s: a rate that passes slowly through
        zero is still for a while.
    entry_rate_level, entry_alpha_level : float
        Probability that the rate, or the mean α of the still blocks, of a body at rest are too large to begin a rest.
        Too strict costs another block of waiting; too lax a wrong rate.
    """

    window_s: float = 0.5
    false_alarm: float = 1e-3
    start_false_alarm: float = 1e-6
    scatter_margin: float = 1.1
    halves_margin: float = 1.2
    rate_std: float = 5e-3
    rate_limit: float = 16.3
    alpha_false_alarm: float = 0.02
    alpha_loss: float = 1e-4
    entry_s: float = 4.0
    entry_rate_level: float = 0.05
    entry_alpha_level: float = 0.2

    def __post_init__(self) -> None:
        if not 0 < self.false_alarm < 1:
            raise InputError(f"false_alarm = {self.false_alarm!r}: must lie between 0 and 1")
        for name in ("window_s", "scatter_margin", "halves_margin", "rate_std", "rate_limit", "entry_s"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise InputError(f"{name} = {getattr(self, name)!r}: must be a positive number")

    @property
    def of_start(self) -> Self:
        """The test of the first block."""
        return replace(self, false_alarm=self.start_false_alarm)

    def window(self, period: float) -> int:
        """Return the samples per block, at least four."""
        return max(4, round(self.window_s / period))

    def entry_blocks(self, period: float) -> int:
        """Return how many still blocks in a row begin a rest after a motion."""
        return max(1, round(self.entry_s / (self.window(period) * period)))


MOVES, TURNS, DOUBTED, RESTS = -1, 1, 2, 3  # blocks, in the order of how much they contradict rest
_LOOK_AHEAD = 2  # blocks that must be still behind a block of rest: a slow departure shows after a second
_SPANS = (1, 2, 4)  # blocks whose mean α is compared with that of the blocks before


class RestJudge:
    """Decides block by block which still ones are rest: those whose followers are still, and turn no faster.

    A departure too slow for the readings of one block shows in the mean α of the last ones, against the mean over the
    still blocks before them.

    Parameters
    ----------
    noise : ndarray, shape (3, 3)
        Covariance of the noise of the mean α of a block, (rad/s²)².
    test : RestTest
        Probabilities.
    """

    def __init__(self, noise: NDArray[np.float64], test: RestTest) -> None:
        self._white = np.linalg.inv(np.linalg.cholesky(noise))
        levels = np.array([test.alpha_false_alarm, test.alpha_loss]) / len(_SPANS)
        self._limits = chdtri(3, levels)
        self._run: deque[NDArray[np.float64]] = deque(maxlen=max(_SPANS))  # mean α of the last blocks, whitened
        self._sum, self._count = np.zeros(3), 0  # of the blocks of the run before those
        self._open: list[int] = []
        self._blocks = 0

    def __len__(self) -> int:
        return self._blocks

    def decide(self, still: NDArray[np.bool_], alpha: NDArray[np.float64], *, closing: bool) -> list[tuple[int, int]]:
        """Take further blocks; returns numbers of blocks and `MOVES`, `DOUBTED` or `RESTS`, in the order of decision.

        A block is decided at once, and again, for good, when two more have come.

        Parameters
        ----------
        still : ndarray of bool, shape (k,)
            Whether they are still.
        alpha : ndarray, shape (k, 3)
            Mean α, rad/s².
        closing : bool
            Whether no block follows.
        """
        decided = []
        for rests, value in zip(still, alpha @ self._white.T, strict=True):
            self._open.append(self._judge(value) if rests else MOVES)
            if not rests:
                self._run.clear()
                self._sum, self._count = np.zeros(3), 0
            decided.append((self._blocks, max(self._open[-1], DOUBTED) if rests else MOVES))
            self._blocks += 1
            if len(self._open) > _LOOK_AHEAD:
                decided.append(self._verdict())
        while closing and self._open:
            decided.append(self._verdict())
        return decided

    @property
    def final(self) -> int:
        """Number of blocks whose verdict no later one changes."""
        return self._blocks - len(self._open)

    def _verdict(self) -> tuple[int, int]:
        """Decide the oldest open block: a departure may have begun in it where those behind it contradict rest."""
        number, first = self.final, self._open.pop(0)
        behind = self._open[:_LOOK_AHEAD]
        if first == RESTS and (min(behind, default=RESTS) < DOUBTED or behind == [DOUBTED] * _LOOK_AHEAD):
            return number, DOUBTED
        return number, MOVES if first < DOUBTED else first

    def _judge(self, value: NDArray[np.float64]) -> int:
        """Compare a block's mean α, and that of the last ones with it, with the still blocks before."""
        last = [*self._run, value]
        found = RESTS
        for span in _SPANS:
            before = self._count + len(last) - span
            if before < 1:
                break
            late = sum(last[len(last) - span :]) / span
            early = (self._sum + sum(last[: len(last) - span])) / before
            square = float(np.sum((late - early) ** 2)) / (1.0 / span + 1.0 / before)
            found = min(found, RESTS if square < self._limits[0] else DOUBTED if square < self._limits[1] else TURNS)
        if len(self._run) == self._run.maxlen:
            self._sum, self._count = self._sum + self._run[0], self._count + 1
        self._run.append(value)
        return found


def still_blocks(
    readings: NDArray[np.float64], noise_std: NDArray[np.float64], period: float, test: RestTest = RestTest()
) -> NDArray[np.bool_]:
    """Return which blocks of readings (n, c), m/s², are still, shape (n // window,).

    A channel that lacks a reading in a block is left out of that block.

    Parameters
    ----------
    readings : ndarray, shape (n, c)
        Specific force, m/s²; NaN where missing.
    noise_std : ndarray, shape (c,)
        White noise of each channel per sample, m/s².
    period : float
        Sample period, s.
    test : RestTest, optional
        Length of a block and limits.
    """
    window = test.window(period)
    count = len(readings) // window
    block = (readings[: count * window] / noise_std).reshape(count, window, readings.shape[1])
    absent: NDArray[np.bool_] = np.any(np.isnan(block), axis=1)  # (count, c)
    block = np.where(absent[:, None], 0.0, block)
    used = (~absent).sum(axis=1)
    half = window // 2
    scatter = np.sum((block - block.mean(axis=1, keepdims=True)) ** 2, axis=(1, 2))
    change = block[:, half:].mean(axis=1) - block[:, :half].mean(axis=1)  # (count, c)
    halves = np.sum(change**2, axis=1) / (1.0 / half + 1.0 / (window - half))
    freedom = np.maximum(used, 1.0)
    with np.errstate(invalid="ignore"):  # NaN is not below the limit
        calm = scatter < test.scatter_margin * chdtri(freedom * (window - 1.0), test.false_alarm)
        steady = halves < test.halves_margin * chdtri(freedom, test.false_alarm)
    return np.asarray(calm & steady & (used > 0), dtype=np.bool_)


def begins_still(readings: NDArray[np.float64], noise_std: NDArray[np.float64], period: float) -> bool:
    """Return whether the first block of readings (n, c), m/s², is still."""
    test = RestTest()
    first = readings[: test.window(period)]
    return bool(np.any(still_blocks(first, noise_std, period, test.of_start)))


def constant_readings(
    array: AccelerometerArray, readings: ArrayLike, noise_std: ArrayLike, period: float
) -> NDArray[np.bool_]:
    """Return which samples lie in a still block, shape (n,); False in an incomplete last block.

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
    """
    rows = np.asarray(readings, dtype=float)
    noise = np.broadcast_to(np.asarray(noise_std, dtype=float), (array.n_channels,))
    still = still_blocks(rows, noise, period)
    window = RestTest().window(period)
    return np.append(np.repeat(still, window), np.zeros(len(rows) - len(still) * window, dtype=bool))
