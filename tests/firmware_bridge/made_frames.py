"""Frames that a board may send, beside its samples (`firmware_bridge.encode_samples`)."""

from __future__ import annotations

import struct

from firmware_bridge import FrameType, crc16


def encode_message(kind: FrameType, sequence: int, time_us: int, payload: bytes) -> bytes:
    """Encode one identity or reply frame of the format `lpc1768`; ``payload`` has at most 24 bytes."""
    body = struct.pack("<2sBBHI24sHh", b"\xa5\x5a", 1, kind, sequence & 0xFFFF, time_us, payload, 0, -(2**15))
    return body + struct.pack("<H", crc16(body))
