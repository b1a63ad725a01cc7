"""The emulated board in a process of its own.

Unicorn is GPL-2: it is loaded only in that process, which takes conversions in and gives bytes out. The physics stays
with the caller and is asked for in batches.
"""

from __future__ import annotations

import multiprocessing
import signal
import sys
import threading
from array import array
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from multiprocessing.connection import Connection
from pathlib import Path
from types import ModuleType, TracebackType
from typing import Any, Self

from firmware_bridge.adxl345.device import Adxl345
from firmware_bridge.adxl345.registers import TICKS_PER_SECOND, Adxl345Options, LineFault
from firmware_bridge.loop.physics import Conversions, RestPhysics
from firmware_bridge.lpc1768.build import IMAGES, image_path
from gfimu.base.child_process import environment
from gfimu.base.errors import GfimuError, InputError, did_you_mean
from gfimu.base.optional_packages import missing, require

__all__ = ["BoardProcess", "require_emulator"]


def require_emulator() -> None:
    """Raise `InputError` that says what to install when the emulator is missing."""
    require("the emulated board", "unicorn")


class BoardProcess:
    """A board that runs in another process.

    Parameters
    ----------
    conversions : callable, optional
        Physics (`ScenarioPhysics`); by default the board lies still.
    image : str or Path
        Name of an image (``gfimu``, ``selfcheck``) or an ELF or .bin file.
    chips : sequence of Adxl345Options, optional
        Clocks, self-test and wiring of the four chips.
    fast : bool, optional
        Whether the peripherals run in C; by default when the compiler is there. The result is the same.
    trace : bool
        Keep a list of register accesses and exceptions (slow; not with the fast path).
    lose_every : int
        Fault: every so many sample interrupts one is lost (0: none).
    array : str
        Name of the array that the board states, as if its image had been built so; by default that of the image.

    Raises
    ------
    InputError
        If the emulator is not installed or the image can't be read.
    """

    def __init__(
        self,
        conversions: Conversions | None = None,
        *,
        image: str | Path = "gfimu",
        chips: Sequence[Adxl345Options] = (Adxl345Options(),) * 4,
        fast: bool | None = None,
        trace: bool = False,
        lose_every: int = 0,
        array: str = "",
    ) -> None:
        require_emulator()
        path = image_path(str(image)) if str(image) in IMAGES else Path(image)
        if not path.is_file():
            raise InputError(
                f"{image}: no such image; valid: {', '.join(IMAGES)}, or the path of an ELF file"
                f"{did_you_mean(str(image), IMAGES)}"
            )
        compiled = not missing("ziglang")
        self.fast = (compiled if fast is None else fast) and not trace and not lose_every
        self._conversions = conversions or RestPhysics()
        self._calling = threading.Lock()  # one thread may serve a port while another presses reset
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(
            target=_work, args=(theirs, path, tuple(chips), self.fast, trace, lose_every, array), daemon=True
        )
        with environment(), _without_main(), _without_interrupt():
            self._process.start()
        theirs.close()
        self._call("ready")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the process."""
        if self._process.is_alive():
            try:
                self._pipe.send(("close", ()))
            except OSError:
                self._process.terminate()
            self._process.join(5.0)
            if self._process.is_alive():
                self._process.kill()
        self._pipe.close()

    def _call(self, name: str, *arguments: Any) -> Any:
        try:
            with self._calling:
                self._pipe.send((name, arguments))
                while True:
                    kind, value = self._pipe.recv()
                    if kind == "conversions":
                        self._pipe.send(self._conversions(*value))
                    elif kind == "error":
                        raise value
                    else:
                        return value
        except (EOFError, BrokenPipeError, ConnectionResetError):
            raise GfimuError("the process of the emulated board has ended") from None

    def run_until(self, ticks: int) -> int:
        """Run to a point of virtual time, ticks; return where it stands. Raises `BoardFault`."""
        return int(self._call("run_until", ticks))

    def run_for(self, seconds: float) -> int:
        """Run for a span of virtual time, s."""
        return self.run_until(self.now + round(seconds * TICKS_PER_SECOND))

    @property
    def now(self) -> int:
        """Virtual time, ticks."""
        return int(self._call("now"))

    def take_sent(self, uart: int = 0) -> tuple[bytes, array[int]]:
        """Bytes that have left a UART by now, and the tick at which each did; handed out once."""
        result: tuple[bytes, array[int]] = self._call("take_sent", uart)
        return result

    def receive(self, data: bytes, errors: int = 0, uart: int = 0) -> None:
        """Put bytes on the receiving line of a UART."""
        self._call("receive", uart, data, errors)

    def brown_out(self) -> None:
        """Let the supply voltage drop."""
        self._call("brown_out")

    def press_reset(self) -> None:
        """Reset the processor by its pin; the sensors keep their registers."""
        self._call("press_reset")

    def read_chip(self, sensor: int, address: int) -> int:
        """Register of a sensor (from 0) as it stands."""
        return int(self._call("read_chip", sensor, address))

    def write_chip(self, sensor: int, address: int, value: int) -> None:
        """Write a register of a sensor (from 0) as a program that ran before would have done."""
        self._call("write_chip", sensor, address, value)

    def warnings(self) -> list[str]:
        """Return what the firmware did that the processor's documents advise against, once each."""
        result: list[str] = self._call("warnings")
        return result

    def set_line_fault(self, sensor: int, fault: LineFault) -> None:
        """Break or mend the line of a sensor (from 0)."""
        self._call("set_line_fault", sensor, fault)

    def baud(self, uart: int = 0) -> float:
        """Bits per second of a UART."""
        return float(self._call("baud", uart))

    def word(self, symbol: str) -> int:
        """Value of a 32-bit variable of the firmware."""
        return int(self._call("word", symbol))

    def timer(self, number: int) -> int:
        """Counter of TIMER0…3 as it stands."""
        return int(self._call("timer", number))

    def counters(self) -> dict[str, int]:
        """Exceptions handled, register accesses, resets."""
        result: dict[str, int] = self._call("counters")
        return result

    def take_trace(self) -> Any:
        """Events noted since the last call (`firmware_bridge.board.trace.Event`)."""
        return self._call("take_trace")


@contextmanager
def _without_main() -> Iterator[None]:
    """Hide the program's main module: a new process would run it again, and a plain script has no guard."""
    main = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


@contextmanager
def _without_interrupt() -> Iterator[None]:
    """Let a new process leave Ctrl-C, which a terminal sends to every process, to the one that starts it.

    A process begins with the blocked signals of the thread that starts it.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _work(
    pipe: Connection,
    path: Path,
    chips: tuple[Adxl345Options, ...],
    fast: bool,
    trace: bool,
    lose_every: int,
    array: str,
) -> None:
    """Serve one board until the pipe closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the first process that is started has it unblocked again
    import numpy as np

    from firmware_bridge.board.worker import Worker

    def conversions(*request: int) -> Any:
        pipe.send(("conversions", request))
        return np.asarray(pipe.recv(), dtype=np.int32)

    sensors = [
        Adxl345(lambda *request, number=number: conversions(number, *request), options)
        for number, options in enumerate(chips)
    ]
    worker: Worker | None = None
    while True:
        try:
            name, arguments = pipe.recv()
        except (EOFError, KeyboardInterrupt):
            return
        if name == "close":
            return
        try:
            if worker is None:
                worker = Worker(path, sensors, fast=fast, trace=trace, lose_every=lose_every, array=array)
            answer = getattr(worker, name)(*arguments)
        except GfimuError as error:
            pipe.send(("error", error))
        except KeyboardInterrupt:
            return
        else:
            pipe.send(("done", answer))
