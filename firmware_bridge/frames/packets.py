"""Finding packets of one length in a byte stream: any chunking, any garbage, nothing invented, nothing whole lost.

The stream is read from the left. Where the signature bytes stand and the checksum is right, a packet is accepted and
reading goes on behind it; everywhere else reading goes on one byte further. The rule looks at absolute positions only,
so how the bytes were cut into chunks makes no difference.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

__all__ = ["PacketLayout", "PacketScanner", "StreamLayout", "StreamScanner"]


class StreamScanner(Protocol):
    """Streaming search for samples of one layout; attributes as of `PacketScanner`."""

    accepted: int
    corrupt: int
    skipped_bytes: int
    first_at: int | None

    def feed(self, data: bytes | bytearray | memoryview) -> NDArray[Any]:
        """Take the next bytes and return what is now complete, shape (n,)."""
        ...

    def finish(self) -> None:
        """Count what is left of an unfinished sample as skipped."""


class StreamLayout(Protocol):
    """How samples look on the wire."""

    @property
    def dtype(self) -> np.dtype[Any]:
        """Fields of a sample."""
        ...

    @property
    def size(self) -> int:
        """Usual length on the wire, bytes."""
        ...

    def scanner(self) -> StreamScanner:
        """Return a scanner for a new stream."""
        ...


@dataclass(frozen=True)
class PacketLayout:
    """How one packet looks on the wire.

    Parameters
    ----------
    dtype : dtype
        Fields in the order of the bytes, packed; the last field is the checksum if there is one.
    signature : tuple of (int, int)
        Offsets and values of the bytes that every packet has.
    checksum : callable or None
        Checksum of each row of bytes, shape (n, k) to (n,).
    """

    dtype: np.dtype[Any]
    signature: tuple[tuple[int, int], ...]
    checksum: Callable[[NDArray[np.uint8]], NDArray[Any]] | None

    @property
    def size(self) -> int:
        """Length of a packet, bytes."""
        return self.dtype.itemsize

    def scanner(self) -> PacketScanner:
        """Return a scanner for a new stream."""
        return PacketScanner(self)

    def has_signature(self, packets: NDArray[Any]) -> NDArray[np.bool_]:
        """Return which packets, shape (n,), have the bytes that every packet has."""
        rows = packets.view(np.uint8).reshape(len(packets), self.size)
        return np.all([rows[:, offset] == value for offset, value in self.signature], axis=0) & np.ones(len(rows), bool)

    def is_valid(self, packets: NDArray[Any]) -> NDArray[np.bool_]:
        """Return which packets, shape (n,), carry the right checksum."""
        if self.checksum is None:
            return np.ones(len(packets), dtype=bool)
        name = (self.dtype.names or ())[-1]
        covered = self.size - self.dtype[name].itemsize
        rows = packets.view(np.uint8).reshape(len(packets), self.size)  # (n, size)
        return np.asarray(packets[name] == self.checksum(rows[:, :covered]))


class PacketScanner:
    """Streaming search for the packets of one layout.

    Attributes
    ----------
    accepted : int
        Packets found.
    corrupt : int
        Places where the signature stood but the checksum was wrong: damaged packets.
    skipped_bytes : int
        Bytes that belong to no packet.
    first_at : int or None
        Bytes before the first packet; None before it has come.
    """

    def __init__(self, layout: PacketLayout) -> None:
        self.layout = layout
        self.accepted = 0
        self.corrupt = 0
        self.skipped_bytes = 0
        self.first_at: int | None = None
        self._tail = b""

    def feed(self, data: bytes | bytearray | memoryview) -> NDArray[Any]:
        """Take the next bytes and return the packets that are now complete, shape (n,)."""
        stream = np.frombuffer(self._tail + bytes(data) if self._tail else data, dtype=np.uint8)
        packets, used = self._scan(stream)
        self._tail = stream[used:].tobytes()
        return packets

    def finish(self) -> None:
        """Count what is left of an unfinished packet as skipped; call it at the end of a stream."""
        self.skipped_bytes += len(self._tail)
        self._tail = b""

    def _scan(self, stream: NDArray[np.uint8]) -> tuple[NDArray[Any], int]:
        """Packets in a stream and the number of bytes that are decided."""
        size = self.layout.size
        starts = len(stream) - size + 1  # positions at which a whole packet can begin
        if starts <= 0:
            return np.empty(0, self.layout.dtype), 0
        hit = np.ones(starts, dtype=bool)
        for offset, value in self.layout.signature:
            hit &= stream[offset : offset + starts] == value
        candidates = np.flatnonzero(hit)
        packets = np.lib.stride_tricks.sliding_window_view(stream, size)[candidates]  # (n, size), a copy
        packets = packets.view(self.layout.dtype)[:, 0]
        valid = self.layout.is_valid(packets)
        chosen = _without_overlaps(candidates[valid], size)
        if len(chosen) != np.count_nonzero(valid):
            valid &= np.isin(candidates, chosen)
        self.corrupt += int(np.count_nonzero(~_covered(candidates, chosen, size)))
        self.accepted += len(chosen)
        if self.first_at is None and len(chosen):
            self.first_at = self.skipped_bytes + int(chosen[0])
        used = max(starts, int(chosen[-1]) + size if len(chosen) else 0)
        self.skipped_bytes += used - size * len(chosen)
        return packets[valid], used


def _without_overlaps(starts: NDArray[np.intp], size: int) -> NDArray[np.intp]:
    """Keep, from the left, the starts that do not lie inside a packet kept before."""
    if not (np.diff(starts) < size).any():
        return starts
    kept = []
    free_from = -1
    for start in starts.tolist():
        if start >= free_from:
            kept.append(start)
            free_from = start + size
    return np.array(kept, dtype=np.intp)


def _covered(candidates: NDArray[np.intp], chosen: NDArray[np.intp], size: int) -> NDArray[np.bool_]:
    """Return which candidates are or lie inside a chosen packet."""
    if not len(chosen):
        return np.zeros(len(candidates), dtype=bool)
    before = np.searchsorted(chosen, candidates, side="right") - 1
    return np.asarray((before >= 0) & (candidates < chosen[before] + size))
