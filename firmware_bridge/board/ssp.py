"""SSP0 and SSP1 of the LPC1768 as SPI masters: 8-deep FIFOs, 4 to 16 bits (UM10360 chapter 18)."""

from __future__ import annotations

from collections import deque
from typing import Protocol

from firmware_bridge.board.bus import Bus
from firmware_bridge.board.peripheral import NEVER, Peripheral

__all__ = ["SpiDevice", "Ssp"]

_DEPTH = 8
_TX_EMPTY, _TX_NOT_FULL, _RX_NOT_EMPTY, _RX_FULL, _BUSY = 1, 2, 4, 8, 16
_OVERRUN, _TIMEOUT, _RX_HALF, _TX_HALF = 1, 2, 4, 8
_TIMEOUT_BITS = 32
_MODE_3 = 0xC0
_FLOATING = 0xFFFF


class SpiDevice(Protocol):
    """A chip on the bus; times are ticks."""

    def select(self, now: int) -> None:
        """CS goes low."""

    def deselect(self, now: int) -> None:
        """CS goes high."""

    def transfer(self, value: int, now: int) -> int:
        """Exchange one byte."""
        ...


class Ssp(Peripheral):
    """A word written to the data register is exchanged when the words before it are through."""

    def __init__(self, bus: Bus, name: str, base: int, irq: int, clock_place: int) -> None:
        self.clock_place = clock_place
        self.selected: SpiDevice | None = None
        super().__init__(bus, name, base, irq=irq)

    def reset(self) -> None:
        """Disabled, FIFOs empty."""
        self.control0 = self.control1 = self.mask = self.raw = 0
        self.prescaler = 2
        self.words: deque[tuple[int, int]] = deque()  # when each word is through, and what was received
        self.done = 0
        self._set_word()

    def _set_word(self) -> None:
        divider = self.bus.system_control.peripheral_divider(self.clock_place)
        self.bits = (self.control0 & 15) + 1
        self.bit = max(2, self.prescaler) * ((self.control0 >> 8 & 0xFF) + 1) * self.bus.cycle * divider

    def _received(self) -> int:
        """Words in the receive FIFO now."""
        now = self.bus.now
        count = 0
        for through, _ in self.words:
            if through > now:
                break
            count += 1
        return count

    def _waiting(self) -> int:
        """Words in the transmit FIFO now (the one being shifted is not in it)."""
        return max(0, len(self.words) - self._received() - 1)

    def read(self, offset: int, size: int) -> int:
        """SSP registers."""
        if offset == 0x08:
            words = self.words
            if not words or words[0][0] > self.bus.now:
                return 0
            value = words.popleft()[1]
            if self.mask:
                self._update_interrupt()
            return value
        if offset == 0x0C:
            return self._status()
        self._update_raw()
        return {
            0x00: self.control0,
            0x04: self.control1,
            0x10: self.prescaler,
            0x14: self.mask,
            0x18: self.raw,
            0x1C: self.raw & self.mask,
        }.get(offset, 0)

    def _status(self) -> int:
        if self.done > self.bus.now and self.bus.spinning(self.slot):
            self.bus.wait_until(self.done)
        if self.done <= self.bus.now:
            received, waiting = len(self.words), 0
            status = _TX_EMPTY | _TX_NOT_FULL
        else:
            received = self._received()
            waiting = max(0, len(self.words) - received - 1)
            status = _BUSY | (0 if waiting else _TX_EMPTY) | (_TX_NOT_FULL if waiting < _DEPTH else 0)
        return status | (_RX_NOT_EMPTY if received else 0) | (_RX_FULL if received >= _DEPTH else 0)

    def write(self, offset: int, value: int, size: int) -> None:
        """SSP registers."""
        if offset == 0x08:
            self._exchange(value & 0xFFFF)
        elif offset == 0x00:
            self.control0 = value & 0xFFFF
            self._set_word()
        elif offset == 0x04:
            self.control1 = value & 15
        elif offset == 0x10:
            self.prescaler = value & 0xFE
            self._set_word()
        elif offset == 0x14:
            self.mask = value & 15
        elif offset == 0x20:
            self.raw &= ~(value & 3)
        if self.mask or offset == 0x14:
            self._update_interrupt()

    def _exchange(self, value: int) -> None:
        words, bits, start = self.words, self.bits, self.bus.now
        crowded = len(words) >= _DEPTH
        if not self.control1 & 2 or (crowded and self._waiting() >= _DEPTH):
            return
        if start < self.done:  # noqa: PLR1730 - a call of max costs more, twenty times a sample
            start = self.done
        self.done = start + bits * self.bit
        if self.control1 & 1:
            answer = value  # loop-back
        elif self.selected is None or self.control0 & _MODE_3 != _MODE_3:
            answer = _FLOATING
        elif bits == 16:
            transfer = self.selected.transfer
            answer = transfer(value >> 8, start) << 8
            answer |= transfer(value & 0xFF, start + 8 * self.bit)
        elif bits == 8:
            answer = self.selected.transfer(value & 0xFF, start)
        else:
            answer = _FLOATING
        if crowded and (len(words) >= 2 * _DEPTH or self._received() >= _DEPTH):
            self.raw |= _OVERRUN
        else:
            words.append((self.done, answer & ((1 << bits) - 1)))

    def _update_raw(self) -> None:
        received = self._received()
        self.raw &= ~(_RX_HALF | _TX_HALF)
        self.raw |= _RX_HALF if received >= _DEPTH // 2 else 0
        self.raw |= _TX_HALF if self._waiting() <= _DEPTH // 2 else 0
        if received and self.bus.now >= self.words[received - 1][0] + _TIMEOUT_BITS * self.bit:
            self.raw |= _TIMEOUT

    def _update_interrupt(self) -> None:
        self._update_raw()
        self.bus.nvic.set_line(self.irq, level=self.raw & self.mask)
        later = [through for through, _ in self.words if through > self.bus.now]
        when = later[0] if later else NEVER
        if not later and self.words and not self.raw & _TIMEOUT:
            when = self.words[-1][0] + _TIMEOUT_BITS * self.bit
        self.bus.schedule(self.slot, when if self.mask else NEVER)

    def event(self) -> None:
        """Note that a word is through, or that words waited too long in the receive FIFO."""
        self._update_interrupt()

    def clock_changed(self) -> None:
        """Bits take another time from now on."""
        self._set_word()
