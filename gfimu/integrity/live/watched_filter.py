"""The rate filter on a stream whose channels are watched: a faulty one is left out from before its onset on."""

from __future__ import annotations

import copy
from collections import deque
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.integrity.live.channel_watch import HealthEvent, LiveWatch
from gfimu.rate.live import LiveRateFilter
from gfimu.rate.result import ChannelReport, RateEstimate

__all__ = ["WatchedRateFilter"]

_KEEP_EVERY_S = 1.0  # numerical: between states of the filter that can be gone back to


class _Samples(NamedTuple):
    """Samples that may be filtered again."""

    t: NDArray[np.float64]  # (n,)
    readings: NDArray[np.float64]  # (n, c), NaN where not used
    gyro: NDArray[np.float64] | None  # (n, 3)


class WatchedRateFilter:
    """A `LiveRateFilter` that leaves out the channels which a `LiveWatch` excludes.

    A fault is found some time after its onset. Then the filter goes back to its state before the onset, or as far back
    as faults are followed, and filters the samples since then again without the channel. Estimates that were given
    meanwhile are not corrected; those that follow are as if the channel had not been used since.

    Parameters
    ----------
    live : LiveRateFilter
        The filter, before its first sample.
    watch : LiveWatch
        The watch.
    """

    def __init__(self, live: LiveRateFilter, watch: LiveWatch) -> None:
        self._live, self.watch = live, watch
        self._states: deque[tuple[float, LiveRateFilter]] = deque()  # with the time before which they were kept
        self._samples: deque[_Samples] = deque()
        self._events: list[HealthEvent] = []

    @property
    def live(self) -> LiveRateFilter:
        """The filter as it is now."""
        return self._live

    @property
    def report(self) -> ChannelReport:
        """What was wrong with the channels so far."""
        return self._live.report

    @property
    def health(self) -> list[int] | None:
        """Health of each channel now: 0 used, 1 in doubt, 2 not used; None while nothing is watched."""
        codes = self.watch.codes
        return None if codes is None else [int(code) for code in codes]

    def take_events(self) -> list[HealthEvent]:
        """Return what changed since this was asked last."""
        events, self._events = self._events, []
        return events

    def take_news(self) -> list[dict[str, Any]]:
        """Return what changed since this was asked last, as JSON can hold it."""
        return [event.to_dict() for event in self.take_events()]

    def push(self, t: ArrayLike, readings: ArrayLike, gyro: ArrayLike | None = None) -> RateEstimate:
        """Take one sample or a block, as `LiveRateFilter.push`."""
        times = np.atleast_1d(np.asarray(t, dtype=float))
        rows = np.atleast_2d(np.asarray(readings, dtype=float))
        turning = None if gyro is None else np.atleast_2d(np.asarray(gyro, dtype=float))
        used = np.where(self.watch.watched, rows, np.nan)
        self._keep(_Samples(times, used, turning))
        found = self._live.push(times, used, turning)
        events = self.watch.push(times, rows)
        self._events += events
        onsets = [event.fault.onset_s for event in events if event.event == "excluded" and event.fault is not None]
        if onsets:
            self._again(min(onsets) - self.watch.margin_s)
        return found

    def finish(self) -> RateEstimate:
        """Return the estimates of the last samples."""
        return self._live.finish()

    def _keep(self, samples: _Samples) -> None:
        """Keep samples, and now and then the filter's state, as long as a fault may be found in them."""
        if not self.watch.possible:
            self._states.clear()
            self._samples.clear()
        if not self.watch.possible or not len(samples.t):
            return
        now = float(samples.t[0])
        if not self._states or now - self._states[-1][0] >= _KEEP_EVERY_S:
            self._states.append((now, copy.deepcopy(self._live)))
        self._samples.append(samples)
        oldest = now - self.watch.policy.oldest_s - 2.0 * _KEEP_EVERY_S
        while len(self._states) > 2 and self._states[1][0] < oldest:
            self._states.popleft()
        while len(self._samples) > 1 and self._states and self._samples[1].t[0] <= self._states[0][0]:
            self._samples.popleft()

    def _again(self, since: float) -> None:
        """Filter the samples since a time again, without the channels that are excluded now."""
        kept = [number for number, (time, _) in enumerate(self._states) if time <= since] or [0]
        while len(self._states) > kept[-1] + 1:
            self._states.pop()
        start, state = self._states[-1]
        parts = list(self._samples)
        times, rows = np.concatenate([part.t for part in parts]), np.concatenate([part.readings for part in parts])
        gyro = None if parts[0].gyro is None else np.concatenate([part.gyro for part in parts if part.gyro is not None])
        rows[(times >= since)[:, None] & ~self.watch.watched] = np.nan
        self._samples = deque([_Samples(times, rows, gyro)])
        again = times >= start
        self._live = copy.deepcopy(state)
        self._live.push(times[again], rows[again], None if gyro is None else gyro[again])
