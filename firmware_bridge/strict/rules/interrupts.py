"""Interrupts: handlers, priorities, flags that are not cleared (ARMv7-M ARM B1.5, UM10360 chapter 6)."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import replace

from firmware_bridge.board.cpu import FLASH_SIZE
from firmware_bridge.board.nvic import FIRST_IRQ, SYSTICK
from firmware_bridge.board.trace import exception_name
from firmware_bridge.strict.findings import Place, Rule, Severity
from firmware_bridge.strict.rules.clock import RESERVED_BITS
from firmware_bridge.strict.watch import Access, Watch

__all__ = ["InterruptWatch"]

NO_HANDLER = Rule(
    "no_handler", "write the handler under the name that the vector table expects, or do not enable it", "UM10360 6.3"
)
PRIORITY = Rule(
    "priority_bits", "shift priorities left by 3: the LPC1768 has the upper five bits only", "UM10360 6.5.11, 34.4.2.7"
)
STORM = Rule("interrupt_storm", "clear the interrupt's flag in its handler", "UM10360, the peripheral's chapter")
DEEP_SLEEP = Rule(
    "deep_sleep",
    "leave SLEEPDEEP in SCR clear, or set up PLL0 anew after every WFI: it stops PLL0 and the peripherals' clocks",
    "UM10360 4.8.2",
    Severity.WARNING,
)
DEAD = Rule("dead_handler", "find what raised the exception: the program stays in its handler", "ARMv7-M ARM B1.5")

_BRANCH_TO_SELF, _BREAKPOINT = 0xE7FE, 0xBE00
_PRIORITY_REGISTERS = (range(0x400, 0x424), range(0xD18, 0xD24))
_PRIORITY_BITS, _ALL_ONES = 0xF8, 0xFF
_ENABLE_REGISTERS = range(0x100, 0x108)
_SYSTICK_CONTROL, _SYSTICK_ON, _SYSTICK_RELOAD, _SYSTICK_MOST = 0x010, 3, 0x014, 0xFFFFFF
_SYSTEM_CONTROL, _SLEEPDEEP = 0xD10, 4
_DEFAULT_NAMES = re.compile(r"(default|dummy|unused|unexpected|unhandled)_?\w*|\w*(infinite_loop)", re.IGNORECASE)


class InterruptWatch(Watch):
    """Looks at what is enabled, entered and left."""

    peripherals = frozenset({"nvic"})

    def reset(self) -> None:
        """Nothing enabled."""
        self._enabled: dict[int, Place] = {}
        self._row: Counter[int] = Counter()
        self._row_since = 0.0
        self._dead: Place | None = None

    def before(self, access: Access) -> None:
        """Look at enabled interrupts and priorities."""
        if not access.write:
            return
        if access.offset in _ENABLE_REGISTERS:
            first = FIRST_IRQ + 8 * (access.offset - _ENABLE_REGISTERS.start)
            for bit in range(8 * access.size):
                if access.value >> bit & 1:
                    self._enabled.setdefault(first + bit, self.ledger.here())
        elif access.offset == _SYSTICK_CONTROL and access.value & _SYSTICK_ON == _SYSTICK_ON:
            self._enabled.setdefault(SYSTICK, self.ledger.here())
        elif access.offset == _SYSTICK_RELOAD and access.value > _SYSTICK_MOST:
            self.report(
                RESERVED_BITS, f"SYST_RVR = {access.value:#x} becomes {access.value & _SYSTICK_MOST:#x}: 24 bits"
            )
        elif access.offset == _SYSTEM_CONTROL and access.value & _SLEEPDEEP:
            self.report(DEEP_SLEEP, "SLEEPDEEP is set")
        elif any(access.offset in registers for registers in _PRIORITY_REGISTERS):
            for byte in range(access.size):
                value = access.value >> 8 * byte & 0xFF
                if (
                    value & ~_PRIORITY_BITS and value != _ALL_ONES
                ):  # all ones is how programs ask for the bits there are
                    self.report(PRIORITY, f"priority byte {value:#04x} becomes {value & _PRIORITY_BITS:#04x}")

    def exception(self, number: int, *, entered: bool) -> None:
        """Look at the handler, and at handlers that run again at once."""
        if not entered:
            self._dead = None
            return
        if len(self.board.nvic.active) == 1:
            self._enter_from_program(number)
        reason = self._missing(number)
        if reason:
            enabled_at = self._enabled.pop(number, None)
            self.ledger.add(NO_HANDLER, f"{_title(number)} comes, but {reason}", enabled_at)

    def _enter_from_program(self, number: int) -> None:
        """Count what comes in place of the program, and not within another handler."""
        if not self._row:
            self._row_since = self.board.seconds
        self._row[number] += 1
        if self._is_storm() and not self.ledger.hopeless:
            worst = self._row.most_common(1)[0][0]
            place = replace(self.ledger.here(), pc=self._vector(worst) & ~1)
            self.ledger.add(STORM, f"{_title(worst)} runs again and again: the program stands still", place)
            self.ledger.hopeless = True

    def _is_storm(self) -> bool:
        """Whether exceptions have kept the program from running for too often, or for too long."""
        policy, count = self.policy, self._row.total()
        lasted = self.board.seconds - self._row_since
        return count >= policy.storm or (count >= policy.storm_least and lasted > policy.storm_s)

    def _vector(self, exception: int) -> int:
        return int.from_bytes(self.board.cpu.peek(self.board.nvic.vtor + 4 * exception, 4), "little")

    def _missing(self, exception: int) -> str:
        """Say why an exception has no handler; empty if it has one."""
        board = self.board
        vector = self._vector(exception)
        address = vector & ~1
        if not vector & 1 or (address >= FLASH_SIZE and not board.image.in_memory(address)):
            return f"its vector is {vector:#010x}"
        first = int.from_bytes(board.cpu.peek(address, 2), "little")
        names = [name for name, value in board.image.symbols.items() if value == address]
        if any(_DEFAULT_NAMES.fullmatch(name) for name in names):
            return f"its vector is the default handler {' = '.join(sorted(names))}"
        if first == _BRANCH_TO_SELF or first & 0xFF00 == _BREAKPOINT:
            return f"its handler at {address:#x} is an endless loop"
        return ""

    def block(self, address: int, stack: int | None) -> None:
        """Note that the program gets on."""
        if not self.board.nvic.active:
            self._row.clear()

    def stand_still(self) -> None:
        """Note that the program stands in an exception."""
        active = self.board.nvic.active
        if not active:
            return
        if self._dead is None:
            self._dead = self.ledger.here()
        elif self.board.seconds - self._dead.time_s > self.policy.dead_s:
            self.ledger.add(DEAD, f"the program stays in the handler of {_title(active[-1])}", self._dead)
            self._dead = replace(self._dead, time_s=float("inf"))

    def end(self) -> None:
        """Look at interrupts that are enabled but have not come yet."""
        for number, place in sorted(self._enabled.items()):
            reason = self._missing(number)
            if reason:
                self.ledger.add(NO_HANDLER, f"{_title(number)} is enabled, but {reason}", place)
        self._enabled.clear()


def _title(exception: int) -> str:
    if exception < FIRST_IRQ:
        return exception_name(exception)
    return f"interrupt {exception - FIRST_IRQ} ({exception_name(exception)})"
