"""The watchdog: started, fed in time (UM10360 chapter 28)."""

from __future__ import annotations

from firmware_bridge.board.nvic import FIRST_IRQ
from firmware_bridge.board.peripheral import NEVER
from firmware_bridge.board.system_control import WATCHDOG
from firmware_bridge.strict.findings import Place, Rule, Severity
from firmware_bridge.strict.watch import Access, Watch

__all__ = ["WatchdogWatch"]

RESET = Rule("watchdog_reset", "feed the watchdog in time, or find where the program stands", "UM10360 28.3")
LATE = Rule("watchdog_late", "feed the watchdog earlier, or set WDTC longer", "UM10360 28.3", Severity.WARNING)
NO_RESET = Rule(
    "watchdog_without_reset",
    "set WDRESET in WDMOD, or enable the watchdog's interrupt",
    "UM10360 28.4.1",
    Severity.WARNING,
)
NOT_STARTED = Rule("watchdog_not_started", "feed the watchdog once: WDMOD alone does not start it", "UM10360 28.4.1")

_WDMOD, _WDTC, _WDFEED = 0x00, 0x04, 0x08
_ENABLE, _RESETS, _LAST = 1, 2, 0x55
_MINIMUM = 0xFF


class WatchdogWatch(Watch):
    """Looks at each feed and at the time that was left."""

    peripherals = frozenset({"watchdog"})

    def reset(self) -> None:
        """Off."""
        self._enabled: Place | None = None
        self._toothless: Place | None = None
        self._span = 0
        self._before = NEVER

    def before(self, access: Access) -> None:
        """Look at the time that is left."""
        self._before = self.board.watchdog.expires

    def after(self, access: Access) -> None:
        """Judge a feed."""
        watchdog, now = self.board.watchdog, self.board.now
        if not access.write:
            return
        if access.offset == _WDMOD and access.value & _ENABLE and watchdog.expires >= NEVER:
            self._enabled = self.ledger.here()
            self._toothless = None if watchdog.mode & _RESETS else self._enabled
        elif access.offset == _WDTC and access.value < _MINIMUM:
            self.report(LATE, f"WDTC = {access.value} is less than the least, {_MINIMUM}")
        elif access.offset == _WDFEED and access.value & 0xFF == _LAST and watchdog.expires < NEVER:
            self._enabled = None
            left = self._before - now
            if self._before < NEVER and watchdog.expires != self._before and left < self.policy.feed_share * self._span:
                self.report(LATE, f"fed with {left / self._span:.0%} of its time left")
            self._span = watchdog.expires - now

    def end(self) -> None:
        """Look whether the watchdog resets the board, or never ran."""
        if self.board.reset_cause == WATCHDOG:
            self.report(RESET, "the watchdog was not fed in time and resets the board")
        elif self._enabled is not None:
            self.ledger.add(NOT_STARTED, "the watchdog is enabled, but never fed", self._enabled)
            self._enabled = None
        if self._toothless is not None and not self.board.nvic.enabled >> (FIRST_IRQ + self.board.watchdog.irq) & 1:
            self.ledger.add(NO_RESET, "the watchdog neither resets nor interrupts when it ends", self._toothless)
            self._toothless = None
