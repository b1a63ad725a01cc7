"""Loops that wait for a register without an end."""

from __future__ import annotations

from dataclasses import dataclass

from firmware_bridge.board.peripheral import StoredRegisters
from firmware_bridge.strict.findings import Rule, Severity
from firmware_bridge.strict.registers import register_name
from firmware_bridge.strict.watch import Access, Watch

__all__ = ["NO_TIME_OUT", "UNBOUNDED", "WaitWatch"]

UNBOUNDED = Rule(
    "unbounded_wait", "give the loop a time-out: what it waits for may never come", "any wait for hardware"
)

NO_TIME_OUT = Rule(
    "no_time_out",
    "give the loop a count of tries, and the program a way on: a part that is broken never becomes ready",
    "any wait for hardware",
    Severity.WARNING,
)
OUTSIDE = Rule(
    "wait_for_outside",
    "give the loop a time-out; on this board nothing drives that pin, or the peripheral only stores what is written",
    "any wait for hardware",
    Severity.WARNING,
)

_GPIO_BASE = 0x2009C000
_LINE_STATUS, _TRANSMITTER_EMPTY, _RECEIVED = 0x14, 0x20, 0x01
_UARTS = frozenset({0x4000C000, 0x40010000, 0x40098000, 0x4009C000})


@dataclass
class _Poll:
    """A register that is read over and over."""

    address: int
    value: int
    since_s: float
    stands: bool = False


class WaitWatch(Watch):
    """Looks for a register that is read over and over and does not change."""

    def reset(self) -> None:
        """Nobody waits."""
        self._polled: dict[int, _Poll] = {}
        stored = (peripheral.base for peripheral in self.board.peripherals if isinstance(peripheral, StoredRegisters))
        self._outside = {_GPIO_BASE, *stored}

    def _level(self) -> int:
        active = self.board.nvic.active
        return active[-1] if active else 0

    def after(self, access: Access) -> None:
        """Note what is read, at the level of the present exception: interrupts do not end a wait."""
        level = self._level()
        if access.write:
            self._polled.pop(level, None)
            return
        poll = self._polled.get(level)
        if poll is None or (poll.address, poll.value) != (access.address, access.value):
            self._polled[level] = _Poll(access.address, access.value, self.board.seconds)
            return
        lasted = self.board.seconds - poll.since_s
        if poll.stands and lasted > self.policy.wait_s and not self._waits_for_the_host(access):
            name = register_name(access.base, access.offset)
            rule = OUTSIDE if access.base in self._outside else UNBOUNDED
            self.report(rule, f"{name} = {access.value:#x} for {lasted * 1e3:.0f} ms, and no count of tries")
            poll.since_s = float("inf")

    def stand_still(self) -> None:
        """Note that the loop has no counter."""
        poll = self._polled.get(self._level())
        if poll is not None:
            poll.stands = True

    @staticmethod
    def _waits_for_the_host(access: Access) -> bool:
        """Whether an idle UART is asked for a character: nobody has typed one."""
        status = access.value & (_TRANSMITTER_EMPTY | _RECEIVED)
        return access.base in _UARTS and access.offset == _LINE_STATUS and status == _TRANSMITTER_EMPTY
