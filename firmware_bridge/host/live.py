"""A look at a recording while it is made: the angular rate from the filter, as a line of text and in rerun."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from firmware_bridge.frames.decoder import StreamCounts
from firmware_bridge.host.recorder import Batch
from gfimu.errors import GfimuError
from gfimu.files.rerun_stream import rrd_stream, viewer_stream
from gfimu.geometry.array import AccelerometerArray

if TYPE_CHECKING:  # imported by the view's own thread: that takes longer than a recording should wait
    from gfimu.integrity.fault import ChannelFault
    from gfimu.integrity.live.watched_filter import WatchedRateFilter

__all__ = ["LiveView", "StreamPicture"]

_VIEW_HZ = 100.0
_TEXT_EVERY_S = 0.25
_APPLICATION = "gfimu_record"
_FLUSH_S = 5.0
_LANE = 0.7  # numerical: height of a lane


class StreamPicture(Protocol):
    """What draws a stream beside its plain lines: the array and its readings, say (`gfimu.visual.live`)."""

    def open(self, stream: Any) -> None:
        """Send what does not change, before any reading."""
        ...

    def add(self, stream: Any, times: Any, readings: NDArray[np.float64]) -> None:
        """Send readings (n, c), m/s², at the times of a rerun time column."""
        ...


class LiveView:
    """Is given each batch of a recording; estimates the rate at up to 100 Hz, in a thread of its own.

    The recording never waits for the view: the filter is compiled on first use, which takes a while. If the recording
    begins with a rest, channels that contradict the others are reported and left out of the rate, not of the recording.

    Parameters
    ----------
    array : AccelerometerArray
        The array.
    lsb : float
        Size of a count, m/s².
    on_text : callable, optional
        Is given a line of text a few times a second.
    on_fault : callable, optional
        Is given a sentence when a channel is found faulty, or used again.
    rrd : Path, optional
        Write a rerun recording when the view is closed.
    viewer : bool
        Open the rerun viewer, which listens to this machine only, and send to it.
    picture : StreamPicture, optional
        Draws the array and its readings.
    """

    def __init__(
        self,
        array: AccelerometerArray,
        lsb: float,
        *,
        on_text: Callable[[str], None] | None = None,
        on_fault: Callable[[str], None] | None = None,
        rrd: Path | None = None,
        viewer: bool = False,
        picture: StreamPicture | None = None,
    ) -> None:
        self._array, self._lsb, self._on_text, self._on_fault = array, lsb, on_text, on_fault
        self._filter: WatchedRateFilter | None = None
        self._picture, self._without_rate = picture, ""
        self._sum = np.zeros(array.n_channels)
        self._times: list[float] = []
        self._group = 0
        self._text_at = 0.0
        self._seen = 0
        self._first_s: float | None = None
        self._ended = ""
        self.omega = np.full(3, np.nan)
        self._open = ExitStack()
        self._streams: list[Any] = [] if rrd is None else [self._open.enter_context(rrd_stream(rrd, _APPLICATION))]
        if viewer:
            self._streams.append(viewer_stream(_APPLICATION))
            self._open.callback(_flush, self._streams[-1])
        if picture is not None:
            for stream in self._streams:
                picture.open(stream)
        self._batches: queue.SimpleQueue[tuple[Batch, StreamCounts] | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._work, name="live view", daemon=True)
        self._thread.start()

    def __call__(self, batch: Batch, counts: StreamCounts) -> None:
        """Take one batch and the totals so far; returns at once."""
        self._batches.put((batch, counts))

    def _work(self) -> None:
        while (item := self._batches.get()) is not None:
            if self._ended:
                continue
            try:
                self._show(*item)
            except OSError as error:  # a full disk: the recording goes on as far as it can, and says so first
                self._ended = f"the live view ended after {self._seen} samples: {error}"

    def _show(self, batch: Batch, counts: StreamCounts) -> None:
        if self._first_s is None:
            self._first_s = float(batch.t_s[0])
        self._seen += len(batch.t_s)
        if self._group == 0:
            span = float(batch.t_s[-1] - batch.t_s[0])
            if len(batch.t_s) < 2 or span <= 0:
                return
            rate = (len(batch.t_s) - 1) / span
            self._group = max(1, round(rate / _VIEW_HZ))
            shown = rate / self._group
            try:
                self._filter = _watched_filter(self._array, float(shown))
            except GfimuError as error:  # an array that can't see all six motions still has readings
                self._without_rate = f"no rate: {error}"
        times, readings = self._averaged(batch)
        if not len(times):
            return
        omega = self._estimate(times, readings)
        self._report_faults()
        for stream in self._streams:
            _log(stream, self._array, times, readings, omega)
            if self._filter is not None and (health := self._filter.health) is not None:
                _log_health(stream, self._array, times, health)
            if self._picture is not None:
                import rerun as rr

                self._picture.add(stream, rr.TimeColumn("t", duration=times), readings)
        now = time.monotonic()
        if self._on_text is not None and now - self._text_at >= _TEXT_EVERY_S:
            self._text_at = now
            self._on_text(self._line(batch, counts))

    def _averaged(self, batch: Batch) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Means over groups of samples: times (m,) and readings (m, c), m/s²."""
        times, readings = [], []
        for t, row in zip(batch.t_s.tolist(), batch.counts * self._lsb, strict=True):
            self._sum += row
            self._times.append(t)
            if len(self._times) == self._group:
                times.append(sum(self._times) / self._group)
                readings.append(self._sum / self._group)
                self._sum = np.zeros(self._array.n_channels)
                self._times.clear()
        return np.array(times), np.array(readings).reshape(-1, self._array.n_channels)

    def _estimate(self, times: NDArray[np.float64], readings: NDArray[np.float64]) -> NDArray[np.float64]:
        """Angular rate (m, 3) as far as it is ready, rad/s; the newest is kept."""
        if self._filter is None:
            return np.empty((0, 3))
        try:
            result = self._filter.push(times, readings)
        except GfimuError:
            return np.empty((0, 3))
        if len(result.omega):
            self.omega = result.omega[-1]
        return result.omega

    def _report_faults(self) -> None:
        """Pass on the faults of channels that were found, measured, or are over."""
        for event in [] if self._filter is None else self._filter.take_events():
            if self._on_fault is not None and event.fault is not None:
                self._on_fault(f"{event.text} (at {event.t_s:.1f} s on the board's clock)")

    @property
    def faults(self) -> tuple[ChannelFault, ...]:
        """Faults of channels that were found so far; times on the board's clock."""
        return () if self._filter is None else self._filter.watch.faults

    def _line(self, batch: Batch, counts: StreamCounts) -> str:
        elapsed = float(batch.t_s[-1]) - (self._first_s or 0.0)
        rate = self._seen / elapsed if elapsed > 0 else 0.0
        omega = " ".join(f"{value:+7.3f}" for value in self.omega)
        motion = self._without_rate or f"ω {omega} rad/s"
        return f"{elapsed:8.1f} s  {rate:6.1f} Hz  lost {counts.lost}  corrupt {counts.corrupt}  {motion}"

    def close(self, *, keep: bool = True) -> None:
        """Show what still waits, and write the rerun recording if it is to be kept.

        Raises
        ------
        WriteError
            If it can't be written.
        """
        self._batches.put(None)
        self._thread.join()
        if keep:
            if self._ended and self._on_fault is not None:
                self._on_fault(self._ended)
            self._open.close()
        else:
            self._open.pop_all()


def _watched_filter(array: AccelerometerArray, rate: float) -> WatchedRateFilter:
    """Return a filter for a sample rate, Hz, that watches its channels."""
    from gfimu.integrity.live.channel_watch import LiveWatch
    from gfimu.integrity.live.watched_filter import WatchedRateFilter
    from gfimu.rate.live import LiveRateFilter
    from gfimu.rate.sensing import SensorErrors

    errors, period = SensorErrors.from_parts(array, rate), 1.0 / rate
    watch = LiveWatch(array, errors.with_part_gains(array), period)  # raw counts: nothing is calibrated
    return WatchedRateFilter(LiveRateFilter(array, errors, period), watch)


def _flush(stream: Any) -> None:
    """Send what still waits; a viewer that was closed meanwhile is no fault of the recording."""
    with suppress(RuntimeError):
        stream.flush(timeout_sec=_FLUSH_S)


def _log_health(stream: Any, array: AccelerometerArray, times: NDArray[np.float64], health: list[int]) -> None:
    """Send the health of each channel at the newest time, in a lane for each, the first at the top.

    A line stands at the bottom of its lane while the channel is used, in the middle in doubt, at the top when not used.
    """
    import rerun as rr

    from gfimu.integrity.fault import HealthCode

    index = [rr.TimeColumn("t", duration=times[-1:])]
    for lane, (channel, code) in enumerate(zip(array.channels, health, strict=True)):
        height = {HealthCode.USED: 0.0, HealthCode.DOUBTED: 0.5}.get(HealthCode(code), 1.0)
        place = _LANE * height - lane
        rr.send_columns(f"health/{channel}", index, rr.Scalars.columns(scalars=[place]), recording=stream)


def _log(
    stream: Any,
    array: AccelerometerArray,
    times: NDArray[np.float64],
    readings: NDArray[np.float64],
    omega: NDArray[np.float64],
) -> None:
    """Send a batch to rerun, by columns."""
    import rerun as rr

    index = [rr.TimeColumn("t", duration=times)]
    for place, channel in enumerate(array.channels):
        rr.send_columns(f"readings/{channel}", index, rr.Scalars.columns(scalars=readings[:, place]), recording=stream)
    if len(omega):
        late = [rr.TimeColumn("t", duration=times[-len(omega) :] if len(omega) <= len(times) else times)]
        shown = omega[-len(times) :]
        for place, axis in enumerate("xyz"):
            rr.send_columns(f"omega/{axis}", late, rr.Scalars.columns(scalars=shown[:, place]), recording=stream)
