"""What a recording has come to: samples on one time axis, what the board said, what still waits to be written."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firmware_bridge.frames.commands import ArrayName, Dialogue, Identity, Reply
from firmware_bridge.frames.decoder import FrameFormat, SampleDecoder, Samples, Status
from firmware_bridge.host.clock import HostClock, SampleRate
from firmware_bridge.host.journal import Journal
from firmware_bridge.host.link import Chunk, Link
from firmware_bridge.host.mounting.on_board import ArrayOnBoard
from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError
from gfimu.base.files.model_files import list_models
from gfimu.recording.carried_array import array_metadata

__all__ = ["Batch", "RecordSession", "SampleClock"]

_FLUSH_S = 0.25
_ANSWER_S = 0.5  # samples wait so long for the board to give their scale
_SETUP_ANSWER_S = 3.0  # and so long if they will be left out because the board was not set up yet
_SAME_CLOCK_S = 0.5  # by how much board and host may differ about a gap, with the latency of both its ends
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
    temperature_degC : ndarray, shape (n,), optional
        Temperature of the board; NaN where a sample has none.
    """

    t_s: NDArray[np.float64]
    counts: NDArray[np.float64]
    status: NDArray[np.uint16]
    temperature_degC: NDArray[np.float64] | None = None

    @property
    def temperatures(self) -> NDArray[np.float64]:
        """Temperatures (n,), °C; NaN where there is none."""
        return np.full(len(self.t_s), np.nan) if self.temperature_degC is None else self.temperature_degC


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


class RecordSession:
    """State of one recording."""

    def __init__(
        self, form: FrameFormat, on_board: ArrayOnBoard, out: Path, metadata: dict[str, Any], *, has_setup: bool
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
        self._has_setup = has_setup
        self.waiting_for_board = form.dialogue is not None  # for its answer to the setup, which gives the scale
        self.baud: int | None = None
        self.expect_answers()
        self.on_board = on_board
        self.board_array = on_board.array.name if on_board.stated_by == "board" else ""
        self.warmth: tuple[float, float] | None = None  # lowest and highest temperature, °C
        self._form, self._array, self._out, self._metadata = form, on_board.array, out, metadata
        self._asked_s = -math.inf
        self._unanswered_s: list[float] = []
        self._held: list[tuple[Samples, float]] = []
        self._waiting: list[Batch] = []
        self._flushed_at = 0.0
        self._segment = 0
        self._read_at_s = 0.0

    def expect_answers(self) -> None:
        """Give the board its time to answer from now on."""
        self.give_up_s = time.monotonic() + (_SETUP_ANSWER_S if self._has_setup else _ANSWER_S)

    def take(self, data: bytes, host_s: float) -> Batch | None:
        """Decode bytes read at ``host_s``; return the samples they complete."""
        samples = self.decoder.feed(data)
        if self._form.dialogue is not None:
            for packet in self.decoder.messages:
                self._take_message(self._form.dialogue, packet)
        self.decoder.messages.clear()
        if not len(samples):
            return None
        self._read_at_s = host_s
        if int(samples.segment[-1]) != self._segment:
            self._segment = int(samples.segment[-1])
            self.clock.restart()
        if self.waiting_for_board:
            self._held.append((samples, host_s))
            if self.identity is None and host_s < self.give_up_s:
                return None
            return self.release()
        return self._accept(samples, [(len(samples), host_s)])

    def resume(self, chunks: list[Chunk]) -> None:
        """Go on after a time without frames: in a new segment if the board's clock did not run on as the host's."""
        self.decoder.break_stream()
        for chunk in chunks:
            samples = SampleDecoder(self._form).feed(chunk.data)
            if len(samples):
                passed_s = chunk.host_s - self._read_at_s
                if abs(self.decoder.gap_s(int(samples.ticks[-1])) - passed_s) > _SAME_CLOCK_S:
                    self.decoder.start_anew()
                return

    def _take_message(self, dialogue: Dialogue, packet: NDArray[Any]) -> None:
        """Take an answer of the board; identities of an earlier listener do not count."""
        message = dialogue.parse(packet)
        if isinstance(message, Identity) and self.answers:
            self.identity = message
        elif isinstance(message, ArrayName):
            self.board_array = message.name
        elif isinstance(message, Reply):
            if message.command == dialogue.identify_code:
                self._take_answer(packet)
            if message.result:
                self.refused.append(message)

    def late_array(self) -> dict[str, Any]:
        """Return the metadata of an array that the board stated only after the recording had begun, if it fits."""
        if self.on_board.stated_by or self.board_array not in list_models("arrays"):
            return {}
        stated = AccelerometerArray.load(self.board_array)
        if stated.channels != self._array.channels:
            return {}
        self.on_board = ArrayOnBoard(stated, "board")
        return array_metadata(stated)

    def _refuse_more_chips(self, identity: Identity) -> None:
        """Nothing that answers is left out of a recording."""
        chips = len(self._array.chips)
        if any(identity.present[chips:]):
            answers = sum(identity.present)
            raise InputError(
                f"array {self._array.name!r} has {chips} chip{'' if chips == 1 else 's'}, but {answers} answer on the "
                "board; give the array of all with --array"
            )

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
        """Take the samples that were held back until the board's answer gave their scale."""
        self.waiting_for_board = False
        held, self._held = self._held, []
        if not held:
            return None
        samples = Samples.join([part for part, _ in held])
        if self.identity is not None and self._has_setup:
            began = np.flatnonzero(samples.status & Status.FIRST)
            start = int(began[-1]) if len(began) else 0  # what came before was not as asked for
            samples = samples.of(slice(start, None))
        return self._accept(samples, [(len(part), host_s) for part, host_s in held])

    def _accept(self, samples: Samples, arrivals: list[tuple[int, float]]) -> Batch:
        """Scale samples and place them in time; ``arrivals``: how many were read at once and when, up to the last."""
        counts = samples.counts.astype(float)
        if self._form.no_reading is not None:
            counts[samples.counts == self._form.no_reading] = np.nan
        if self.identity is not None:
            counts *= self.identity.count_size
        times = self.times.place(samples, arrivals[-1][1])
        batch = Batch(times, counts, samples.status, samples.temperature_degC)
        ends = np.cumsum([number for number, _ in arrivals])
        for place, (_, host_s) in zip(ends - ends[-1] + len(samples) - 1, arrivals, strict=True):
            if place >= 0:  # those before were left out
                self.clock.add(float(batch.t_s[place]), host_s)
        self.rate.add(samples)
        for flag in Status:
            number = int(np.count_nonzero(samples.status & flag))
            if number:
                name = (flag.name or "").lower()
                self.status_counts[name] = self.status_counts.get(name, 0) + number
        if self.first_s is None:
            self.first_s = float(batch.t_s[0])
        self.last_s = float(batch.t_s[-1])
        warm = batch.temperatures[np.isfinite(batch.temperatures)]
        if len(warm):
            seen = (*(self.warmth or ()), float(warm.min()), float(warm.max()))
            self.warmth = (min(seen), max(seen))
        self._waiting.append(batch)
        return batch

    def flush(self, now_s: float, *, force: bool = False) -> None:
        """Write what waits, a few times a second."""
        if not self._waiting or not (force or now_s - self._flushed_at >= _FLUSH_S):
            return
        if self.journal is None:
            if self.identity is not None:
                self._refuse_more_chips(self.identity)
                self._metadata["sample_rate_hz"] = self.identity.rate_hz
                self._metadata["range_g"] = self.identity.range_g
                self._metadata["firmware"] = self.identity.firmware
                self._metadata.update(self.identity.conversions)
            warm = any(np.isfinite(part.temperatures).any() for part in self._waiting)
            self.journal = Journal(self._out, self._array.channels, self._metadata, has_temperature=warm)
        parts = self._waiting
        self._waiting = []
        self._flushed_at = now_s
        self.journal.append(
            np.concatenate([part.t_s for part in parts]),
            np.concatenate([part.counts for part in parts]),
            np.concatenate([part.status for part in parts]),
            np.concatenate([part.temperatures for part in parts]),
        )
