"""Ctrl-C and SIGTERM: both end a command in order, with its half-written files removed, and the shell's exit codes."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

__all__ = ["INTERRUPTED", "Stop", "stop_signals"]

INTERRUPTED = 128 + signal.SIGINT
"""Exit code after Ctrl-C, as shells have it."""


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
        if number == signal.SIGTERM:  # no KeyboardInterrupt, by which a search reports what it has found so far
            raise SystemExit(self.code)
        raise KeyboardInterrupt

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
    before = [signal.signal(number, stop) for number in numbers]
    try:
        yield stop
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)
