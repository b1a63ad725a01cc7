"""What peripherals and chips know of the board: the bus protocol, and not the board that implements it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

__all__ = ["Bus", "Tracer"]


class Tracer(Protocol):
    """Takes note of what happens on the board."""

    def access(self, ticks: int, peripheral: str, offset: int, value: int, *, write: bool) -> None:
        """Note that a register was read or written."""

    def exception(self, ticks: int, number: int, *, entered: bool) -> None:
        """Note that an exception was entered or left."""


class InterruptLines(Protocol):
    """The side of the interrupt controller that peripherals drive."""

    def set_line(self, irq: int, level: bool | int) -> None:
        """Set the level of an interrupt line."""

    def pend(self, exception: int) -> None:
        """Make an exception pending."""


class ClockTree(Protocol):
    """Dividers of the peripheral clocks."""

    def peripheral_divider(self, place: int) -> int:
        """Core clock cycles per cycle of a peripheral's clock, by its place in PCLKSEL0 and PCLKSEL1."""


class RegisterBlock(Protocol):
    """Registers that lie inside the address range of another peripheral."""

    def read(self, offset: int, size: int) -> int:
        """Value of the register at ``offset``."""

    def write(self, offset: int, value: int, size: int) -> None:
        """Write the register at ``offset``."""


class PinWatcher(Protocol):
    """Interrupts on the edges of pins."""

    @property
    def watching(self) -> bool:
        """Whether any edge is enabled."""

    def pins_changed(self, port: int, changed: int, levels: int) -> None:
        """Look for enabled edges."""

    def update_line(self) -> None:
        """Set the interrupt line anew."""


class ExternalPins(RegisterBlock, Protocol):
    """External interrupts, which have their registers in system control and share a line with the pins."""

    selected: int
    flags: int

    def select(self, pinsel4: int) -> None:
        """Take over a selection of pins."""

    def pins_changed(self, port: int, changed: int, levels: int) -> None:
        """Look for edges and levels."""


class TransmitLine(Protocol):
    """The pace of a UART's transmitter."""

    @property
    def character(self) -> int:
        """Ticks per character."""


class Bus(Protocol):
    """Time, events, interrupts, clocks and memory of a board, as its peripherals see them.

    Attributes
    ----------
    now : int
        Virtual time, ticks.
    cycle : int
        Ticks per core clock cycle.
    alarm : int
        Time at which the processor looks for interrupts; −1 at its next block of code.
    """

    now: int
    cycle: int
    alarm: int

    @property
    def nvic(self) -> InterruptLines:
        """Interrupt lines."""

    @property
    def system_control(self) -> ClockTree:
        """Clock dividers."""

    @property
    def systick(self) -> RegisterBlock:
        """Registers of the system timer, within those of the interrupt controller."""

    @property
    def gpio_interrupts(self) -> PinWatcher:
        """Interrupts on pins."""

    @property
    def external_interrupts(self) -> ExternalPins:
        """External interrupts."""

    @property
    def uarts(self) -> Sequence[TransmitLine]:
        """UARTs by number."""

    def add(self, peripheral: Any, /) -> int:
        """Take in a `firmware_bridge.board.peripheral.Peripheral`; return the number of its event."""

    def schedule(self, slot: int, when: int) -> None:
        """Wake a peripheral at ``when`` (instead of the time it asked for before)."""

    def spinning(self, slot: int) -> bool:
        """Whether the last register access was the same: the program waits in a loop."""

    def wait_until(self, when: int) -> None:
        """Let a polling program skip to ``when``, or to the next event if that is earlier."""

    def change_clock(self, cycle: int) -> None:
        """Change the core clock or a peripheral divider."""

    def request_reset(self, cause: int) -> None:
        """Reset at the next instruction boundary."""

    def warn(self, text: str) -> None:
        """Record what the firmware should not do."""

    def read_bus(self, address: int, size: int = 4) -> int:
        """Read memory or a register as another bus master does."""

    def write_bus(self, address: int, value: int, size: int = 4) -> None:
        """Write memory or a register as another bus master does."""
