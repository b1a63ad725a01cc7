"""The register-level ADXL345 as a driver sees it, through SPI or I2C."""

from __future__ import annotations

from firmware_bridge.adxl345.core import NO_AXIS, ChipCore
from firmware_bridge.adxl345.registers import DATAX0, LineFault

__all__ = ["Adxl345"]

_FLOATING = 0xFF  # what the host reads from a line that nobody drives


class Adxl345(ChipCore):
    """One ADXL345.

    Parameters
    ----------
    source : callable
        Where the conversions come from.
    options : Adxl345Options
        Clock, self-test, wiring.
    """

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
            self._word_axis = NO_AXIS
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
        self._word_axis = NO_AXIS
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
