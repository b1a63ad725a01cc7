"""EINT0…3 of the LPC1768: external interrupts on P2.10…P2.13 (UM10360 3.6), and the pins' selection for them."""

from __future__ import annotations

from firmware_bridge.board.bus import Bus
from firmware_bridge.board.peripheral import Peripheral, StoredRegisters

__all__ = ["ExternalInterrupts", "PinConnect"]

_PORT, _FIRST_PIN, _FIRST_IRQ, _COUNT = 2, 10, 18, 4
_FLAGS, _MODE, _POLARITY = 0x140, 0x148, 0x14C
_PINSEL4, _FIRST_SELECTION, _EINT = 0x10, 20, 1
_FIO2PIN = 0x2009C054


class ExternalInterrupts(Peripheral):
    """Level- or edge-sensitive; the registers lie in system control, which passes them on.

    Attributes
    ----------
    selected : int
        Inputs whose pin is selected for them, a bit each.
    flags : int
        EXTINT.
    """

    def __init__(self, bus: Bus) -> None:
        super().__init__(bus, "eint", 0, 0)

    def reset(self) -> None:
        """No pin selected; low level."""
        self.selected = self.flags = self.mode = self.polarity = self.levels = 0

    def select(self, pinsel4: int) -> None:
        """Take over the selection of P2.10…P2.13."""
        functions = [pinsel4 >> (_FIRST_SELECTION + 2 * k) & 3 for k in range(_COUNT)]
        self.selected = sum(1 << k for k, function in enumerate(functions) if function == _EINT)
        self.levels = self.bus.read_bus(_FIO2PIN) >> _FIRST_PIN & 0xF
        self._update()

    def pins_changed(self, port: int, changed: int, levels: int) -> None:
        """Look for edges, and for the end of a level."""
        if port != _PORT:
            return
        changed = changed >> _FIRST_PIN & self.selected
        self.levels = levels >> _FIRST_PIN & 0xF
        self.flags |= changed & self.mode & ~(self.levels ^ self.polarity)
        self._update()

    def _update(self) -> None:
        """Set the flags of active levels, which can't be cleared while they last, and the interrupt lines."""
        self.flags |= self.selected & ~self.mode & ~(self.levels ^ self.polarity) & 0xF
        for index in range(_COUNT - 1):
            self.bus.nvic.set_line(_FIRST_IRQ + index, level=self.flags >> index & 1)
        self.bus.gpio_interrupts.update_line()  # EINT3 shares its line with the pins of ports 0 and 2

    def read(self, offset: int, size: int) -> int:
        """EXTINT, EXTMODE, EXTPOLAR."""
        return {_FLAGS: self.flags, _MODE: self.mode, _POLARITY: self.polarity}.get(offset, 0)

    def write(self, offset: int, value: int, size: int) -> None:
        """EXTINT (cleared by ones), EXTMODE, EXTPOLAR."""
        if offset == _FLAGS:
            self.flags &= ~value
        elif offset == _MODE:
            self.mode = value & 0xF
        elif offset == _POLARITY:
            self.polarity = value & 0xF
        self._update()


class PinConnect(StoredRegisters):
    """Pin selection: kept as written; PINSEL4 also says which external interrupts have a pin."""

    def write(self, offset: int, value: int, size: int) -> None:
        """Keep the value."""
        super().write(offset, value, size)
        if offset & ~3 == _PINSEL4:
            self.bus.external_interrupts.select(self.values[_PINSEL4])
