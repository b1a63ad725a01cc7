"""The strict board: the reference board with watches at its registers, exceptions and blocks of code."""

from __future__ import annotations

import ctypes
import mmap
import random
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from firmware_bridge.adxl345.device import Adxl345
from firmware_bridge.adxl345.registers import TICKS_PER_SECOND
from firmware_bridge.board.board import Board
from firmware_bridge.board.bus import Tracer
from firmware_bridge.board.cpu import Cpu, RegisterSet, unicorn_parts
from firmware_bridge.board.faults import BoardFault, FaultKind
from firmware_bridge.board.peripheral import Peripheral
from firmware_bridge.lpc1768.elf import ElfImage
from firmware_bridge.strict.findings import Finding, Ledger, Place
from firmware_bridge.strict.image import started_by_loader
from firmware_bridge.strict.rules import BUS_FAULT, WATCHES
from firmware_bridge.strict.rules.image import judge_image
from firmware_bridge.strict.rules.memory import OVERFLOW, word_accesses
from firmware_bridge.strict.watch import Access, Policy, Watch

__all__ = ["STUCK", "StrictBoard", "StuckPart"]


@dataclass(frozen=True)
class StuckPart:
    """A status bit that a broken part leaves as it is.

    Parameters
    ----------
    title : str
        What is broken.
    address, bits, value : int
        Register, its bits, and what they are for ever.
    """

    title: str
    address: int
    bits: int
    value: int


STUCK = {
    "crystal": StuckPart("a crystal that never starts", 0x400FC1A0, 0x40, 0),
    "pll": StuckPart("PLL0 never locked", 0x400FC088, 1 << 26, 0),
    "ssp": StuckPart("SSP1 busy for ever", 0x4003000C, 0x10, 0x10),
}
"""Parts that may be broken."""

_LONGEST_LOOP = 4096  # blocks; longer loops are not recognised as standing still
_SLICE_TICKS = TICKS_PER_SECOND // 1000
_PROCESS_STACK = 2
_EXCEPTION_RETURN = 0xFFFFFFF0
_REGISTERS = (*(f"R{index}" for index in range(13)), "SP", "LR", "PC", "XPSR", "CONTROL")
_SP_NUMBER, _PC_NUMBER = 13, 15
_WIDE = 0xE800  # a first half-word from here on begins an instruction of four bytes
_UNUSED = ctypes.c_uint8
_BLOCK_HOOK = ctypes.CFUNCTYPE(None, _UNUSED, ctypes.c_uint32, ctypes.c_uint32)


class StandStill:
    """Finds loops that repeat exactly: the same registers, the same memory, the same values read.

    Such a loop holds no counter: only time and what comes with it can end it. Found with Brent's algorithm (BIT 20
    (1980) 176): the state is compared with one kept, and the one kept is renewed after 1, 2, 4… blocks of code. Memory
    is looked at only when the registers repeat.
    """

    def __init__(self, memories: Iterable[mmap.mmap]) -> None:
        self._memories = tuple(memories)
        self._reads: dict[int, int] = {}
        self.moved()

    def moved(self) -> None:
        """Note that a register was changed or read anew: the loop, if any, gets on."""
        self._kept = b""
        self._memory: list[bytes] | None = None
        self._since = 0
        self._renew_after = 1
        self._reads.clear()

    def read(self, address: int, value: int) -> None:
        """Note what was read from a register."""
        if self._reads.setdefault(address, value) != value:
            self.moved()

    def repeats(self, state: bytes) -> bool:
        """Whether the program was in this state before, and nothing was changed since."""
        self._since += 1
        if state == self._kept:
            memory = [one[:] for one in self._memories]
            if memory == self._memory:
                return True
            if self._memory is None:
                self._memory = memory
                return False
        if self._since >= self._renew_after:
            self._kept, self._memory, self._since = state, None, 0
            self._renew_after = min(2 * self._renew_after, _LONGEST_LOOP)
        return False


class StrictCpu(Cpu):
    """The processor with a program counter that is right at every register access.

    No hook on memory: in unicorn 2.1 it breaks the instructions of an IT block that come after the access.
    """

    def _install_hooks(self) -> None:
        super()._install_hooks()
        unicorn, arm, _ = unicorn_parts()
        self._all = RegisterSet(self._handle, [getattr(arm, f"UC_ARM_REG_{name}") for name in _REGISTERS])
        self.stand_still = StandStill(memory for base, memory in self.memory.items() if base)
        # Asked to call before every instruction, Unicorn keeps the program counter up to date. What is called does
        # nothing, in C: one of the interpreter's own functions.
        self._hook(unicorn.UC_HOOK_CODE, ctypes.pythonapi.Py_IsInitialized)
        self._hook(unicorn.UC_HOOK_BLOCK, _BLOCK_HOOK(self._strict_block_hook()))
        self._hook_word_accesses(unicorn.UC_HOOK_CODE)

    def _hook_word_accesses(self, kind: int) -> None:
        """Ask for a call before every instruction that needs its words to be aligned."""
        _, _, binding = unicorn_parts()
        hook = _BLOCK_HOOK(self._on_word_access)
        self._callbacks.append(hook)
        for segment in self.image.segments:
            for address in word_accesses(segment.address, segment.data):
                place = ctypes.c_uint64(address)
                handle = ctypes.byref(ctypes.c_size_t())
                binding.uclib.uc_hook_add(
                    self._handle, handle, ctypes.c_int(kind), ctypes.cast(hook, ctypes.c_void_p), None, place, place
                )

    def _on_word_access(self, _: int, address: int, __: int) -> None:
        first = int.from_bytes(self.peek(address, 2), "little")
        number = first >> 8 & 7 if first < _WIDE else first & 15
        if number < _PC_NUMBER:
            base = self._all.read()[number]
            if base & 3:
                self.bus.on_unaligned(base)  # type: ignore[attr-defined]

    def _strict_block_hook(self) -> Any:
        bus, stand_still, everything = self.bus, self.stand_still, self._all

        def on_block(_: int, address: int, __: int) -> None:
            registers = everything.read()
            on_main_stack = bus.nvic.active or not registers[-1] & _PROCESS_STACK
            bus.on_block(address, registers[_SP_NUMBER] if on_main_stack else None)  # type: ignore[attr-defined]
            if stand_still.repeats(registers.tobytes()):
                bus.on_stand_still()  # type: ignore[attr-defined]
                bus.now = max(bus.now, min(bus.until, self.limit))

        return on_block

    def place(self) -> int:
        """Address of the instruction that is executed, or comes next after an exception return."""
        pc = int(self._pc.read()[0])
        return (self.pc if pc >= _EXCEPTION_RETURN else pc) & ~1


class StrictBoard(Board):
    """A board that writes down which rules its program breaks.

    Parameters
    ----------
    image : ElfImage
        The firmware.
    sensors : sequence of Adxl345
        Chips on SSP1; none if something else hangs there.
    policy : Policy, optional
        Limits.
    stuck : str, optional
        A part that never becomes ready, one of `STUCK`.

    Attributes
    ----------
    started_at : int
        Address of the vector table; not 0 for an image that a boot loader starts.
    """

    _cpu_class = StrictCpu

    def __init__(
        self,
        image: ElfImage,
        sensors: Sequence[Adxl345] = (),
        *,
        policy: Policy | None = None,
        stuck: str | None = None,
    ) -> None:
        self.ledger = Ledger(image.symbol_at, self._here)
        self._stuck = STUCK[stuck] if stuck is not None else None
        self.policy = policy or Policy()
        self.watches: list[Watch] = []
        image, self.started_at = started_by_loader(image)
        super().__init__(image, sensors, tracer=self)
        self.nvic.vtor = self.started_at
        self._fill_memory(image)
        judge_image(image, self.ledger, self.started_at)

    def _fill_memory(self, image: ElfImage) -> None:
        """Fill the RAM with what is there after power-on: anything but zeros."""
        junk = random.Random(0)  # noqa: S311 - the same at every run
        for base, memory in self.cpu.memory.items():
            if base:
                memory[:] = junk.randbytes(len(memory))
        for segment in image.segments:
            self.cpu.poke(segment.address, segment.data)

    @property
    def _strict_cpu(self) -> StrictCpu:
        assert isinstance(self.cpu, StrictCpu)
        return self.cpu

    def _map(self) -> None:
        self.watches = [watch(self, self.ledger, self.policy) for watch in WATCHES]
        self._by_block = [watch for watch in self.watches if type(watch).block is not Watch.block]
        self._by_exception = [watch for watch in self.watches if type(watch).exception is not Watch.exception]
        self._observed = {peripheral.base: self._observers(peripheral) for peripheral in self.peripherals}
        super()._map()

    def _watching(self, peripheral: Peripheral, method: str) -> list[Any]:
        return [
            getattr(watch, method)
            for watch in self.watches
            if (watch.peripherals is None or peripheral.name in watch.peripherals)
            and getattr(type(watch), method) is not getattr(Watch, method)
        ]

    def _observers(self, peripheral: Peripheral) -> tuple[Any, Any]:
        before, after = self._watching(peripheral, "before"), self._watching(peripheral, "after")
        base = peripheral.base
        still = self._strict_cpu.stand_still
        stuck = self._stuck

        def read(offset: int, size: int) -> int:
            access = Access(base + offset, base, offset, size, 0, write=False)
            for look in before:
                look(access)
            value = peripheral.read(offset, size)
            if stuck is not None and base + offset == stuck.address:
                value = value & ~stuck.bits | stuck.value
            still.read(base + offset, value)
            access = Access(base + offset, base, offset, size, value, write=False)
            for look in after:
                look(access)
            return value

        def write(offset: int, value: int, size: int) -> None:
            still.moved()
            access = Access(base + offset, base, offset, size, value, write=True)
            for look in before:
                look(access)
            peripheral.write(offset, value, size)
            for look in after:
                look(access)

        return read, write

    def _traced(self, peripheral: Peripheral, tracer: Tracer) -> tuple[Any, Any]:
        observers: tuple[Any, Any] = self._observed[peripheral.base]
        return observers

    def read_bus(self, address: int, size: int = 4) -> int:
        """Read as another bus master, or a bit-band alias, does; registers under the eyes of the watches."""
        peripheral = self._peripheral_at(address)
        if peripheral is None:
            return super().read_bus(address, size)
        return int(self._observed[peripheral.base][0](address - peripheral.base, size))

    def write_bus(self, address: int, value: int, size: int = 4) -> None:
        """Write as another bus master, or a bit-band alias, does; registers under the eyes of the watches."""
        peripheral = self._peripheral_at(address)
        if peripheral is None:
            super().write_bus(address, value, size)
        else:
            self._observed[peripheral.base][1](address - peripheral.base, value, size)

    def access(self, ticks: int, peripheral: str, offset: int, value: int, *, write: bool) -> None:
        """Nothing: the watches see register accesses where they happen."""

    def exception(self, ticks: int, number: int, *, entered: bool) -> None:
        """Show the watches an exception (the board is its own tracer)."""
        for watch in self._by_exception:
            watch.exception(number, entered=entered)

    def on_block(self, address: int, stack: int | None) -> None:
        """Show the watches a block of code before it is executed."""
        for watch in self._by_block:
            watch.block(address, stack)

    def on_unaligned(self, address: int) -> None:
        """Show the watches an access to several words at an address that is not a multiple of four."""
        for watch in self.watches:
            watch.unaligned(address)

    def on_stand_still(self) -> None:
        """Show the watches that the program repeats itself."""
        for watch in self.watches:
            watch.stand_still()

    def do_reset(self) -> None:
        """Let the watches conclude, then reset."""
        for watch in self.watches:
            watch.end()
        super().do_reset()
        self.nvic.vtor = self.started_at
        for watch in self.watches:
            watch.reset()

    def run_slice(self, end: int) -> bool:
        """Run for a millisecond of virtual time, not beyond ``end`` (ticks); False when the program can't go on."""
        try:
            self.run_until(min(end, self.now + _SLICE_TICKS))
        except BoardFault as fault:
            self._add_fault(fault)
        return not self.ledger.hopeless

    def _add_fault(self, fault: BoardFault) -> None:
        """Write down that the program ended in a fault of the processor."""
        rule = OVERFLOW if fault.kind is FaultKind.STACKING else BUS_FAULT
        detail = f": {fault.detail}" if fault.detail else ""
        self.ledger.add(rule, fault.kind.value + detail, Place(fault.pc & ~1, fault.exception, fault.time_s))
        self.ledger.hopeless = True

    def findings(self) -> tuple[Finding, ...]:
        """Rules broken so far, with what is certain now."""
        for watch in self.watches:
            watch.end()
        return self.ledger.findings()

    def _here(self) -> Place:
        active = self.nvic.active
        return Place(self._strict_cpu.place(), active[-1] if active else 0, self.seconds)
