"""Analogue-to-digital converter of the LPC1768 (UM10360 chapter 29)."""

from __future__ import annotations

from firmware_bridge.board.bus import Bus
from firmware_bridge.board.peripheral import NEVER, Peripheral

__all__ = ["Adc"]

_CHANNELS = 8
_CLOCKS = 65  # of the converter, for one conversion
_CLOCK_PLACE = 24
_BURST, _POWERED, _START_NOW = 1 << 16, 1 << 21, 1
_GLOBAL_INTERRUPT = 1 << 8
_DONE, _OVERRUN = 1 << 31, 1 << 30


class Adc(Peripheral):
    """Converts on command and in bursts; starts by an edge of a pin or timer do not happen.

    Attributes
    ----------
    values : list of int
        What the eight inputs read, 0…4095; set from outside.
    """

    def __init__(self, bus: Bus) -> None:
        self.values = [0] * _CHANNELS
        super().__init__(bus, "adc", 0x40034000, irq=22)

    def reset(self) -> None:
        """Off, channel 0 selected, interrupt by the global flag."""
        self.control = 1
        self.enable = _GLOBAL_INTERRUPT
        self.trim = 0
        self.latest = 0
        self.results = [0] * _CHANNELS
        self.done_at = NEVER
        self.channel = 0

    def _duration(self) -> int:
        divider = (self.control >> 8 & 0xFF) + 1
        return _CLOCKS * divider * self.bus.cycle * self.bus.system_control.peripheral_divider(_CLOCK_PLACE)

    def _begin(self, after: int) -> None:
        """Begin the next conversion: the next selected channel above ``after``, around."""
        selected = self.control & 0xFF
        ready = self.control & _POWERED and selected
        if ready and (self.control & _BURST or self.control >> 24 & 7 == _START_NOW):
            places = [(after + 1 + k) % _CHANNELS for k in range(_CHANNELS)]
            self.channel = next(place for place in places if selected >> place & 1)
            self.done_at = self.bus.now + self._duration()
        else:
            self.done_at = NEVER
        self.bus.schedule(self.slot, self.done_at)

    def event(self) -> None:
        """End one conversion; in a burst, begin the next."""
        channel = self.channel
        result = _DONE | (self.values[channel] & 0xFFF) << 4
        self.results[channel] = result | (_OVERRUN if self.results[channel] & _DONE else 0)
        self.latest = result | channel << 24 | (_OVERRUN if self.latest & _DONE else 0)
        if self.control & _BURST:
            self._begin(channel)
        else:
            self.control &= ~(7 << 24)
            self.done_at = NEVER
            self.bus.schedule(self.slot, NEVER)
        self._update()

    def _done(self) -> int:
        return sum(1 << k for k, result in enumerate(self.results) if result & _DONE)

    def _interrupt(self) -> bool:
        by_global = self.enable & _GLOBAL_INTERRUPT and self.latest & _DONE
        return bool(by_global or self.enable & 0xFF & self._done())

    def _update(self) -> None:
        self.bus.nvic.set_line(self.irq, level=self._interrupt())

    def _awaited(self, offset: int) -> bool:
        """Whether a program that looks for the end of a conversion here would not find it yet."""
        if self.done_at >= NEVER:
            return False
        if offset == 0x04:
            return not self.latest & _DONE
        if 0x10 <= offset < 0x30:
            return not self.results[(offset - 0x10) >> 2] & _DONE
        return offset == 0x30 and not self._done()

    def read(self, offset: int, size: int) -> int:
        """ADCR, ADGDR, ADINTEN, ADDR0…7, ADSTAT, ADTRM; reading a result takes its flag away."""
        if self._awaited(offset) and self.bus.spinning(self.slot):
            self.bus.wait_until(self.done_at)
        if offset == 0x04:
            value = self.latest
            self.latest &= ~(_DONE | _OVERRUN)
            self._update()
            return value
        if 0x10 <= offset < 0x30:
            channel = (offset - 0x10) >> 2
            value = self.results[channel]
            self.results[channel] &= ~(_DONE | _OVERRUN)
            self._update()
            return value
        if offset == 0x30:
            overrun = sum(1 << k for k, result in enumerate(self.results) if result & _OVERRUN)
            return self._done() | overrun << 8 | self._interrupt() << 16
        return {0x00: self.control, 0x0C: self.enable, 0x34: self.trim}.get(offset, 0)

    def write(self, offset: int, value: int, size: int) -> None:
        """ADCR, which also begins a conversion, ADINTEN and ADTRM."""
        if offset == 0x00:
            self.control = value
            self.latest &= ~(_DONE | _OVERRUN)
            self._begin(-1)
            self._update()
        elif offset == 0x0C:
            self.enable = value & 0x1FF
            self._update()
        elif offset == 0x34:
            self.trim = value
