"""Checksums of the frame formats, for one message and for many at once."""

from __future__ import annotations

import binascii
from functools import cache

import numpy as np
from numpy.typing import NDArray

__all__ = ["crc16", "crc16_rows", "sum16_rows"]

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
