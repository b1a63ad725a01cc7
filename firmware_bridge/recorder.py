"""Recording from a port: bytes to samples to a file, with clocks, gaps and what the board says about itself."""

from __future__ import annotations

import math
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import gfimu
from firmware_bridge.clock import ClockFit, HostClock, SampleRate
from firmware_bridge.commands import Dialogue, Identity, Reply
from firmware_bridge.frames import FrameFormat, SampleDecoder, Samples, Status, StreamCounts, frame_format
from firmware_bridge.journal import Journal, JournalError
from firmware_bridge.link import Link
from gfimu.errors import GfimuError, InputError
from gfimu.files.outputs import RECORDING, check_outputs
from gfimu.geometry.array import AccelerometerArray
from gfimu.parts.part import Part
from gfimu.recording.carried_array import array_metadata

__all__ = ["Batch", "RecordReport", "SampleClock", "record"]

_FLUSH_S = 0.25
_SILENCE_S = 5.0
_ANSWER_S = 0.5  # samples wait so long for the board to tell their scale
_SETUP_ANSWER_S = 3.0  # and so long if they will be left out because the board was not set up yet
_IDENTIFY_EVERY_S = 1.0
_FIRST_ANSWERS = 2  # so many are asked for at that pace
_EXCHANGE_EVERY_S = 10.0  # then at this one


@dataclass(frozen=True)
class Batch:
    """Samples as they go to the file and to whoever looks on.

    Parameters
    ----------
    t_s : ndarray, shape (n,)
        Time on the board's clock, s; strictly increasing through the whole recording.
    counts : ndarray, shape (n, c)
        Full-resolution counts; NaN where a chip did not answer.
    status : ndarray, shape (n,)
        Status bits.
    """

    t_s: NDArray[np.float64]
    counts: NDArray[np.float64]
    status: NDArray[np.uint16]


@dataclass(frozen=True)
class RecordReport:
    """What was recorded.

    Parameters
    ----------
    path : Path
        The file.
    duration_s : float
        From the first to the last sample, board time, s.
    stream : StreamCounts
        Samples, lost, corrupt, skipped bytes, restarts of the board.
    breaks : int
        Times the connection was lost.
    clock : ClockFit or None
        Board clock against host clock.
    identity : Identity or None
        What the board said about itself.
    status_counts : dict of str to int
        Samples per status bit.
    faults : tuple of dict
        Faults of channels that a live view saw (`gfimu.integrity.fault.ChannelFault.entries`).
    """

    path: Path
    duration_s: float
    stream: StreamCounts
    breaks: int
    clock: ClockFit | None
    identity: Identity | None
    status_counts: dict[str, int] = field(default_factory=dict)
    faults: tuple[dict[str, Any], ...] = ()


class SampleClock:
    """Puts samples of all segments on one time axis that never goes back.

    Within a segment time is the board's own. After a restart of the board, or a break of the connection, the new
    segment is placed as much later as the host's clock says has passed: the gap shows in the file as it was.
    """

    def __init__(self, tick_hz: float) -> None:
        self._tick_hz = tick_hz
        self._segment: int | None = None
        self._origin_s = 0.0
        self._last_s = -np.inf
        self._last_host_s = 0.0

    def of(self, ticks: int) -> float:
        """Time of a board time in the newest segment, s."""
        return ticks / self._tick_hz + self._origin_s

    def place(self, samples: Samples, host_s: float) -> NDArray[np.float64]:
        """Return times (n,), s, of samples that were read at host time ``host_s``."""
        board = samples.ticks / self._tick_hz
        times = np.empty(len(board))
        for segment in np.unique(samples.segment).tolist():
            rows = samples.segment == segment
            mine = board[rows]
            if segment != self._segment:
                if self._segment is None:
                    self._origin_s = 0.0
                else:
                    behind = float(board[-1] - mine[0])  # the newest sample arrived just now
                    passed = max(host_s - behind - self._last_host_s, 0.0)
                    step = float(np.median(np.diff(mine))) if len(mine) > 1 else 1e-3
                    self._origin_s = self._last_s + max(passed, 2 * step) - float(mine[0])
                self._segment = segment
            times[rows] = mine + self._origin_s
            self._last_s = float(times[rows][-1])
            self._last_host_s = host_s - float(board[-1] - mine[-1])
        return times


class _Session:
    """State of one recording."""

    def __init__(
        self, form: FrameFormat, array: AccelerometerArray, out: Path, metadata: dict[str, Any], *, has_setup: bool
    ) -> None:
        self.decoder = SampleDecoder(form)
        self.clock = HostClock()
        self.times = SampleClock(form.clock_hz)
        self.rate = SampleRate(form.clock_hz)
        self.identity: Identity | None = None
        self.refused: list[Reply] = []
        self.answers = 0  # to the question who the board is
        self.journal: Journal | None = None
        self.first_s: float | None = None
        self.last_s = 0.0
        self.status_counts: dict[str, int] = {}
        self.waiting_for_board = form.dialogue is not None  # for its answer to the setup, which gives the scale
        self.give_up_s = time.monotonic() + (_SETUP_ANSWER_S if has_setup else _ANSWER_S)
        self._form, self._array, self._out, self._metadata = form, array, out, metadata
        self._has_setup = has_setup
        self._asked_s = -math.inf
        self._unanswered_s: list[float] = []
        self._held: list[tuple[Samples, float]] = []
        self._waiting: list[Batch] = []
        self._flushed_at = 0.0
        self._segment = 0

    def take(self, data: bytes, host_s: float) -> Batch | None:
        """Decode bytes read at ``host_s``; return the samples they complete."""
        samples = self.decoder.feed(data)
        if self._form.dialogue is not None:
            for packet in self.decoder.messages:
                self._hear(self._form.dialogue, packet)
        self.decoder.messages.clear()
        if not len(samples):
            return None
        if int(samples.segment[-1]) != self._segment:
            self._segment = int(samples.segment[-1])
            self.clock.restart()
        if self.waiting_for_board:
            self._held.append((samples, host_s))
            if self.identity is None and host_s < self.give_up_s:
                return None
            return self.release()
        return self._accept(samples, host_s)

    def _hear(self, dialogue: Dialogue, packet: NDArray[Any]) -> None:
        """Take an answer of the board; identities of an earlier listener do not count."""
        message = dialogue.parse(packet)
        if isinstance(message, Identity) and self.answers:
            self.identity = message
        elif isinstance(message, Reply):
            if message.command == dialogue.identify_code:
                self._take_answer(packet)
            if message.result:
                self.refused.append(message)

    def ask(self, link: Link, dialogue: Dialogue, now_s: float) -> None:
        """Ask the board who it is: now and then, as command and answer bound the latency of the line."""
        due_s = _IDENTIFY_EVERY_S if self.identity is None or self.answers < _FIRST_ANSWERS else _EXCHANGE_EVERY_S
        if now_s - self._asked_s >= due_s:
            self._asked_s = now_s
            self._unanswered_s.append(now_s)
            link.write(dialogue.identify)

    def _take_answer(self, packet: NDArray[Any]) -> None:
        """Relate the time in an answer to when it was asked for, at the earliest.

        The first answer may be to an earlier listener's question; an answer may have been lost.
        """
        self.answers += 1
        if self.answers > 1 and self._unanswered_s and self.first_s is not None:
            self.clock.exchange(self.times.of(self.decoder.ticks_of(packet)), self._unanswered_s[0])
        self._unanswered_s.clear()

    def release(self) -> Batch | None:
        """Take the samples that were held back until the board's answer told their scale."""
        self.waiting_for_board = False
        held, self._held = self._held, []
        if not held:
            return None
        samples = Samples.join([part for part, _ in held])
        if self.identity is not None and self._has_setup:
            began = np.flatnonzero(samples.status & Status.FIRST)
            start = int(began[-1]) if len(began) else 0  # what came before was not as asked for
            samples = Samples(*(getattr(samples, name)[start:] for name in Samples.__dataclass_fields__))
        return self._accept(samples, held[-1][1])

    def _accept(self, samples: Samples, host_s: float) -> Batch:
        """Scale samples and place them in time."""
        counts = samples.counts.astype(float)
        if self._form.no_reading is not None:
            counts[samples.counts == self._form.no_reading] = np.nan
        if self.identity is not None:
            counts *= self.identity.count_size
        batch = Batch(self.times.place(samples, host_s), counts, samples.status)
        self.clock.add(float(batch.t_s[-1]), host_s)
        self.rate.add(samples)
        for flag in Status:
            number = int(np.count_nonzero(samples.status & flag))
            if number:
                name = (flag.name or "").lower()
                self.status_counts[name] = self.status_counts.get(name, 0) + number
        if self.first_s is None:
            self.first_s = float(batch.t_s[0])
        self.last_s = float(batch.t_s[-1])
        self._waiting.append(batch)
        return batch

    def flush(self, now_s: float, *, force: bool = False) -> None:
        """Write what waits, a few times a second."""
        if not self._waiting or not (force or now_s - self._flushed_at >= _FLUSH_S):
            return
        if self.journal is None:
            if self.identity is not None:
                self._metadata["sample_rate_hz"] = self.identity.rate_hz
                self._metadata["range_g"] = self.identity.range_g
                self._metadata["firmware"] = self.identity.firmware
            self.journal = Journal(self._out, self._array.channels, self._metadata)
        parts = self._waiting
        self._waiting = []
        self._flushed_at = now_s
        self.journal.append(
            np.concatenate([part.t_s for part in parts]),
            np.concatenate([part.counts for part in parts]),
            np.concatenate([part.status for part in parts]),
        )


def record(
    port: str,
    out: str | Path,
    *,
    duration_s: float | None = None,
    form: str | FrameFormat = "lpc1768",
    array: str = "",
    baud: int = 1_562_500,
    setup: tuple[bytes, ...] = (),
    reconnect_s: float | None = None,
    on_batch: Callable[[Batch, StreamCounts], None] | None = None,
    stop: Callable[[], bool] | None = None,
) -> RecordReport:
    """Record from a port until the time is up, ``stop`` says so, or Ctrl-C.

    Parameters
    ----------
    port : str
        Device, pseudo-terminal or ``socket://host:port``.
    out : str or Path
        ``.csv`` or ``.parquet``; can be read at any moment, at most half a second behind.
    duration_s : float, optional
        Length of the recording, s of board time; by default until stopped.
    form : str or FrameFormat
        Frame format, or its name in `firmware_bridge.frames.FORMATS`.
    array : str
        Array file; by default the format's.
    baud : int
        Bits per second.
    setup : tuple of bytes
        Commands to send first (`firmware_bridge.commands`); sent again when the board started anew.
    reconnect_s : float, optional
        How long to wait for a port that is not there yet, and for a lost connection, s; by default the port has to be
        there at once, and a lost connection is waited for a minute.
    on_batch : callable, optional
        Is given each batch and the totals so far.
    stop : callable, optional
        Asked often; True ends the recording.

    Raises
    ------
    InputError
        If the file can't be written (found before the port is opened), the port can't be opened or is in use, or
        nothing that is a frame comes.
    JournalError
        If the disk is full; what was written until then can be read.
    """
    target = Path(out)
    check_outputs([("out", target, RECORDING)])
    layout = frame_format(form)
    if setup and layout.dialogue is None:
        raise InputError(f"format {layout.name} has no commands: rate and range can't be set; leave them out")
    carried = AccelerometerArray.load(array or layout.array)
    if carried.n_channels != len(layout.channels):
        raise InputError(
            f"array {carried.name!r} has {carried.n_channels} channels, {layout.name} {len(layout.channels)}"
        )
    part = carried.chips[0].part
    metadata: dict[str, Any] = {
        **array_metadata(carried),
        "part": part,
        "lsb_m_s2": Part.load(part, carried.part_files).lsb,
        "port": port,
        "format": layout.name,
        "started_utc": datetime.now(UTC).isoformat(timespec="milliseconds"),
        "software_version": gfimu.__version__,
        "time_stamp_clock": "board",
        "time_stamp_tick_hz": layout.clock_hz,
    }
    session = _Session(layout, carried, target, metadata, has_setup=bool(setup))
    with Link(port, baud=baud, reconnect_s=reconnect_s) as link, _ask_to_stop() as asked:
        trouble = _run(
            link,
            session,
            duration_s,
            setup,
            on_batch,
            lambda: asked() or (stop is not None and stop()),
        )
        breaks = link.breaks
    try:
        session.release()
        session.flush(time.monotonic(), force=True)
    except JournalError as error:
        trouble = trouble if isinstance(trouble, JournalError) else error
    session.decoder.finish()
    if session.refused and not session.journal:
        refusal = session.refused[0]
        raise InputError(f"{port}: the board refused command {refusal.command}: {refusal.result.name.lower()}")
    if session.journal is None:
        if isinstance(trouble, GfimuError):
            raise trouble
        raise InputError(
            f"{port}: no {layout.name} frame came; check the port, the baud rate ({baud}) and --format "
            f"({session.decoder.counts.skipped_bytes} bytes were no frames)"
        )
    counts = session.decoder.counts
    fit = session.clock.fit()
    final = {
        "frames_lost": counts.lost,
        "frames_corrupt": counts.corrupt,
        "bytes_skipped": counts.skipped_bytes,
        "samples_unconfirmed": counts.unconfirmed,
        "board_restarts": counts.restarts,
        "connection_breaks": breaks,
        "status_counts": session.status_counts,
        **session.rate.metadata(fit),
        **({} if fit is None else {"host_clock": fit.__dict__}),
        **({} if trouble is None else {"ended_by": str(trouble)}),
    }
    try:
        session.journal.finish(final)
    except JournalError as error:
        trouble = trouble if isinstance(trouble, JournalError) else error
    if isinstance(trouble, JournalError):
        raise trouble
    duration = session.last_s - (session.first_s or 0.0)
    return RecordReport(target, duration, counts, breaks, fit, session.identity, session.status_counts)


@contextmanager
def _ask_to_stop() -> Iterator[Callable[[], bool]]:
    """Turn Ctrl-C and a polite kill into a question, so that neither strikes in the middle of a write."""
    asked = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield asked.is_set
        return
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, lambda *_: asked.set()) for number in numbers]
    try:
        yield asked.is_set
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)


def _run(
    link: Link,
    session: _Session,
    duration_s: float | None,
    setup: tuple[bytes, ...],
    on_batch: Callable[[Batch, StreamCounts], None] | None,
    stop: Callable[[], bool],
) -> GfimuError | None:
    """Read until the end; return what ended the recording early, if anything did."""
    heard_at = time.monotonic()
    for command in setup:
        link.write(command)
    dialogue = session.decoder.format.dialogue
    restarts = 0
    seen: Identity | None = None
    try:
        while not stop():
            if dialogue is not None:
                session.ask(link, dialogue, time.monotonic())
            chunk = link.read()
            now = time.monotonic()
            if chunk is not None:
                if chunk.after_break:
                    session.decoder.break_stream()
                batch = session.take(chunk.data, chunk.host_s)
                if session.identity is not seen:
                    seen = session.identity
                    if dialogue is not None and seen is not None and not seen.streaming:
                        link.write(dialogue.start)  # someone stopped it
                if session.decoder.counts.restarts > restarts:
                    restarts = session.decoder.counts.restarts
                    for command in setup:
                        link.write(command)
                if batch is not None:
                    heard_at = now
                    if on_batch is not None:
                        on_batch(batch, session.decoder.counts)
            if session.waiting_for_board and now >= session.give_up_s:
                session.release()
            session.flush(now)
            if session.refused and session.journal is None:
                return None
            started = session.first_s is not None and duration_s is not None
            if started and session.last_s - session.first_s >= duration_s:  # type: ignore[operator]
                return None
            if session.first_s is None and now - heard_at > _SILENCE_S:
                return None
    except GfimuError as error:
        return error
    return None
