"""Stack, alignment, registers that are none (ARMv7-M ARM; UM10360 chapter 2)."""

from __future__ import annotations

from collections.abc import Iterator

from firmware_bridge.board.cpu import RAM_BASE, RAM_SIZE
from firmware_bridge.strict.findings import Rule, Severity
from firmware_bridge.strict.registers import is_register, register_name
from firmware_bridge.strict.watch import Access, Watch

__all__ = ["BUS_FAULT", "OVERFLOW", "AlignmentWatch", "RegisterWatch", "StackWatch", "word_accesses"]

OVERFLOW = Rule(
    "stack_overflow", "make arrays static or smaller, end recursion, or give the stack more room", "linker script"
)
LOW = Rule("stack_low", "give the stack more room", "linker script", Severity.WARNING)
BUS_FAULT = Rule(
    "processor_fault",
    "look at the address: nothing is there, or it may not be used so; the boot ROM (IAP) is not on this board",
    "ARMv7-M ARM B1.5.14, UM10360 2.2",
)
UNALIGNED = Rule(
    "unaligned_access",
    "align what LDM, STM, LDRD, STRD and LDREX access to words, and registers to their size",
    "ARMv7-M ARM A3.2.1",
)
PART = Rule(
    "partial_register", "access registers of the APB from their first byte, as words", "UM10360 2.3", Severity.WARNING
)
RESERVED = Rule(
    "reserved_register", "the manual has no register there: look at the address", "UM10360, register tables",
    Severity.WARNING,
)  # fmt: skip

_APB = range(0x40000000, 0x40100000)
_SYSTEM = range(0xE0000000, 0x100000000)
# Instructions that load or store words and half-words, by their first half-word (ARMv7-M ARM A5.2.4, A5.3.7, A5.3.10).
_WORD_ACCESSES = ((0xF000, 0x6000), (0xFE00, 0x5000), (0xFE00, 0x5800), (0xF000, 0x9000), (0xFF60, 0xF840))
_HALF_ACCESSES = ((0xF000, 0x8000), (0xFE00, 0x5200), (0xFE00, 0x5A00), (0xFE60, 0xF820))


class StackWatch(Watch):
    """Follows the main stack down to the data below it."""

    def reset(self) -> None:
        """Begin at the top of the stack."""
        image = self.board.image
        self._top = int.from_bytes(image.read(0, 4), "little")
        self._limit = image.stack_limit(self._top, RAM_BASE, RAM_SIZE)
        self._lowest = self._top
        self._over = self._low = False

    @property
    def used(self) -> int | None:
        """Bytes of the main stack used so far; None if its end is not known."""
        return None if self._limit is None else self._top - self._lowest

    @property
    def room(self) -> int | None:
        """Bytes between the top of the main stack and the data below it."""
        return None if self._limit is None else self._top - self._limit

    def block(self, address: int, stack: int | None) -> None:
        """Look at the main stack pointer."""
        if stack is None or self._limit is None:
            return
        if self._limit <= stack <= self._top:
            if stack < self._lowest:
                self._lowest = stack
                if stack - self._limit < self.policy.stack_spare and not self._low:
                    self._low = True
                    self.report(LOW, f"{stack - self._limit} bytes are left above the data")
        elif stack < self._limit and not self._over and not self._is_a_stack(stack):
            self._over = True
            what = f"the main stack is at {stack:#010x}, below the end of the data at {self._limit:#010x}"
            self.report(OVERFLOW, what)

    def _is_a_stack(self, address: int) -> bool:
        """Whether the data there are called a stack: a scheduler may use several."""
        return "stack" in self.board.image.symbol_at(address).lower()


def word_accesses(start: int, code: bytes) -> Iterator[int]:
    """Yield where in a code the half-words are that look like LDM, STM, LDRD, STRD, LDREX or STREX (ARMv7-M ARM A5)."""
    for offset in range(start & 1, len(code) - 1, 2):
        first = code[offset] | code[offset + 1] << 8
        narrow = first & 0xF000 == 0xC000
        # E8C. and E8D. are table branches and exclusive accesses to bytes; the stack pointer is always aligned.
        wide = first & 0xFE00 == 0xE800 and first & 0xFFE0 != 0xE8C0 and first & 15 != 13
        if narrow or wide:
            yield start + offset


class AlignmentWatch(Watch):
    """Looks at accesses that need to be aligned."""

    def unaligned(self, address: int) -> None:
        """Note an instruction that the processor does not execute at this address."""
        self.report(UNALIGNED, f"several words at {address:#010x}: a usage fault")

    def before(self, access: Access) -> None:
        """Look at the alignment of register accesses: the emulator cuts unaligned ones into bytes."""
        if access.size == 1 and (size := self._size_of_instruction()) > 1 and access.address & (size - 1):
            name = register_name(access.base, access.offset)
            self.report(UNALIGNED, f"{size} bytes at once at {access.address:#010x} ({name})")

    def _size_of_instruction(self) -> int:
        """Bytes that the present instruction loads or stores, as far as that is 2 or 4; else 1."""
        first = int.from_bytes(self.board.cpu.peek(self.ledger.here().pc, 2), "little")
        if any(first & mask == value for mask, value in _WORD_ACCESSES):
            return 4
        return 2 if any(first & mask == value for mask, value in _HALF_ACCESSES) else 1


class RegisterWatch(Watch):
    """Looks for accesses to places where no register is, or to a part of one."""

    def before(self, access: Access) -> None:
        """Look at the register."""
        if access.address in _SYSTEM:
            return
        if not is_register(access.base, access.offset):
            verb = "write to" if access.write else "read from"
            self.report(RESERVED, f"{verb} {access.address:#010x}, where no register is")
        elif access.offset & 3 and access.address in _APB:
            name = register_name(access.base, access.offset)
            self.report(PART, f"byte {access.offset & 3} of {name} alone")
