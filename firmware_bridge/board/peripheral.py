"""What every peripheral of the board has: registers to read and write, and events it asks to be woken for."""

from __future__ import annotations

from firmware_bridge.board.bus import Bus

__all__ = ["NEVER", "Peripheral", "StoredRegisters"]

NEVER = 1 << 62
"""Time of an event that is not scheduled."""


class Peripheral:
    """Base of the peripherals.

    Parameters
    ----------
    bus : Bus
        Time (``bus.now``, ticks), events, interrupt lines, clocks and memory of the board.
    name : str
        Name in traces.
    base, size : int
        Address range.
    irq : int
        Interrupt number, or −1.
    """

    def __init__(self, bus: Bus, name: str, base: int, size: int = 0x1000, irq: int = -1) -> None:
        self.bus = bus
        self.name = name
        self.base = base
        self.size = size
        self.irq = irq
        self.slot = bus.add(self)

    def reset(self) -> None:
        """Return to the state after reset."""

    def read(self, offset: int, size: int) -> int:
        """Value of the register at ``offset``; ``size`` is 1, 2 or 4 bytes."""
        raise NotImplementedError

    def write(self, offset: int, value: int, size: int) -> None:
        """Write the register at ``offset``."""
        raise NotImplementedError

    def event(self) -> None:
        """Do what was scheduled for a time that has come."""

    def clock_will_change(self) -> None:
        """Settle what depends on the core clock before it changes."""

    def clock_changed(self) -> None:
        """Go on with the new core clock."""


class StoredRegisters(Peripheral):
    """Registers that keep what is written and do nothing: peripherals the board does not model."""

    def reset(self) -> None:
        """Clear all registers."""
        self.values: dict[int, int] = {}

    def read(self, offset: int, size: int) -> int:
        """Value last written, or 0."""
        value = self.values.get(offset & ~3, 0) >> 8 * (offset & 3)
        return value & ((1 << 8 * size) - 1)

    def write(self, offset: int, value: int, size: int) -> None:
        """Keep the value."""
        shift = 8 * (offset & 3)
        mask = ((1 << 8 * size) - 1) << shift
        old = self.values.get(offset & ~3, 0)
        self.values[offset & ~3] = (old & ~mask) | (value << shift & mask)
