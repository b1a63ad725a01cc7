"""The same board with its hot half in C (``native/board.c``), built on first use; bit-identical with `Board`."""

from __future__ import annotations

import ctypes
import hashlib
import os
import stat
import sys
import tempfile
from array import array
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from firmware_bridge.adxl345.device import Adxl345
from firmware_bridge.adxl345.registers import LineFault
from firmware_bridge.board.board import Board
from firmware_bridge.board.chip_pins import ChipPins
from firmware_bridge.board.cpu import AHB_RAM_BASE, AHB_RAM_SIZE, FLASH_SIZE, RAM_BASE, RAM_SIZE, Cpu, unicorn_parts
from firmware_bridge.board.faults import FaultKind
from firmware_bridge.board.gpio import Gpio
from firmware_bridge.board.nvic import Nvic
from firmware_bridge.board.peripheral import Peripheral
from firmware_bridge.board.ssp import Ssp
from firmware_bridge.board.systick import SysTick
from firmware_bridge.board.timer import Timer
from firmware_bridge.board.uart import Uart
from firmware_bridge.lpc1768.build import compiler_version
from firmware_bridge.lpc1768.elf import ElfImage
from gfimu.base.child_process import run_module
from gfimu.base.errors import GfimuError

__all__ = ["FastBoard", "build_native"]

_SOURCE = Path(__file__).resolve().parent / "native" / "board.c"
_FLAGS = ("-std=gnu11", "-O2", "-g0", "-shared", "-fPIC", "-Wall", "-Wextra", "-Werror", "-fno-sanitize=undefined")
_KINDS: dict[type[Peripheral], str] = {
    Nvic: "n",
    Timer: "t",
    Uart: "u",
    Ssp: "s",
    Gpio: "g",
    SysTick: "k",
    ChipPins: "w",
}
_UNICORN_FUNCTIONS = (
    "reg_read", "reg_write", "reg_read_batch", "reg_write_batch", "emu_start", "emu_stop", "mmio_map", "hook_add",
)  # fmt: skip
_UNICORN_REGISTERS = (
    "R0", "R1", "R2", "R3", "R12", "LR", "XPSR", "SP", "CONTROL", "PC", "PRIMASK", "BASEPRI", "FAULTMASK", "MSP", "PSP",
)  # fmt: skip
_BIT_BAND = 62, 63  # numbers of the two bit-band aliases in call-backs
_RUN_RESET, _RUN_UNICORN, _RUN_INTR, _RUN_STACKING = 1, 1000, 2000, 3000


class Shared(ctypes.Structure):
    """Mirror of ``struct shared``."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("now", "until", "alarm", "limit", "cycle", "access_ticks")),
        ("accesses", ctypes.c_int64),
        ("exceptions", ctypes.c_int64),
        ("reset_requested", ctypes.c_int32),
        ("sleeping", ctypes.c_int32),
        ("gpio_watching", ctypes.c_int32),
        ("pc", ctypes.c_uint32),
        ("vtor", ctypes.c_uint32),
        ("active_exception", ctypes.c_int32),
    )


_READ = ctypes.CFUNCTYPE(ctypes.c_uint32, ctypes.c_int32, ctypes.c_uint32, ctypes.c_uint32)
_WRITE = ctypes.CFUNCTYPE(None, ctypes.c_int32, ctypes.c_uint32, ctypes.c_uint32, ctypes.c_uint32)
_EVENT = ctypes.CFUNCTYPE(None, ctypes.c_int32)
_CONVERSIONS = ctypes.CFUNCTYPE(
    None, ctypes.c_int32, ctypes.c_int64, ctypes.c_int64, ctypes.c_int32, ctypes.c_uint32, ctypes.c_void_p
)
_PINS = ctypes.CFUNCTYPE(None, ctypes.c_int32, ctypes.c_uint32, ctypes.c_uint32)


def _cache_folder() -> Path:
    base = os.environ.get("XDG_CACHE_HOME") or (os.environ.get("LOCALAPPDATA") if sys.platform == "win32" else None)
    folder = Path(base) if base else Path.home() / ".cache"
    try:
        (folder / "gfimu").mkdir(parents=True, exist_ok=True)
    except OSError:
        return _private_folder()
    return folder / "gfimu"


def _private_folder() -> Path:
    """Return a folder for temporary files that no other user can put a library into."""
    owner = os.getuid() if hasattr(os, "getuid") else 0
    folder = Path(tempfile.gettempdir()) / f"gfimu-{owner}"
    folder.mkdir(mode=0o700, exist_ok=True)
    found = folder.lstat()
    if found.st_uid != owner or not stat.S_ISDIR(found.st_mode) or stat.S_IMODE(found.st_mode) & 0o022:
        raise GfimuError(f"{folder}: is another user's; set XDG_CACHE_HOME to a folder that is yours")
    return folder


@cache
def build_native() -> Path:
    """Compile the fast path if it is not there yet; return the shared library.

    Raises
    ------
    InputError
        If the compiler (`ziglang`) is not installed.
    """
    compiler = compiler_version()
    source = _SOURCE.read_bytes()
    key = hashlib.sha256(source + repr((_FLAGS, compiler, sys.platform)).encode()).hexdigest()[:16]
    suffix = {"win32": ".dll", "darwin": ".dylib"}.get(sys.platform, ".so")
    library = _cache_folder() / f"board-{key}{suffix}"
    if library.is_file():
        return library
    with tempfile.TemporaryDirectory(dir=library.parent) as scratch:
        fresh = Path(scratch) / library.name
        run = run_module("ziglang", "cc", *_FLAGS, str(_SOURCE), "-o", str(fresh), "-lm", text=True)
        if run.returncode:
            raise GfimuError(f"the fast path of the board does not compile:\n{run.stderr.strip()}")
        fresh.replace(library)
    return library


@cache
def _library() -> Any:
    library = ctypes.PyDLL(str(build_native()))
    pointer, i32, i64, u32 = ctypes.c_void_p, ctypes.c_int32, ctypes.c_int64, ctypes.c_uint32
    signatures: dict[str, tuple[Any, list[Any]]] = {
        "new": (pointer, [pointer, pointer, pointer, pointer]),
        "free": (None, [pointer]),
        "shared": (ctypes.POINTER(Shared), [pointer]),
        "memory": (None, [pointer, pointer, u32, pointer, u32, u32, pointer, u32, u32]),
        "map": (i32, [pointer, i32, i32, i32, i32, u32, u32]),
        "add_sensor": (None, [pointer, ctypes.c_double, ctypes.c_double, pointer, i32, i32]),
        "power_on_sensor": (None, [pointer, i32]),
        "set_line_fault": (None, [pointer, i32, i32]),
        "read_chip": (u32, [pointer, i32, u32]),
        "write_chip": (None, [pointer, i32, u32, u32]),
        "schedule": (None, [pointer, i32, i64]),
        "set_line": (None, [pointer, i32, i32]),
        "pend": (None, [pointer, i32]),
        "spinning": (i32, [pointer, i32]),
        "wait_until": (None, [pointer, i64]),
        "access": (u32, [pointer, u32, u32, i32]),
        "drive": (None, [pointer, i32, i32, i32]),
        "clock_will_change": (None, [pointer]),
        "clock_changed": (None, [pointer, pointer]),
        "reset": (None, [pointer, pointer]),
        "receive": (None, [pointer, i32, ctypes.c_char_p, ctypes.c_size_t, i32]),
        "sent": (ctypes.c_size_t, [pointer, i32, pointer, pointer]),
        "sent_taken": (None, [pointer, i32, ctypes.c_size_t]),
        "character": (i64, [pointer, i32]),
        "run": (i32, [pointer, i64]),
    }
    for name, (result, arguments) in signatures.items():
        function = getattr(library, f"board_{name}")
        function.restype, function.argtypes = result, arguments
    return library


class _FastNvic:
    """What the Python peripherals use of the interrupt controller."""

    def __init__(self, board: FastBoard) -> None:
        self._board = board

    @property
    def active(self) -> list[int]:
        """Innermost active exception, if any."""
        number = self._board.shared.active_exception
        return [number] if number else []

    def set_line(self, irq: int, level: bool | int) -> None:
        """Set the level of an interrupt line."""
        self._board.native.board_set_line(self._board.handle, irq, int(bool(level)))

    def pend(self, exception: int) -> None:
        """Make an exception pending."""
        self._board.native.board_pend(self._board.handle, exception)


class _FastUart:
    """The outside of a UART that lives in C."""

    def __init__(self, board: FastBoard, index: int) -> None:
        self._board, self._index = board, index

    @property
    def character(self) -> int:
        """Ticks per character."""
        return int(self._board.native.board_character(self._board.handle, self._index))

    baud = Uart.baud

    def receive(self, data: bytes, errors: int = 0) -> None:
        """Put bytes on the receiving line."""
        self._board.native.board_receive(self._board.handle, self._index, data, len(data), errors)

    def take_sent(self) -> tuple[bytes, array[int]]:
        """Bytes that have left the line by now, and when."""
        native, handle = self._board.native, self._board.handle
        data, at = ctypes.c_void_p(), ctypes.c_void_p()
        count = native.board_sent(handle, self._index, ctypes.byref(data), ctypes.byref(at))
        if not count:
            return b"", array("q")
        result = ctypes.string_at(data.value or 0, count), array("q", ctypes.string_at(at.value or 0, 8 * count))
        native.board_sent_taken(handle, self._index, count)
        return result


class _FastGpio:
    """The outside of the GPIO that lives in C."""

    def __init__(self, board: FastBoard) -> None:
        self._board = board

    def drive(self, port: int, bit: int, level: bool) -> None:
        """Drive an input pin from outside."""
        self._board.native.board_drive(self._board.handle, port, bit, int(level))


class _FastCpu(Cpu):
    """Processor whose run loop and hooks are in C."""

    def _install_hooks(self) -> None:
        """Leave the hooks to the C side."""

    def reset(self) -> None:
        super().reset()
        self.bus.shared.pc = self.pc  # type: ignore[attr-defined]


class FastBoard(Board):
    """A `Board` whose processor loop, NVIC, SysTick, timers, UARTs, SSPs, GPIO and SPI sensors run in C.

    Takes the same image and sensors; a tracer is not supported. The registers of the sensors on SPI live in C
    (`read_chip`, `write_chip`).
    """

    _cpu_class = _FastCpu
    handle: Any = None

    def __init__(self, image: ElfImage, sensors: Sequence[Adxl345] = ()) -> None:
        self.native = _library()
        self._early: dict[str, Any] = {}
        super().__init__(image, sensors)

    # Time lives in C once it is there.

    def _shared_property(name: str) -> Any:  # type: ignore[misc]  # noqa: N805
        def get(self: FastBoard) -> int:
            return self._early.get(name, 0) if self.handle is None else getattr(self.shared, name)

        def put(self: FastBoard, value: int) -> None:
            if self.handle is None:
                self._early[name] = value
            else:
                setattr(self.shared, name, value)

        return property(get, put)

    now = _shared_property("now")
    until = _shared_property("until")
    alarm = _shared_property("alarm")
    cycle = _shared_property("cycle")
    access_ticks = _shared_property("access_ticks")
    accesses = _shared_property("accesses")
    exceptions = _shared_property("exceptions")
    sleeping = _shared_property("sleeping")

    @property
    def reset_cause(self) -> int | None:  # type: ignore[override]
        """Cause of a requested reset."""
        if self.handle is None:
            return None
        cause = int(self.shared.reset_requested)
        return cause if cause >= 0 else None

    @reset_cause.setter
    def reset_cause(self, cause: int | None) -> None:
        if self.handle is not None:
            self.shared.reset_requested = -1 if cause is None else cause

    def _map(self) -> None:
        unicorn, arm, binding = unicorn_parts()
        self._error = unicorn.UcError
        addresses = [ctypes.cast(getattr(binding.uclib, f"uc_{name}"), ctypes.c_void_p) for name in _UNICORN_FUNCTIONS]
        api = (ctypes.c_void_p * len(addresses))(*[address.value for address in addresses])
        self._by_slot = dict(enumerate(self._peripherals))
        self._alias = dict(zip(_BIT_BAND, (self._bit_band(0x40000000), self._bit_band(0x20000000)), strict=True))
        self._callbacks = [
            _READ(self._read_python),
            _WRITE(self._write_python),
            _EVENT(lambda slot: self._by_slot[slot].event()),
            _CONVERSIONS(self._conversions),
            _PINS(self.gpio_interrupts.pins_changed),
        ]
        call = (ctypes.c_void_p * 5)(*[ctypes.cast(item, ctypes.c_void_p).value for item in self._callbacks])
        names = _UNICORN_REGISTERS
        ids = (ctypes.c_int32 * len(names))(*[getattr(arm, f"UC_ARM_REG_{name}") for name in names])
        handle = self.native.board_new(self.cpu.uc._uch, api, call, ids)
        self.shared = self.native.board_shared(handle).contents
        self.handle = handle
        for name, value in self._early.items():
            setattr(self, name, value)
        self._give_memory()
        counters: dict[str, int] = {}
        for slot, peripheral in self._by_slot.items():
            kind = _KINDS.get(type(peripheral), "p" if peripheral.size else "-")
            index = slot if kind in "p-" else counters.get(kind, 0)
            counters[kind] = index + 1
            self._check(
                self.native.board_map(handle, ord(kind), index, slot, peripheral.irq, peripheral.base, peripheral.size)
            )
        for number, base in zip(_BIT_BAND, (0x42000000, 0x22000000), strict=True):
            self._check(self.native.board_map(handle, ord("p"), number, 0, -1, base, 0x02000000))
        for sensor in self.sensors:
            options = sensor.options
            shift = (ctypes.c_int32 * 3)(*sensor.self_test_raw)
            stuck = -1 if options.stuck_range is None else options.stuck_range
            self.native.board_add_sensor(handle, options.clock_error, options.phase, shift, options.wires, stuck)
        self.nvic = _FastNvic(self)  # type: ignore[assignment]
        self.uarts = [_FastUart(self, index) for index in range(4)]  # type: ignore[misc]
        self.gpio = _FastGpio(self)  # type: ignore[assignment]

    def _check(self, error: int) -> None:
        if error:
            raise self._error(error)

    def _give_memory(self) -> None:
        places = [
            ctypes.addressof(ctypes.c_char.from_buffer(self.cpu.memory[base])) for base in (0, RAM_BASE, AHB_RAM_BASE)
        ]
        self.native.board_memory(
            self.handle,
            places[0], FLASH_SIZE,
            places[1], RAM_BASE, RAM_SIZE,
            places[2], AHB_RAM_BASE, AHB_RAM_SIZE,
        )  # fmt: skip

    def _read_python(self, number: int, offset: int, size: int) -> int:
        if number in self._alias:
            return int(self._alias[number][0](offset, size))
        return self._by_slot[number].read(offset, size) & 0xFFFFFFFF

    def _write_python(self, number: int, offset: int, value: int, size: int) -> None:
        if number in self._alias:
            self._alias[number][1](offset, value, size)
        else:
            self._by_slot[number].write(offset, value, size)
            self.shared.gpio_watching = int(self.gpio_interrupts.watching)

    def _conversions(self, sensor: int, first: int, period: int, count: int, bw_rate: int, out: int) -> None:
        block = np.ascontiguousarray(self.sensors[sensor].source(first, period, count, bw_rate), dtype=np.int32)
        ctypes.memmove(out, block.ctypes.data, block.nbytes)

    def read_bus(self, address: int, size: int = 4) -> int:
        """Read memory or a register as another bus master does."""
        peripheral = self._peripheral_at(address)
        if peripheral is not None and type(peripheral) in _KINDS:
            return int(self.native.board_access(self.handle, address, 0, 0))
        return super().read_bus(address, size)

    def write_bus(self, address: int, value: int, size: int = 4) -> None:
        """Write memory or a register as another bus master does."""
        peripheral = self._peripheral_at(address)
        if peripheral is not None and type(peripheral) in _KINDS:
            self.native.board_access(self.handle, address, value, 1)
        else:
            super().write_bus(address, value, size)

    def schedule(self, slot: int, when: int) -> None:
        """Wake a peripheral at ``when``."""
        if self.handle is not None:
            self.native.board_schedule(self.handle, slot, when)

    def spinning(self, slot: int) -> bool:
        """Whether the last register access was the same."""
        return bool(self.native.board_spinning(self.handle, slot))

    def wait_until(self, when: int) -> None:
        """Skip to ``when`` or to the next event."""
        self.native.board_wait_until(self.handle, when)

    def _dividers(self) -> Any:
        places = [peripheral.clock_place for peripheral in self._clocked]
        return (ctypes.c_int32 * len(places))(*[self.system_control.peripheral_divider(place) for place in places])

    @property
    def _clocked(self) -> list[Any]:
        return [p for kind in (Timer, Uart, Ssp) for p in self._peripherals if type(p) is kind]

    def _in_python(self) -> list[Peripheral]:
        return [peripheral for peripheral in self._peripherals if type(peripheral) not in _KINDS]

    def change_clock(self, cycle: int) -> None:
        """Change the core clock or a peripheral divider."""
        if not self._ready:
            self.cycle = cycle
            self.access_ticks = 4 * cycle
            return
        self.native.board_clock_will_change(self.handle)
        for peripheral in self._in_python():
            peripheral.clock_will_change()
        self.cycle = cycle
        self.access_ticks = 4 * cycle
        self.native.board_clock_changed(self.handle, self._dividers())
        for peripheral in self._in_python():
            peripheral.clock_changed()

    def run_until(self, ticks: int) -> None:
        """Run to a point of virtual time; raises `BoardFault` as `Board` does."""
        while True:
            result = self.native.board_run(self.handle, ticks)
            if result == _RUN_RESET:
                self.do_reset()
            elif result == 0:
                return
            elif result >= _RUN_STACKING:
                kind = FaultKind.STACKING if result == _RUN_STACKING else FaultKind.EXCEPTION_RETURN
                raise self.cpu._fault(kind, "")
            elif result >= _RUN_INTR:
                raise self.cpu._fault(FaultKind.UNDEFINED, f"processor exception {result - _RUN_INTR}")
            else:
                raise self.cpu._fault(FaultKind.of(result - _RUN_UNICORN), "")

    def set_line_fault(self, sensor: int, fault: LineFault) -> None:
        """Break or mend the line between a sensor (from 0) and the processor."""
        self.native.board_set_line_fault(self.handle, sensor, int(fault))

    def read_chip(self, sensor: int, address: int) -> int:
        """Register of a sensor (from 0) as it stands, without the bus and without side effects."""
        return int(self.native.board_read_chip(self.handle, sensor, address))

    def write_chip(self, sensor: int, address: int, value: int) -> None:
        """Write a register of a sensor (from 0) as a program that ran before would have done."""
        self.native.board_write_chip(self.handle, sensor, address, value)

    def _power_on_sensors(self) -> None:
        for index in range(len(self.sensors)):
            self.native.board_power_on_sensor(self.handle, index)

    def _reset_peripherals(self) -> None:
        for peripheral in self._in_python():
            peripheral.reset()
        self.native.board_reset(self.handle, self._dividers())

    def __del__(self) -> None:
        if self.handle is not None:
            self.native.board_free(self.handle)
            self.handle = None
