"""The rate filter on a stream whose channels are watched: a faulty one is left out from before its onset on."""

from __future__ import annotations

import copy
from collections import deque
from dataclasses import replace
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.rate.health.live.channel_watch import HealthEvent, LiveWatch
from gfimu.rate.health.start import Settling
from gfimu.rate.live import LiveRateFilter
from gfimu.rate.result import ChannelReport, RateEstimate
from gfimu.rate.sensing import SensorErrors

__all__ = ["WatchedRateFilter"]

_KEEP_EVERY_S = 1.0  # numerical: between states of the filter that can be gone back to


class _Samples(NamedTuple):
    """Samples that may be filtered again."""

    t: NDArray[np.float64]  # (n,)
    readings: NDArray[np.float64]  # (n, c), NaN where not used
    masked: NDArray[np.bool_]  # (n, c) left out although there is a reading
    gyro: NDArray[np.float64] | None  # (n, 3)


class _Kept(NamedTuple):
    """The filter before a sample."""

    t_s: float
    live: LiveRateFilter
    left_out: NDArray[np.int64]  # (c,) readings left out so far


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
        self._left_out = np.zeros(live.array.n_channels, dtype=np.int64)
        self._states: deque[_Kept] = deque()
        self._samples: deque[_Samples] = deque()
        self._events: list[HealthEvent] = []
        self._settling = Settling(live.period, watch.policy)
        self._ask_at = -np.inf

    @classmethod
    def of(cls, live: LiveRateFilter, errors: SensorErrors, *, calibrated: bool = False, at_rest: bool = True) -> Self:
        """Return a filter with the watch for its sensors' errors, to which the gains of uncalibrated parts belong."""
        stated = errors if calibrated else errors.with_part_gains(live.array)
        return cls(live, LiveWatch(live.array, stated, live.period, at_rest=at_rest))

    @property
    def live(self) -> LiveRateFilter:
        """The filter as it is now."""
        return self._live

    @property
    def report(self) -> ChannelReport:
        """What was wrong with the channels so far; readings that the watch left out are not missing."""
        report = self._live.report
        if not self._left_out.any():
            return report
        counts = dict(zip(self._live.array.channels, self._left_out.tolist(), strict=True))
        missing = {name: count - counts[name] for name, count in report.missing.items() if count > counts[name]}
        return replace(report, missing=missing)

    @property
    def health(self) -> list[int] | None:
        """Health of each channel now (`gfimu.rate.health.fault.HealthCode`); None while nothing is watched."""
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
        masked = ~self.watch.watched & np.isfinite(rows)
        used = np.where(masked, np.nan, rows)
        if len(times):
            self._keep_state(float(times[0]))
        found = self._live.push(times, used, turning)
        self._left_out += masked.sum(axis=0)
        if len(times):
            self._keep_samples(_Samples(times, used, masked, turning))
        events = self.watch.push(times, rows)
        self._events += events
        if len(found) and self.watch.possible and not self.watch.active:
            self._settling.add(found)
        if self.watch.in_motion and len(found) and self.watch.possible and not self.watch.active:
            self._begin_in_motion(float(found.t_s[-1]))
        onsets = [event.fault.onset_s for event in events if event.event == "excluded" and event.fault is not None]
        if onsets:
            self._again(min(onsets) - self.watch.margin_s)
        return found

    def finish(self) -> RateEstimate:
        """Return the estimates of the last samples."""
        return self._live.finish()

    def _begin_in_motion(self, now: float) -> None:
        """Begin to watch behind the newest estimate, if the filter has settled; asked every second."""
        if now < self._ask_at:
            return
        self._ask_at = now + _KEEP_EVERY_S
        start = self._settling.start(self._live)
        if start is None:
            return
        before = np.concatenate([samples.readings[samples.t <= now] for samples in self._samples])
        self._events.append(self.watch.begin_in_motion(start, now, before))
        for samples in self._samples:
            later = samples.t > now
            if later.any():
                self._events += self.watch.push(samples.t[later], samples.readings[later])

    def _keep_state(self, now: float) -> None:
        """Keep the filter's state now and then, before a sample at a time, as long as a fault may have begun there."""
        if not self.watch.possible:
            self._states.clear()
        elif not self._states or now - self._states[-1].t_s >= _KEEP_EVERY_S:
            self._states.append(_Kept(now, copy.deepcopy(self._live), self._left_out.copy()))
            oldest = now - self.watch.policy.oldest_s - 2.0 * _KEEP_EVERY_S
            while len(self._states) > 2 and self._states[1].t_s < oldest:
                self._states.popleft()

    def _keep_samples(self, samples: _Samples) -> None:
        """Keep samples that were filtered, from the oldest state on."""
        if not self.watch.possible:
            self._samples.clear()
            return
        self._samples.append(samples)
        while len(self._samples) > 1 and self._samples[1].t[0] <= self._states[0].t_s:
            self._samples.popleft()

    def _again(self, since: float) -> None:
        """Filter the samples since a time again, without the channels that are excluded now."""
        while len(self._states) > 1 and self._states[-1].t_s > since:
            self._states.pop()
        kept, parts = self._states[-1], list(self._samples)
        times = np.concatenate([part.t for part in parts])
        rows, masked = (np.concatenate([part[place] for part in parts]) for place in (1, 2))
        gyro = None if parts[0].gyro is None else np.concatenate([part.gyro for part in parts if part.gyro is not None])
        new = (times >= since)[:, None] & ~self.watch.watched & np.isfinite(rows)
        rows[new] = np.nan
        masked = masked | new
        self._samples = deque([_Samples(times, rows, masked, gyro)])
        again = times >= kept.t_s
        self._live = copy.deepcopy(kept.live)
        self._left_out = kept.left_out + masked[again].sum(axis=0)
        self._live.push(times[again], rows[again], None if gyro is None else gyro[again])
