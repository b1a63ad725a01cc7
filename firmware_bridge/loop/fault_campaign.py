"""What can go wrong between the chips and the host, and what comes of it: one row per fault, from one call."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from firmware_bridge.adxl345.registers import Adxl345Options, LineFault
from firmware_bridge.frames.commands import Command, encode_command, sample_at
from firmware_bridge.frames.decoder import LPC1768_DTYPE, FrameType, SampleDecoder, Status, StreamCounts
from firmware_bridge.loop.board_process import BoardProcess
from gfimu.base.declared import Declared, Table, cell, figure
from gfimu.base.results import TableResult, columns_of, text_column

__all__ = ["FAULTS", "FaultOutcome", "FaultReport", "resample_line", "run_campaign", "run_fault"]

_RATE_HZ = 800
_BOOT_S, _RUN_S = 0.05, 1.0
_FRAME = LPC1768_DTYPE.itemsize
_CHUNK = 700  # bytes the host reads at a time


@dataclass(frozen=True)
class FaultOutcome(Declared):
    """What the host makes of one fault."""

    fault: Annotated[str, figure("Name of the fault.")]
    frames_whole: Annotated[int, figure("Sample frames that reached the host undamaged.")]
    frames_decoded: Annotated[int, figure("Sample frames that the host accepted.")]
    invented: Annotated[int, figure("Accepted frames that the board never sent.")]
    counts: Annotated[StreamCounts, figure("What the host's decoder reports.")]
    reported: Annotated[tuple[str, ...], figure("Status bits that the board raised because of the fault.")]
    recovered: Annotated[bool, figure("Whether good frames came again after the fault.")]
    detail: Annotated[str, figure("What else happened.")]

    @property
    def passed(
        self,
    ) -> Annotated[bool, figure("Whether nothing was invented or lost, and good frames came again.")]:
        """Nothing invented, nothing lost that arrived whole, and good frames afterwards."""
        return self.invented == 0 and self.frames_decoded == self.frames_whole and self.recovered


@dataclass(frozen=True)
class FaultReport(Declared, TableResult):
    """What the host makes of faults of wire, supply and chips; counts and iterates like a list of `FaultOutcome`."""

    outcomes: Annotated[tuple[FaultOutcome, ...], figure("The faults.", key="faults")]

    @property
    def passed(self) -> Annotated[bool, figure("Whether every fault passed.", before="outcomes")]:
        """Whether every fault passed."""
        return all(one.passed for one in self)

    def shown(self) -> Iterator[Table]:
        """Yield the table that people read."""
        rows = [
            (
                one.fault.replace("_", " "),
                *(one.frames_whole, one.frames_decoded, one.invented, one.counts.lost, one.counts.corrupt),
                ", ".join(one.reported).replace("_", " ") or ("restart" if one.counts.restarts else "-"),
                cell(one.passed),
            )
            for one in self
        ]
        header = ("fault", "whole", "decoded", "invented", "lost", "corrupt", "board reports", "passed")
        yield Table(self._heading(), header, rows, note="Frames: arrived whole, accepted.")

    def __len__(self) -> int:
        return len(self.outcomes)

    def __iter__(self) -> Iterator[FaultOutcome]:
        return iter(self.outcomes)

    def __getitem__(self, place: int) -> FaultOutcome:
        return self.outcomes[place]

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per fault: frames, what the decoder reports, whether the host took no fault for data."""
        counted = columns_of((outcome.counts for outcome in self), "lost corrupt restarts")
        reported = {"reported": text_column(", ".join(outcome.reported) for outcome in self)}
        frames = columns_of(self, "fault frames_whole frames_decoded invented")
        return frames | counted | reported | columns_of(self, "passed")

    def _heading(self) -> str:
        return "Faults and what the host makes of them"


@dataclass(frozen=True)
class _Line:
    """Bytes that left the board, and bytes that reached the host."""

    sent: bytes
    arrived: bytes
    detail: str = ""


Scenario = Callable[[BoardProcess, np.random.Generator], _Line]


def _settle(board: BoardProcess) -> None:
    board.run_for(_BOOT_S)
    board.receive(sample_at(_RATE_HZ))
    board.run_for(_BOOT_S)
    board.take_sent()


def _clean(board: BoardProcess, seconds: float = _RUN_S) -> bytes:
    board.run_for(seconds)
    return board.take_sent()[0]


def _no_fault(board: BoardProcess, chance: np.random.Generator) -> _Line:
    data = _clean(board)
    return _Line(data, data)


def _bit_flips(board: BoardProcess, chance: np.random.Generator) -> _Line:
    data = _clean(board)
    damaged = np.frombuffer(data, np.uint8).copy()
    places = chance.choice(len(data) - 20 * _FRAME, 200, replace=False)
    damaged[places] ^= (1 << chance.integers(0, 8, len(places))).astype(np.uint8)
    return _Line(data, damaged.tobytes(), "200 bits flipped")


def _lost_bytes(board: BoardProcess, chance: np.random.Generator) -> _Line:
    data = _clean(board)
    keep = np.ones(len(data), dtype=bool)
    for start in chance.integers(0, len(data) - 20 * _FRAME, 60):
        keep[start : start + chance.integers(1, 90)] = False
    return _Line(data, np.frombuffer(data, np.uint8)[keep].tobytes(), f"{np.count_nonzero(~keep)} bytes lost in bursts")


def _inserted_noise(board: BoardProcess, chance: np.random.Generator) -> _Line:
    data = _clean(board)
    cuts = np.sort(chance.integers(0, len(data) - 20 * _FRAME, 50))
    pieces = np.split(np.frombuffer(data, np.uint8), cuts)
    noise = [chance.integers(0, 256, chance.integers(1, 60), dtype=np.uint8) for _ in pieces[1:]]
    arrived = [pieces[0], *(part for pair in zip(noise, pieces[1:], strict=True) for part in pair)]
    return _Line(data, np.concatenate(arrived).tobytes(), "50 bursts of noise inserted")


def _brown_out(board: BoardProcess, chance: np.random.Generator) -> _Line:
    first = _clean(board, 0.5)
    board.run_for(1.0 / _RATE_HZ - 0.0001)
    # Into the middle of a frame: step until some but not all bytes of it have left.
    middle = b""
    while len(first + middle) % _FRAME == 0:
        board.run_for(0.00005)
        middle += board.take_sent()[0]
    board.brown_out()
    cut = len(first + middle) % _FRAME
    board.run_for(_BOOT_S)
    after = board.take_sent()[0]
    board.receive(sample_at(_RATE_HZ))
    data = first + middle + after + _clean(board, 0.5)
    return _Line(data, data, f"supply dropped {cut} bytes into a frame")


def _line_fault(fault: LineFault) -> Scenario:
    def run(board: BoardProcess, chance: np.random.Generator) -> _Line:
        first = _clean(board, 0.3)
        board.set_line_fault(2, fault)
        during = _clean(board, 0.3)
        board.set_line_fault(2, LineFault.NONE)
        data = first + during + _clean(board, 0.4)
        return _Line(data, data, "sensor 3 affected for 0.3 s")

    return run


def _receive_overrun(board: BoardProcess, chance: np.random.Generator) -> _Line:
    first = _clean(board, 0.2)
    board.receive(bytes(8), errors=0x02)
    board.receive(chance.integers(0, 256, 4000, dtype=np.uint8).tobytes())
    during = _clean(board, 0.3)
    board.receive(encode_command(Command.IDENTIFY))
    data = first + during + _clean(board, 0.5)
    identified = sum(frame[3] == FrameType.IDENTITY for frame in _whole_frames(data))
    return _Line(
        data,
        data,
        f"receiver overrun, then 4000 random bytes to the board; answers commands afterwards: {identified > 0}",
    )


def _framing_errors(board: BoardProcess, chance: np.random.Generator) -> _Line:
    first = _clean(board, 0.2)
    board.receive(bytes(16), errors=0x08)
    data = first + _clean(board, 0.8)
    return _Line(data, data, "16 bytes with framing errors to the board")


def _wrong_baud(board: BoardProcess, chance: np.random.Generator) -> _Line:
    first = _clean(board, 0.3)
    data = first + _clean(board, 0.7)
    garbled = resample_line(first, 1_562_500, 921_600)
    return _Line(data, garbled + data[len(first) :], f"host listened at 921600 for 0.3 s: {len(garbled)} wrong bytes")


FAULTS: dict[str, Scenario] = {
    "none": _no_fault,
    "bit_flips": _bit_flips,
    "lost_bytes": _lost_bytes,
    "inserted_noise": _inserted_noise,
    "brown_out_in_frame": _brown_out,
    "sensor_silent": _line_fault(LineFault.SILENT),
    "spi_stuck_low": _line_fault(LineFault.STUCK_LOW),
    "spi_stuck_high": _line_fault(LineFault.STUCK_HIGH),
    "uart_receive_overrun": _receive_overrun,
    "uart_framing_errors": _framing_errors,
    "wrong_baud": _wrong_baud,
}
"""The faults, by name."""


def run_fault(name: str, *, seed: int = 0) -> FaultOutcome:
    """Run one fault of `FAULTS` and return its row."""
    chance = np.random.default_rng([seed, list(FAULTS).index(name)])
    options = tuple(Adxl345Options(phase=0.25 * index) for index in range(4))
    with BoardProcess(chips=options) as board:
        _settle(board)
        line = FAULTS[name](board, chance)
    decoder = SampleDecoder()
    statuses = []
    decoded = []
    for start in range(0, len(line.arrived), _CHUNK):
        samples = decoder.feed(line.arrived[start : start + _CHUNK])
        statuses.append(samples.status)
        decoded += [row.tobytes() for row in _keys(samples.sequence, samples.counts)]
    decoder.finish()
    sent = [
        np.frombuffer(frame, LPC1768_DTYPE)[0] for frame in _whole_frames(line.sent) if frame[3] == FrameType.SAMPLE
    ]
    known = {
        row.tobytes() for row in _keys(np.array([f["sequence"] for f in sent]), np.array([f["counts"] for f in sent]))
    }
    whole = sum(frame[3] == FrameType.SAMPLE for frame in _survivors(line))
    flags = int(np.bitwise_or.reduce(np.concatenate(statuses))) & ~Status.FIRST
    reported = tuple((flag.name or "").lower() for flag in Status if flags & flag)
    tail = np.concatenate(statuses)[-10:]
    recovered = len(tail) == 10 and not (tail & ~np.uint16(Status.FIRST)).any()
    return FaultOutcome(
        name,
        whole,
        len(decoded),
        sum(key not in known for key in decoded),
        decoder.counts,
        reported,
        recovered,
        line.detail,
    )


def run_campaign(*, seed: int = 0, progress: Callable[[float], None] | None = None) -> FaultReport:
    """Run all faults; return the table."""
    rows = []
    for index, name in enumerate(FAULTS):
        rows.append(run_fault(name, seed=seed))
        if progress is not None:
            progress((index + 1) / len(FAULTS))
    return FaultReport(tuple(rows))


def _keys(sequence: NDArray[np.uint16], counts: NDArray[np.int16]) -> NDArray[np.int32]:
    """One row per frame that distinguishes frames: sequence number and counts."""
    return np.column_stack([sequence.astype(np.int32), counts.astype(np.int32)])


def _whole_frames(data: bytes) -> list[bytes]:
    """Frames in an undamaged stream, which may begin and end, or be cut by a reset, inside a frame."""
    scanner = SampleDecoder().format.layout.scanner()
    return [frame.tobytes() for frame in scanner.feed(data)]


def _survivors(line: _Line) -> list[bytes]:
    """Frames of the sent stream whose bytes stand, whole and in order, in what arrived."""
    survivors = []
    place = 0
    for frame in _whole_frames(line.sent):
        found = line.arrived.find(frame, place)
        if found >= 0:
            survivors.append(frame)
            place = found + len(frame)
    return survivors


def resample_line(data: bytes, from_baud: float, to_baud: float) -> bytes:
    """Bytes that a receiver at ``to_baud`` makes of bytes sent back to back at ``from_baud`` (8 data bits, 1 stop bit).

    The receiver waits for a falling edge, samples the middles of its own bit times, and drops a byte whose stop bit is
    not high.
    """
    bits = np.unpackbits(np.frombuffer(data, np.uint8)[:, None], axis=1, bitorder="little")
    levels = np.column_stack([np.zeros(len(bits), np.uint8), bits, np.ones(len(bits), np.uint8)]).ravel()
    levels = np.concatenate([levels, np.ones(20, np.uint8)])
    ratio = from_baud / to_baud  # sent bits per received bit
    received = bytearray()
    falling = np.flatnonzero((levels[1:] == 0) & (levels[:-1] == 1)) + 1
    if levels[0] == 0:
        falling = np.concatenate([[0], falling])
    at = 0.0
    while True:
        later = np.searchsorted(falling, at)
        if later >= len(falling):
            return bytes(received)
        start = float(falling[later])
        middles = (start + ratio * (np.arange(1, 10) + 0.5)).astype(int)
        if middles[-1] >= len(levels):
            return bytes(received)
        if levels[middles[-1]]:
            received.append(int(np.packbits(levels[middles[:8]], bitorder="little")[0]))
        at = start + ratio * 9.5
