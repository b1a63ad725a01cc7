"""The interrupt pins of the chips, wired to inputs of the processor."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from firmware_bridge.board.bus import Bus
from firmware_bridge.board.peripheral import Peripheral

__all__ = ["INT1_PINS", "INT2_PINS", "PORT", "ChipPins"]

PORT = 0
INT1_PINS = (15, 16, 17, 18)
"""P0.15…P0.18 (mbed p13, p14, p12, p11): INT1 of sensors 1…4."""
INT2_PINS = (23, 24, 25, 26)
"""P0.23…P0.26 (mbed p15…p18): INT2 of sensors 1…4."""


class _Chip(Protocol):
    """What a chip shows on its interrupt pins."""

    signalling: bool
    """Whether a pin may have changed, or may change by itself."""

    @property
    def signals(self) -> bool:
        """Whether any interrupt output is enabled."""

    @property
    def next_change(self) -> int:
        """Tick of the next conversion that may change a pin."""

    def interrupt_pin(self, number: int, now: int) -> bool:
        """Level of pin INT1 or INT2."""


class ChipPins(Peripheral):
    """Sixteen wires at most; without an enabled interrupt they cost nothing.

    Parameters
    ----------
    bus : Bus
        The board.
    chips : sequence
        Chips on the SPI bus, in the order of `INT1_PINS`.
    drive : callable
        (port, bit, level): sets an input pin of the processor.
    """

    def __init__(self, bus: Bus, chips: Sequence[_Chip], drive: Callable[[int, int, bool], None]) -> None:
        self._chips = chips
        self._drive = drive
        super().__init__(bus, "chip pins", 0, 0)

    def reset(self) -> None:
        """Show what the chips, which have no reset pin, still say."""
        self._levels: dict[int, bool] = {}
        for chip in self._chips:
            chip.signalling = True
        self.update()

    def update(self) -> None:
        """Pass on the levels, and ask to be woken when one may change."""
        now = self.bus.now
        following = 1 << 62
        for index, chip in enumerate(self._chips):
            if chip.signalling:
                for output, pins in ((1, INT1_PINS), (2, INT2_PINS)):
                    level = chip.interrupt_pin(output, now)
                    if self._levels.get(pins[index]) != level:
                        self._levels[pins[index]] = level
                        self._drive(PORT, pins[index], level)
                chip.signalling = chip.signals
                if chip.signals:
                    following = min(following, chip.next_change)
        self.bus.schedule(self.slot, following)

    def event(self) -> None:
        """Look at the chips when one has converted."""
        self.update()
