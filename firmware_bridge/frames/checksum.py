"""Checksums of the frame formats, for one message and for many at once."""

from __future__ import annotations

import binascii
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["CHECKSUMS", "Checksum", "crc16", "crc16_rows", "sum16_rows"]

_INITIAL = 0xFFFF
_BLOCK_ROWS = 2048  # the table look-ups of one block stay in the processor's cache


def crc16(data: bytes | bytearray | memoryview) -> int:
    """CRC-16/CCITT-FALSE of one message: polynomial 0x1021, initial value 0xFFFF, no reflection, no final XOR."""
    return binascii.crc_hqx(data, _INITIAL)


@cache
def _tables(length: int) -> tuple[NDArray[np.uint16], int]:
    """Contribution of each byte value at each position to the CRC, shape (256 · length,), and the CRC of zeros.

    The CRC is affine over GF(2): crc(x) = crc(0) ⊕ Σ contribution(position, byte). So all rows of a matrix of messages
    are done with one look-up per byte and no loop over the bits.
    """
    zeros = crc16(bytes(length))
    table = np.empty((length, 256), dtype=np.uint16)
    for position in range(length):
        tail = bytes(length - position - 1)
        for value in range(256):
            table[position, value] = binascii.crc_hqx(bytes([value]) + tail, 0)
    return table.reshape(-1), zeros


def crc16_rows(rows: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """CRC-16/CCITT-FALSE of each row of bytes, shape (n, length) to (n,)."""
    table, zeros = _tables(rows.shape[1])
    offsets = np.arange(rows.shape[1], dtype=np.intp) * 256
    result = np.empty(len(rows), dtype=np.uint16)
    for start in range(0, len(rows), _BLOCK_ROWS):
        block = slice(start, start + _BLOCK_ROWS)
        result[block] = np.bitwise_xor.reduce(table.take(rows[block] + offsets), axis=1)
    return result ^ np.uint16(zeros)


def sum16_rows(rows: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Sum modulo 2¹⁶ of the bytes of each row, shape (n, length) to (n,)."""
    return rows.sum(axis=1, dtype=np.uint32).astype(np.uint16)


def _crc16_modbus(data: bytes) -> int:
    """CRC-16/MODBUS: polynomial 0x8005 reflected, initial value 0xFFFF."""
    value = 0xFFFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ (0xA001 if value & 1 else 0)
    return value


def _crc8(data: bytes) -> int:
    """CRC-8/SMBUS: polynomial 0x07, initial value 0."""
    value = 0
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = (value << 1 ^ (0x07 if value & 0x80 else 0)) & 0xFF
    return value


def _of_each(one: Callable[[bytes], int]) -> Callable[[NDArray[np.uint8]], NDArray[Any]]:
    return lambda rows: np.array([one(row.tobytes()) for row in rows], dtype=np.uint32)


@dataclass(frozen=True)
class Checksum:
    """A checksum at the end of a packet.

    Parameters
    ----------
    bytes : int
        Its width; 0 for none.
    of_rows : callable or None
        Checksum of each row of bytes, shape (n, k) to (n,).
    """

    bytes: int
    of_rows: Callable[[NDArray[np.uint8]], NDArray[Any]] | None


CHECKSUMS: Mapping[str, Checksum] = {
    "none": Checksum(0, None),
    "sum8": Checksum(1, lambda rows: rows.sum(axis=1, dtype=np.uint32).astype(np.uint8)),
    "xor8": Checksum(1, lambda rows: np.bitwise_xor.reduce(rows, axis=1)),
    "crc8": Checksum(1, _of_each(_crc8)),
    "sum16": Checksum(2, sum16_rows),
    "crc16_ccitt_false": Checksum(2, crc16_rows),
    "crc16_modbus": Checksum(2, _of_each(_crc16_modbus)),
    "crc32": Checksum(4, _of_each(binascii.crc32)),
}
"""Checksums by the name that format files use; CRCs by the names of the CRC catalogue (crc8: CRC-8/SMBUS)."""
