"""Recording from a port: bytes to samples to a file, with clocks, gaps and what the board says about itself."""

from __future__ import annotations

import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from firmware_bridge.frames.commands import Identity, asked_rate
from firmware_bridge.frames.decoder import FrameFormat, StreamCounts
from firmware_bridge.host.finder import SPEEDS, has_speed
from firmware_bridge.host.journal import JournalError
from firmware_bridge.host.line_up import line_up, needed_baud
from firmware_bridge.host.link import Chunk, Link
from firmware_bridge.host.mounting.on_board import (
    ArrayOnBoard,
    BoardAnswer,
    ask_board,
    candidate_arrays,
    load_stated,
    take_waiting,
)
from firmware_bridge.host.record_report import RecordReport
from firmware_bridge.host.record_session import Batch, RecordSession, SampleClock
from firmware_bridge.sources.ports import port_format
from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import GfimuError, InputError
from gfimu.base.files.outputs import RECORDING, check_outputs
from gfimu.base.version import __version__
from gfimu.recording.carried_array import array_metadata

__all__ = ["Batch", "RecordReport", "SampleClock", "record"]

_SILENCE_S = 5.0
_LOST_S = 2.0  # without a frame, after which the speed is looked for again


def record(
    port: str,
    out: str | Path,
    *,
    duration_s: float | None = None,
    form: str | FrameFormat = "",
    array: str = "",
    baud: int | None = None,
    setup: tuple[bytes, ...] = (),
    reconnect_s: float | None = None,
    on_batch: Callable[[Batch, StreamCounts], None] | None = None,
    on_array: Callable[[AccelerometerArray | None], None] | None = None,
    choose_array: Callable[[tuple[AccelerometerArray, ...]], str] | None = None,
    stop: Callable[[], bool] | None = None,
) -> RecordReport:
    """Record from a port until the time is up, ``stop`` says so, or Ctrl-C.

    Parameters
    ----------
    port : str
        Device, pseudo-terminal, ``socket://host:port``, or a source (`firmware_bridge.sources`): ``udp://``,
        ``klipper://``, ``phyphox://``.
    out : str or Path
        ``.csv`` or ``.parquet``; can be read at any moment, at most half a second behind.
    duration_s : float, optional
        Length of the recording, s of board time; by default until stopped.
    form : str or FrameFormat
        Frame format, or its name in `firmware_bridge.frames.decoder.FORMATS`; by default that of this project's board,
        and of a source that delivers samples its own.
    array : str
        Array file; by default the one that the board states, or the format's. With fewer chips than the format has,
        they are the first ones.
    baud : int, optional
        Bits per second. By default the speed at which the board answers or sends, raised if the sample rate needs more.
    setup : tuple of bytes
        Commands to send first (`firmware_bridge.frames.commands`); sent again when the board started anew.
    reconnect_s : float, optional
        How long to wait for a port that is not there yet, and for a lost connection, s; by default the port has to be
        there at once, and a lost connection is waited for a minute.
    on_batch : callable, optional
        Is given each batch and the totals so far.
    on_array : callable, optional
        Is given the array before the first batch; None if nobody stated it. Then the recording carries none.
    choose_array : callable, optional
        Is asked for the name or file of the array, from the shipped ones that have these channels, if neither
        ``array`` nor the board states it; an empty answer leaves it open.
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
    layout = port_format(port, form, array)
    if setup and layout.dialogue is None:
        raise InputError(f"format {layout.name} has no commands: rate and range can't be set; leave them out")
    given = AccelerometerArray.load(array or layout.array)
    layout = layout.for_array(given)
    with Link(port, baud=baud or SPEEDS[0], reconnect_s=reconnect_s, form=layout) as link:
        began = time.monotonic()
        on_board, answer = ArrayOnBoard(given, "host" if array else "format"), None
        if layout.array_is_assumed and not array:
            on_board, answer = _settle_array(link, layout, baud, setup, choose_array, stop)
            layout = layout.for_array(on_board.array)
        if on_array is not None:
            on_array(on_board.known)
        session = RecordSession(layout, on_board, target, _metadata(port, layout, on_board), has_setup=bool(setup))
        if answer is not None:
            session.baud = answer.baud
            session.waiting_for_board &= answer.answers or bool(setup)  # it was given its time
        with _ask_to_stop() as asked:
            trouble = _run(
                link,
                session,
                duration_s,
                setup,
                on_batch,
                lambda: asked() or (stop is not None and stop()),
                baud,
                (began, deque(() if answer is None else answer.chunks)),
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
        if link.source is not None and not session.decoder.counts.skipped_bytes:
            raise InputError(f"{port}: nothing came; {link.source.hint}")
        raise InputError(
            f"{port}: no {layout.name} frame came{f' at {baud} baud' if baud else ''}; check the port and --format, "
            f"or look for the board with --find ({session.decoder.counts.skipped_bytes} bytes were no frames)"
        )
    counts = session.decoder.counts
    fit = session.clock.fit()
    of_source = {} if link.source is None else link.source.facts()
    final = {
        "frames_lost": counts.lost,
        "frames_corrupt": counts.corrupt,
        "bytes_skipped": counts.skipped_bytes,
        "samples_unconfirmed": counts.unconfirmed,
        "board_restarts": counts.restarts,
        "connection_breaks": breaks,
        "status_counts": session.status_counts,
        **session.late_array(),
        **session.rate.metadata(fit),
        **of_source,
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
    return RecordReport(
        target, duration, counts, breaks, fit, session.identity, session.status_counts,
        baud=session.baud, source=of_source, array=session.on_board.name, array_stated_by=session.on_board.stated_by,
        board_array=session.board_array, temperature_degC=session.warmth,
    )  # fmt: skip


def _metadata(port: str, layout: FrameFormat, on_board: ArrayOnBoard) -> dict[str, Any]:
    """Return what a recording says of its board from the start."""
    array = on_board.array
    return {
        **({} if on_board.known is None else array_metadata(array)),
        "part": array.chips[0].part,
        "lsb_m_s2": layout.count_size(array),
        "port": port,
        "format": layout.name,
        "started_utc": datetime.now(UTC).isoformat(timespec="milliseconds"),
        "software_version": __version__,
        "time_stamp_clock": "board",
        "time_stamp_tick_hz": layout.clock_hz,
    }


def _settle_array(
    link: Link,
    layout: FrameFormat,
    baud: int | None,
    setup: tuple[bytes, ...],
    choose: Callable[[tuple[AccelerometerArray, ...]], str] | None,
    stop: Callable[[], bool] | None,
) -> tuple[ArrayOnBoard, BoardAnswer]:
    """Return the array that the board states, or that is chosen, and what else became of the question."""
    least = needed_baud(layout, asked_rate(setup))
    answer = ask_board(link, layout, baud, least, stop or (lambda: False), has_setup=bool(setup))
    if answer.array:
        return ArrayOnBoard(load_stated(answer.array, link.port), "board"), answer
    name = "" if choose is None else choose(candidate_arrays(layout))
    if choose is not None:
        take_waiting(link)  # the recording begins with the answer
        answer.chunks.clear()
    array = AccelerometerArray.load(name or layout.array)
    return ArrayOnBoard(array, "answer" if name else ""), answer


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
    session: RecordSession,
    duration_s: float | None,
    setup: tuple[bytes, ...],
    on_batch: Callable[[Batch, StreamCounts], None] | None,
    stop: Callable[[], bool],
    baud: int | None,
    so_far: tuple[float, deque[Chunk]],
) -> GfimuError | None:
    """Read until the end; return what ended the recording early, if anything did.

    ``so_far``: when the port was opened, and what came since.
    """
    began, chunks = so_far
    form = session.decoder.format
    dialogue = form.dialogue
    least = needed_baud(form, asked_rate(setup))

    def find_speed() -> None:
        found = line_up(link, form, baud, least_baud=least, stop=stop)
        if found is not None:
            session.baud = found[0].baud
            if session.first_s is not None:
                session.resume(found[1])
            chunks.extend(() if setup and session.first_s is None else found[1])

    has_to_agree = has_speed(link.port) or least > link.baud
    restarts = 0
    seen: Identity | None = None
    try:
        while has_to_agree and session.baud is None and time.monotonic() - began < _SILENCE_S and not stop():
            find_speed()
        last_sample_at = began if session.baud is None else time.monotonic()
        session.expect_answers()
        for command in setup:
            link.write(command)
        while not stop():
            if dialogue is not None:
                session.ask(link, dialogue, time.monotonic())
            chunk = chunks.popleft() if chunks else link.read()
            now = time.monotonic()
            if chunk is not None:
                if chunk.after_break and (link.source is None or session.first_s is None):
                    session.decoder.break_stream()
                elif chunk.after_break:  # its samples have no numbers: only the clocks can say what is missing
                    session.resume([chunk])
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
                    last_sample_at = now
                    if on_batch is not None:
                        on_batch(batch, session.decoder.counts)
            if dialogue is not None and has_to_agree and session.first_s is not None and now - last_sample_at > _LOST_S:
                find_speed()  # a board that started anew is back at its first speed
                last_sample_at = time.monotonic()
            if session.waiting_for_board and now >= session.give_up_s:
                session.release()
            session.flush(now)
            if session.refused and session.journal is None:
                return None
            started = session.first_s is not None and duration_s is not None
            if started and session.last_s - session.first_s >= duration_s:  # type: ignore[operator]
                return None
            if session.first_s is None and now - last_sample_at > _SILENCE_S:
                return None
    except GfimuError as error:
        return error
    return None
