"""Watchdog timer (UM10360 chapter 28)."""

from __future__ import annotations

from firmware_bridge.adxl345.registers import TICKS_PER_SECOND
from firmware_bridge.board.peripheral import NEVER, Peripheral
from firmware_bridge.board.system_control import WATCHDOG

__all__ = ["Watchdog"]

_ENABLE, _RESET_ENABLE, _TIMED_OUT, _INTERRUPT = 1, 2, 4, 8
_MINIMUM = 0xFF
_INTERNAL_OSCILLATOR_HZ = 4_000_000
_PREDIVIDER = 4


class Watchdog(Peripheral):
    """Counts down from WDTC; a complete feed sequence starts it over, running out resets the board."""

    def reset(self) -> None:
        """Off."""
        self.mode = 0
        self.constant = _MINIMUM
        self.clock = 0
        self.expires = NEVER
        self._fed = 0

    def _tick(self) -> int:
        if self.clock & 3 == 1:
            return self.bus.cycle * self.bus.system_control.peripheral_divider(0) * _PREDIVIDER
        return TICKS_PER_SECOND // _INTERNAL_OSCILLATOR_HZ * _PREDIVIDER

    def read(self, offset: int, size: int) -> int:
        """WDMOD, WDTC, WDTV, WDCLKSEL."""
        if offset == 0x0C:
            return max(0, (self.expires - self.bus.now) // self._tick()) if self.expires < NEVER else self.constant
        return {0x00: self.mode, 0x04: self.constant, 0x10: self.clock}.get(offset, 0)

    def write(self, offset: int, value: int, size: int) -> None:
        """WDMOD, WDTC, WDFEED, WDCLKSEL."""
        if offset == 0x00:
            self.mode = (self.mode & 3) | (value & 7)  # enable bits can't be taken back
        elif offset == 0x04:
            self.constant = max(_MINIMUM, value)
        elif offset == 0x08:
            if self._fed == 0xAA and value == 0x55 and self.mode & _ENABLE:
                self.expires = self.bus.now + self.constant * self._tick()
                self.bus.schedule(self.slot, self.expires)
            self._fed = value
        elif offset == 0x10:
            self.clock = value

    def event(self) -> None:
        """Nobody fed it in time."""
        self.expires = NEVER
        self.bus.schedule(self.slot, NEVER)
        self.mode |= _TIMED_OUT
        if self.mode & _RESET_ENABLE:
            self.bus.request_reset(WATCHDOG)
        else:
            self.mode |= _INTERRUPT
            self.bus.nvic.set_line(self.irq, level=True)
