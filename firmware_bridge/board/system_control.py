"""System control of the LPC1768: oscillators, PLL0, clock dividers, reset cause (UM10360 chapters 3 and 4)."""

from __future__ import annotations

from firmware_bridge.adxl345.registers import TICKS_PER_SECOND
from firmware_bridge.board.bus import Bus
from firmware_bridge.board.peripheral import Peripheral

__all__ = ["BROWN_OUT", "EXTERNAL", "POWER_ON", "WATCHDOG", "SystemControl"]

POWER_ON, EXTERNAL, WATCHDOG, BROWN_OUT = 1, 2, 4, 8
"""Reset causes in RSID."""

_INTERNAL_OSCILLATOR_HZ = 4_000_000
_CRYSTAL_HZ = 12_000_000
_RTC_HZ = 32_768
_CONNECTED = 3
_PERIPHERAL_CLOCKS = (0x1A8, 0x1AC)
_EXTERNAL_INTERRUPTS = (0x140, 0x148, 0x14C)


class SystemControl(Peripheral):
    """Clock tree with a PLL that locks at once, and the reset cause.

    PCLKSEL0 and PCLKSEL1 keep their value while PLL0 is connected, whatever is written: the worst that NXP's errata
    sheet ES_LPC176x allows (PCLKSELx.1, "may not take effect"). The board records a warning.

    Attributes
    ----------
    crystal, pll_locks : bool
        Whether the main oscillator starts and PLL0 locks; False is a fault of the board.
    """

    def __init__(self, bus: Bus) -> None:
        self.cause = POWER_ON
        self.crystal = True
        self.pll_locks = True
        super().__init__(bus, "syscon", 0x400FC000, 0x4000)

    def reset(self) -> None:
        """Start on the internal oscillator, PLL off; the reset cause adds up until the firmware clears it."""
        self.registers = {0x000: 0x303A, 0x0C4: 0x042887DE}
        self._feed = 0
        self._pll_control = 0
        self._pll_setting = (0, 1)
        self._update()

    def power_cause(self, cause: int) -> None:
        """Record why the next reset happens (power-on clears the other causes)."""
        self.cause = cause if cause & POWER_ON else self.cause | cause

    @property
    def core_hz(self) -> float:
        """Core clock, Hz."""
        source = {0: _INTERNAL_OSCILLATOR_HZ, 1: _CRYSTAL_HZ, 2: _RTC_HZ}.get(
            self.registers.get(0x10C, 0) & 3, _INTERNAL_OSCILLATOR_HZ
        )
        divider = (self.registers.get(0x104, 0) & 0xFF) + 1
        if self._pll_control & _CONNECTED == _CONNECTED:
            multiplier, predivider = self._pll_setting
            return 2 * (multiplier + 1) * source / (predivider + 1) / divider
        return source / divider

    def peripheral_divider(self, place: int) -> int:
        """Division of the core clock for a peripheral, by its bit position in PCLKSEL0 (0…31) or PCLKSEL1 (32…63)."""
        register = self.registers.get(0x1A8 if place < 32 else 0x1AC, 0)
        return (4, 1, 2, 8)[register >> (place & 31) & 3]

    def _update(self) -> None:
        cycle = max(1, round(TICKS_PER_SECOND / self.core_hz))
        if cycle != self.bus.cycle:
            self.bus.change_clock(cycle)

    def read(self, offset: int, size: int) -> int:
        """Return registers as written; status bits say ready and locked."""
        if offset == 0x088:
            multiplier, predivider = self._pll_setting
            lock = 1 << 26 if self._pll_control & 1 and self.pll_locks else 0
            return multiplier | predivider << 16 | self._pll_control << 24 | lock
        if offset == 0x0A8:
            return 1 << 10 | (self.registers.get(0x0A0, 0) & 3) << 8  # PLL1 (USB): locked
        if offset == 0x180:
            return self.cause
        if offset in _EXTERNAL_INTERRUPTS:
            return self.bus.external_interrupts.read(offset, size)
        value = self.registers.get(offset & ~3, 0)
        if offset & ~3 == 0x1A0 and value & 0x20 and self.crystal:
            value |= 0x40  # main oscillator ready
        return value >> 8 * (offset & 3)

    def write(self, offset: int, value: int, size: int) -> None:
        """Keep the value; PLL settings take effect with the feed sequence."""
        if offset == 0x08C:
            if self._feed == 0xAA and value == 0x55:
                setting = self.registers.get(0x084, 0)
                self._pll_setting = (setting & 0x7FFF, setting >> 16 & 0xFF)
                self._pll_control = self.registers.get(0x080, 0) & 3
                self._update()
            self._feed = value
        elif offset == 0x180:
            self.cause &= ~value
        elif offset in _PERIPHERAL_CLOCKS:
            self._select_peripheral_clocks(offset, value)
        elif offset in _EXTERNAL_INTERRUPTS:
            self.bus.external_interrupts.write(offset, value, size)
        else:
            self.registers[offset] = value
            if offset in {0x104, 0x10C}:
                self._update()

    def _select_peripheral_clocks(self, offset: int, value: int) -> None:
        if value == self.registers.get(offset, 0):
            return
        if self._pll_control & _CONNECTED == _CONNECTED:
            name = f"PCLKSEL{_PERIPHERAL_CLOCKS.index(offset)}"
            self.bus.warn(
                f"{name} = {value:#010x} ignored: written while PLL0 is connected (errata sheet ES_LPC176x, "
                "PCLKSELx.1); write it before"
            )
            return
        self.registers[offset] = value
        self.bus.change_clock(self.bus.cycle)
