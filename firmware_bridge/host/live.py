"""A look at a recording while it is made: the angular rate from the filter, as a line of text and in rerun."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from firmware_bridge.frames.decoder import StreamCounts
from firmware_bridge.host.recorder import Batch
from firmware_bridge.host.stream_meter import GroupMeans, StreamMeter
from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import GfimuError
from gfimu.base.files.rerun_stream import rrd_stream

if TYPE_CHECKING:  # imported by the view's own thread: that takes longer than a recording should wait
    from gfimu.rate.health.fault import ChannelFault
    from gfimu.rate.health.live.background import BackgroundFilter
    from gfimu.rate.health.live.block import Event, LiveBlock

__all__ = ["LiveView", "StreamDrawing", "StreamPicture"]

_VIEW_HZ = 100.0
"""Most samples per second that are filtered and drawn; of a faster stream means over groups."""

_LOOK_EVERY_S = 0.1  # numerical: between looks at what came, and pictures to a viewer
_FILE_EVERY_S = 1.0  # numerical: between pictures to a file, which nobody looks at yet
_TEXT_EVERY_S = 0.25  # numerical
_VIEWER_EVERY_S = 1.0  # numerical: between looks whether the viewer is still there
_FIRST_SAMPLES = 4  # from which the sample rate is found
_CATCHING_UP_S = 1.0  # the rate is said to be behind from here on
_APPLICATION = "gfimu_record"
_COMPILES = "the filter is compiled on first use, about a minute; the recording goes on"
_FLUSH_S = 5.0


class StreamDrawing(Protocol):
    """A picture on one rerun stream."""

    def add(self, block: LiveBlock) -> None:
        """Draw what came."""
        ...


class Viewer(Protocol):
    """Shows a rerun stream on this machine (`gfimu.visual.viewer`)."""

    def viewer_stream(self, application: str) -> Any:
        """Return a stream to the viewer; one is started unless it is there."""
        ...

    def viewer_listens(self) -> bool:
        """Whether the viewer is still there."""
        ...


class StreamPicture(Protocol):
    """Draws an array, its readings, rate and health in rerun (`gfimu.visual.live`)."""

    def open(self, stream: Any) -> StreamDrawing:
        """Send what does not change, and return what draws the rest."""
        ...


class LiveView:
    """Is given each batch of a recording; estimates the rate at up to 100 Hz, in threads of its own.

    The recording never waits for the view. On first use the filter is compiled, which takes a while: readings and state
    of the stream are shown meanwhile, and the rate follows. If the recording begins with a rest, channels that
    contradict the others are reported and left out of the rate, not of the recording.

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
    on_note : callable, optional
        Is given a sentence on the view itself: that the filter is being compiled, that a viewer was closed.
    picture : StreamPicture, optional
        Draws what comes, for a file or a viewer.
    rrd : Path, optional
        Write the picture as a rerun recording when the view is closed.
    viewer : Viewer, optional
        Shows the picture while it is drawn.

    Raises
    ------
    GfimuError
        If the viewer does not start.
    """

    def __init__(
        self,
        array: AccelerometerArray,
        lsb: float,
        *,
        on_text: Callable[[str], None] | None = None,
        on_fault: Callable[[str], None] | None = None,
        on_note: Callable[[str], None] | None = None,
        picture: StreamPicture | None = None,
        rrd: Path | None = None,
        viewer: Viewer | None = None,
    ) -> None:
        self._array, self._lsb = array, lsb
        self._on_text, self._on_fault, self._on_note = on_text, on_fault, on_note
        self._filter: BackgroundFilter | None = None
        self._means: GroupMeans | None = None
        self._meter = StreamMeter()
        self._without_rate = ""
        self._text_at = 0.0
        self._ended = ""
        self._is_last = False  # nothing comes any more
        self.omega = np.full(3, np.nan)
        self._open = ExitStack()
        self._sinks: list[_Sink] = []
        self._viewer = viewer
        self._shown: Any = None  # its stream, while it is there
        if viewer is not None and picture is not None:
            self._shown = viewer.viewer_stream(_APPLICATION)
            self._sinks.append(_Sink(picture.open(self._shown), _LOOK_EVERY_S))
        if rrd is not None and picture is not None:
            stream = self._open.enter_context(rrd_stream(rrd, _APPLICATION))
            self._sinks.append(_Sink(picture.open(stream), _FILE_EVERY_S))
        self._viewer_seen_at = time.monotonic()
        self._arrivals: queue.SimpleQueue[tuple[Batch, StreamCounts, float] | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._work, name="live view", daemon=True)
        self._thread.start()

    def __call__(self, batch: Batch, counts: StreamCounts) -> None:
        """Take one batch and the totals so far; returns at once."""
        self._arrivals.put((batch, counts, time.monotonic()))

    def _work(self) -> None:
        try:
            self._follow()
        except OSError as error:  # a full disk: the recording goes on as far as it can, and says so first
            self._ended = f"the live view ended after {self._meter.samples} samples: {error}"
            while not self._is_last:
                self._gather([])

    def _follow(self) -> None:
        """Look at what comes, now and then, until nothing comes any more and all of it is filtered."""
        waiting: list[tuple[Batch, StreamCounts, float]] = []
        while not self._is_last:
            self._gather(waiting)
            if waiting and (self._means is not None or sum(len(one.t_s) for one, _, _ in waiting) >= _FIRST_SAMPLES):
                self._look(waiting)
                waiting.clear()
        if self._filter is not None:
            self._filter.finish()
            self._draw(np.empty(0), np.empty((0, self._array.n_channels)), [])
        for sink in self._sinks:
            sink.flush()

    def _gather(self, waiting: list[tuple[Batch, StreamCounts, float]]) -> None:
        """Gather what comes until the next look is due, or nothing comes any more."""
        due = time.monotonic() + _LOOK_EVERY_S
        with suppress(queue.Empty):
            while not self._is_last and (left := due - time.monotonic()) > 0:
                item = self._arrivals.get(timeout=left)
                if item is None:
                    self._is_last = True
                else:
                    waiting.append(item)

    def _look(self, arrivals: list[tuple[Batch, StreamCounts, float]]) -> None:
        """Filter and draw what came."""
        times = np.concatenate([batch.t_s for batch, _, _ in arrivals])
        raw = self._lsb * np.concatenate([batch.counts for batch, _, _ in arrivals])
        for batch, counts, host_s in arrivals:
            self._meter.add(batch.t_s, counts, host_s)
        events = self._begin(times) if self._means is None else []
        assert self._means is not None
        t, readings = self._means.add(times, raw)
        if self._filter is not None and len(t):
            self._filter.push(t, readings, self._means.saturated)
        self._draw(t, readings, events)
        now = time.monotonic()
        if self._on_text is not None and now - self._text_at >= _TEXT_EVERY_S:
            self._text_at = now
            self._on_text(self._line())

    def _begin(self, times: NDArray[np.float64]) -> list[Event]:
        """Start the filter for the rate of the first samples; return what is to be said of it."""
        from gfimu.rate.health.live.background import BackgroundFilter
        from gfimu.rate.health.live.block import Event
        from gfimu.rate.sensing import SensorErrors

        rate = 1.0 / float(np.median(np.diff(times)))
        group = max(1, round(rate / _VIEW_HZ))
        self._means = GroupMeans(group, 1.0 / rate, SensorErrors.from_parts(self._array, rate).limits)
        shown = f"shown as means of {group}" if group > 1 else "all shown"
        said = [f"first sample of array {self._array.name}; {rate:.0f} samples per second, {shown}"]
        try:
            self._filter = BackgroundFilter(self._array, rate / group)
        except GfimuError as error:  # an array that can't see all six motions still has readings
            self._without_rate = f"no rate: {error}"
            said.append(self._without_rate)
        else:
            if self._filter.must_compile:
                said.append(_COMPILES)
                self._note(_COMPILES)
        return [Event(float(times[0]), text) for text in said]

    def _draw(self, t: NDArray[np.float64], readings: NDArray[np.float64], events: list[Event]) -> None:
        """Take what the filter has done, pass faults on, and hand all that is new to the pictures."""
        from gfimu.rate.health.live.block import Event, LiveBlock

        done = [] if self._filter is None else self._filter.take()
        for part in done:
            for event in part.events:
                events.append(Event(event.t_s, event.text, event.fault is not None))
                if self._on_fault is not None and event.fault is not None:
                    self._on_fault(f"{event.text} (at {event.t_s:.1f} s on the board's clock)")
        rates = [part.rate for part in done if len(part.rate)]
        if rates:
            self.omega = rates[-1].omega[-1]
        if not self._sinks:
            return
        behind = 0.0 if self._filter is None else self._filter.behind_s
        block = LiveBlock.of(t, readings, rates)
        block = replace(
            block, health=tuple(part.health for part in done), states=(self._meter.state(behind),), events=tuple(events)
        )
        self._look_for_viewer()
        for sink in self._sinks:
            sink.add(block)

    def _look_for_viewer(self) -> None:
        """Go on without a viewer that was closed."""
        now = time.monotonic()
        if self._viewer is None or self._shown is None or now - self._viewer_seen_at < _VIEWER_EVERY_S:
            return
        self._viewer_seen_at = now
        if not self._viewer.viewer_listens():
            self._shown = None
            del self._sinks[0]
            self._note("the viewer was closed; the recording goes on")

    def _note(self, text: str) -> None:
        if self._on_note is not None:
            self._on_note(text)

    @property
    def faults(self) -> tuple[ChannelFault, ...]:
        """Faults of channels that were found so far; times on the board's clock."""
        return () if self._filter is None else self._filter.faults

    def _line(self) -> str:
        state = self._meter.state(0.0)
        rate = "…" if np.isnan(state.rate_hz) else f"{state.rate_hz:.1f}"
        motion = self._without_rate or f"ω {' '.join(f'{value:+7.3f}' for value in self.omega)} rad/s"
        if self._filter is not None and self._filter.behind_s > _CATCHING_UP_S:
            why = "being compiled" if self._filter.must_compile else "catching up"
            motion = f"ω {self._filter.behind_s:.0f} s behind, {why}"
        counts = f"lost {state.lost}  corrupt {state.corrupt}"
        return f"{self._meter.elapsed_s:8.1f} s  {rate:>6} Hz  {counts}  {motion}"

    def close(self, *, keep: bool = True) -> None:
        """Show what still waits, and write the rerun recording if it is to be kept.

        Ctrl-C while the filter catches up leaves the rest of the rate out.

        Raises
        ------
        WriteError
            If it can't be written.
        """
        if not keep and self._filter is not None:
            self._filter.abandon()
        self._arrivals.put(None)
        try:
            self._thread.join(_CATCHING_UP_S)
            if self._thread.is_alive() and keep:
                self._note("the recording is complete; its rate is being caught up with, Ctrl-C leaves that out")
            self._thread.join()
        except KeyboardInterrupt:
            if self._filter is not None:
                self._filter.abandon()
            self._thread.join()
        if keep:
            if self._ended and self._on_fault is not None:
                self._on_fault(self._ended)
            _flush(self._shown)
            self._open.close()
        else:
            self._open.pop_all()


class _Sink:
    """A picture that is added to at its own pace, so that the number of pieces sent is bounded."""

    def __init__(self, drawing: StreamDrawing, every_s: float) -> None:
        self._drawing, self._every_s = drawing, every_s
        self._waiting: list[LiveBlock] = []
        self._sent_at = -np.inf

    def add(self, block: LiveBlock) -> None:
        """Take a block; draw it with what waits if the time has come."""
        self._waiting.append(block)
        if time.monotonic() - self._sent_at >= self._every_s:
            self.flush()

    def flush(self) -> None:
        """Draw what waits."""
        if self._waiting:
            self._drawing.add(type(self._waiting[0]).join(self._waiting))
            self._waiting.clear()
            self._sent_at = time.monotonic()


def _flush(stream: Any) -> None:
    """Send what still waits; a viewer that was closed meanwhile is no fault of the recording."""
    if stream is not None:
        with suppress(RuntimeError):
            stream.flush(timeout_sec=_FLUSH_S)
