"""SSP0 and SSP1 as SPI masters: clock prescaler, FIFOs (UM10360 chapter 18)."""

from __future__ import annotations

from firmware_bridge.board.ssp import Ssp
from firmware_bridge.strict.findings import Rule, Severity
from firmware_bridge.strict.rules.uart import READ_EMPTY, WRITE_FULL
from firmware_bridge.strict.watch import Access, Watch

__all__ = ["SspWatch", "words_received"]

PRESCALER = Rule("ssp_prescaler", "write an even value, 2…254, to SSPnCPSR: it is 0 after reset", "UM10360 18.6.5")
DISABLED = Rule("ssp_disabled", "set SSE in SSPnCR1 before the first word", "UM10360 18.6.2", Severity.WARNING)
BUSY = Rule("ssp_changed_while_busy", "wait until BSY is clear before CR0, CR1 or CPSR is changed", "UM10360 18.6")
OVERRUN = Rule("ssp_overrun", "read a word for every word that is written: 8 are kept", "UM10360 18.6.7")

_DEPTH = 8
_ENABLE, _OVERRUN_FLAG = 2, 1


def words_received(ssp: Ssp) -> int:
    """Words in the receive FIFO now."""
    return sum(through <= ssp.bus.now for through, _ in ssp.words)


class SspWatch(Watch):
    """Looks at clock and FIFOs when words are exchanged."""

    peripherals = frozenset({"ssp0", "ssp1"})

    def reset(self) -> None:
        """Prescalers are 0, nothing was sent."""
        self._prescaler = {0: 0, 1: 0}
        self._used: set[int] = set()
        self._emptied = {0: 0, 1: 0}
        self._overrun = False

    def _ssp(self, access: Access) -> tuple[int, Ssp]:
        return next((index, ssp) for index, ssp in enumerate(self.board.ssps) if ssp.base == access.base)

    def before(self, access: Access) -> None:
        """Look at the interface before the access changes it."""
        number, ssp = self._ssp(access)
        if access.offset == 0x08 and access.write:
            self._send(number, ssp)
        elif access.offset == 0x08:
            if not words_received(ssp):
                self._read_empty(number)
        elif access.offset in {0x00, 0x04, 0x10} and access.write:
            if ssp.done > self.board.now and self._changes(ssp, access):
                self.report(BUSY, f"SSP{number} is set up anew while a word is shifted")
            if access.offset == 0x10:
                self._prescaler[number] = access.value & 0xFF

    def _read_empty(self, number: int) -> None:
        """Judge a read of nothing; programs may empty a FIFO that they have not used yet."""
        if number not in self._used:
            self._emptied[number] += 1
        if number in self._used or self._emptied[number] > _DEPTH:
            self.report(READ_EMPTY, f"SSP{number}DR is read, but no word has arrived")

    @staticmethod
    def _changes(ssp: Ssp, access: Access) -> bool:
        present = {0x00: ssp.control0, 0x04: ssp.control1, 0x10: ssp.prescaler}[access.offset]
        return access.value & 0xFFFF != present

    def _send(self, number: int, ssp: Ssp) -> None:
        self._used.add(number)
        prescaler = self._prescaler[number]
        self._overrun = bool(ssp.raw & _OVERRUN_FLAG)
        if not ssp.control1 & _ENABLE:
            self.report(DISABLED, f"SSP{number}DR is written before SSE is set")
        elif prescaler < 2 or prescaler & 1:
            self.report(PRESCALER, f"SSP{number}CPSR = {prescaler}: nothing is sent as it should be")
        if len(ssp.words) - words_received(ssp) - 1 >= _DEPTH:
            self.report(WRITE_FULL, f"SSP{number}DR is written, but its FIFO is full: the word is lost")

    def after(self, access: Access) -> None:
        """Look whether a word found no room in the receive FIFO."""
        if access.write and access.offset == 0x08:
            number, ssp = self._ssp(access)
            if ssp.raw & _OVERRUN_FLAG and not self._overrun:
                self.report(OVERRUN, f"SSP{number}: more words than its receive FIFO holds")
