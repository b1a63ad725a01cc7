"""Packets that a marker byte ends: COBS and SLIP, in which no byte of the packet can be taken for the marker."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from firmware_bridge.frames.packets import PacketLayout

__all__ = ["DelimitedLayout", "DelimitedScanner", "decode_cobs", "decode_slip"]

_SLIP_END, _SLIP_ESCAPE, _SLIP_ESCAPED_END, _SLIP_ESCAPED_ESCAPE = 0xC0, 0xDB, 0xDC, 0xDD
_LONGEST_TAIL = 1 << 16  # bytes without a marker after which they are no packet


def decode_cobs(block: bytes) -> bytes | None:
    """Decode what stands between two zeros; None if it is no COBS (Cheshire & Baker, IEEE/ACM ToN 7(2):159, 1999)."""
    out = bytearray()
    place = 0
    while place < len(block):
        code = block[place]
        end = place + code
        if code == 0 or end > len(block):
            return None
        out += block[place + 1 : end]
        place = end
        if code < 0xFF and place < len(block):
            out.append(0)
    return bytes(out)


def decode_slip(block: bytes) -> bytes | None:
    """Decode what stands between two END bytes; None if an escape is wrong (RFC 1055)."""
    if _SLIP_ESCAPE not in block:
        return block
    out = bytearray()
    escaped = False
    for byte in block:
        if escaped:
            if byte not in {_SLIP_ESCAPED_END, _SLIP_ESCAPED_ESCAPE}:
                return None
            out.append(_SLIP_END if byte == _SLIP_ESCAPED_END else _SLIP_ESCAPE)
            escaped = False
        elif byte == _SLIP_ESCAPE:
            escaped = True
        else:
            out.append(byte)
    return None if escaped else bytes(out)


@dataclass(frozen=True)
class DelimitedLayout:
    """A packet behind COBS or SLIP.

    Parameters
    ----------
    packet : PacketLayout
        The packet once decoded.
    encoding : str
        ``cobs`` (a zero ends a packet) or ``slip`` (0xC0 does).
    """

    packet: PacketLayout
    encoding: Literal["cobs", "slip"]

    @property
    def dtype(self) -> np.dtype[Any]:
        """Fields of a packet."""
        return self.packet.dtype

    @property
    def size(self) -> int:
        """Usual length on the wire with its marker, bytes."""
        return self.packet.size + 2

    def scanner(self) -> DelimitedScanner:
        """Return a scanner for a new stream."""
        return DelimitedScanner(self)


class DelimitedScanner:
    """Streaming search for packets between markers; attributes as of `firmware_bridge.frames.packets.PacketScanner`."""

    def __init__(self, layout: DelimitedLayout) -> None:
        self.layout = layout
        self.accepted = self.corrupt = self.skipped_bytes = 0
        self.first_at: int | None = None
        self._tail = b""
        self._decode, self._marker = (
            (decode_cobs, b"\x00") if layout.encoding == "cobs" else (decode_slip, bytes([_SLIP_END]))
        )

    def feed(self, data: bytes | bytearray | memoryview) -> NDArray[Any]:
        """Take the next bytes and return the packets that are now complete, shape (n,)."""
        *blocks, self._tail = (self._tail + bytes(data)).split(self._marker)
        packet = self.layout.packet
        sized, lengths = [], []
        for block in blocks:
            whole = self._decode(block) if block else None
            if whole is not None and len(whole) == packet.size:
                sized.append(whole)
                lengths.append(len(block) + 1)
            else:
                self.corrupt += len(block) >= packet.size
                self.skipped_bytes += len(block) + bool(block)
        if len(self._tail) > _LONGEST_TAIL:
            self.finish()
        rows = np.frombuffer(b"".join(sized), packet.dtype)
        valid = packet.is_valid(rows) & packet.has_signature(rows)
        if self.first_at is None and valid.any():
            self.first_at = self.skipped_bytes + int(np.sum(np.array(lengths)[: int(np.argmax(valid))]))
        self.corrupt += int(np.count_nonzero(~valid))
        self.skipped_bytes += int(np.sum(np.array(lengths, dtype=np.int64)[~valid]))
        self.accepted += int(np.count_nonzero(valid))
        return rows[valid]

    def finish(self) -> None:
        """Count what is left of an unfinished packet as skipped."""
        self.skipped_bytes += len(self._tail)
        self._tail = b""
