"""The Cortex-M3 in Unicorn: memory, registers, exception entry and return, the run loop.

Unicorn (GPL-2) runs the instructions and nothing else: interrupts, sleep and time are done here. Interrupts are taken
at the boundaries of Unicorn's translation blocks, always before a block is counted and executed, so the result does
not depend on where the caller cuts time into slices. Emulation is never stopped from inside a register access: the
access would be repeated.
"""

from __future__ import annotations

import ctypes
import mmap
import struct
from array import array
from typing import TYPE_CHECKING, Any, Protocol

from firmware_bridge.board.bus import Bus, Tracer
from firmware_bridge.board.faults import BoardFault, FaultKind
from firmware_bridge.board.nvic import SVCALL, UNMASKABLE, Nvic
from gfimu.base.optional_packages import require

if TYPE_CHECKING:
    from firmware_bridge.lpc1768.elf import ElfImage

try:
    import unicorn
    from unicorn import arm_const as arm
    from unicorn.unicorn_py3 import unicorn as binding

    # Called without releasing the interpreter's lock: taking it again in every call-back would cost more than the call.
    _LIBRARY = ctypes.PyDLL(None, handle=binding.uclib._handle)
    _LIBRARY.uc_emu_start.argtypes = (
        ctypes.c_void_p, ctypes.c_uint64, ctypes.c_uint64, ctypes.c_uint64, ctypes.c_size_t,
    )  # fmt: skip
    _LIBRARY.uc_emu_stop.argtypes = (ctypes.c_void_p,)
except ImportError:  # the extra is not installed; `require_unicorn` says so
    unicorn = None

__all__ = ["Cpu", "RegisterSet", "require_unicorn", "unicorn_parts"]

FLASH_SIZE, RAM_BASE, RAM_SIZE, AHB_RAM_BASE, AHB_RAM_SIZE = 512 << 10, 0x10000000, 32 << 10, 0x2007C000, 32 << 10
_EXC_RETURN = 0xFFFFFFF0
_UNTIL = 0xFFFFFFF0  # never reached: emulation ends by WFI, by a stop or by an exception return
_ENTRY_CYCLES = 12
_FRAME_BYTES = 32
_STACK_FRAME = struct.Struct("<8I")
_STACK_ALIGNED = 1 << 9
_SWI, _PREFETCH_ABORT, _EXCEPTION_EXIT = 2, 3, 8
_IT_BITS = 0x0600FC00

# Unicorn's call-backs, with arguments that nobody looks at taken as one byte, which Python need not allocate, and
# those at the end left out. Sound where these arguments come in registers: on the 64-bit machines that MuJoCo runs on.
_UNUSED = ctypes.c_uint8
_MMIO_READ = ctypes.CFUNCTYPE(ctypes.c_uint64, _UNUSED, ctypes.c_uint32, ctypes.c_uint32)
_MMIO_WRITE = ctypes.CFUNCTYPE(None, _UNUSED, ctypes.c_uint32, ctypes.c_uint32, ctypes.c_uint32)
_BLOCK_HOOK = ctypes.CFUNCTYPE(None, _UNUSED, _UNUSED, ctypes.c_uint32)
_INTERRUPT_HOOK = ctypes.CFUNCTYPE(None, _UNUSED, ctypes.c_uint32)


def require_unicorn() -> None:
    """Raise `InputError` that says what to install when the emulator is missing."""
    if unicorn is None:
        require("the emulated board", "unicorn")


def unicorn_parts() -> tuple[Any, Any, Any]:
    """Return the emulator's package, its ARM constants and its binding; raises `InputError` without it."""
    require_unicorn()
    return unicorn, arm, binding


class RegisterSet:
    """Several registers read or written with one call."""

    def __init__(self, handle: Any, names: list[int]) -> None:
        count = len(names)
        self._handle, self._count = handle, count
        self._read, self._write = _LIBRARY.uc_reg_read_batch, _LIBRARY.uc_reg_write_batch
        self._names = (ctypes.c_int32 * count)(*names)
        self.values = array("I", [0] * count)
        address, _ = self.values.buffer_info()
        self._places = (ctypes.c_void_p * count)(*[address + 4 * k for k in range(count)])

    def read(self) -> array[int]:
        """Read all into ``values``."""
        self._read(self._handle, self._names, self._places, self._count)
        return self.values

    def write(self) -> None:
        """Write all from ``values``."""
        self._write(self._handle, self._names, self._places, self._count)


class CoreBus(Bus, Protocol):
    """The bus as the processor sees it: also the events that are due, resets and sleep.

    Attributes
    ----------
    access_ticks : int
        Time of one register access, ticks.
    accesses : int
        Register accesses so far.
    until : int
        Time of the next event, ticks.
    reset_cause : int or None
        Cause of a reset that was requested.
    stopped : bool
        Whether the processor was stopped to look at what has come.
    sleeping : bool
        Whether a slice of time ended in WFI.
    exceptions : int
        Exceptions entered so far.
    tracer : Tracer or None
        Is given every exception.
    """

    access_ticks: int
    accesses: int
    until: int
    reset_cause: int | None
    stopped: bool
    sleeping: bool
    exceptions: int
    tracer: Tracer | None

    @property
    def nvic(self) -> Nvic:
        """Interrupt controller."""

    @property
    def seconds(self) -> float:
        """Virtual time, s."""

    def service(self) -> None:
        """Do the events that are due."""

    def do_reset(self) -> None:
        """Carry out a requested reset."""


class Cpu:
    """Processor core and memories.

    Parameters
    ----------
    bus : CoreBus
        The board around it.
    image : ElfImage
        What is in the flash.
    """

    def __init__(self, bus: CoreBus, image: ElfImage) -> None:
        require_unicorn()
        self.bus = bus
        self.image = image
        self.limit = 0
        self._next_exception = 0
        self._exception_return = False
        self._returned_to = 0
        self._supervisor_call = False
        self._intr_error = -1
        self.uc = unicorn.Uc(unicorn.UC_ARCH_ARM, unicorn.UC_MODE_THUMB)
        # UC_MODE_MCLASS would force a Cortex-M33 in unicorn 2.1; the model named here is the part on the board.
        self.uc.ctl_set_cpu_model(arm.UC_CPU_ARM_CORTEX_M3)
        self._handle = self.uc._uch
        self.memory: dict[int, mmap.mmap] = {}
        for base, size, rights in (
            (0, FLASH_SIZE, unicorn.UC_PROT_READ | unicorn.UC_PROT_EXEC),
            (RAM_BASE, RAM_SIZE, unicorn.UC_PROT_ALL),
            (AHB_RAM_BASE, AHB_RAM_SIZE, unicorn.UC_PROT_ALL),
        ):
            self._map_memory(base, size, rights)
        self._flash, self._ram = self.memory[0], self.memory[RAM_BASE]
        for segment in image.segments:
            self.poke(segment.address, segment.data)
        r = arm
        self._core = RegisterSet(
            self._handle,
            [r.UC_ARM_REG_R0, r.UC_ARM_REG_R1, r.UC_ARM_REG_R2, r.UC_ARM_REG_R3, r.UC_ARM_REG_R12, r.UC_ARM_REG_LR,
             r.UC_ARM_REG_XPSR, r.UC_ARM_REG_SP, r.UC_ARM_REG_CONTROL],
        )  # fmt: skip
        self._unstack = RegisterSet(
            self._handle,
            [r.UC_ARM_REG_SP, r.UC_ARM_REG_R0, r.UC_ARM_REG_R1, r.UC_ARM_REG_R2, r.UC_ARM_REG_R3, r.UC_ARM_REG_R12,
             r.UC_ARM_REG_LR, r.UC_ARM_REG_XPSR],
        )  # fmt: skip
        self._entry = RegisterSet(self._handle, [r.UC_ARM_REG_SP, r.UC_ARM_REG_XPSR, r.UC_ARM_REG_LR])
        self._primask = RegisterSet(self._handle, [r.UC_ARM_REG_PRIMASK])
        self._masks = RegisterSet(self._handle, [r.UC_ARM_REG_BASEPRI, r.UC_ARM_REG_FAULTMASK])
        self._exit = RegisterSet(self._handle, [r.UC_ARM_REG_PC, r.UC_ARM_REG_SP])
        self._pc = RegisterSet(self._handle, [r.UC_ARM_REG_PC])
        self._callbacks: list[Any] = []
        self._install_hooks()
        self.pc = 0

    # Memory

    def _map_memory(self, base: int, size: int, rights: int) -> None:
        """Map memory that this process and the guest share."""
        memory = mmap.mmap(-1, size)
        self.memory[base] = memory
        address = ctypes.addressof(ctypes.c_char.from_buffer(memory))
        error = _LIBRARY.uc_mem_map_ptr(
            self._handle,
            ctypes.c_uint64(base),
            ctypes.c_size_t(size),
            ctypes.c_uint32(rights),
            ctypes.c_void_p(address),
        )
        if error:
            raise unicorn.UcError(error)

    def _memory_at(self, address: int, count: int) -> tuple[mmap.mmap, int]:
        if RAM_BASE <= address <= RAM_BASE + RAM_SIZE - count:
            return self._ram, address - RAM_BASE
        for base, memory in self.memory.items():
            if base <= address and address + count <= base + len(memory):
                return memory, address - base
        raise self._fault(FaultKind.STACKING, f"no memory at {address:#010x}")

    def peek(self, address: int, count: int) -> bytes:
        """Bytes in flash or RAM."""
        memory, offset = self._memory_at(address, count)
        return memory[offset : offset + count]

    def poke(self, address: int, data: bytes) -> None:
        """Put bytes into flash or RAM."""
        memory, offset = self._memory_at(address, len(data))
        memory[offset : offset + len(data)] = data

    # Hooks

    def _install_hooks(self) -> None:
        """Ask Unicorn to call before every block and at every processor exception."""
        self._hook(unicorn.UC_HOOK_INTR, _INTERRUPT_HOOK(self._on_intr))
        self._hook(unicorn.UC_HOOK_BLOCK, _BLOCK_HOOK(self._block_hook()))

    def _hook(self, kind: int, callback: Any) -> None:
        self._callbacks.append(callback)
        handle = ctypes.c_size_t()
        _LIBRARY.uc_hook_add(
            self._handle,
            ctypes.byref(handle),
            ctypes.c_int(kind),
            ctypes.cast(callback, ctypes.c_void_p),
            None,
            ctypes.c_uint64(1),
            ctypes.c_uint64(0),
        )

    def map_registers(self, base: int, size: int, read: Any, write: Any) -> None:
        """Send accesses to an address range to ``read(offset, size)`` and ``write(offset, value, size)``."""
        bus = self.bus

        def on_read(_: int, offset: int, width: int) -> int:
            bus.now = now = bus.now + bus.access_ticks
            bus.accesses += 1
            if now >= bus.until:
                bus.service()
            return read(offset, width) & 0xFFFFFFFF

        def on_write(_: int, offset: int, width: int, value: int) -> None:
            bus.now = now = bus.now + bus.access_ticks
            bus.accesses += 1
            if now >= bus.until:
                bus.service()
            write(offset, value, width)

        callbacks = _MMIO_READ(on_read), _MMIO_WRITE(on_write)
        self._callbacks += callbacks
        error = _LIBRARY.uc_mmio_map(
            self._handle, ctypes.c_uint64(base), ctypes.c_size_t(size), callbacks[0], None, callbacks[1], None
        )
        if error:
            raise unicorn.UcError(error)

    def _block_hook(self) -> Any:
        bus, stop, handle = self.bus, _LIBRARY.uc_emu_stop, self._handle

        def on_block(_: int, __: int, size: int) -> None:
            now = bus.now
            if now >= bus.alarm:
                if self._must_stop():
                    bus.stopped = True
                    stop(handle)
                    return
                now = bus.now
            bus.now = now + (size >> 1) * bus.cycle  # about one cycle per half-word of code

        return on_block

    def _must_stop(self) -> bool:
        """Look, before a block is executed, whether an interrupt or the end of the slice comes first."""
        bus = self.bus
        if bus.now >= bus.until:
            bus.service()
        if bus.reset_cause is not None:
            return True
        self._next_exception = self._deliverable()
        return self._next_exception != 0 or bus.now >= self.limit

    def _deliverable(self) -> int:
        """Exception to enter now, 0 if none; sets the alarm for the next look."""
        bus, nvic = self.bus, self.bus.nvic
        exception = 0
        if nvic.pending & nvic.enabled:
            primask = self._primask.read()[0]
            if primask & 1 and not nvic.pending & UNMASKABLE:
                bus.alarm = -1  # look at every block until the mask is gone
                return 0
            exception = nvic.best()
            if exception and nvic.masked(exception, primask, *self._masks.read()):
                bus.alarm = -1
                return 0
        until, limit = bus.until, self.limit
        bus.alarm = until if until < limit else limit  # noqa: FURB136 - this runs twenty times a sample
        return exception

    def _on_intr(self, _: int, number: int) -> None:
        pc = self._exit.read()[0]
        if number == _EXCEPTION_EXIT or (number == _PREFETCH_ABORT and pc >= _EXC_RETURN):
            self._exception_return = True
            self._returned_to = pc
        elif number == _SWI:
            self._supervisor_call = True
        else:
            self._intr_error = number
        _LIBRARY.uc_emu_stop(self._handle)

    # Exceptions

    def reset(self) -> None:
        """Load stack pointer and entry point from the vector table; RAM keeps what it holds, as on the chip."""
        stack, entry = struct.unpack("<II", self.peek(0, 8))
        for register in (arm.UC_ARM_REG_PRIMASK, arm.UC_ARM_REG_BASEPRI, arm.UC_ARM_REG_FAULTMASK):
            self.uc.reg_write(register, 0)
        self.uc.reg_write(arm.UC_ARM_REG_XPSR, 1 << 24)
        self.uc.reg_write(arm.UC_ARM_REG_CONTROL, 0)
        self.uc.reg_write(arm.UC_ARM_REG_MSP, stack)
        self.pc = entry | 1

    def enter(self, exception: int) -> None:
        """Exception entry (ARMv7-M ARM B1.5.6): stack eight words, run the handler on the main stack."""
        bus, nvic = self.bus, self.bus.nvic
        r0, r1, r2, r3, r12, lr, xpsr, sp, control = self._core.read()
        padding = sp & 4
        frame = sp - _FRAME_BYTES - padding
        status = (xpsr & ~_STACK_ALIGNED) | (_STACK_ALIGNED if padding else 0)
        memory, offset = self._memory_at(frame, _FRAME_BYTES)
        _STACK_FRAME.pack_into(memory, offset, r0, r1, r2, r3, r12, lr, self.pc & ~1, status)
        process_stack = not nvic.active and control & 2
        entry = self._entry
        entry.values[0] = frame
        entry.values[1] = (xpsr & ~_IT_BITS & ~0x1FF) | exception
        entry.values[2] = 0xFFFFFFF1 if nvic.active else 0xFFFFFFFD if process_stack else 0xFFFFFFF9
        entry.write()  # the stack pointer first: a new exception number may switch to the main stack
        if process_stack:
            self.uc.reg_write(arm.UC_ARM_REG_CONTROL, control & ~2)
        nvic.enter(exception)
        bus.now += _ENTRY_CYCLES * bus.cycle
        bus.exceptions += 1
        if bus.tracer is not None:
            bus.tracer.exception(bus.now, exception, entered=True)
        vector = nvic.vtor + 4 * exception
        table = self._flash[vector : vector + 4] if vector < FLASH_SIZE else self.peek(vector, 4)
        self.pc = int.from_bytes(table, "little") | 1

    def leave(self) -> None:
        """Exception return (ARMv7-M ARM B1.5.8)."""
        bus, nvic = self.bus, self.bus.nvic
        if not nvic.active:
            raise self._fault(FaultKind.EXCEPTION_RETURN, "exception return outside an exception")
        ended = nvic.active[-1]
        nvic.leave()
        process_stack = self._returned_to & 0xC == 0xC
        if process_stack:
            self.uc.reg_write(arm.UC_ARM_REG_SP, self.uc.reg_read(arm.UC_ARM_REG_SP))
            sp = self.uc.reg_read(arm.UC_ARM_REG_PSP)
        else:
            sp = self._exit.values[1]
        r0, r1, r2, r3, r12, lr, pc, status = _STACK_FRAME.unpack_from(*self._memory_at(sp, _FRAME_BYTES))
        after = sp + _FRAME_BYTES + (4 if status & _STACK_ALIGNED else 0)
        values = self._unstack.values
        values[1], values[2], values[3], values[4], values[5], values[6] = r0, r1, r2, r3, r12, lr
        values[7] = status & ~_STACK_ALIGNED
        if process_stack:
            values[0] = self.uc.reg_read(arm.UC_ARM_REG_SP)
            self._unstack.write()
            self.uc.reg_write(arm.UC_ARM_REG_CONTROL, self.uc.reg_read(arm.UC_ARM_REG_CONTROL) | 2)
            self.uc.reg_write(arm.UC_ARM_REG_SP, after)
        else:
            values[0] = after
            self._unstack.write()
        self.pc = pc | 1
        bus.now += _ENTRY_CYCLES * bus.cycle
        if bus.tracer is not None:
            bus.tracer.exception(bus.now, ended, entered=False)

    # Running

    def run(self, limit: int) -> None:
        """Run until virtual time reaches ``limit`` (ticks)."""
        bus, nvic = self.bus, self.bus.nvic
        start, handle, pc_register = _LIBRARY.uc_emu_start, self._handle, self._pc
        self.limit = limit
        bus.alarm = -1
        while bus.now < limit:
            if bus.now >= bus.until:
                bus.service()
            if bus.reset_cause is not None:
                bus.do_reset()
                self._next_exception = 0
            exception = self._next_exception or self._deliverable()
            if exception:
                self._next_exception = 0
                self.enter(exception)
                bus.alarm = -1 if nvic.pending else min(bus.until, limit)
            error = start(handle, self.pc, _UNTIL, 0, 0)
            if error:
                raise self._fault(FaultKind.of(error), "")
            if self._exception_return:
                self._exception_return = False
                self.leave()
                continue
            if self._intr_error >= 0:
                number, self._intr_error = self._intr_error, -1
                raise self._fault(FaultKind.UNDEFINED, f"processor exception {number}")
            self.pc = pc_register.read()[0] | 1
            if self._supervisor_call:
                self._supervisor_call = False
                nvic.pend(SVCALL)
                continue
            if self.bus.stopped:
                self.bus.stopped = False
                continue
            if not self._sleep(limit):
                return

    def resume_sleep(self, limit: int) -> bool:
        """Go on sleeping where the last slice ended; False if this slice ends first, too."""
        return self._sleep(limit)

    def _sleep(self, limit: int) -> bool:
        """WFI: skip to the event that wakes the processor; False if the slice ends first."""
        bus = self.bus
        while not bus.nvic.wakes and bus.reset_cause is None:
            if bus.until > limit:
                bus.now = max(bus.now, limit)
                bus.sleeping = True
                return False
            bus.now = max(bus.now, bus.until)
            bus.service()
        return True

    # Faults

    def _fault(self, kind: FaultKind, detail: str) -> BoardFault:
        """Describe where the processor stands."""
        names = [f"r{index}" for index in range(13)] + ["sp", "lr", "pc", "xpsr", "msp", "psp"]
        registers = {
            name: int(self.uc.reg_read(getattr(arm, f"UC_ARM_REG_{name.upper()}"))) & 0xFFFFFFFF for name in names
        }
        active = self.bus.nvic.active[-1] if self.bus.nvic.active else 0
        return BoardFault(
            kind, registers["pc"], registers, self.image.symbol_at(registers["pc"]), detail, active, self.bus.seconds
        )
