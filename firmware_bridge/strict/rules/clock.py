"""Oscillators, PLL0, core clock, flash wait states, peripheral clocks (UM10360 chapters 4 and 5)."""

from __future__ import annotations

from firmware_bridge.board.nvic import FIRST_IRQ
from firmware_bridge.strict.findings import Place, Rule, Severity
from firmware_bridge.strict.registers import register_name
from firmware_bridge.strict.watch import Access, Watch

__all__ = ["ClockWatch", "FeedWatch"]

OSCILLATOR = Rule(
    "oscillator",
    "set OSCEN in SCS, wait until OSCSTAT is set, then select the crystal; OSCRANGE 0 is for 1…20 MHz",
    "UM10360 3.7.1, 4.3",
)
PLL_RANGE = Rule(
    "pll_range", "choose M and N so that Fcco = 2·M·Fin/N is 275…550 MHz, M 6…512, N 1…32", "UM10360 4.5.10"
)
PLL_FEED = Rule(
    "pll_feed",
    "write 0xAA, then 0x55, to PLL0FEED after each change, with interrupts off and no access in between",
    "UM10360 4.5.8",
)
PLL_LOCK = Rule("pll_lock", "wait for PLOCK0 in PLL0STAT between enabling and connecting PLL0", "UM10360 4.5.13")
PLL_STEPS = Rule(
    "pll_steps",
    "one step per feed: disconnect, disable, source and PLL0CFG, enable, CCLKCFG, lock, connect",
    "UM10360 4.5.13",
)
CCLK = Rule("core_clock", "keep CCLK at 100 MHz or less: set CCLKCFG before PLL0 is connected", "LPC1768 data sheet, 9")
FLASH = Rule("flash_wait_states", "set FLASHTIM for the clock: 5 cycles (0x4) above 80 MHz", "UM10360 5.4")
FLASH_LATE = Rule("flash_wait_late", "set FLASHTIM before the clock rises, not after", "UM10360 5.4", Severity.WARNING)
PCLKSEL = Rule(
    "pclksel_ignored",
    "select peripheral clocks before PLL0 is connected; afterwards the write may be ignored",
    "ES_LPC176x, PCLKSELx.1",
)
RESERVED_BITS = Rule(
    "reserved_bits",
    "write reserved bits as they are after reset",
    "UM10360, the table of the register",
    Severity.WARNING,
)
WATCHDOG_FEED = Rule(
    "watchdog_feed", "write 0xAA and 0x55 to WDFEED one after the other, with interrupts off", "UM10360 28.4.3"
)

_BASE = 0x400FC000
_FLASHCFG, _PLL0CON, _PLL0CFG, _PLL0STAT, _PLL0FEED = 0x000, 0x080, 0x084, 0x088, 0x08C
_CCLKCFG, _CLKSRCSEL, _SCS, _PCLKSELS = 0x104, 0x10C, 0x1A0, (0x1A8, 0x1AC)
_ENABLE, _CONNECT, _LOCKED = 1, 2, 1 << 26
_OSCRANGE, _OSCEN, _OSCSTAT = 0x10, 0x20, 0x40
_CRYSTAL_HZ, _LOW_RANGE_END_HZ, _HIGH_RANGE_START_HZ = 12e6, 20e6, 15e6
_SOURCE_HZ = {0: 4e6, 1: _CRYSTAL_HZ, 2: 32_768.0}
_FCCO_HZ = (275e6, 550e6)
_CCLK_MAX_HZ = 100e6
_HZ_PER_FLASH_CYCLE = 20e6
_SLOWEST_FLASHTIM = 5
_TOLERANCE = 1e-4
# What may not be changed: register, its reserved bits, their value after reset.
_RESERVED = {
    _FLASHCFG: (0xFFFF0FFF, 0x03A), _PLL0CFG: (0xFF008000, 0), _CCLKCFG: (0xFFFFFF00, 0), 0x0C4: (0x10100821, 0),
    _PCLKSELS[0]: (0x000C0C00, 0), _PCLKSELS[1]: (0x03000300, 0), _CLKSRCSEL: (0xFFFFFFFC, 0),
}  # fmt: skip


class ClockWatch(Watch):
    """Follows the set-up of the clocks step by step."""

    peripherals = frozenset({"syscon"})

    def reset(self) -> None:
        """Start on the internal oscillator."""
        self._lock_seen = self._oscillator_seen = False
        self._enabled_at = 0.0
        self._old = (0, 0)
        self._unfed: Place | None = None
        self._slow_flash: tuple[Place, str] | None = None
        self._hz = 0.0

    def _pll(self) -> tuple[int, int]:
        """PLL0's control bits and setting in effect."""
        status = self.board.system_control.read(_PLL0STAT, 4)
        return status >> 24 & 3, status & 0xFF7FFF

    def _register(self, offset: int) -> int:
        return self.board.system_control.registers.get(offset, 0)

    def before(self, access: Access) -> None:
        """Look at PLL0 before a step, and at writes that are not allowed now."""
        self._old = self._pll()
        if not access.write:
            return
        control = self._old[0]
        if access.offset in _PCLKSELS and control == _ENABLE | _CONNECT:
            if access.value != self._register(access.offset):
                name = register_name(_BASE, access.offset)
                self.report(PCLKSEL, f"{name} = {access.value:#010x} written while PLL0 is connected")
        elif access.offset == _CLKSRCSEL:
            self._select_source(access.value, control)
        if access.offset in _RESERVED:
            mask, value = _RESERVED[access.offset]
            if access.value & mask != value:
                name = register_name(_BASE, access.offset)
                self.report(RESERVED_BITS, f"{name} = {access.value:#010x} changes bits {mask:#010x}")

    def _select_source(self, value: int, control: int) -> None:
        if control & _ENABLE and value != self._register(_CLKSRCSEL):
            self.report(PLL_STEPS, "the clock source is changed while PLL0 is enabled")
        scs = self._register(_SCS)
        if value & 3 == 3:
            self.report(OSCILLATOR, "CLKSRCSEL = 3 is reserved")
        if value & 3 != 1:
            return
        if not scs & _OSCEN:
            self.report(OSCILLATOR, "the crystal is selected but not enabled: the processor has no clock")
        elif not self._oscillator_seen:
            self.report(OSCILLATOR, "the crystal is selected before OSCSTAT was seen set")
        if scs & _OSCRANGE and _CRYSTAL_HZ < _HIGH_RANGE_START_HZ:
            self.report(OSCILLATOR, f"OSCRANGE 1 is for 15…25 MHz; the crystal has {_CRYSTAL_HZ / 1e6:g} MHz")
        if not scs & _OSCRANGE and _CRYSTAL_HZ > _LOW_RANGE_END_HZ:
            self.report(OSCILLATOR, f"OSCRANGE 0 is for 1…20 MHz; the crystal has {_CRYSTAL_HZ / 1e6:g} MHz")

    def after(self, access: Access) -> None:
        """Judge what the access made of the clocks."""
        if access.write:
            self._judge_write(access)
        elif access.offset == _PLL0STAT:
            self._lock_seen |= bool(access.value & _LOCKED)
            if self._unfed is not None:
                self.ledger.add(PLL_FEED, "PLL0CON or PLL0CFG changed, but not fed: it has no effect", self._unfed)
                self._unfed = None
        elif access.offset == _SCS:
            self._oscillator_seen |= bool(access.value & _OSCSTAT)
        self._judge_clock()

    def _judge_write(self, access: Access) -> None:
        control, setting = self._pll()
        old_control, old_setting = self._old
        if access.offset in {_PLL0CON, _PLL0CFG}:
            wanted = self._register(_PLL0CFG) & 0xFF7FFF, self._register(_PLL0CON) & 3
            self._unfed = self.ledger.here() if wanted != (setting, control) else None
        if access.offset != _PLL0FEED or (control, setting) == (old_control, old_setting):
            return
        self._unfed = None
        if old_control & _CONNECT and not control & _ENABLE:
            self.report(PLL_STEPS, "PLL0 is disabled in the feed that disconnects it, or while it is connected")
        if setting != old_setting and (old_control & _ENABLE or control & _ENABLE):
            self.report(PLL_STEPS, "PLL0CFG is changed while PLL0 is enabled, or in the feed that enables it")
        if control & _ENABLE and not old_control & _ENABLE:
            self._lock_seen, self._enabled_at = False, self.board.seconds
            self._judge_range(setting)
        if control & _CONNECT and not old_control & _CONNECT:
            waited = self.board.seconds - self._enabled_at
            if not old_control & _ENABLE:
                self.report(PLL_LOCK, "PLL0 is connected in the feed that enables it")
            elif not self._lock_seen and waited < self.policy.settle_s:
                self.report(PLL_LOCK, f"PLL0 is connected {waited * 1e6:.1f} µs after it was enabled, its lock unseen")

    def _judge_range(self, setting: int) -> None:
        source = _SOURCE_HZ.get(self._register(_CLKSRCSEL) & 3, 0.0)
        multiplier, divider = (setting & 0x7FFF) + 1, (setting >> 16 & 0xFF) + 1
        fcco = 2.0 * multiplier * source / divider
        from_rtc = source < 1e5  # low sources have a table of multipliers of their own
        if not _FCCO_HZ[0] <= fcco <= _FCCO_HZ[1]:
            self.report(PLL_RANGE, f"Fcco = {fcco / 1e6:g} MHz (M = {multiplier}, N = {divider})")
        elif not from_rtc and not (6 <= multiplier <= 512 and divider <= 32):
            self.report(PLL_RANGE, f"M = {multiplier}, N = {divider}")

    def _judge_clock(self) -> None:
        hz = self.board.system_control.core_hz
        if hz != self._hz:
            self._hz = hz
            if hz > _CCLK_MAX_HZ * (1.0 + _TOLERANCE):
                self.report(CCLK, f"CCLK = {hz / 1e6:g} MHz")
        flashtim = self._register(_FLASHCFG) >> 12 & 15
        enough = flashtim >= _SLOWEST_FLASHTIM or hz <= (flashtim + 1) * _HZ_PER_FLASH_CYCLE * (1.0 + _TOLERANCE)
        if enough and self._slow_flash is not None:
            self._settle_flash()
        elif not enough and self._slow_flash is None:
            what = f"CCLK = {hz / 1e6:g} MHz with {flashtim + 1} cycles per flash access"
            self._slow_flash = (self.ledger.here(), what)

    def _settle_flash(self) -> None:
        """Say for how long the flash was too slow for the clock."""
        if self._slow_flash is None:
            return
        place, what = self._slow_flash
        self._slow_flash = None
        lasted = self.board.seconds - place.time_s
        if lasted > self.policy.flash_late_s:
            self.ledger.add(FLASH, what, place)
        else:
            self.ledger.add(FLASH_LATE, f"{what}, for {lasted * 1e6:.1f} µs", place)

    def end(self) -> None:
        """Say what has not come: wait states, a feed."""
        self._settle_flash()
        if self._unfed is not None:
            self.ledger.add(PLL_FEED, "PLL0CON or PLL0CFG changed, but not fed: it has no effect", self._unfed)
            self._unfed = None


_WATCHDOG_BASE = 0x40000000
_FEEDS = {_BASE + _PLL0FEED: PLL_FEED, _BASE + 0x0AC: PLL_FEED, _WATCHDOG_BASE + 0x08: WATCHDOG_FEED}


class FeedWatch(Watch):
    """Looks at the two writes of a feed sequence, and at what comes between them."""

    def reset(self) -> None:
        """No sequence begun."""
        self._begun: int | None = None

    def before(self, access: Access) -> None:
        """Take the next write of a sequence."""
        if access.write and access.address in _FEEDS:
            self._feed(access.address, access.value & 0xFF)
        elif self._begun is not None and access.base in {self._begun & ~0x3FFF, _WATCHDOG_BASE}:
            name = register_name(access.base, access.offset)
            self.report(_FEEDS[self._begun], f"{name} is accessed between 0xAA and 0x55: the feed is void")
            self._begun = None

    def _feed(self, address: int, value: int) -> None:
        name = register_name(*((_BASE, address - _BASE) if address >= _BASE else (_WATCHDOG_BASE, address & 0xFF)))
        begun, self._begun = self._begun, address if value == 0xAA else None
        if value == 0x55 and begun != address:
            self.report(_FEEDS[address], f"{name} = 0x55 without 0xAA before it")
        elif value not in {0xAA, 0x55}:
            self.report(_FEEDS[address], f"{name} = {value:#04x}: a feed is 0xAA, then 0x55")
        elif value == 0xAA and begun is not None:
            self.report(_FEEDS[begun], f"{name} = 0xAA twice without 0x55")

    def exception(self, number: int, *, entered: bool) -> None:
        """Name an interrupt between the two writes: it may access other registers."""
        if entered and self._begun is not None:
            interrupt = f"interrupt {number - FIRST_IRQ}" if number >= FIRST_IRQ else f"exception {number}"
            self.report(_FEEDS[self._begun], f"{interrupt} between 0xAA and 0x55")
            self._begun = None

    def end(self) -> None:
        """Name a sequence that was not ended."""
        if self._begun is not None:
            self.report(_FEEDS[self._begun], "0xAA without 0x55")
            self._begun = None
