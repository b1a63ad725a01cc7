"""I2C0…2 of the LPC1768 as bus master (UM10360 chapter 19): the state machine behind I2STAT."""

from __future__ import annotations

from typing import Protocol

from firmware_bridge.board.bus import Bus
from firmware_bridge.board.peripheral import NEVER, Peripheral

__all__ = ["I2c", "I2cDevice"]

_ACKNOWLEDGE, _INTERRUPT, _STOP, _START, _ENABLE = 0x04, 0x08, 0x10, 0x20, 0x40
_IDLE = 0xF8
_BITS_PER_BYTE = 9


class I2cDevice(Protocol):
    """A chip on the bus; times are ticks."""

    def i2c_start(self, address_byte: int, now: int) -> bool:
        """Address byte after a start; True to acknowledge."""
        ...

    def i2c_write(self, value: int, now: int) -> bool:
        """Byte from the master; True to acknowledge."""
        ...

    def i2c_read(self, now: int) -> int:
        """Byte to the master."""
        ...

    def i2c_stop(self, now: int) -> None:
        """Stop condition."""


class I2c(Peripheral):
    """Each step of the bus takes its bit times and ends with SI set and the state in I2STAT."""

    def __init__(self, bus: Bus, name: str, base: int, irq: int, clock_place: int) -> None:
        self.clock_place = clock_place
        self.devices: list[I2cDevice] = []
        super().__init__(bus, name, base, irq=irq)

    def reset(self) -> None:
        """Off."""
        self.control = 0
        self.status = _IDLE
        self.data = 0
        self.high = self.low = 4
        self.stored: dict[int, int] = {}
        self._talking: I2cDevice | None = None
        self._owns_bus = self._receiving = self._address_next = self._step_pending = False
        self._next_status = _IDLE
        self._next_data: int | None = None

    def _bits(self, count: int) -> int:
        divider = self.bus.system_control.peripheral_divider(self.clock_place)
        return count * (self.high + self.low) * self.bus.cycle * divider

    def read(self, offset: int, size: int) -> int:
        """I2CONSET, I2STAT, I2DAT, clock registers."""
        return {0x00: self.control, 0x04: self.status, 0x08: self.data, 0x10: self.high, 0x14: self.low}.get(
            offset, self.stored.get(offset, 0)
        )

    def write(self, offset: int, value: int, size: int) -> None:
        """I2CONSET, I2CONCLR, I2DAT, clock registers."""
        if offset == 0x00:
            self.control |= value & 0x7C & ~_INTERRUPT
            self._step()
        elif offset == 0x18:
            self.control &= ~(value & 0x6C)
            if not self.control & _ENABLE:
                self.status = _IDLE
                self._owns_bus = False
            self._update()
            self._step()
        elif offset == 0x08:
            self.data = value & 0xFF
        elif offset == 0x10:
            self.high = max(4, value & 0xFFFF)
        elif offset == 0x14:
            self.low = max(4, value & 0xFFFF)
        else:
            self.stored[offset] = value

    def _update(self) -> None:
        self.bus.nvic.set_line(self.irq, level=self.control & _INTERRUPT)

    def _step(self) -> None:
        """Begin what the control bits ask for; nothing happens while SI is set or a step is under way."""
        if not self.control & _ENABLE or self.control & _INTERRUPT or self._step_pending:
            return
        now = self.bus.now
        if self.control & _STOP and self._owns_bus:
            self.control &= ~_STOP
            if self._talking is not None:
                self._talking.i2c_stop(now)
            self._talking = None
            self._owns_bus = False
            self.status = _IDLE
        if self.control & _START:
            self._finish(0x10 if self._owns_bus else 0x08, 1)
            self._owns_bus = self._address_next = True
        elif self._owns_bus and self._address_next:
            self._address_next = False
            self._receiving = bool(self.data & 1)
            self._talking = next((device for device in self.devices if device.i2c_start(self.data, now)), None)
            good, bad = (0x40, 0x48) if self._receiving else (0x18, 0x20)
            self._finish(bad if self._talking is None else good, _BITS_PER_BYTE)
        elif self._owns_bus and self._receiving and self.status in {0x40, 0x50}:
            answer = 0xFF if self._talking is None else self._talking.i2c_read(now)
            self._finish(0x50 if self.control & _ACKNOWLEDGE else 0x58, _BITS_PER_BYTE, answer)
        elif self._owns_bus and not self._receiving and self.status in {0x18, 0x28}:
            good = self._talking is not None and self._talking.i2c_write(self.data, now)
            self._finish(0x28 if good else 0x30, _BITS_PER_BYTE)

    def _finish(self, status: int, bits: int, data: int | None = None) -> None:
        self._next_status, self._next_data = status, data
        self._step_pending = True
        self.bus.schedule(self.slot, self.bus.now + self._bits(bits))

    def event(self) -> None:
        """End a step on the bus."""
        self.bus.schedule(self.slot, NEVER)
        self._step_pending = False
        self.status = self._next_status
        if self._next_data is not None:
            self.data = self._next_data
        self.control |= _INTERRUPT
        self._update()
