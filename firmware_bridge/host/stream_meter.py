"""What a stream of batches amounts to: means over groups of samples, how many come, how late, and what is missing."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from firmware_bridge.frames.decoder import StreamCounts

if TYPE_CHECKING:
    from gfimu.rate.health.live.block import StreamState

__all__ = ["GroupMeans", "StreamMeter"]

_GAP = 1.5  # sample periods, above which samples were lost
_COUNT_OVER_S = 1.0  # numerical: samples per second are counted over it
_LEAST_DELAY_OVER_S = 60  # numerical: clocks of board and host that differ by 100 ppm part by 6 ms in it


class GroupMeans:
    """Means over groups of samples that follow each other without a gap.

    Parameters
    ----------
    size : int
        Samples in a group.
    period : float
        Sample period, s.
    limits : ndarray, shape (c,)
        Readings from which on a channel is saturated, m/s².

    Attributes
    ----------
    saturated : ndarray of bool, shape (m, c)
        Of the groups returned last: whether one of their readings was saturated.
    """

    def __init__(self, size: int, period: float, limits: NDArray[np.float64]) -> None:
        self._size, self._period, self._limits = size, period, limits
        self._t = np.empty(0)
        self._readings = np.empty((0, len(limits)))
        self.saturated = np.zeros((0, len(limits)), dtype=np.bool_)

    def add(
        self, t: NDArray[np.float64], readings: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Take samples (n,), s, and (n, c), m/s²; return the groups that are full: times (m,) and means (m, c).

        A group that a gap interrupts is left out. A mean is NaN where one of its readings is missing.
        """
        times, rows = np.concatenate([self._t, t]), np.concatenate([self._readings, readings])
        starts = np.flatnonzero(np.diff(times, prepend=-np.inf) > _GAP * self._period)
        ends = np.append(starts[1:], len(times))
        places = [np.arange(start, end - self._size + 1, self._size) for start, end in zip(starts, ends, strict=True)]
        first = np.concatenate(places) if places else np.empty(0, dtype=int)  # of each group
        used = int(first[-1]) + self._size if len(first) else 0
        rest = max(used, int(starts[-1])) if len(starts) else 0
        members = first[:, None] + np.arange(self._size)  # (m, size)
        self._t, self._readings = times[rest:], rows[rest:]
        grouped = rows[members]  # (m, size, c)
        self.saturated = (np.abs(grouped) >= self._limits).any(axis=1)
        return times[members].mean(axis=1), grouped.mean(axis=1)


class StreamMeter:
    """Counts what comes, and how late it does.

    Attributes
    ----------
    samples : int
        Samples so far.
    newest_s : float
        Board time of the newest sample, s.
    """

    def __init__(self) -> None:
        self.samples = 0
        self.newest_s = 0.0
        self._first_s: float | None = None
        self._lost = self._corrupt = 0
        self._delay_s = 0.0
        self._totals: deque[tuple[float, int]] = deque()  # host time, samples so far
        self._least: deque[tuple[int, float]] = deque(maxlen=_LEAST_DELAY_OVER_S)  # second, host minus board time

    def add(self, t: NDArray[np.float64], counts: StreamCounts, host_s: float) -> None:
        """Take the times (n,), s, of a batch that was there at ``host_s``, and the totals up to it."""
        self.newest_s = float(t[-1])
        self._first_s = float(t[0]) if self._first_s is None else self._first_s
        self.samples += len(t)
        self._lost, self._corrupt = counts.lost, counts.corrupt
        apart = host_s - self.newest_s
        second = int(host_s)
        if self._least and self._least[-1][0] == second:
            self._least[-1] = (second, min(self._least[-1][1], apart))
        else:
            self._least.append((second, apart))
        self._delay_s = apart - min(least for _, least in self._least)
        self._totals.append((host_s, self.samples))
        while len(self._totals) > 2 and host_s - self._totals[1][0] >= _COUNT_OVER_S:
            self._totals.popleft()

    @property
    def elapsed_s(self) -> float:
        """Board time since the first sample, s."""
        return self.newest_s - (self.newest_s if self._first_s is None else self._first_s)

    def state(self, behind_s: float) -> StreamState:
        """Return the state of the stream; ``behind_s`` is what the rate filter has still to do, s."""
        from gfimu.rate.health.live.block import StreamState

        (begin_s, before), (end_s, after) = self._totals[0], self._totals[-1]
        rate = (after - before) / (end_s - begin_s) if end_s - begin_s >= _COUNT_OVER_S else np.nan
        return StreamState(self.newest_s, rate, self._lost, self._corrupt, self._delay_s, behind_s)
