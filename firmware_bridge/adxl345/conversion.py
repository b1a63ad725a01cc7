"""From the analogue side to the data registers: conversions in blocks, their rate, their format."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from firmware_bridge.adxl345.registers import FULL_RESOLUTION, LEFT_JUSTIFY, TICKS_PER_SECOND

__all__ = ["ConversionSource", "Readings", "format_count", "output_period", "wake_up_period"]

ConversionSource = Callable[[int, int, int, int], NDArray[np.int32]]
"""(first tick, period in ticks, number, BW_RATE register) → raw conversions, shape (number, 3)."""

BLOCK = 256  # conversions asked for at a time
_SLOWEST_PERIOD = 1024 * TICKS_PER_SECOND // 100  # rate code 0: 0.09765625 Hz


def output_period(rate_code: int, clock_error: float) -> int:
    """Ticks between two conversions at a BW_RATE code, by the chip's own clock."""
    return round((_SLOWEST_PERIOD >> (rate_code & 15)) / (1.0 + clock_error))


def wake_up_period(wake_up: int, clock_error: float) -> int:
    """Ticks between two conversions in sleep, by the wake-up bits of POWER_CTL: 8, 4, 2 or 1 Hz."""
    return round(((TICKS_PER_SECOND // 8) << (wake_up & 3)) / (1.0 + clock_error))


def format_count(raw: int, data_format: int, bw_rate: int) -> int:
    """Return the data register value, 0…65535, of one raw conversion under DATA_FORMAT and BW_RATE."""
    rng = data_format & 3
    full = data_format & FULL_RESOLUTION
    bits = 10 + rng if full else 10
    shift = 8 if full else 8 + rng
    count = (raw + (1 << (shift - 1))) >> shift
    limit = 1 << (bits - 1)
    if count >= limit:
        count = limit - 1
    elif count < -limit:
        count = -limit
    if (bw_rate & 15) >= 14 and (full or rng == 0):
        count &= ~1  # at 3200 and 1600 Hz the LSB is always 0
    if data_format & LEFT_JUSTIFY:
        count <<= 16 - bits
    return count & 0xFFFF


class Readings:
    """A series of raw conversions, asked for in blocks."""

    def __init__(self) -> None:
        self._block: list[list[int]] = []
        self.place = 0

    def restart(self) -> None:
        """Drop what was asked for in advance."""
        self._block = []
        self.place = 0

    def take(self, source: ConversionSource, first: int, period: int, bw_rate: int, skip: int = 0) -> list[int]:
        """Yield the conversion ``skip`` places ahead of the one at tick ``first``."""
        place = self.place + skip
        if place >= len(self._block):
            self._block = source(first + skip * period, period, BLOCK, bw_rate).tolist()
            place = 0
        self.place = place + 1
        return self._block[place]
