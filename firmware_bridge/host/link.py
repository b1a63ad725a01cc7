"""The link to a board: a serial device, a pseudo-terminal, a TCP port or a source; it comes back after an unplug."""

from __future__ import annotations

import contextlib
import errno
import queue
import threading
import time
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Self

import serial

from firmware_bridge.frames.frame_format import FrameFormat
from firmware_bridge.sources.ports import source_of
from firmware_bridge.sources.source import Source
from gfimu.base.errors import GfimuError, InputError

__all__ = ["DEFAULT_BAUD", "Chunk", "Link"]

DEFAULT_BAUD = 115_200
_POLL_S = 0.05
_READ_BYTES = 1 << 16
_SOCKET_POLL_S = 0.005
_QUEUE_CHUNKS = 4096
_FIRST_RETRY_S, _LONGEST_RETRY_S = 0.1, 2.0
_LOST_FOR_S = 60.0
_TAKEN = {errno.EAGAIN, errno.EWOULDBLOCK, errno.EBUSY}
_TAKEN_ADDRESS = {errno.EADDRINUSE, errno.EADDRNOTAVAIL}
_NOT_THERE_YET = {errno.ENOENT, errno.ENODEV, errno.ENXIO, errno.EIO, errno.EACCES}  # EACCES: until udev is through


class _NotYetError(InputError):
    """The port can't be opened for a reason that may pass: the board is not plugged in, the server not started."""


@dataclass(frozen=True)
class Chunk:
    """Bytes as they came.

    Parameters
    ----------
    data : bytes
        The bytes; empty when only the break is to be reported.
    host_s : float
        Host time (`time.monotonic`) at which they were read, s.
    after_break : bool
        Whether the connection was lost before them: what came before and what comes now are not one stream.
    """

    data: bytes
    host_s: float
    after_break: bool = False


class Link:
    """A connection that a thread reads, so that nothing is lost while the caller computes or writes.

    When the caller falls behind by more than the queue holds, the thread waits: the bytes then stay in the operating
    system's buffer and, on links with flow control, at the sender.

    Parameters
    ----------
    port : str
        Device (``/dev/ttyUSB0``, ``COM3``), pseudo-terminal, ``socket://host:port``, or a source
        (`firmware_bridge.sources`).
    baud : int
        Bits per second; without meaning on pseudo-terminals, sockets and sources.
    reconnect_s : float, optional
        How long to wait for a port that is not there yet, and for a connection that was lost, s. By default a port has
        to be there at once, and a lost connection is waited for a minute.
    form : FrameFormat, optional
        Format in which a source gives its samples.

    Raises
    ------
    InputError
        If the port can't be opened, or another program has it.

    Notes
    -----
    A serial device or pseudo-terminal is opened for this program alone: two readers would share out its bytes.
    """

    def __init__(
        self,
        port: str,
        *,
        baud: int = DEFAULT_BAUD,
        reconnect_s: float | None = None,
        form: FrameFormat | None = None,
    ) -> None:
        self.port = port
        self.breaks = 0
        self._baud = baud
        self._reconnect_s = _LOST_FOR_S if reconnect_s is None else reconnect_s
        self.source = source_of(port, form)
        self._is_socket = port.startswith("socket://")
        self._serial = self._open_first(reconnect_s or 0.0)
        self._chunks: queue.Queue[Chunk | GfimuError | None] = queue.Queue(_QUEUE_CHUNKS)
        self._closing = threading.Event()
        self._writing = threading.Lock()
        self._thread = threading.Thread(target=self._read, name=f"link {port}", daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _open(self) -> Any:
        if self.source is not None:
            return self._open_source(self.source)
        timeout = _SOCKET_POLL_S if self._is_socket else _POLL_S
        exclusive = None if "://" in self.port else True  # a lock on the device (flock); on Windows always
        try:
            return serial.serial_for_url(
                self.port, baudrate=self._baud, timeout=timeout, write_timeout=2.0, exclusive=exclusive
            )
        except (serial.SerialException, OSError, ValueError) as error:
            number = error.errno if isinstance(error, OSError) else None
            if number in _TAKEN:
                raise InputError(
                    f"{self.port}: the port is in use by another program; end that one (another gfimu record?) first"
                ) from None
            reason = str(error).splitlines()[0] if str(error) else type(error).__name__
            may_pass = number in _NOT_THERE_YET or (self._is_socket and not isinstance(error, ValueError))
            raise (_NotYetError if may_pass else InputError)(
                f"{self.port}: can't be opened ({reason}); give a device, a pseudo-terminal or socket://host:port"
            ) from None

    def _open_source(self, source: Source) -> Source:
        try:
            source.open()
        except InputError:
            raise
        except OSError as error:
            if error.errno in _TAKEN_ADDRESS:
                raise InputError(f"{self.port}: {error.strerror}; {source.hint}") from None
            reason = error.strerror or str(error) or type(error).__name__
            raise _NotYetError(f"{self.port}: can't be opened ({reason}); {source.hint}") from None
        return source

    def _open_first(self, wait_s: float) -> Any:
        """Open the port, or wait for it to appear."""
        give_up = time.monotonic() + wait_s
        pause = _FIRST_RETRY_S
        while True:
            try:
                return self._open()
            except _NotYetError:
                if time.monotonic() >= give_up:
                    raise
            time.sleep(max(0.0, min(pause, give_up - time.monotonic())))
            pause = min(2 * pause, _LONGEST_RETRY_S)

    def close(self) -> None:
        """Stop reading and close the port."""
        self._closing.set()
        self._thread.join(5.0)
        with contextlib.suppress(OSError, serial.SerialException):
            self._serial.close()

    def write(self, data: bytes) -> None:
        """Send bytes to the board; they are dropped while the connection is lost."""
        with self._writing, contextlib.suppress(OSError, serial.SerialException):
            self._serial.write(data)

    def set_baud(self, baud: int) -> None:
        """Change the speed of this side of the line, once everything written has left."""
        if baud == self._baud:
            return
        self._baud = baud
        with self._writing, contextlib.suppress(OSError, serial.SerialException, ValueError):
            self._serial.flush()
            self._serial.baudrate = baud

    def read(self, timeout_s: float = 0.2) -> Chunk | None:
        """Return the next bytes, or None when none came in time.

        Raises
        ------
        GfimuError
            When the connection was lost and did not come back.
        """
        try:
            chunk = self._chunks.get(timeout=timeout_s)
        except queue.Empty:
            return None
        if isinstance(chunk, GfimuError):
            raise chunk
        return chunk

    @property
    def baud(self) -> int:
        """Speed of this side of the line, bits per second."""
        return self._baud

    @property
    def backlog(self) -> int:
        """Chunks that wait for the caller."""
        return self._chunks.qsize()

    def _read(self) -> None:
        after_break = False
        while not self._closing.is_set():
            try:
                data = self._read_some()
            except GfimuError as error:  # a source that goes on no more
                self._put(error)
                return
            except (serial.SerialException, OSError, TypeError):  # pyserial: TypeError when closed while reading
                if self._closing.is_set():
                    return
                self.breaks += 1
                after_break = True
                self._put(Chunk(b"", time.monotonic(), after_break=True))
                if not self._come_back():
                    return
                continue
            if data:
                self._put(Chunk(data, time.monotonic(), after_break))
                after_break = False

    def _read_some(self) -> bytes:
        """Bytes that are there, or an empty string after a short wait."""
        if self._is_socket or self.source is not None:  # does not report how many bytes wait
            return bytes(self._serial.read(_READ_BYTES))
        data = bytes(self._serial.read(1))
        return data + bytes(self._serial.read(min(self._serial.in_waiting, _READ_BYTES))) if data else data

    def _put(self, chunk: Chunk | GfimuError) -> None:
        while not self._closing.is_set():
            try:
                self._chunks.put(chunk, timeout=_POLL_S)
            except queue.Full:
                continue
            return

    def _come_back(self) -> bool:
        """Try to open the port again until the patience ends."""
        with contextlib.suppress(OSError, serial.SerialException):
            self._serial.close()
        give_up = time.monotonic() + self._reconnect_s
        pause = _FIRST_RETRY_S
        while not self._closing.is_set() and time.monotonic() < give_up:
            if self._closing.wait(pause):
                return False
            pause = min(2 * pause, _LONGEST_RETRY_S)
            try:
                fresh = self._open()
            except InputError:
                continue
            with self._writing:
                self._serial = fresh
            return True
        self._put(GfimuError(f"{self.port}: the connection was lost and did not come back in {self._reconnect_s:g} s"))
        return False
