"""Fast GPIO ports 0…4 and the interrupts of ports 0 and 2 (UM10360 chapter 9)."""

from __future__ import annotations

from collections.abc import Callable

from firmware_bridge.board.bus import Bus
from firmware_bridge.board.peripheral import Peripheral

__all__ = ["Gpio", "GpioInterrupts"]

PORTS = 5
_ALL = 0xFFFFFFFF
_EINT3 = 21
OnChange = Callable[[int, int, int], None]
"""(port, bits that changed, new levels)"""


class Gpio(Peripheral):
    """Five ports of 32 pins; inputs are pulled up unless driven with `drive`."""

    def __init__(self, bus: Bus) -> None:
        self.on_change: OnChange | None = None
        super().__init__(bus, "gpio", 0x2009C000, 0x4000)

    def reset(self) -> None:
        """All pins are inputs with pull-ups."""
        self.direction = [0] * PORTS
        self.mask = [0] * PORTS
        self.latch = [0] * PORTS
        self.driven = [_ALL] * PORTS
        self.levels = [_ALL] * PORTS

    def read(self, offset: int, size: int) -> int:
        """FIOxDIR, FIOxMASK, FIOxPIN, FIOxSET; whole words, half-words or bytes."""
        port, register = offset >> 5, offset & 0x1C
        if port >= PORTS:
            return 0
        value = 0
        if register == 0x00:
            value = self.direction[port]
        elif register == 0x10:
            value = self.mask[port]
        elif register == 0x14:
            value = self.levels[port] & ~self.mask[port]
        elif register == 0x18:
            value = self.latch[port] & ~self.mask[port]
        return value >> 8 * (offset & 3) & ((1 << 8 * size) - 1)

    def write(self, offset: int, value: int, size: int) -> None:
        """FIOxDIR, FIOxMASK, FIOxPIN, FIOxSET, FIOxCLR; whole words, half-words or bytes."""
        port, register = offset >> 5, offset & 0x1C
        if port >= PORTS:
            return
        shift = 8 * (offset & 3)
        lane = ((1 << 8 * size) - 1) << shift
        bits = value << shift & lane
        free = ~self.mask[port]
        if register == 0x18:
            self.latch[port] |= bits & free
        elif register == 0x1C:
            self.latch[port] &= ~(bits & free)
        elif register == 0x14:
            self.latch[port] = self.latch[port] & ~(lane & free) | bits & free
        elif register == 0x00:
            self.direction[port] = self.direction[port] & ~lane | bits
        elif register == 0x10:
            self.mask[port] = self.mask[port] & ~lane | bits
            return
        self._update(port)

    def drive(self, port: int, bit: int, level: bool) -> None:
        """Drive an input pin from outside."""
        if level:
            self.driven[port] |= 1 << bit
        else:
            self.driven[port] &= ~(1 << bit)
        self._update(port)

    def _update(self, port: int) -> None:
        direction = self.direction[port]
        levels = (self.latch[port] & direction) | (self.driven[port] & ~direction & _ALL)
        changed = levels ^ self.levels[port]
        if changed:
            self.levels[port] = levels
            if self.on_change is not None:
                self.on_change(port, changed, levels)
            if self.bus.gpio_interrupts.watching:
                self.bus.gpio_interrupts.pins_changed(port, changed, levels)


class GpioInterrupts(Peripheral):
    """Rising and falling edges of ports 0 and 2, on the interrupt they share with EINT3."""

    def __init__(self, bus: Bus) -> None:
        super().__init__(bus, "gpioint", 0x40028000, irq=_EINT3)

    def reset(self) -> None:
        """No edge enabled."""
        self.edges = False
        self.status = {(port, edge): 0 for port in (0, 2) for edge in "RF"}
        self.enable = {(port, edge): 0 for port in (0, 2) for edge in "RF"}

    @property
    def watching(self) -> bool:
        """Whether any edge is enabled, or an external interrupt has a pin."""
        return self.edges or self.bus.external_interrupts.selected != 0

    def pins_changed(self, port: int, changed: int, levels: int) -> None:
        """Look for enabled edges."""
        self.bus.external_interrupts.pins_changed(port, changed, levels)
        if port not in {0, 2}:
            return
        for edge, at in (("R", levels), ("F", ~levels)):
            self.status[port, edge] |= changed & at & self.enable[port, edge]
        self.update_line()

    def update_line(self) -> None:
        """Set the interrupt line by the edges seen and by EINT3."""
        self.bus.nvic.set_line(self.irq, level=any(self.status.values()) or self.bus.external_interrupts.flags & 8)

    def read(self, offset: int, size: int) -> int:
        """IOIntStatus, IO0IntStatR … IO2IntEnF."""
        if offset == 0x80:
            port0 = any(self.status[0, edge] for edge in "RF")
            port2 = any(self.status[2, edge] for edge in "RF")
            return port0 | port2 << 2
        port, place = (0, offset - 0x84) if offset < 0xA4 else (2, offset - 0xA4)
        if place in {0x00, 0x04}:
            return self.status[port, "RF"[place >> 2]]
        if place in {0x0C, 0x10}:
            return self.enable[port, "RF"[(place - 0x0C) >> 2]]
        return 0

    def write(self, offset: int, value: int, size: int) -> None:
        """IO0IntClr, IO0IntEnR, IO0IntEnF and the same of port 2."""
        port, place = (0, offset - 0x84) if offset < 0xA4 else (2, offset - 0xA4)
        if place == 0x08:
            for edge in "RF":
                self.status[port, edge] &= ~value
            self.update_line()
        elif place in {0x0C, 0x10}:
            self.enable[port, "RF"[(place - 0x0C) >> 2]] = value
            self.edges = any(self.enable.values())
