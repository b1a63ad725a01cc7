"""General-purpose DMA of the LPC1768 (UM10360 chapter 31): memory to memory, and memory to a UART's transmitter.

Other peripherals as sources or destinations are not modelled: such a channel stays enabled and moves nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

from firmware_bridge.board.bus import Bus
from firmware_bridge.board.peripheral import NEVER, Peripheral

__all__ = ["Gpdma"]

_CHANNELS = 8
_ENABLE, _TERMINAL_MASK = 1, 1 << 15
_COUNT = 0xFFF
_SOURCE_UP, _DESTINATION_UP, _TERMINAL = 1 << 26, 1 << 27, 1 << 31
_MEMORY_TO_MEMORY, _MEMORY_TO_PERIPHERAL = 0, 1
_UART_TRANSMITTERS = {8: 0, 10: 1, 12: 2, 14: 3}  # DMA request numbers (UM10360 table 543)
_UNIT_CYCLES = 4


@dataclass
class _Channel:
    """Registers of one channel, and when it moves its next unit."""

    source: int = 0
    destination: int = 0
    link: int = 0
    control: int = 0
    config: int = 0
    due: int = NEVER


class Gpdma(Peripheral):
    """Moves one unit per event: at the bus's pace between memories, at the line's pace into a UART."""

    def __init__(self, bus: Bus) -> None:
        super().__init__(bus, "gpdma", 0x50004000, 0x4000, irq=26)

    def reset(self) -> None:
        """All channels off."""
        self.channels = [_Channel() for _ in range(_CHANNELS)]
        self.terminal = 0
        self.config = 0

    def read(self, offset: int, size: int) -> int:
        """Status, enabled channels, channel registers."""
        if 0x100 <= offset < 0x100 + 0x20 * _CHANNELS:
            channel = self.channels[(offset - 0x100) >> 5]
            values = (channel.source, channel.destination, channel.link, channel.control, channel.config)
            place = (offset & 0x1F) >> 2
            return values[place] if place < len(values) else 0
        enabled = sum(1 << index for index, channel in enumerate(self.channels) if channel.config & _ENABLE)
        pending = self._pending()
        return {0x00: pending, 0x04: pending, 0x14: self.terminal, 0x1C: enabled, 0x30: self.config}.get(offset, 0)

    def write(self, offset: int, value: int, size: int) -> None:
        """Clear interrupts, configure, set up and start channels."""
        if offset == 0x08:
            self.terminal &= ~value
            self._update()
        elif offset == 0x30:
            self.config = value
        elif 0x100 <= offset < 0x100 + 0x20 * _CHANNELS:
            channel = self.channels[(offset - 0x100) >> 5]
            name = {0x00: "source", 0x04: "destination", 0x08: "link", 0x0C: "control", 0x10: "config"}.get(
                offset & 0x1F
            )
            if name is not None:
                setattr(channel, name, value)
            if name == "config":
                self._start(channel)

    def _pending(self) -> int:
        masks = sum(1 << n for n, channel in enumerate(self.channels) if channel.config & _TERMINAL_MASK)
        return self.terminal & masks

    def _update(self) -> None:
        self.bus.nvic.set_line(self.irq, level=self._pending())

    def _pace(self, channel: _Channel) -> int:
        """Ticks from one unit to the next; 0 for a channel that can't move."""
        kind = channel.config >> 11 & 7
        if kind == _MEMORY_TO_MEMORY:
            return _UNIT_CYCLES * self.bus.cycle
        uart = _UART_TRANSMITTERS.get(channel.config >> 6 & 31)
        if kind == _MEMORY_TO_PERIPHERAL and uart is not None:
            return self.bus.uarts[uart].character
        return 0

    def _start(self, channel: _Channel) -> None:
        running = channel.config & _ENABLE and self.config & _ENABLE
        pace = self._pace(channel) if running else 0
        channel.due = self.bus.now + _UNIT_CYCLES * self.bus.cycle if pace else NEVER
        self._plan()

    def _plan(self) -> None:
        self.bus.schedule(self.slot, min(channel.due for channel in self.channels))

    def event(self) -> None:
        """Move the units that are due."""
        for index, channel in enumerate(self.channels):
            if channel.due <= self.bus.now:
                self._move(index, channel)
        self._plan()

    def _move(self, number: int, channel: _Channel) -> None:
        if channel.control & _COUNT:
            width = 1 << (channel.control >> 18 & 7)
            self.bus.write_bus(channel.destination, self.bus.read_bus(channel.source, width), width)
            channel.source += width if channel.control & _SOURCE_UP else 0
            channel.destination += width if channel.control & _DESTINATION_UP else 0
            channel.control -= 1
        if channel.control & _COUNT:
            channel.due = self.bus.now + self._pace(channel)
            return
        if channel.control & _TERMINAL:
            self.terminal |= 1 << number
        if channel.link:
            words = [self.bus.read_bus((channel.link & ~3) + 4 * k, 4) for k in range(4)]
            channel.source, channel.destination, channel.link, channel.control = words
            channel.due = self.bus.now + self._pace(channel)
        else:
            channel.config &= ~_ENABLE
            channel.due = NEVER
        self._update()
