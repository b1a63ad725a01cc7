"""TIMER0…3 of the LPC1768: counter with prescaler and four match registers (UM10360 chapter 21)."""

from __future__ import annotations

from firmware_bridge.board.bus import Bus
from firmware_bridge.board.peripheral import NEVER, Peripheral

__all__ = ["Timer"]

_ENABLE, _RESET = 1, 2
_WRAP = 1 << 32


class Timer(Peripheral):
    """The count is worked out when it is read; only matches that do something are events."""

    matches = 4

    def __init__(self, bus: Bus, name: str, base: int, irq: int, clock_place: int) -> None:
        self.clock_place = clock_place
        super().__init__(bus, name, base, irq=irq)

    def reset(self) -> None:
        """Stop, at zero."""
        self.interrupts = 0
        self.control = 0
        self.prescale = 0
        self.match_control = 0
        self.match = [0] * self.matches
        self.start_count = 0
        self.start = 0
        self.due = NEVER
        self.due_match = 0
        self.stored: dict[int, int] = {}
        self._set_tick()

    def _set_tick(self) -> None:
        divider = self.bus.system_control.peripheral_divider(self.clock_place)
        self.tick = self.bus.cycle * divider * (self.prescale + 1)

    def flag(self, number: int) -> int:
        """Bit of a match in the interrupt register."""
        return 1 << number

    def count(self) -> int:
        """Timer counter now."""
        if self.control != _ENABLE or self.bus.now < self.start:
            return self.start_count
        return (self.start_count + (self.bus.now - self.start) // self.tick) & 0xFFFFFFFF

    def _hold(self) -> None:
        """Restart the reckoning from the present count."""
        count = self.count()
        if self.control == _ENABLE and self.bus.now > self.start:
            self.start += (self.bus.now - self.start) // self.tick * self.tick
        elif self.control != _ENABLE:
            self.start = self.bus.now
        self.start_count = count

    def _plan(self, *, after_match: bool = False) -> None:
        """Schedule the next match that does something."""
        self.due = NEVER
        if self.control == _ENABLE:
            for index in range(self.matches):
                if self.match_control >> 3 * index & 7:
                    ahead = (self.match[index] - self.start_count) % _WRAP
                    if ahead == 0 and after_match:
                        ahead = _WRAP
                    when = self.start + ahead * self.tick
                    if when < self.due:
                        self.due = when
                        self.due_match = index
        self.bus.schedule(self.slot, self.due)

    def event(self) -> None:
        """Do what the match register that was reached asks for."""
        reached = self.match[self.due_match]
        self.start, self.start_count = self.due, reached
        clear = False
        for index in range(self.matches):
            action = self.match_control >> 3 * index & 7
            if action and self.match[index] == reached:
                if action & 1:
                    self.interrupts |= self.flag(index)
                if action & 2:
                    clear = True
                if action & 4:
                    self.control &= ~_ENABLE
        if clear:
            self.start, self.start_count = self.due + self.tick, 0
        self._plan(after_match=not clear)
        if self.interrupts:
            self.bus.nvic.set_line(self.irq, level=True)

    def read(self, offset: int, size: int) -> int:
        """Timer registers."""
        if offset == 0x08:
            return self.count()
        if offset == 0x00:
            return self.interrupts
        if offset == 0x04:
            return self.control
        if offset == 0x0C:
            return self.prescale
        if offset == 0x14:
            return self.match_control
        if 0x18 <= offset < 0x28:
            return self.match[(offset - 0x18) >> 2]
        return self.stored.get(offset, 0)

    def write(self, offset: int, value: int, size: int) -> None:
        """Timer registers."""
        if offset == 0x00:
            self.interrupts &= ~value
            if not self.interrupts:
                self.bus.nvic.set_line(self.irq, level=False)
            return
        self._hold()
        if offset == 0x04:
            self.control = value & 3
            if value & _RESET:  # held at zero while the bit is set
                self.start, self.start_count = self.bus.now, 0
        elif offset == 0x08:
            self.start, self.start_count = self.bus.now, value
        elif offset == 0x0C:
            self.prescale = value
            self._set_tick()
        elif offset == 0x14:
            self.match_control = value & 0xFFF
        elif 0x18 <= offset < 0x28:
            self.match[(offset - 0x18) >> 2] = value
        else:
            self.stored[offset] = value
        self._plan()

    def clock_will_change(self) -> None:
        """Keep the count."""
        self._hold()

    def clock_changed(self) -> None:
        """Count on at the new rate."""
        self._set_tick()
        self._plan()
