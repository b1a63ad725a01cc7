"""A virtual board on a pseudo-terminal or a TCP port, which any serial program can open."""

from __future__ import annotations

import contextlib
import os
import select
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Annotated, Any, Protocol

from numpy.typing import NDArray

from firmware_bridge.adxl345.registers import TICKS_PER_SECOND
from firmware_bridge.board.uart import FRAMING_ERROR
from firmware_bridge.loop.board_process import BoardProcess
from firmware_bridge.loop.line_speed import as_received, terminal_baud
from gfimu.base.declared import Declared, Line, Table, figure, figures
from gfimu.base.errors import InputError
from gfimu.base.results import TableResult, one_row

__all__ = ["PseudoTerminal", "ServeReport", "TcpPort", "VirtualPort", "open_port", "serve"]

_SLICE_S = 0.01
_FAST_SLICE_S = 0.1
_READ_BYTES = 4096
_BUFFER_BYTES = 1 << 18
_NOBODY_S = 1.0
_PORTS = range(65536)


class VirtualPort(Protocol):
    """The board's end of a line."""

    name: str

    @property
    def baud(self) -> int | None:
        """Speed that the host has set, bits per second; None on a line without one."""
        ...

    def read(self) -> bytes:
        """Bytes from the host, without waiting."""
        ...

    def write(self, data: bytes, timeout_s: float) -> int:
        """Send bytes to the host; return how many it took in time."""
        ...

    def close(self) -> None:
        """Close this end."""


class PseudoTerminal:
    """A pseudo-terminal; the host opens ``name`` as it would a serial device. Linux and macOS."""

    def __init__(self) -> None:
        if sys.platform == "win32":
            raise InputError("there are no pseudo-terminals on Windows; use --port tcp:PORT")
        import tty

        self._ours, self._theirs = os.openpty()  # theirs stays open, so that the host may come and go
        tty.setraw(self._theirs)
        os.set_blocking(self._ours, False)
        self.name = os.ttyname(self._theirs)

    @property
    def baud(self) -> int | None:
        """Speed that the host has set, bits per second."""
        return terminal_baud(self._ours)

    def read(self) -> bytes:
        """Bytes from the host, without waiting."""
        with contextlib.suppress(BlockingIOError, OSError):
            return os.read(self._ours, _READ_BYTES)
        return b""

    def write(self, data: bytes, timeout_s: float) -> int:
        """Send bytes to the host; return how many it took in time."""
        sent = 0
        end = time.monotonic() + timeout_s
        while sent < len(data):
            _, ready, _ = select.select([], [self._ours], [], max(0.0, end - time.monotonic()))
            if not ready:
                break
            with contextlib.suppress(BlockingIOError):
                sent += os.write(self._ours, data[sent : sent + _READ_BYTES])
        return sent

    def close(self) -> None:
        """Close both ends."""
        os.close(self._ours)
        os.close(self._theirs)


class TcpPort:
    """A TCP port on this computer; the host opens ``socket://127.0.0.1:PORT``. One host at a time."""

    def __init__(self, number: int) -> None:
        self._listener = socket.socket()
        self._listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            self._listener.bind(("127.0.0.1", number))
        except OSError as error:
            self._listener.close()
            raise InputError(f"tcp:{number}: {error.strerror or error}; give another port") from None
        self._listener.listen(1)
        self._listener.setblocking(False)
        self._host: socket.socket | None = None
        self.name = f"socket://127.0.0.1:{self._listener.getsockname()[1]}"

    @property
    def baud(self) -> int | None:
        """A network has no speed of characters."""
        return None

    def _accept(self) -> None:
        if self._host is None:
            with contextlib.suppress(BlockingIOError):
                self._host, _ = self._listener.accept()
                self._host.setblocking(False)
                self._host.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def _drop(self) -> None:
        if self._host is not None:
            self._host.close()
            self._host = None

    def read(self) -> bytes:
        """Bytes from the host, without waiting."""
        self._accept()
        if self._host is None:
            return b""
        try:
            data = self._host.recv(_READ_BYTES)
        except BlockingIOError:
            return b""
        except OSError:
            data = b""
        if not data:
            self._drop()
        return data

    def write(self, data: bytes, timeout_s: float) -> int:
        """Send bytes to the host; return how many it took in time. Without a host they are gone, as on a wire."""
        self._accept()
        if self._host is None:
            return len(data)
        sent = 0
        end = time.monotonic() + timeout_s
        try:
            while sent < len(data):
                _, ready, _ = select.select([], [self._host], [], max(0.0, end - time.monotonic()))
                if not ready:
                    break
                sent += self._host.send(data[sent:])
        except OSError:
            self._drop()
        return sent

    def close(self) -> None:
        """Close the port."""
        self._drop()
        self._listener.close()


def open_port(port: str) -> VirtualPort:
    """Open ``pty`` or ``tcp:PORT`` (0: any free port).

    Raises
    ------
    InputError
        If it is neither, or the port is taken.
    """
    if port == "pty":
        return PseudoTerminal()
    kind, _, number = port.partition(":")
    if kind != "tcp" or not number.isdigit() or int(number) not in _PORTS:
        raise InputError(f"unknown port {port!r}; valid: pty, tcp:PORT")
    return TcpPort(int(number))


@dataclass(frozen=True)
class ServeReport(Declared, TableResult):
    """What the emulated board did behind a port."""

    virtual_s: Annotated[float, figure("Virtual time.", "s", head="virtual time", form=".2f")]
    wall_s: Annotated[float, figure("Real time.", "s", head="real time", form=".2f")]
    sent: Annotated[int, figure("Bytes sent.", "bytes", head="sent")]
    refused: Annotated[int, figure("Bytes that the host did not take.", "bytes", head="nobody read")]
    received: Annotated[int, figure("Bytes from the host.", "bytes", head="from the host")]
    warnings: Annotated[
        tuple[str, ...], figure("What the firmware did that the processor's documents advise against.")
    ] = ()
    port: Annotated[str, figure("The port.")] = ""

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row: virtual and real time, bytes each way."""
        counts = {f"{name}_bytes": getattr(self, name) for name in ("sent", "refused", "received")}
        return one_row({"virtual_s": self.virtual_s, "wall_s": self.wall_s, **counts})

    def shown(self) -> Iterator[Table | Line]:
        """Yield the tables and sentences that people read."""
        yield figures(f"Virtual board behind {self.port}", self)
        for warning in self.warnings:
            yield Line(f"warning from the board: {warning}", "yellow")

    def _heading(self) -> str:
        return "Virtual board behind a port"

    def _notes(self) -> tuple[str, ...]:
        return self.warnings


class _Buffer:
    """Bytes on their way to the host."""

    def __init__(self, port: VirtualPort) -> None:
        self._port = port
        self._bytes = bytearray()
        self._moved_at = time.monotonic()
        self.sent = 0
        self.refused = 0

    @property
    def waiting(self) -> bool:
        """Whether bytes wait."""
        return bool(self._bytes)

    def put(self, data: bytes) -> None:
        """Append bytes."""
        self._bytes += data

    def pass_on(self, timeout_s: float) -> None:
        """Hand the host what it takes."""
        if not self._bytes:
            return
        taken = self._port.write(bytes(self._bytes), timeout_s)
        del self._bytes[:taken]
        self.sent += taken
        if taken:
            self._moved_at = time.monotonic()

    def forget(self) -> None:
        """Lose the newest bytes beyond the buffer's size, or all when nobody reads."""
        idle = time.monotonic() - self._moved_at > _NOBODY_S
        excess = len(self._bytes) - (0 if idle else _BUFFER_BYTES)
        if excess > 0:
            del self._bytes[-excess:]
            self.refused += excess


@contextmanager
def _ask_to_stop() -> Iterator[Callable[[], bool]]:
    """Turn Ctrl-C into a question, so that it does not come in the middle of a call to the board's process."""
    asked = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield asked.is_set
        return
    before = signal.signal(signal.SIGINT, lambda *_: asked.set())
    try:
        yield asked.is_set
    finally:
        signal.signal(signal.SIGINT, before)


def serve(
    board: BoardProcess,
    port: VirtualPort,
    *,
    duration_s: float | None = None,
    realtime: bool = True,
    stop: Callable[[], bool] = lambda: False,
) -> ServeReport:
    """Run a board behind a port until the time is up, ``stop`` says so, or Ctrl-C.

    A host that reads at another speed than the board sends gets garbage, as on a wire.

    Parameters
    ----------
    board : BoardProcess
        The board.
    port : VirtualPort
        Its line to the host.
    duration_s : float, optional
        Virtual time to run, s.
    realtime : bool
        Keep pace with the clock on the wall: a host that reads late finds up to 256 KiB buffered, as a serial driver
        does, and what exceeds that, or nobody reads for a second, is lost. Otherwise run as fast as the host reads.
    stop : callable
        Asked often; True ends the run.
    """
    began = time.monotonic()
    first = now = board.now
    received = 0
    end = None if duration_s is None else first + round(duration_s * TICKS_PER_SECOND)
    line = _Buffer(port)
    with _ask_to_stop() as interrupted:
        while (end is None or now < end) and not interrupted() and not stop():
            target = now + round((_SLICE_S if realtime else _FAST_SLICE_S) * TICKS_PER_SECOND)
            before = board.baud()
            now = board.run_until(target if end is None else min(target, end))
            line.put(as_received(board.take_sent()[0], before, port.baud or before)[0])
            line.pass_on(0.0 if realtime else _SLICE_S)
            while not realtime and line.waiting and not interrupted() and not stop():
                line.pass_on(_SLICE_S)
            if realtime:
                line.forget()
            asked = port.read()
            if asked:
                ours = board.baud()
                read, errors = as_received(asked, port.baud or ours, ours)
                board.receive(read, FRAMING_ERROR if errors else 0)
                received += len(asked)
            ahead = (now - first) / TICKS_PER_SECOND - (time.monotonic() - began)
            if realtime and ahead > 0:
                time.sleep(ahead)
    virtual_s, wall_s = (now - first) / TICKS_PER_SECOND, time.monotonic() - began
    return ServeReport(virtual_s, wall_s, line.sent, line.refused, received, port=port.name)
