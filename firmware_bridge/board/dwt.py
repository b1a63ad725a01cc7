"""DWT cycle counter of the Cortex-M3 (ARMv7-M ARM C1.8)."""

from __future__ import annotations

from firmware_bridge.board.peripheral import Peripheral

__all__ = ["CycleCounter"]


class CycleCounter(Peripheral):
    """CYCCNT counts core clock cycles while DWT_CTRL bit 0 is set."""

    def reset(self) -> None:
        """Stop, at zero."""
        self.control = 0x40000000
        self.since = 0
        self.count = 0

    def _now(self) -> int:
        if not self.control & 1:
            return self.count
        return self.count + (self.bus.now - self.since) // self.bus.cycle & 0xFFFFFFFF

    def read(self, offset: int, size: int) -> int:
        """DWT_CTRL and CYCCNT."""
        return {0x0: self.control, 0x4: self._now()}.get(offset, 0)

    def write(self, offset: int, value: int, size: int) -> None:
        """DWT_CTRL and CYCCNT."""
        self.count = self._now()
        self.since = self.bus.now
        if offset == 0x0:
            self.control = 0x40000000 | value & 1
        elif offset == 0x4:
            self.count = value

    def clock_will_change(self) -> None:
        """Keep the count."""
        self.count = self._now()
        self.since = self.bus.now
