"""What a watch is given to see of the board: register accesses, exceptions, blocks of code, resets."""

from __future__ import annotations

from dataclasses import dataclass

from firmware_bridge.board.board import Board
from firmware_bridge.strict.findings import Ledger, Rule

__all__ = ["Access", "Policy", "Watch"]


@dataclass(frozen=True)
class Policy:
    """Limits that no document fixes to the digit.

    Parameters
    ----------
    baud : int or None
        Expected speed of every UART that sends, baud; None: the nearest of ``speeds``.
    speeds : tuple of int
        Speeds that serial ports are opened at, baud; 1,562,500 is this firmware's own.
    baud_error : float
        Largest share by which a UART may be off: half a bit in ten is 5 %, shared by both ends.
    wait_s : float
        A program that polls one unchanged register for longer waits without an end, s. A crystal takes 10 ms.
    settle_s : float
        PLL0 counts as locked after so long, even if nobody looked, s (UM10360 4.5.13, step 8).
    flash_late_s : float
        Wait states that come later than this after the clock has risen have not come, s.
    feed_share : float
        A watchdog fed with a smaller share of its time left was fed late.
    storm : int
        Exceptions in a row, without an instruction of the program between them, that make a storm.
    storm_s, storm_least : float, int
        A row that lasts longer, s, and has at least so many entries, is one as well.
    stack_spare : int
        Free bytes between the main stack and the data below it that are too few.
    dead_s : float
        Time in an endless empty loop inside an exception that no program wants, s.
    """

    baud: int | None = None
    speeds: tuple[int, ...] = (
        300, 600, 1200, 2400, 4800, 9600, 14_400, 19_200, 28_800, 31_250, 38_400, 57_600, 76_800, 115_200, 230_400,
        250_000, 460_800, 500_000, 921_600, 1_000_000, 1_500_000, 1_562_500, 2_000_000, 2_500_000, 3_000_000,
    )  # fmt: skip
    baud_error: float = 0.025
    wait_s: float = 0.5
    settle_s: float = 500e-6
    flash_late_s: float = 1e-3
    feed_share: float = 0.1
    storm: int = 300
    storm_s: float = 0.1
    storm_least: int = 20
    stack_spare: int = 128
    dead_s: float = 0.05


@dataclass(frozen=True, slots=True)
class Access:
    """One register access.

    Parameters
    ----------
    address : int
        Address.
    base : int
        First address of the peripheral.
    offset : int
        Place within the peripheral.
    size : int
        Bytes.
    value : int
        Value written; of a read, what was read (0 before it).
    write : bool
        Whether it writes.
    """

    address: int
    base: int
    offset: int
    size: int
    value: int
    write: bool


class Watch:
    """Base of the watches: each looks after a few rules.

    Parameters
    ----------
    board : Board
        The board.
    ledger : Ledger
        Where broken rules are written down.
    policy : Policy
        Limits.
    """

    peripherals: frozenset[str] | None = None
    """Names of the peripherals it looks at; None: all."""

    def __init__(self, board: Board, ledger: Ledger, policy: Policy) -> None:
        self.board, self.ledger, self.policy = board, ledger, policy
        self.reset()

    def report(self, rule: Rule, what: str) -> None:
        """Write down that a rule is broken here and now."""
        self.ledger.add(rule, what)

    def reset(self) -> None:
        """Forget what a reset of the processor makes void."""

    def before(self, access: Access) -> None:
        """Look at the board before a register is accessed."""

    def after(self, access: Access) -> None:
        """Look at the board after a register was accessed."""

    def exception(self, number: int, *, entered: bool) -> None:
        """Note that an exception was entered or left."""

    def block(self, address: int, stack: int | None) -> None:
        """Look before a block of code at ``address`` is executed; ``stack``: main stack pointer, if in use."""

    def unaligned(self, address: int) -> None:
        """Note an access to several words at an address that is not a multiple of four."""

    def stand_still(self) -> None:
        """Note that the program repeats itself exactly: only time, and what comes with it, can end that."""

    def end(self) -> None:
        """Say what is only certain at the end of a run, or before a reset."""
