"""From bytes to samples: a stream in one of the frame formats, with unwrapped time and what is missing in it.

`SampleDecoder` turns a byte stream in one of the formats (`firmware_bridge.frames.frame_format`,
docs/reference/frames.md) into
samples with unwrapped time, the number of samples lost before each, and a segment number that changes whenever the
board has started anew.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from firmware_bridge.frames.commands import FrameType
from firmware_bridge.frames.continuity import Continuity
from firmware_bridge.frames.format_file import load_format
from firmware_bridge.frames.frame_format import (
    FORMATS,
    LPC1768_DTYPE,
    FrameFormat,
    Status,
    encode_samples,
)
from gfimu.base.declared import Declared, figure
from gfimu.base.errors import unknown_name
from gfimu.base.files.model_files import list_models
from gfimu.base.short_repr import short_repr

__all__ = [
    "FORMATS",
    "LPC1768_DTYPE",
    "FrameFormat",
    "FrameType",
    "SampleDecoder",
    "Samples",
    "Status",
    "StreamCounts",
    "encode_samples",
    "frame_format",
]

_LONGEST_GAP_OVER_WRAP_S = 10.0
_ANY_NUMBER = 0xFFFFFFFF  # of samples that carry none


def frame_format(name: str | FrameFormat) -> FrameFormat:
    """Return a frame format given as such, by name, or as a TOML file; raises `InputError` that lists the formats."""
    if isinstance(name, FrameFormat):
        return name
    if name in FORMATS:
        return FORMATS[name]
    described = list_models("frames")
    if name in described or name.endswith(".toml"):
        return load_format(name)
    raise unknown_name("frame format", name, (*FORMATS, *described))


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
    temperature_degC : ndarray, shape (n,)
        Temperature of the board; NaN where the sample has none.
    """

    ticks: NDArray[np.int64]
    sequence: NDArray[Any]
    counts: NDArray[Any]
    status: NDArray[np.uint16]
    lost_before: NDArray[np.int64]
    segment: NDArray[np.int64]
    temperature_degC: NDArray[np.float64]

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
class StreamCounts(Declared):
    """How a stream of samples came in."""

    samples: Annotated[int, figure("Samples that were received.", head="samples")]
    messages: Annotated[int, figure("Messages of the board that are no samples.")]
    lost: Annotated[int, figure("Samples that were lost, by the numbers of the frames.", head="lost")]
    corrupt: Annotated[int, figure("Frames with a wrong checksum.", head="corrupt")]
    skipped_bytes: Annotated[int, figure("Bytes between frames.", "bytes", head="skipped")]
    restarts: Annotated[int, figure("Restarts of the board.", head="board restarts")]
    unconfirmed: Annotated[
        int,
        figure("Samples that follow no other and are refused.", head="samples that follow no other, refused"),
    ] = 0


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
        counts, warm = self.format.counts(packets), self.format.temperatures(packets)
        return Samples(ticks, numbers, counts, status, lost, segment, warm)

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
