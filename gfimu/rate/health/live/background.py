"""The watched rate filter in a thread of its own: samples go in at once, estimates come out when they are ready.

On first use the filter is compiled, which takes about a minute. Whoever feeds it does not wait: the samples queue up,
and the filter catches up.
"""

from __future__ import annotations

import queue
import threading
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import GfimuError
from gfimu.rate.first_call import must_compile
from gfimu.rate.health.fault import ChannelFault, HealthCode
from gfimu.rate.health.live.block import Health
from gfimu.rate.health.live.channel_watch import HealthEvent
from gfimu.rate.health.live.watched_filter import WatchedRateFilter
from gfimu.rate.live import LiveRateFilter
from gfimu.rate.result import RateEstimate
from gfimu.rate.sensing import SensorErrors

__all__ = ["BackgroundFilter", "Filtered"]

_MOST_AT_ONCE = 50  # numerical: samples in a block, so that a fault found behind a backlog is dated as without one


class Filtered(NamedTuple):
    """What a block of samples came to."""

    rate: RateEstimate
    """Estimates that became ready."""
    events: list[HealthEvent]
    """What changed in the health of the channels."""
    health: Health
    """Health of the channels in the block."""


class BackgroundFilter:
    """Filters a stream of raw, uncalibrated samples in the background, and watches its channels.

    Parameters
    ----------
    array : AccelerometerArray
        An array that sees all six motions, with c channels.
    sample_rate : float
        Nominal sample rate, Hz.

    Raises
    ------
    GeometryError
        If the array can't see all six motions.
    """

    def __init__(self, array: AccelerometerArray, sample_rate: float) -> None:
        errors, period = SensorErrors.from_parts(array, sample_rate), 1.0 / sample_rate
        self._filter = WatchedRateFilter.of(LiveRateFilter(array, errors, period), errors)
        self.must_compile = must_compile()
        self._samples: queue.SimpleQueue[tuple[NDArray[Any], ...] | None] = queue.SimpleQueue()
        self._done: queue.SimpleQueue[Filtered] = queue.SimpleQueue()
        self._given_s = self._done_s = np.nan
        self._abandoned = False
        self._failure: OSError | None = None
        self._thread = threading.Thread(target=self._work, name="rate filter", daemon=True)
        self._thread.start()

    def push(self, t: NDArray[np.float64], readings: NDArray[np.float64], saturated: NDArray[np.bool_]) -> None:
        """Give samples: times (n,), s, readings (n, c), m/s², NaN where missing, and which of them are saturated.

        Returns at once. A saturated reading is not used.
        """
        if np.isnan(self._done_s):
            self._done_s = float(t[0])
        self._given_s = float(t[-1])
        for first in range(0, len(t), _MOST_AT_ONCE):
            part = slice(first, first + _MOST_AT_ONCE)
            self._samples.put((t[part], readings[part], saturated[part]))

    def take(self) -> list[Filtered]:
        """Return what was done since this was asked last.

        Raises
        ------
        OSError
            If the filter could not go on: the disk is full where its compiled code is kept, say.
        """
        if self._failure is not None:
            raise self._failure
        found = []
        while not self._done.empty():
            found.append(self._done.get())
        return found

    @property
    def behind_s(self) -> float:
        """Time of the stream that is not filtered yet, s."""
        return 0.0 if np.isnan(self._given_s) else self._given_s - self._done_s

    @property
    def faults(self) -> tuple[ChannelFault, ...]:
        """Faults of channels that were found so far; times on the stream's clock."""
        return self._filter.watch.faults

    def finish(self) -> None:
        """Wait until all samples are filtered."""
        self._samples.put(None)
        while self._thread.is_alive() and not self._abandoned:
            self._thread.join(0.1)

    def abandon(self) -> None:
        """Filter no further, and let `finish` return."""
        self._abandoned = True

    def _work(self) -> None:
        try:
            while (block := self._samples.get()) is not None and not self._abandoned:
                self._filter_block(*block)
        except OSError as error:
            self._failure = error

    def _filter_block(
        self, t: NDArray[np.float64], readings: NDArray[np.float64], saturated: NDArray[np.bool_]
    ) -> None:
        try:
            rate = self._filter.push(t, np.where(saturated, np.nan, readings))
        except GfimuError:  # a time that goes back: the block is left out
            return
        watched = self._filter.health
        codes: list[HealthCode | None] = [None] * readings.shape[1]
        if watched is not None:
            codes = [HealthCode(code) for code in watched]
        for code, marks in ((HealthCode.SATURATED, saturated), (HealthCode.MISSING, np.isnan(readings))):
            for column in np.flatnonzero(marks.any(axis=0)):
                codes[column] = code
        self._done.put(Filtered(rate, self._filter.take_events(), Health(float(t[0]), tuple(codes))))
        self._done_s, self.must_compile = float(t[-1]), False
