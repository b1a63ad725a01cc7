"""Repetitive interrupt timer of the LPC1768 (UM10360 chapter 22)."""

from __future__ import annotations

from firmware_bridge.board.bus import Bus
from firmware_bridge.board.peripheral import NEVER, Peripheral

__all__ = ["RepetitiveTimer"]

_FLAG, _CLEAR, _ENABLE = 1, 2, 8
_ALL = 0xFFFFFFFF
_CLOCK_PLACE = 32 + 26


class RepetitiveTimer(Peripheral):
    """A counter, a compare value and a mask of bits that are not compared."""

    def __init__(self, bus: Bus) -> None:
        super().__init__(bus, "rit", 0x400B0000, irq=29)

    def reset(self) -> None:
        """Count from zero, as the part does after reset."""
        self.compare = _ALL
        self.mask = 0
        self.control = 0xC
        self.held = 0
        self.since = self.bus.now
        self._set_tick()
        self._plan()

    def _set_tick(self) -> None:
        self.tick = self.bus.cycle * self.bus.system_control.peripheral_divider(_CLOCK_PLACE)

    def _count(self) -> int:
        if not self.control & _ENABLE:
            return self.held
        return self.held + (self.bus.now - self.since) // self.tick & _ALL

    def _hold(self) -> None:
        """Restart the reckoning from the present count."""
        count = self._count()
        if self.control & _ENABLE:
            self.since += (self.bus.now - self.since) // self.tick * self.tick
        else:
            self.since = self.bus.now
        self.held = count

    def _next_match(self, count: int) -> int:
        """Return the first value from ``count`` on, around, that equals the compare value where it is compared."""
        free, wanted = self.mask, self.compare & ~self.mask & _ALL
        if count & ~free & _ALL == wanted:
            return count
        best = wanted + _ALL + 1
        for bit in range(32):  # agree with the count above this bit, be larger in it, be least below
            here, above = 1 << bit, _ALL << (bit + 1) & _ALL
            head = count & above | here
            if not count & here and head & ~free & (above | here) == wanted & (above | here):
                best = min(best, head | wanted & (here - 1))
        return best

    def _plan(self, *, after_match: bool = False) -> None:
        when = NEVER
        if self.control & _ENABLE:
            start = self.held + after_match
            when = self.since + (self._next_match(start & _ALL) + (start & ~_ALL) - self.held) * self.tick
        self.due = when
        self.bus.schedule(self.slot, when)

    def event(self) -> None:
        """Set the flag; start over from zero if asked to."""
        count = self.held + (self.due - self.since) // self.tick & _ALL
        self.held, self.since = count, self.due
        self.control |= _FLAG
        if self.control & _CLEAR:
            self.held, self.since = 0, self.due + self.tick
        self._plan(after_match=not self.control & _CLEAR)
        self.bus.nvic.set_line(self.irq, level=True)

    def read(self, offset: int, size: int) -> int:
        """RICOMPVAL, RIMASK, RICTRL, RICOUNTER."""
        if offset == 0x0C:
            return self._count() if self.bus.now >= self.since else 0
        return {0x00: self.compare, 0x04: self.mask, 0x08: self.control}.get(offset, 0)

    def write(self, offset: int, value: int, size: int) -> None:
        """RICOMPVAL, RIMASK, RICTRL (its flag is cleared by a one), RICOUNTER."""
        self._hold()
        if offset == 0x00:
            self.compare = value
        elif offset == 0x04:
            self.mask = value
        elif offset == 0x08:
            flag = self.control & _FLAG & ~value
            self.control = value & 0xE | flag
            self.bus.nvic.set_line(self.irq, level=flag)
        elif offset == 0x0C:
            self.held, self.since = value, self.bus.now
        self._plan()

    def clock_will_change(self) -> None:
        """Keep the count."""
        self._hold()

    def clock_changed(self) -> None:
        """Count on at the new rate."""
        self._set_tick()
        self._plan()
