"""What ends an emulation: a typed error with the place in the program and all registers."""

from __future__ import annotations

import enum
from collections.abc import Mapping

from gfimu.base.errors import GfimuError

__all__ = ["BoardFault", "FaultKind"]


class FaultKind(enum.Enum):
    """Kinds of fault; on the chip most of them end in a bus, usage or hard fault."""

    READ_UNMAPPED = "read from an address where nothing is"
    WRITE_UNMAPPED = "write to an address where nothing is"
    FETCH_UNMAPPED = "jump to an address where nothing is"
    WRITE_PROTECTED = "write to flash memory"
    READ_PROTECTED = "read from protected memory"
    FETCH_PROTECTED = "jump into memory that holds no code"
    UNALIGNED = "unaligned access"
    UNDEFINED = "undefined instruction"
    STACKING = "stack overflow: an exception could not be stacked"
    EXCEPTION_RETURN = "exception return without an exception"
    OTHER = "emulation error"

    @classmethod
    def of(cls, code: int) -> FaultKind:
        """Kind of an error code of Unicorn."""
        return {
            6: cls.READ_UNMAPPED,
            7: cls.WRITE_UNMAPPED,
            8: cls.FETCH_UNMAPPED,
            10: cls.UNDEFINED,
            12: cls.WRITE_PROTECTED,
            13: cls.READ_PROTECTED,
            14: cls.FETCH_PROTECTED,
            18: cls.UNALIGNED,
            19: cls.UNALIGNED,
            20: cls.UNALIGNED,
            21: cls.UNDEFINED,
        }.get(code, cls.OTHER)


class BoardFault(GfimuError):  # noqa: N818 - "fault" is the processor's word for it
    """The firmware did what the processor can't do.

    Attributes
    ----------
    kind : FaultKind
        What happened.
    pc : int
        Address of the instruction.
    registers : mapping of str to int
        r0…r12, sp, lr, pc, xpsr, msp, psp.
    symbol : str
        Function and offset, where the image has symbols.
    detail : str
        Last register access or address, where known.
    exception : int
        Exception that was being handled; 0 in the main program.
    time_s : float
        Virtual time, s.
    """

    def __init__(
        self,
        kind: FaultKind,
        pc: int,
        registers: Mapping[str, int],
        symbol: str,
        detail: str,
        exception: int,
        time_s: float,
    ) -> None:
        self.kind, self.pc, self.registers, self.symbol = kind, pc, registers, symbol
        self.detail, self.exception, self.time_s = detail, exception, time_s
        super().__init__(str(self))

    def __str__(self) -> str:
        place = f"{self.pc:#010x}" + (f" ({self.symbol})" if self.symbol else "")
        within = f" in exception {self.exception}" if self.exception else ""
        detail = f"; {self.detail}" if self.detail else ""
        return f"firmware fault at {place}{within} after {self.time_s:.6f} s: {self.kind.value}{detail}"

    def __reduce__(self) -> tuple[type[BoardFault], tuple[object, ...]]:
        return (
            BoardFault,
            (self.kind, self.pc, dict(self.registers), self.symbol, self.detail, self.exception, self.time_s),
        )
