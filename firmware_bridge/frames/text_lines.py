"""Samples as lines of text: columns between separators, or the groups of a regular expression."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["TextLayout", "TextScanner"]

_LONGEST_LINE = 4096  # bytes without an end of line after which they are no sample


@dataclass(frozen=True)
class TextLayout:
    """A line of text that is one sample.

    Parameters
    ----------
    pattern : re.Pattern
        Matches a whole line; group ``time``, groups of the channels, and where there are such ``sequence`` and
        ``temperature``.
    channels : tuple of str
        Groups of the channels, in the order of the counts.
    ticks_per_unit : float
        Ticks of the format's clock in a unit of the line's time.
    counts_per_unit : float
        Counts in a unit of the line's readings.
    wraps_at : float, optional
        Where the line's time starts over.
    """

    pattern: re.Pattern[bytes]
    channels: tuple[str, ...]
    ticks_per_unit: float
    counts_per_unit: float
    wraps_at: float | None = None

    @property
    def dtype(self) -> np.dtype[Any]:
        """Fields of a sample."""
        return np.dtype(
            [("sequence", "<u4"), ("time", "<u8"), ("counts", "<i4", len(self.channels)), ("temperature", "<f8")]
        )

    @property
    def size(self) -> int:
        """Usual length of a line, bytes."""
        return 8 * (1 + len(self.channels))

    def scanner(self) -> TextScanner:
        """Return a scanner for a new stream."""
        return TextScanner(self)


class TextScanner:
    """Streaming search for lines that match; attributes as of `firmware_bridge.frames.packets.PacketScanner`.

    Lines that do not match, such as headings and messages of the board, are skipped.
    """

    def __init__(self, layout: TextLayout) -> None:
        self.layout = layout
        self.accepted = self.corrupt = self.skipped_bytes = 0
        self.first_at: int | None = None
        self._tail = b""
        self._last = self._turns = 0.0

    def feed(self, data: bytes | bytearray | memoryview) -> NDArray[Any]:
        """Take the next bytes and return the samples of the lines that are now complete, shape (n,)."""
        *lines, self._tail = (self._tail + bytes(data)).split(b"\n")
        rows = []
        for line in lines:
            row = self._row(line.strip())
            if row is None:
                self.skipped_bytes += len(line) + 1
                continue
            if self.first_at is None:
                self.first_at = self.skipped_bytes
            rows.append(row)
        if len(self._tail) > _LONGEST_LINE:
            self.finish()
        self.accepted += len(rows)
        return np.array(rows, dtype=self.layout.dtype) if rows else np.empty(0, self.layout.dtype)

    def _row(self, line: bytes) -> tuple[int, int, tuple[int, ...], float] | None:
        """Return a sample; None for a line that is none."""
        layout = self.layout
        found = layout.pattern.fullmatch(line)
        if found is None:
            return None
        groups = found.groupdict()
        try:
            time = round(self._unwrapped(float(groups["time"])) * layout.ticks_per_unit)
            counts = tuple(round(float(groups[name]) * layout.counts_per_unit) for name in layout.channels)
            sequence = int(groups.get("sequence") or 0)
            temperature = float(groups.get("temperature") or "nan")
        except (ValueError, OverflowError):  # of NaN, infinity, or an empty group
            return None
        inside = all(abs(count) < 1 << 31 for count in counts) and 0 <= time < 1 << 63 and 0 <= sequence < 1 << 32
        return (sequence, time, counts, temperature) if inside else None

    def _unwrapped(self, time: float) -> float:
        """Go on where the time starts over."""
        wraps_at = self.layout.wraps_at
        if wraps_at is not None and time < self._last - 0.5 * wraps_at:
            self._turns += 1.0
        self._last = time
        return time + self._turns * (wraps_at or 0.0)

    def finish(self) -> None:
        """Count what is left of an unfinished line as skipped."""
        self.skipped_bytes += len(self._tail)
        self._tail = b""
