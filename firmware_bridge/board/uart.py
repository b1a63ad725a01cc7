"""UART0…3 of the LPC1768: 16550-like, 16-byte FIFOs, fractional divider (UM10360 chapters 14 and 15)."""

from __future__ import annotations

from array import array
from collections import deque

from firmware_bridge.adxl345.registers import TICKS_PER_SECOND
from firmware_bridge.board.bus import Bus
from firmware_bridge.board.peripheral import NEVER, Peripheral

__all__ = ["FRAMING_ERROR", "Uart"]

_DEPTH = 16
_TRIGGER = (1, 4, 8, 14)
_READY, _OVERRUN, FRAMING_ERROR, _THR_EMPTY, _IDLE, _FIFO_ERROR = 0x01, 0x02, 0x08, 0x20, 0x40, 0x80
_LINE_ERRORS = 0x1E
_BITS_PER_CHARACTER = 10  # start, eight data, stop
_TIMEOUT_CHARACTERS = 4


class Uart(Peripheral):
    """Sends into ``sent`` with the time each byte left the line; receives what is put on the line with `receive`."""

    def __init__(self, bus: Bus, name: str, base: int, irq: int, clock_place: int) -> None:
        self.clock_place = clock_place
        self.sent = bytearray()
        self.sent_at = array("q")
        super().__init__(bus, name, base, irq=irq)

    def reset(self) -> None:
        """Set registers to their reset values; bytes that have not left the line are lost."""
        self.cut_unsent()
        self.divisor, self.fraction = 1, 0x10
        self.interrupt_enable = self.line_control = self.fifo_control = self.scratch = self.errors = 0
        self.receiver: deque[tuple[int, int]] = deque()
        self.on_line: deque[tuple[int, int, int]] = deque()
        self.sent_end = 0
        self.empty_pending = False
        self.timeout = False
        self.empty_at = self.timeout_at = self.planned = NEVER
        self._set_character()

    def _set_character(self) -> None:
        divider = self.bus.system_control.peripheral_divider(self.clock_place)
        multiplier, add = self.fraction >> 4 & 15 or 1, self.fraction & 15
        bit = 16 * (self.divisor or 1) * self.bus.cycle * divider * (multiplier + add) / multiplier
        self.character = max(1, round(_BITS_PER_CHARACTER * bit))
        self._lone_byte = self.character * (_BITS_PER_CHARACTER - 1) // _BITS_PER_CHARACTER

    @property
    def baud(self) -> float:
        """Bits per second."""
        return _BITS_PER_CHARACTER * TICKS_PER_SECOND / self.character

    # Line

    def cut_unsent(self) -> None:
        """Forget bytes that have not wholly left the line: the power failed."""
        while self.sent_at and self.sent_at[-1] > self.bus.now:
            self.sent_at.pop()
            del self.sent[-1]

    def take_sent(self) -> tuple[bytes, array[int]]:
        """Bytes that have left the line by now, and when; they are handed out once."""
        count = len(self.sent_at)
        while count and self.sent_at[count - 1] > self.bus.now:
            count -= 1
        bytes_out, at = bytes(self.sent[:count]), self.sent_at[:count]
        del self.sent[:count]
        del self.sent_at[:count]
        return bytes_out, at

    def receive(self, data: bytes, errors: int = 0) -> None:
        """Put bytes on the receiving line, one after another from now on; ``errors`` are line status bits."""
        when = max(self.bus.now, self.on_line[-1][0] if self.on_line else 0)
        for byte in data:
            when += self.character
            self.on_line.append((when, byte, errors))
        self._plan()

    def _plan(self) -> None:
        next_byte = self.on_line[0][0] if self.on_line else NEVER
        self.planned = min(next_byte, self.empty_at, self.timeout_at)
        self.bus.schedule(self.slot, self.planned)

    def event(self) -> None:
        """Take a byte that has arrived, or note that the transmitter ran empty or the receiver waited too long."""
        now = self.bus.now
        while self.on_line and self.on_line[0][0] <= now:
            when, byte, errors = self.on_line.popleft()
            if len(self.receiver) >= (_DEPTH if self.fifo_control & 1 else 1):
                self.errors |= _OVERRUN
            else:
                self.receiver.append((byte, errors))
                self.errors |= errors
            self.timeout_at = when + _TIMEOUT_CHARACTERS * self.character
        if self.empty_at <= now:
            self.empty_at = NEVER
            self.empty_pending = True
        if self.timeout_at <= now:
            self.timeout_at = NEVER
            self.timeout = bool(self.receiver)
        self._plan()
        self._update_line()

    def _cause(self) -> int:
        """Identification of the interrupt of the highest priority; 1 if none."""
        enabled = self.interrupt_enable
        if enabled & 4 and self.errors & _LINE_ERRORS:
            return 0x06
        if enabled & 1 and len(self.receiver) >= _TRIGGER[self.fifo_control >> 6]:
            return 0x04
        if enabled & 1 and self.timeout and self.receiver:
            return 0x0C
        if enabled & 2 and self.empty_pending:
            return 0x02
        return 0x01

    def _update_line(self) -> None:
        self.bus.nvic.set_line(self.irq, level=self._cause() != 1)

    # Registers

    def read(self, offset: int, size: int) -> int:
        """UART registers."""
        if offset == 0x14:
            return self._line_status()
        if offset == 0x08:
            cause = self._cause()
            if cause == 0x02:
                self.empty_pending = False
                self._update_line()
            return cause | (0xC0 if self.fifo_control & 1 else 0)
        if offset == 0x00:
            if self.line_control & 0x80:
                return self.divisor & 0xFF
            return self._read_receiver()
        if offset == 0x04:
            return self.divisor >> 8 if self.line_control & 0x80 else self.interrupt_enable
        return {0x0C: self.line_control, 0x1C: self.scratch, 0x28: self.fraction, 0x30: 0x80}.get(offset, 0)

    def _read_receiver(self) -> int:
        if not self.receiver:
            return 0
        byte, _ = self.receiver.popleft()
        self.timeout = False
        self.timeout_at = self.bus.now + _TIMEOUT_CHARACTERS * self.character if self.receiver else NEVER
        self._plan()
        self._update_line()
        return byte

    def _line_status(self) -> int:
        now = self.bus.now
        empty = self.sent_end - self.character  # when the last byte moves to the shift register
        if now < empty and not self.receiver and self.bus.spinning(self.slot):
            self.bus.wait_until(empty)
            now = self.bus.now
        elif empty <= now < self.sent_end and not self.receiver and self.bus.spinning(self.slot):
            self.bus.wait_until(self.sent_end)
            now = self.bus.now
        status = self.errors | (_READY if self.receiver else 0)
        if now >= self.sent_end - self.character:
            status |= _THR_EMPTY
        if now >= self.sent_end:
            status |= _IDLE
        if any(errors for _, errors in self.receiver):
            status |= _FIFO_ERROR
        if self.errors:
            self.errors = 0
            self._update_line()
        return status

    def write(self, offset: int, value: int, size: int) -> None:
        """UART registers."""
        if offset == 0x00:
            if self.line_control & 0x80:
                self.divisor = self.divisor & 0xFF00 | value & 0xFF
                self._set_character()
            else:
                self._send(value)
        elif offset == 0x04:
            if self.line_control & 0x80:
                self.divisor = self.divisor & 0xFF | (value & 0xFF) << 8
                self._set_character()
            else:
                self.interrupt_enable = value & 0x307
                self._update_line()
        elif offset == 0x08:
            self.fifo_control = value & 0xC9
            if value & 2:
                self.receiver.clear()
                self.timeout = False
                self.timeout_at = NEVER
                self._plan()
            self._update_line()
        elif offset == 0x0C:
            self.line_control = value
        elif offset == 0x1C:
            self.scratch = value
        elif offset == 0x28:
            self.fraction = value & 0xFF
            self._set_character()

    def _send(self, byte: int) -> None:
        now, empty, character = self.bus.now, self.sent_end, self.character
        if empty <= now:
            empty = now
        elif empty > now + (_DEPTH if self.fifo_control & 1 else 1) * character:
            return  # the FIFO is full: the byte is lost
        self.sent_end = end = empty + character
        self.sent.append(byte & 0xFF)
        self.sent_at.append(end)
        # The interrupt comes when the last byte moves to the shift register, but after a lone byte not before its
        # stop bit (UM10360 14.4.5).
        lone = now + self._lone_byte
        if empty < lone:  # noqa: PLR1730 - a call of max costs more, forty times a sample
            empty = lone
        self.empty_at = empty
        if self.planned > empty:
            self._plan()  # else the event that is planned already looks again
        if self.empty_pending:
            self.empty_pending = False
            self._update_line()

    def clock_changed(self) -> None:
        """Characters take another time from now on."""
        self._set_character()
