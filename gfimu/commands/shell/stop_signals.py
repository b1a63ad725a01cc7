"""Ctrl-C and SIGTERM: both end a command in order, with its half-written files removed, and the shell's exit codes."""

from __future__ import annotations

import os
import select
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType

__all__ = ["INTERRUPTED", "TERMINATED", "Stop", "stop_signals", "write_line"]

INTERRUPTED = 128 + signal.SIGINT
TERMINATED = 128 + signal.SIGTERM
"""Exit codes after Ctrl-C and SIGTERM, as shells have them."""

_AGAIN_S = 0.05  # until a signal is sent again that came while a library of C was calling Python


class Stop:
    """Which signal ended the program, if one did."""

    def __init__(self) -> None:
        self._process = os.getpid()
        self.received: int | None = None

    def __call__(self, number: int, _frame: FrameType | None) -> None:
        """Take a signal: end the work as Ctrl-C does; a worker process, which has this too, ends at once."""
        if os.getpid() != self._process:
            signal.signal(number, signal.SIG_DFL)
            os.kill(os.getpid(), number)
            return
        self.received = number
        # Both end a search that can say what it has found so far; its result names the signal.
        raise KeyboardInterrupt(*(["SIGTERM"] if number == signal.SIGTERM else []))

    def is_cause_of(self, error: BaseException) -> bool:
        """Whether the program ends with this error because of the signal, and not with an exit code of its own."""
        if isinstance(error, SystemExit):
            return False
        if self.received == signal.SIGTERM:
            return True
        # Python has these errors for compiled code that a signal interrupts, and for a compiled module's start.
        return self.received is not None and isinstance(error, SystemError | ImportError)

    @property
    def words(self) -> str:
        """What the user reads."""
        return "terminated" if self.received == signal.SIGTERM else "interrupted"

    @property
    def code(self) -> int:
        """Exit code."""
        return 128 + (self.received or signal.SIGINT)


@contextmanager
def stop_signals() -> Iterator[Stop]:
    """Note which signal ends the program while the block runs, and let SIGTERM do so as Ctrl-C does."""
    stop = Stop()
    if threading.current_thread() is not threading.main_thread() or sys.platform == "win32":
        yield stop
        return
    numbers = [signal.SIGTERM]
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # a shell's background job ignores it
        numbers.append(signal.SIGINT)
    before, hook = [signal.signal(number, stop) for number in numbers], sys.unraisablehook

    def unraisable(swallowed: sys.UnraisableHookArgs) -> None:
        """Send a signal again whose exception a library of C has swallowed, as numba's compiler does."""
        if stop.received is None or not isinstance(swallowed.exc_value, KeyboardInterrupt):
            hook(swallowed)
            return
        threading.Timer(_AGAIN_S, os.kill, (os.getpid(), stop.received)).start()

    sys.unraisablehook = unraisable
    try:
        yield stop
    finally:
        sys.unraisablehook = hook
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)


def write_line(line: str) -> None:
    """Write a line to standard output, whole even if a signal comes meanwhile: that is taken afterwards.

    A reader that does not read holds up the wait for room, which a signal ends, and not the write.
    """
    if not hasattr(signal, "pthread_sigmask"):
        sys.stdout.write(f"{line}\n")
        sys.stdout.flush()
        return
    with suppress(ValueError, OSError):  # of what is no file of the system, as in tests
        select.select([], [sys.stdout], [])  # a pipe then takes 4096 bytes without waiting
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
    try:
        sys.stdout.write(f"{line}\n")
        sys.stdout.flush()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
