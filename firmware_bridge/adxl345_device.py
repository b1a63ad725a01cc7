"""The ADXL345 at register level: what a driver sees through SPI or I2C (data sheet Rev. E).

Time is an integer number of ticks of the board (`TICKS_PER_SECOND`). The analogue side is not here: a conversion
source returns what each conversion yields, before range, resolution and justification, which the chip applies when a
register is read. The same chip exists in C for the fast path (``board/native/adxl345.c``); both do integer arithmetic
only and agree bit by bit.
"""

from __future__ import annotations

import enum
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "RAW_PER_COUNT",
    "TICKS_PER_SECOND",
    "Adxl345",
    "Adxl345Options",
    "ConversionSource",
    "LineFault",
    "format_count",
]

TICKS_PER_SECOND = 14_400_000_000
"""Ticks per second: a whole number of ticks per cycle at 4, 12, 72, 80, 96, 100 and 120 MHz."""

RAW_PER_COUNT = 256
"""Raw conversion values are in 1/256 of the full-resolution count (3.9 mg)."""

ConversionSource = Callable[[int, int, int, int], NDArray[np.int32]]
"""(first tick, period in ticks, number, BW_RATE register) → raw conversions, shape (number, 3)."""

DEVICE_ID = 0xE5
BLOCK = 256  # conversions asked for at a time

THRESH_TAP, OFSX, TAP_AXES = 0x1D, 0x1E, 0x2A
BW_RATE, POWER_CTL, INT_ENABLE, INT_MAP, INT_SOURCE, DATA_FORMAT = 0x2C, 0x2D, 0x2E, 0x2F, 0x30, 0x31
DATAX0, DATAZ1, FIFO_CTL, FIFO_STATUS = 0x32, 0x37, 0x38, 0x39
DATA_READY, WATERMARK, OVERRUN = 0x80, 0x02, 0x01
EVENTS = 0x7C  # single tap, double tap, activity, inactivity, free fall
MEASURE, SLEEP = 0x08, 0x04
SELF_TEST, THREE_WIRE, INT_INVERT, FULL_RESOLUTION, LEFT_JUSTIFY = 0x80, 0x40, 0x20, 0x08, 0x04
BYPASS, FIFO, STREAM, TRIGGER = range(4)
_WRITABLE = frozenset(
    [*range(THRESH_TAP, TAP_AXES + 1), BW_RATE, POWER_CTL, INT_ENABLE, INT_MAP, DATA_FORMAT, FIFO_CTL]
)

_FIFO_DEPTH = 32  # and one more entry at the output filter
_RAW_PER_OFFSET_STEP = 4 * RAW_PER_COUNT  # OFSx: 15.6 mg = 4 counts of 3.9 mg, in every range
_POP_TICKS = 5 * TICKS_PER_SECOND // 1_000_000
_TURN_ON_TICKS = 11 * TICKS_PER_SECOND // 10_000  # τ + 1.1 ms from standby to the first sample
_SLOWEST_PERIOD = 1024 * TICKS_PER_SECOND // 100  # rate code 0: 0.09765625 Hz
_NO_AXIS = 99  # no value is being read
_FLOATING = 0xFF  # what the host reads from a line that nobody drives


class LineFault(enum.IntEnum):
    """What may be wrong between the chip and the host."""

    NONE = 0
    SILENT = 1
    """The chip neither hears nor answers: unplugged, or without power."""
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


class Adxl345:
    """One ADXL345.

    Parameters
    ----------
    source : callable
        Where the conversions come from.
    options : Adxl345Options
        Clock, self-test, wiring.
    """

    def __init__(self, source: ConversionSource, options: Adxl345Options | None = None) -> None:
        self.line_fault = LineFault.NONE
        self.source = source
        self.options = options or Adxl345Options()
        shift = self.options.self_test_counts
        self.self_test_raw = tuple(round(counts * RAW_PER_COUNT) for counts in shift)
        self.power_on()

    def power_on(self) -> None:
        """Return to the state after power-on: standby, registers at their reset values."""
        self.registers = bytearray(64)
        self.registers[0] = DEVICE_ID
        self.registers[BW_RATE] = 0x0A
        self.events = 0
        self.fifo: list[tuple[int, int, int]] = []
        self.next_conversion: int | None = None
        self.triggered = False
        self._data_ready = False
        self._overrun = False
        self._out = (0, 0, 0)
        self._word_axis = _NO_AXIS
        self._word = 0
        self._deaf_host = self.options.wires == 3
        self._shown = 0
        self._pop_done = 0
        self._block: list[list[int]] = []
        self._block_place = 0
        self._selected = False
        self._command: int | None = None
        self._address = 0
        self._reading = False
        self._period = self._sample_period()
        self._set_added()

    # Conversions

    def _sample_period(self) -> int:
        """Ticks between two conversions at the present rate, by the chip's own clock."""
        if self.registers[POWER_CTL] & SLEEP:
            nominal = (TICKS_PER_SECOND // 8) << (self.registers[POWER_CTL] & 3)
        else:
            nominal = _SLOWEST_PERIOD >> (self.registers[BW_RATE] & 15)
        return round(nominal / (1.0 + self.options.clock_error))

    def _restart(self, start: int) -> None:
        """Begin converting, or stop, after a change of rate or power mode."""
        self._period = self._sample_period()
        self._block = []
        self._block_place = 0
        measuring = self.registers[POWER_CTL] & MEASURE
        early = round(self._period * self.options.phase)
        self.next_conversion = start + self._period - early if measuring else None

    def _conversion(self, skip: int) -> tuple[int, int, int]:
        """Yield the conversion ``skip`` places ahead; ``next_conversion`` is still the first of them."""
        place = self._block_place + skip
        if place >= len(self._block):
            assert self.next_conversion is not None
            first = self.next_conversion + skip * self._period
            self._block = self.source(first, self._period, BLOCK, self.registers[BW_RATE]).tolist()
            place = 0
        self._block_place = place + 1
        x, y, z = self._block[place]
        added = self._added
        return x + added[0], y + added[1], z + added[2]

    def _set_added(self) -> None:
        """Work out what the offset registers and the self-test add to a raw conversion."""
        offsets = self.registers[OFSX : OFSX + 3]
        shift = self.self_test_raw if self.registers[DATA_FORMAT] & SELF_TEST else (0, 0, 0)
        self._added = [_signed(byte) * _RAW_PER_OFFSET_STEP + by for byte, by in zip(offsets, shift, strict=True)]

    def catch_up(self, now: int) -> None:
        """Do the conversions that are due by ``now``."""
        if self.next_conversion is None or now < self.next_conversion:
            return
        due = (now - self.next_conversion) // self._period + 1
        mode = self.registers[FIFO_CTL] >> 6
        if mode == BYPASS:
            self._overrun |= self._data_ready or due > 1
            self._out = self._conversion(due - 1)
            self._data_ready = True
            self.next_conversion += due * self._period
            return
        filling = mode == FIFO or (mode == TRIGGER and self.triggered)
        # Conversions that leave no trace: those that find a full FIFO, or those that newer ones push out.
        stored = min(due, _FIFO_DEPTH + 1)
        skip = 0 if filling else due - stored
        for place in range(stored):
            ahead = skip if place == 0 else 0
            sample = self._conversion(ahead)
            self.next_conversion += (ahead + 1) * self._period
            self._store(sample, mode)
        if filling and due > stored:
            self._block_place += due - stored
            self.next_conversion += (due - stored) * self._period
            self._overrun = True

    def _store(self, sample: tuple[int, int, int], mode: int) -> None:
        """Put one sample into the FIFO."""
        holds = _FIFO_DEPTH + 1
        if mode == TRIGGER and not self.triggered:
            holds = max(1, self.registers[FIFO_CTL] & 31)  # keeps the last n samples until the trigger comes
        if len(self.fifo) >= holds:
            if mode == FIFO or (mode == TRIGGER and self.triggered):
                self._overrun = True
                return
            del self.fifo[0]
        self.fifo.append(sample)
        if len(self.fifo) >= _FIFO_DEPTH:
            self._overrun = True  # outside bypass mode: set when the FIFO is filled

    # Interrupts

    def raise_event(self, event: int, now: int) -> None:
        """Raise a tap, activity, inactivity or free-fall event (a bit of INT_SOURCE), as the sensing logic would."""
        self.catch_up(now)
        if not self.registers[INT_ENABLE] & event & EVENTS:
            return
        self.events |= event & EVENTS
        pin = self.registers[FIFO_CTL] >> 5 & 1
        on_pin = bool(self.registers[INT_MAP] & event) == bool(pin)
        if self.registers[FIFO_CTL] >> 6 == TRIGGER and on_pin and not self.triggered:
            self.triggered = True
            keep = self.registers[FIFO_CTL] & 31
            self.fifo = self.fifo[-keep:] if keep else []

    def _int_source(self) -> int:
        source = self.events
        if self.fifo if self.registers[FIFO_CTL] >> 6 else self._data_ready:
            source |= DATA_READY
        if len(self.fifo) >= self.registers[FIFO_CTL] & 31:
            source |= WATERMARK
        return source | (OVERRUN if self._overrun else 0)

    def interrupt_pin(self, number: int, now: int) -> bool:
        """Level of pin INT1 or INT2 at ``now``."""
        self.catch_up(now)
        mapped = self.registers[INT_MAP] if number == 2 else ~self.registers[INT_MAP]
        active = bool(self._int_source() & self.registers[INT_ENABLE] & mapped)
        return active != bool(self.registers[DATA_FORMAT] & INT_INVERT)

    # Registers

    def _read(self, address: int, now: int) -> int:
        if DATAX0 <= address <= DATAZ1:
            self._reading = True
            stuck = self.options.stuck_range
            data_format = self.registers[DATA_FORMAT] if stuck is None else stuck
            axis = (address - DATAX0) >> 1
            if axis != self._word_axis:  # both bytes of a value are of one reading
                self._word_axis = axis
                self._word = format_count(self._out[axis], data_format, self.registers[BW_RATE])
            return self._word >> 8 if address & 1 else self._word & 0xFF
        if self._reading and address == DATAZ1 + 1:
            self._end_of_read(now)
        if address == INT_SOURCE:
            value = self._int_source()
            self.events = 0
            return value
        if address == FIFO_STATUS:
            entries = self._shown if now < self._pop_done else min(len(self.fifo), _FIFO_DEPTH)
            return entries | (0x80 if self.triggered else 0)
        return self.registers[address]

    def _show(self, now: int) -> None:
        """Move the oldest FIFO entry to the data registers, once the last pop is complete (5 µs)."""
        if self.registers[FIFO_CTL] >> 6 and self.fifo and now >= self._pop_done:
            self._out = self.fifo[0]

    def _end_of_read(self, now: int) -> None:
        """Pop the FIFO and clear the flags, at the step from 0x37 to 0x38 or when CS goes high."""
        self._reading = False
        self._overrun = False
        if self.registers[FIFO_CTL] >> 6 == BYPASS:
            self._data_ready = False
        elif self.fifo:
            self._shown = min(len(self.fifo), _FIFO_DEPTH)
            del self.fifo[0]
            self._pop_done = now + _POP_TICKS

    def _write(self, address: int, value: int, now: int) -> None:
        if address not in _WRITABLE:
            return
        old = self.registers[address]
        self.registers[address] = value
        self._set_added()
        if address == BW_RATE:
            self._restart(now)
        elif address == POWER_CTL and (old ^ value) & (MEASURE | SLEEP | 3):
            waking = value & MEASURE and not old & MEASURE
            self._restart(now + _TURN_ON_TICKS if waking else now)
        elif address == DATA_FORMAT:
            # A chip in 3-wire mode on four wires, or the other way round, drives a line the host does not listen to.
            self._deaf_host = bool(value & THREE_WIRE) != (self.options.wires == 3)
        elif address == FIFO_CTL and value >> 6 != old >> 6:
            if value >> 6 == BYPASS:
                self.fifo.clear()
                self._data_ready = self._overrun = False
            self.triggered = False

    def write_register(self, address: int, value: int, now: int) -> None:
        """Write a register at ``now`` without a bus."""
        self.catch_up(now)
        self._write(address, value, now)

    # SPI

    def select(self, now: int) -> None:
        """CS goes low."""
        self.catch_up(now)
        self._selected = True
        self._command = None
        self._reading = False

    def deselect(self, now: int) -> None:
        """CS goes high."""
        if self._selected and self._reading:
            self._end_of_read(now)
        self._selected = False

    def transfer(self, value: int, now: int) -> int:
        """Exchange one byte: bit 7 of the first is read, bit 6 multiple bytes."""
        fault = self.line_fault
        if fault and fault == LineFault.SILENT:
            return _FLOATING
        command = self._command
        if command is None:
            self._command = value
            self._address = value & 0x3F
            self._word_axis = _NO_AXIS
            self.catch_up(now)
            self._show(now)
            answer = 0
        else:
            address = self._address
            if command & 0x40:
                self._address = (address + 1) & 0x3F
            if command & 0x80:
                # The second byte of a value, the most frequent case, needs no look at the registers.
                if address & 1 and (address - DATAX0) >> 1 == self._word_axis:
                    answer = self._word >> 8
                else:
                    answer = self._read(address, now)
            else:
                self._write(address, value, now)
                answer = 0
        if fault:
            return 0 if fault == LineFault.STUCK_LOW else _FLOATING
        return _FLOATING if self._deaf_host else answer

    # I2C

    @property
    def i2c_address(self) -> int:
        """Seven-bit bus address."""
        return 0x1D if self.options.alternate_address else 0x53

    def i2c_start(self, address_byte: int, now: int) -> bool:
        """Start or repeated start with an address byte; True when the chip acknowledges."""
        if address_byte >> 1 != self.i2c_address:
            return False
        if self._reading:
            self._end_of_read(now)
        self.catch_up(now)
        self._show(now)
        self._word_axis = _NO_AXIS
        self._selected = True
        if not address_byte & 1:
            self._command = None
        return True

    def i2c_write(self, value: int, now: int) -> bool:
        """Byte from the host: first the register address, then data; the address counts up."""
        if self._command is None:
            self._command = 0
            self._address = value & 0x3F
        else:
            self._write(self._address, value, now)
            self._address = (self._address + 1) & 0x3F
        return True

    def i2c_read(self, now: int) -> int:
        """Byte to the host; the address counts up."""
        answer = self._read(self._address, now)
        self._address = (self._address + 1) & 0x3F
        return answer

    def i2c_stop(self, now: int) -> None:
        """Stop condition: ends a data read as CS going high does."""
        self.deselect(now)


def _signed(byte: int) -> int:
    return byte - 256 if byte > 127 else byte
