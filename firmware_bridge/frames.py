"""Frame formats: what the boards send, byte by byte, and how it becomes samples (docs/frames.md).

A format is a packet layout and the meaning of its fields. `SampleDecoder` turns a byte stream in one of the formats
into samples with unwrapped time, the number of samples lost before each, and a segment number that changes whenever
the board started anew.
"""

from __future__ import annotations

import enum
import struct
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firmware_bridge.checksum import crc16, crc16_rows, sum16_rows
from firmware_bridge.commands import LPC1768_DIALOGUE, NO_TEMPERATURE, RATES_HZ, Dialogue, FrameType
from firmware_bridge.continuity import Continuity
from firmware_bridge.packets import PacketLayout, StreamLayout
from gfimu.errors import unknown_name
from gfimu.files.model_files import list_models
from gfimu.short_repr import short_repr

__all__ = [
    "FORMATS",
    "FrameFormat",
    "FrameType",
    "SampleDecoder",
    "Samples",
    "Status",
    "StreamCounts",
    "encode_message",
    "encode_samples",
    "frame_format",
]

FRAME_VERSION = 1
SYNC = (0xA5, 0x5A)
_LONGEST_GAP_OVER_WRAP_S = 10.0
_ANY_NUMBER = 0xFFFFFFFF  # of samples that carry none


class Status(enum.IntFlag):
    """Bits of the status field of a sample frame."""

    SENSOR_1_MISSING = 1 << 0
    SENSOR_2_MISSING = 1 << 1
    SENSOR_3_MISSING = 1 << 2
    SENSOR_4_MISSING = 1 << 3
    SENSOR_1_OVERRUN = 1 << 4
    SENSOR_2_OVERRUN = 1 << 5
    SENSOR_3_OVERRUN = 1 << 6
    SENSOR_4_OVERRUN = 1 << 7
    LATE = 1 << 8
    FRAMES_DROPPED = 1 << 9
    SELF_TEST = 1 << 10
    RECEIVE_ERROR = 1 << 11
    FIRST = 1 << 12
    WATCHDOG_RESET = 1 << 13
    STALE = 1 << 14
    CHIP_FAULT = 1 << 15

    @property
    def missing_sensors(self) -> tuple[int, ...]:
        """Numbers 1…4 of the sensors that did not answer."""
        return tuple(number + 1 for number in range(4) if self & (1 << number))


LPC1768_DTYPE = np.dtype(
    [
        ("sync", "u1", 2),
        ("version", "u1"),
        ("type", "u1"),
        ("sequence", "<u2"),
        ("time_us", "<u4"),
        ("counts", "<i2", 12),
        ("status", "<u2"),
        ("temperature", "<i2"),
        ("crc", "<u2"),
    ]
)

MIMU4444_DTYPE = np.dtype(
    [
        ("start", "u1"),
        ("sequence", ">u2"),
        ("payload_bytes", "u1"),
        ("ticks", ">u4"),
        ("counts", ">i2", 48),
        ("sum", ">u2"),
    ]
)


@dataclass(frozen=True)
class FrameFormat:
    """One frame format: all that decoding and recording need to know of a board's stream.

    Parameters
    ----------
    name : str
        Name for ``--format``.
    layout : StreamLayout
        The sample on the wire.
    clock_field : str
        Field that holds the board's time stamp, an unsigned integer.
    clock_hz : float
        Ticks of the time stamp per second.
    array : str
        Array file whose channels the counts belong to.
    channels : tuple of int
        Columns of the counts that are the array's channels, in order.
    sequence_field : str
        Field that holds the sequence number, an unsigned integer; empty if there is none: then the time stamps alone
        say what is missing.
    counts_field : str
        Field that holds the raw counts, signed integers.
    status_field : str, optional
        Field with status bits as in `Status`; None if there is none.
    sample_type : tuple of (str, int), optional
        Field and its value that mark a packet as a sample; None if every packet is one.
    no_reading : int, optional
        Count that stands for a missing reading.
    count_m_s2 : float, optional
        Size of a count, m/s²; by default that of the array's part.
    slowest_hz : float
        Lowest sample rate of the board, Hz: two samples can't be farther apart.
    dialogue : Dialogue, optional
        Commands and answers of the board; None if it only sends.
    """

    name: str
    layout: StreamLayout
    clock_field: str
    clock_hz: float
    array: str
    channels: tuple[int, ...]
    sequence_field: str = "sequence"
    counts_field: str = "counts"
    status_field: str | None = None
    sample_type: tuple[str, int] | None = None
    no_reading: int | None = None
    count_m_s2: float | None = None
    slowest_hz: float = 1.0
    dialogue: Dialogue | None = None

    def is_sample(self, packets: NDArray[Any]) -> NDArray[np.bool_]:
        """Tell which packets, shape (n,), carry a sample."""
        if self.sample_type is None:
            return np.ones(len(packets), dtype=bool)
        field, value = self.sample_type
        return np.asarray(packets[field] == value)

    def status(self, packets: NDArray[Any]) -> NDArray[np.uint16]:
        """Status bits of the packets, shape (n,); zero in formats without them."""
        if self.status_field is None:
            return np.zeros(len(packets), dtype=np.uint16)
        return packets[self.status_field].astype(np.uint16)

    def counts(self, packets: NDArray[Any]) -> NDArray[Any]:
        """Raw counts of the array's channels, shape (n, c), in the byte order of this machine."""
        counts = packets[self.counts_field][:, list(self.channels)]
        return np.asarray(counts, dtype=counts.dtype.newbyteorder("="))

    def mask_of(self, field: str) -> int:
        """Largest value of an unsigned field, at which it wraps; of 8 bytes, only 63 bits are used."""
        return 0 if not field else (1 << min(8 * self.layout.dtype[field].itemsize, 63)) - 1


FORMATS: dict[str, FrameFormat] = {
    known.name: known
    for known in (
        FrameFormat(
            "lpc1768",
            PacketLayout(LPC1768_DTYPE, ((0, SYNC[0]), (1, SYNC[1]), (2, FRAME_VERSION)), crc16_rows),
            clock_field="time_us",
            clock_hz=1e6,
            array="cube12",
            channels=tuple(range(12)),
            status_field="status",
            sample_type=("type", FrameType.SAMPLE),
            no_reading=-(1 << 15),
            slowest_hz=RATES_HZ[0],
            dialogue=LPC1768_DIALOGUE,
        ),
        FrameFormat(
            "mimu4444",
            PacketLayout(MIMU4444_DTYPE, ((0, 0xAA), (3, 0x64)), sum16_rows),
            clock_field="ticks",
            clock_hz=64e6,
            array="mimu4444",
            channels=tuple(6 * chip + axis for chip in range(8) for axis in range(3)),
        ),
    )
}
"""Every frame format by name."""


def frame_format(name: str | FrameFormat) -> FrameFormat:
    """Return a frame format given as such, by name, or as a TOML file; raises `InputError` that lists the formats."""
    if isinstance(name, FrameFormat):
        return name
    if name in FORMATS:
        return FORMATS[name]
    described = list_models("frames")
    if name in described or name.endswith(".toml"):
        from firmware_bridge.format_file import load_format

        return load_format(name)
    raise unknown_name("frame format", name, (*FORMATS, *described))


def encode_samples(
    sequence: ArrayLike,
    time_us: ArrayLike,
    counts: ArrayLike,
    status: ArrayLike = 0,
    temperature: ArrayLike = NO_TEMPERATURE,
) -> bytes:
    """Encode sample frames of the format `lpc1768` as the firmware does.

    Parameters
    ----------
    sequence, time_us, status, temperature : array_like, shape (n,)
        Sequence numbers and time stamps (both taken modulo their width), status bits, temperature field.
    counts : array_like, shape (n, 12)
        Raw counts.
    """
    readings = np.asarray(counts)
    frames = np.zeros(len(readings), LPC1768_DTYPE)
    frames["sync"] = SYNC
    frames["version"] = FRAME_VERSION
    frames["type"] = FrameType.SAMPLE
    frames["sequence"] = np.asarray(sequence, dtype=np.int64) & 0xFFFF
    frames["time_us"] = np.asarray(time_us, dtype=np.int64) & 0xFFFFFFFF
    frames["counts"] = readings
    frames["status"] = status
    frames["temperature"] = temperature
    return _sealed(frames)


def encode_message(kind: FrameType, sequence: int, time_us: int, payload: bytes, status: int = 0) -> bytes:
    """Encode one identity or reply frame of the format `lpc1768`; ``payload`` has at most 24 bytes."""
    body = struct.pack(
        "<2sBBHI24sHh", bytes(SYNC), FRAME_VERSION, kind, sequence & 0xFFFF, time_us, payload, status, NO_TEMPERATURE
    )
    return body + struct.pack("<H", crc16(body))


def _sealed(frames: NDArray[Any]) -> bytes:
    covered = frames.dtype.itemsize - 2
    rows = frames.view(np.uint8).reshape(len(frames), frames.dtype.itemsize)
    frames["crc"] = crc16_rows(rows[:, :covered])
    return frames.tobytes()


@dataclass(frozen=True)
class Samples:
    """Decoded samples of one format, in the order in which they came.

    Parameters
    ----------
    ticks : ndarray, shape (n,)
        Board time, unwrapped, in ticks since the board started.
    sequence : ndarray, shape (n,)
        Sequence numbers as sent.
    counts : ndarray, shape (n, c)
        Raw counts of the array's channels.
    status : ndarray, shape (n,)
        Status bits (`Status`).
    lost_before : ndarray, shape (n,)
        Samples lost between the sample before and this one; 0 where the board began to sample anew.
    segment : ndarray, shape (n,)
        Number that grows by one whenever the board started anew: its clock begins again there.
    """

    ticks: NDArray[np.int64]
    sequence: NDArray[Any]
    counts: NDArray[Any]
    status: NDArray[np.uint16]
    lost_before: NDArray[np.int64]
    segment: NDArray[np.int64]

    __repr__ = short_repr

    def __len__(self) -> int:
        return len(self.ticks)

    def of(self, rows: NDArray[np.bool_] | slice) -> Samples:
        """Return some of the samples."""
        return Samples(*(getattr(self, field.name)[rows] for field in fields(self)))

    @classmethod
    def join(cls, parts: Sequence[Samples]) -> Samples:
        """Put batches of one stream together."""
        return cls(
            *(np.concatenate([getattr(part, name) for part in parts]) for name in (field.name for field in fields(cls)))
        )


@dataclass(frozen=True)
class StreamCounts:
    """What a stream held so far; ``unconfirmed`` samples had the right checksum and followed no other sample."""

    samples: int
    messages: int
    lost: int
    corrupt: int
    skipped_bytes: int
    restarts: int
    unconfirmed: int = 0


class SampleDecoder:
    """Streaming decoder: bytes of one format in, samples out.

    Parameters
    ----------
    form : str or FrameFormat
        The format, or its name in `FORMATS`.

    Attributes
    ----------
    messages : list of ndarray
        Packets that are no samples (identity, replies), since the caller last cleared the list.
    """

    def __init__(self, form: str | FrameFormat = "lpc1768") -> None:
        self.format = frame_format(form)
        self.messages: list[NDArray[Any]] = []
        self._scanner = self.format.layout.scanner()
        self._continuity = Continuity(
            (self.format.sequence_field, self.format.mask_of(self.format.sequence_field)),
            (self.format.clock_field, self.format.mask_of(self.format.clock_field)),
            self.format.clock_hz / self.format.slowest_hz,
        )
        self._last: tuple[int, int, int] | None = None  # sequence, raw clock, unwrapped ticks
        self._recent: list[int] = []
        self._segment = 0
        self._samples = self._messages = self._lost = self._received = 0

    @property
    def counts(self) -> StreamCounts:
        """Totals since the start."""
        scanner = self._scanner
        return StreamCounts(
            self._samples,
            self._messages,
            self._lost,
            scanner.corrupt,
            scanner.skipped_bytes,
            self._segment,
            self._continuity.refused,
        )

    def feed(self, data: bytes | bytearray | memoryview) -> Samples:
        """Take the next bytes and return the samples that are now complete."""
        packets = self._scanner.feed(data)
        is_sample = self.format.is_sample(packets)
        if not is_sample.all():
            others = packets[~is_sample]
            self.messages.extend(others)
            self._messages += len(others)
            packets = packets[is_sample]
        return self._number(self._continuity.admit(packets, trust_first=self._scanner.first_at == 0))

    def ticks_of(self, packet: NDArray[Any]) -> int:
        """Board time of a packet that is no sample, in ticks, unwrapped as the nearest to the newest sample's."""
        _, clock, ticks = self._last or (0, 0, 0)
        mask = self.format.mask_of(self.format.clock_field)
        ahead = (int(packet[self.format.clock_field]) - clock) & mask
        return ticks + (ahead if ahead <= mask // 2 else ahead - mask - 1)

    def finish(self) -> None:
        """Count an unfinished frame at the end of the stream as skipped, and one that waits as unconfirmed."""
        self._scanner.finish()
        self._continuity.finish()

    def start_anew(self) -> None:
        """Begin a new segment with the next sample: the board's clock was set anew while nothing could be read."""
        self._last = None
        self._segment += 1

    def gap_s(self, packet_ticks: int) -> float:
        """Board time from the newest sample to a raw time stamp, taken modulo its width, s."""
        _, clock, _ = self._last or (0, 0, 0)
        return ((packet_ticks - clock) & self.format.mask_of(self.format.clock_field)) / self.format.clock_hz

    def break_stream(self) -> None:
        """Bytes before and after this point are not one stream: the connection was lost in between."""
        self.finish()

    def _number(self, packets: NDArray[Any]) -> Samples:
        """Unwrap time and sequence, count what is missing, find the places where the board started anew."""
        n = len(packets)
        status = self.format.status(packets)
        lost, fresh, ticks = np.zeros((3, n), dtype=np.int64)
        if n:
            wrap = self.format.mask_of(self.format.sequence_field) or _ANY_NUMBER
            sequence = self._sequence(packets).astype(np.int64)
            clock = packets[self.format.clock_field].astype(np.int64)
            last_sequence, last_clock, last_ticks = self._last or (int(sequence[0]) - 1, int(clock[0]), int(clock[0]))
            steps = np.diff(sequence, prepend=last_sequence) & wrap
            spans = np.diff(clock, prepend=last_clock) & self.format.mask_of(self.format.clock_field)
            first = (status & Status.FIRST) != 0
            # A clock that went back has wrapped if that makes a short step; otherwise the board started anew.
            back = np.diff(clock, prepend=last_clock) < 0
            anew = back & (spans > _LONGEST_GAP_OVER_WRAP_S * self.format.clock_hz)
            odd = (steps != 1) | first | anew
            odd[0] &= self._last is not None
            periods = _RecentPeriods(self._recent if self._last else [], spans, ~odd)
            for place in np.flatnonzero(odd).tolist():
                fresh[place] = anew[place]
                known = not (first[place] or anew[place])
                gap = _samples_in_gap(steps[place], spans[place], periods.before(place), wrap + 1) if known else None
                if gap is None:
                    periods.start_anew(place)  # sampling began again, perhaps at another rate
                else:
                    lost[place] = gap - 1
            self._recent = periods.before(n)
            ticks = last_ticks + np.cumsum(spans)
            for place in np.flatnonzero(fresh).tolist():
                ticks[place:] += clock[place] - ticks[place]  # a new segment counts from the board's own start
            self._last = int(sequence[-1]), int(clock[-1]), int(ticks[-1])
        segment = self._segment + np.cumsum(fresh)
        self._segment += int(fresh.sum())
        self._samples += n
        self._lost += int(lost.sum())
        numbers = self._sequence(packets)
        self._received += n
        return Samples(ticks, numbers, self.format.counts(packets), status, lost, segment)

    def _sequence(self, packets: NDArray[Any]) -> NDArray[Any]:
        """Sequence numbers of the packets in the byte order of this machine; where there are none, a count of them."""
        if not self.format.sequence_field:
            return (self._received + np.arange(len(packets))).astype(np.uint32)
        numbers = packets[self.format.sequence_field]
        return numbers.astype(numbers.dtype.newbyteorder("="))


class _RecentPeriods:
    """The last regular sample periods before a place in the stream, wherever the stream was cut into batches."""

    LENGTH = 64

    def __init__(self, earlier: list[int], spans: NDArray[np.int64], regular: NDArray[np.bool_]) -> None:
        self._places = np.flatnonzero(regular & (spans > 0))
        self._spans = spans[self._places]
        self._earlier = earlier
        self._start = 0

    def start_anew(self, place: int) -> None:
        """Forget what was before ``place``: the board may run at another rate now."""
        self._earlier = []
        self._start = int(np.searchsorted(self._places, place))

    def before(self, place: int) -> list[int]:
        """At most `LENGTH` regular periods before ``place``, clock ticks."""
        stop = int(np.searchsorted(self._places, place))
        here = self._spans[max(self._start, stop - self.LENGTH) : stop].tolist()
        return (self._earlier + here)[-self.LENGTH :]


def _samples_in_gap(step: int, span: int, periods: list[int], numbers: int) -> int | None:
    """Sample periods between a sample and the one before it; None if time and sequence contradict each other.

    The sequence number counts the gap modulo ``numbers``; the time stamp, divided by the sample period, gives the rest.
    """
    if step == 0:
        return None
    if not periods:
        return int(step)
    by_clock = float(span) / float(np.median(periods))
    gap = int(step) + numbers * max(0, round((by_clock - int(step)) / numbers))
    return gap if abs(gap - by_clock) <= 1.5 + 0.05 * gap else None
