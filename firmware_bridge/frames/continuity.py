"""Does a sample go on from the one before? A check beyond the checksum, which one in 65,536 pieces of junk passes."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Continuity"]

_MOST_MISSING = 15  # samples lost in a row after which the next one is believed without another that follows it


class Continuity:
    """Lets those samples pass that go on from others.

    A sample follows another if its sequence number is at most 16 further and its time stamp further by no more than
    that many of the longest periods. A sample passes if it follows the last that passed, or if the next one follows it:
    so after a start, a restart or a long gap the first sample waits for the second. The first packet of a stream passes
    at once if no byte was skipped before it. Junk that passes the checksum has random numbers; with a sequence number
    of 16 bits and a clock of 32 bits at 1 MHz it follows with a probability of 1e-7.

    Parameters
    ----------
    sequence, clock : tuple of (str, int)
        Fields of the packets, unsigned integers that wrap, and their largest values; no sequence number where its field
        is empty: then the time stamp alone decides.
    longest_period_ticks : float
        Longest sample period, in ticks of the clock.

    Attributes
    ----------
    refused : int
        Samples that passed the checksum and followed nothing.
    """

    def __init__(self, sequence: tuple[str, int], clock: tuple[str, int], longest_period_ticks: float) -> None:
        self._sequence, self._clock = sequence, clock
        self._longest = 1.1 * longest_period_ticks  # the board's clock against its nominal rate, and jitter
        self._last: NDArray[Any] | None = None
        self._waiting: NDArray[Any] | None = None
        self.refused = 0

    def admit(self, packets: NDArray[Any], *, trust_first: bool) -> NDArray[Any]:
        """Return those packets, shape (m,), of the next (n,) of a stream and of one kept before that pass.

        Parameters
        ----------
        packets : ndarray, shape (n,)
            Samples in the order in which they came.
        trust_first : bool
            Whether the first packet of the stream passes at once.
        """
        if not len(packets):
            return packets
        is_first = self._last is None and self._waiting is None
        rows = packets if self._waiting is None else np.concatenate([self._waiting, packets])
        linked = np.empty(len(rows), dtype=bool)
        linked[1:] = self._follows(rows[:-1], rows[1:])
        linked[0] = trust_first if is_first else self._goes_on(rows[:1])
        self._waiting = None
        if linked.all():
            self._last = rows[-1:]
            return rows
        passes = np.ones(len(rows), dtype=bool)
        bounds = [0, *(1 + np.flatnonzero(~linked[1:])).tolist(), len(rows)]
        for begin, end in pairwise(bounds):  # chains of samples, each of which follows the one before
            if end - begin == 1 and not (linked[begin] or self._goes_on(rows[begin:end])):
                passes[begin] = False
                if end == len(rows):
                    self._waiting = rows[begin:end]
                else:
                    self.refused += 1
            else:
                self._last = rows[end - 1 : end]
        return rows[passes]

    def finish(self) -> None:
        """Refuse a sample that still waits for another, at the end of the stream or where the connection was lost."""
        self.refused += self._waiting is not None
        self._waiting = None

    def _goes_on(self, row: NDArray[Any]) -> bool:
        """Whether a sample, shape (1,), follows the last that passed."""
        return self._last is not None and bool(self._follows(self._last, row)[0])

    def _follows(self, earlier: NDArray[Any], later: NDArray[Any]) -> NDArray[np.bool_]:
        """Whether each of the later samples, shape (n,), follows the earlier one."""
        span = _step(earlier, later, *self._clock)
        if not self._sequence[0]:
            return np.asarray((span > 0) & (span <= (1 + _MOST_MISSING) * self._longest))
        step = _step(earlier, later, *self._sequence)
        return np.asarray((step >= 1) & (step <= 1 + _MOST_MISSING) & (span > 0) & (span <= step * self._longest))


def _step(earlier: NDArray[Any], later: NDArray[Any], field: str, mask: int) -> NDArray[np.int64]:
    """By how much a field that wraps has grown, shape (n,)."""
    return np.asarray((later[field].astype(np.int64) - earlier[field].astype(np.int64)) & mask)
