"""Real-time clock of the LPC1768: calendar, increment and alarm interrupts (UM10360 chapter 27)."""

from __future__ import annotations

from firmware_bridge.adxl345.registers import TICKS_PER_SECOND
from firmware_bridge.board.bus import Bus
from firmware_bridge.board.peripheral import NEVER, Peripheral

__all__ = ["Rtc"]

_ENABLE, _RESET = 1, 2
_INCREMENT, _ALARM = 1, 2
_SEC, _MIN, _HOUR, _DAY, _WEEKDAY, _YEARDAY, _MONTH, _YEAR = range(8)
_WIDTHS = (0x3F, 0x3F, 0x1F, 0x1F, 0x07, 0x1FF, 0x0F, 0xFFF)
_MONTHS = (31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31)


class Rtc(Peripheral):
    """Counts seconds of an oscillator of its own. It runs on the battery: no reset stops or changes it."""

    def __init__(self, bus: Bus) -> None:
        self.time = [0] * 8
        self.alarm = [0] * 8
        self.stored: dict[int, int] = {}
        self.control = 0
        self.increments = 0
        self.mask = 0
        self.flags = 0
        self.second_at = NEVER
        super().__init__(bus, "rtc", 0x40024000, irq=17)

    def reset(self) -> None:
        """Count on."""
        self.bus.schedule(self.slot, self.second_at)
        self._update()

    def _update(self) -> None:
        self.bus.nvic.set_line(self.irq, level=self.flags)

    def event(self) -> None:
        """Count a second."""
        self.second_at += TICKS_PER_SECOND
        self.bus.schedule(self.slot, self.second_at)
        if self._advance() & self.increments:
            self.flags |= _INCREMENT
        compared = [k for k in range(8) if not self.mask >> k & 1]
        if compared and all(self.time[k] == self.alarm[k] for k in compared):
            self.flags |= _ALARM
        self._update()

    def _advance(self) -> int:
        """Add a second; return which fields went on, a bit each."""
        time, changed = self.time, 1 << _SEC
        for place, limit, following in ((_SEC, 60, _MIN), (_MIN, 60, _HOUR), (_HOUR, 24, _DAY)):
            time[place] += 1
            if time[place] < limit:
                return changed
            time[place] = 0
            changed |= 1 << following
        time[_WEEKDAY] = (time[_WEEKDAY] + 1) % 7
        time[_YEARDAY] += 1
        time[_DAY] += 1
        changed |= 1 << _WEEKDAY | 1 << _YEARDAY
        leap = time[_YEAR] % 4 == 0
        month = (time[_MONTH] - 1) % 12
        if time[_DAY] <= _MONTHS[month] + (leap and month == 1):
            return changed
        time[_DAY] = 1
        time[_MONTH] = month + 2
        if month + 2 <= 12:
            return changed | 1 << _MONTH
        time[_MONTH] = time[_YEARDAY] = 1
        time[_YEAR] += 1
        return changed | 1 << _MONTH | 1 << _YEAR

    def read(self, offset: int, size: int) -> int:
        """Return flags, control, the calendar, single and consolidated, alarm, general-purpose registers."""
        time = self.time
        if 0x20 <= offset < 0x40:
            return time[(offset - 0x20) >> 2]
        if 0x60 <= offset < 0x80:
            return self.alarm[(offset - 0x60) >> 2]
        consolidated = {
            0x14: time[_SEC] | time[_MIN] << 8 | time[_HOUR] << 16 | time[_WEEKDAY] << 24,
            0x18: time[_DAY] | time[_MONTH] << 8 | time[_YEAR] << 16,
            0x1C: time[_YEARDAY],
        }
        named = {0x00: self.flags, 0x08: self.control, 0x0C: self.increments, 0x10: self.mask}
        return (consolidated | named).get(offset, self.stored.get(offset, 0))

    def write(self, offset: int, value: int, size: int) -> None:
        """Write flags (cleared by ones), control, masks, calendar, alarm."""
        if offset == 0x00:
            self.flags &= ~value
            self._update()
        elif offset == 0x08:
            self._set_control(value)
        elif offset == 0x0C:
            self.increments = value & 0xFF
        elif offset == 0x10:
            self.mask = value & 0xFF
        elif 0x20 <= offset < 0x40:
            place = (offset - 0x20) >> 2
            self.time[place] = value & _WIDTHS[place]
        elif 0x60 <= offset < 0x80:
            place = (offset - 0x60) >> 2
            self.alarm[place] = value & _WIDTHS[place]
        elif offset not in {0x14, 0x18, 0x1C}:
            self.stored[offset] = value

    def _set_control(self, value: int) -> None:
        was_running = self.control & (_ENABLE | _RESET) == _ENABLE
        running = value & (_ENABLE | _RESET) == _ENABLE
        self.control = value
        if running != was_running:
            self.second_at = self.bus.now + TICKS_PER_SECOND if running else NEVER
            self.bus.schedule(self.slot, self.second_at)
