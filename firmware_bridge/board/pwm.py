"""PWM1 of the LPC1768: a timer with seven match registers that change at the start of a period (UM10360 chapter 24)."""

from __future__ import annotations

from firmware_bridge.board.bus import Bus
from firmware_bridge.board.timer import Timer

__all__ = ["Pwm"]

_PWM_ENABLE = 1 << 3
_MATCHES = {**{0x18 + 4 * k: k for k in range(4)}, **{0x40 + 4 * k: 4 + k for k in range(3)}}


class Pwm(Timer):
    """Counter, match interrupts and latches; the outputs drive no pin."""

    matches = 7

    def __init__(self, bus: Bus) -> None:
        super().__init__(bus, "pwm1", 0x40018000, 9, 12)

    def reset(self) -> None:
        """Stop, at zero."""
        super().reset()
        self._pwm = 0
        self._waiting: dict[int, int] = {}
        self._latched = 0

    def flag(self, number: int) -> int:
        """Bit of a match in PWM1IR: 0…3, then 8…10."""
        return 1 << (number if number < 4 else number + 4)

    def event(self) -> None:
        """Do what the match asks for; a new period takes the latched values."""
        super().event()
        if self.start_count == 0:
            self._take()

    def _take(self) -> None:
        for number in [number for number in self._waiting if self._latched >> number & 1]:
            self.match[number] = self._waiting.pop(number)
        self._latched = 0
        self._plan()

    def read(self, offset: int, size: int) -> int:
        """Return a register of PWM1."""
        if offset in _MATCHES:
            return self.match[_MATCHES[offset]]
        if offset == 0x04:
            return self.control | self._pwm
        return 0 if offset == 0x50 else super().read(offset, size)

    def write(self, offset: int, value: int, size: int) -> None:
        """Write a register; in PWM mode, match registers wait for their latch and the next period."""
        if offset in _MATCHES and self._pwm:
            self._waiting[_MATCHES[offset]] = value
        elif offset in _MATCHES:
            self._hold()
            self.match[_MATCHES[offset]] = value
            self._plan()
        elif offset == 0x14:
            self._hold()
            self.match_control = value & 0x1FFFFF
            self._plan()
        elif offset == 0x50:
            self._latched |= value & 0x7F
            if self.control != 1:
                self._hold()
                self._take()
        else:
            if offset == 0x04:
                self._pwm = value & _PWM_ENABLE
            super().write(offset, value, size)
