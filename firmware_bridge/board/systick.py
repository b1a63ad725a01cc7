"""SysTick: the Cortex-M3's 24-bit down-counter (ARMv7-M ARM B3.3). Its registers lie inside the NVIC's page."""

from __future__ import annotations

from firmware_bridge.board.nvic import SYSTICK
from firmware_bridge.board.peripheral import NEVER, Peripheral

__all__ = ["SysTick"]

_ENABLE, _INTERRUPT, _COUNT_FLAG = 1, 2, 1 << 16


class SysTick(Peripheral):
    """Counts core clock cycles down from the reload value; wraps, and may raise its exception, every reload + 1."""

    def reset(self) -> None:
        """Stop, at zero."""
        self.control = 0
        self.reload = 0
        self.flag = 0
        self.wrap = NEVER
        self.stopped_at = 0

    def read(self, offset: int, size: int) -> int:
        """Control and status (reading clears the count flag), reload, current value, calibration."""
        if offset == 0x10:
            value = self.control | self.flag
            self.flag = 0
            return value
        if offset == 0x14:
            return self.reload
        if offset == 0x18:
            return self._current()
        return 0x8000000F + 0x270FF0  # calibration of the LPC17xx: 10 ms at 100 MHz, without its own reference

    def _current(self) -> int:
        if self.wrap >= NEVER:
            return self.stopped_at
        return (self.wrap - self.bus.now) // self.bus.cycle & 0xFFFFFF

    def write(self, offset: int, value: int, size: int) -> None:
        """Control, reload and current value (writing it clears it)."""
        if offset == 0x10:
            was = self.control & _ENABLE
            self.stopped_at = self._current()
            self.control = value & 7
            if not self.control & _ENABLE:
                self._set_wrap(NEVER)
            elif not was:
                remaining = self.stopped_at or self.reload + 1
                self._set_wrap(self.bus.now + remaining * self.bus.cycle if self.reload else NEVER)
        elif offset == 0x14:
            self.reload = value & 0xFFFFFF
        elif offset == 0x18:
            self.flag = 0
            self.stopped_at = 0
            if self.control & _ENABLE and self.reload:
                self._set_wrap(self.bus.now + (self.reload + 1) * self.bus.cycle)

    def _set_wrap(self, when: int) -> None:
        self.wrap = when
        self.bus.schedule(self.slot, when)

    def event(self) -> None:
        """Wrap: set the flag, raise the exception."""
        self.flag = _COUNT_FLAG
        self._set_wrap(self.wrap + (self.reload + 1) * self.bus.cycle if self.reload else NEVER)
        if self.control & _INTERRUPT:
            self.bus.nvic.pend(SYSTICK)

    def clock_will_change(self) -> None:
        """Keep the count."""
        self.stopped_at = self._current()

    def clock_changed(self) -> None:
        """Count on at the new rate."""
        if self.wrap < NEVER:
            self._set_wrap(self.bus.now + self.stopped_at * self.bus.cycle)
