"""Registers and bits of the ADXL345, units of the model, and what differs from chip to chip."""

from __future__ import annotations

import enum
from dataclasses import dataclass

__all__ = ["RAW_PER_COUNT", "TICKS_PER_SECOND", "Adxl345Options", "LineFault"]

TICKS_PER_SECOND = 14_400_000_000
"""Ticks per second: a whole number of ticks per cycle at 4, 12, 72, 80, 96, 100 and 120 MHz."""

RAW_PER_COUNT = 256
"""Raw conversion values are in 1/256 of the full-resolution count (3.9 mg)."""

DEVICE_ID = 0xE5

THRESH_TAP, OFSX, DUR, LATENT, WINDOW = 0x1D, 0x1E, 0x21, 0x22, 0x23
THRESH_ACT, THRESH_INACT, TIME_INACT, ACT_INACT_CTL = 0x24, 0x25, 0x26, 0x27
THRESH_FF, TIME_FF, TAP_AXES, ACT_TAP_STATUS = 0x28, 0x29, 0x2A, 0x2B
BW_RATE, POWER_CTL, INT_ENABLE, INT_MAP, INT_SOURCE, DATA_FORMAT = 0x2C, 0x2D, 0x2E, 0x2F, 0x30, 0x31
DATAX0, DATAZ1, FIFO_CTL, FIFO_STATUS = 0x32, 0x37, 0x38, 0x39
WRITABLE = frozenset([*range(THRESH_TAP, TAP_AXES + 1), BW_RATE, POWER_CTL, INT_ENABLE, INT_MAP, DATA_FORMAT, FIFO_CTL])

DATA_READY, SINGLE_TAP, DOUBLE_TAP, ACTIVITY, INACTIVITY, FREE_FALL, WATERMARK, OVERRUN = (
    0x80, 0x40, 0x20, 0x10, 0x08, 0x04, 0x02, 0x01,
)  # fmt: skip
EVENTS = SINGLE_TAP | DOUBLE_TAP | ACTIVITY | INACTIVITY | FREE_FALL
LINK, AUTO_SLEEP, MEASURE, SLEEP = 0x20, 0x10, 0x08, 0x04
SELF_TEST, THREE_WIRE, INT_INVERT, FULL_RESOLUTION, LEFT_JUSTIFY = 0x80, 0x40, 0x20, 0x08, 0x04
ACT_AC, ACT_AXES, INACT_AC, INACT_AXES = 0x80, 0x70, 0x08, 0x07
SUPPRESS, ASLEEP, TAP_AXES_BITS, UNDECIMATED = 0x08, 0x08, 0x07, 0x0F
BYPASS, FIFO, STREAM, TRIGGER = range(4)


class LineFault(enum.IntEnum):
    """What may be wrong between the chip and the host."""

    NONE = 0
    SILENT = 1
    """The chip does not take part: unplugged, or without power."""
    STUCK_LOW = 2
    """The data line to the host is shorted to ground."""
    STUCK_HIGH = 3
    """The data line to the host is shorted to the supply."""


@dataclass(frozen=True)
class Adxl345Options:
    """What differs from chip to chip.

    Parameters
    ----------
    clock_error : float
        The chip's oscillator runs (1 + clock_error) times as fast as it should.
    phase : float
        Part of a sample period, 0…1, by which the first conversion is early.
    self_test_counts : tuple of float
        Shift of x, y, z under self-test, full-resolution counts (middle of the data-sheet limits at 2.5 V).
    wires : int
        4 or 3: how the SPI is wired to the host.
    alternate_address : bool
        ALT ADDRESS pin high: I2C address 0x1D instead of 0x53.
    stuck_range : int, optional
        Fault: readings are formatted for this DATA_FORMAT value whatever the register says.
    """

    clock_error: float = 0.0
    phase: float = 0.0
    self_test_counts: tuple[float, float, float] = (294.4, -294.4, 473.6)
    wires: int = 4
    alternate_address: bool = False
    stuck_range: int | None = None
