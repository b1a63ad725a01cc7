"""Frames or lines of text in UDP datagrams."""

from __future__ import annotations

import socket
from typing import Any
from urllib.parse import urlsplit

import numpy as np

from firmware_bridge.frames.frame_format import FrameFormat
from firmware_bridge.frames.text_lines import TextLayout
from gfimu.base.errors import InputError

__all__ = ["UdpSource"]

_POLL_S = 0.05
_LARGEST = 1 << 16
_BUFFER_BYTES = 1 << 21  # asked of the system, so that a busy moment loses nothing
_LATE_S = 1.0  # a datagram whose first sample is older than the newest by less has been overtaken or came twice
_LOOPBACK = "127.0.0.1"


class UdpSource:
    """Listens for datagrams: frames of any format, or a line of text each, with or without its end of line.

    The first sender's address is the board's; what others send is counted and left out, and so is a datagram that comes
    late or twice. Commands go to where the board's datagrams come from.

    Parameters
    ----------
    port : str
        ``udp://ADDRESS:PORT``: the address of this computer on which to listen; without one only what this computer
        sends itself is taken (127.0.0.1). ``udp://0.0.0.0:PORT`` listens on all networks.
    form : FrameFormat, optional
        Format of the frames; by default bytes pass as they come.

    Raises
    ------
    InputError
        If the URL is not of this form.
    """

    def __init__(self, port: str, form: FrameFormat | None = None) -> None:
        try:
            parts = urlsplit(port)
            number = parts.port
        except ValueError:
            number = None
        if number is None or parts.path not in {"", "/"} or parts.query:
            raise InputError(f"{port}: give udp://ADDRESS:PORT, such as udp://0.0.0.0:5005, with a port up to 65535")
        self._address = (parts.hostname or _LOOPBACK, number)
        self._form = form
        self._socket: socket.socket | None = None
        self._board: tuple[str, int] | None = None
        self._newest: int | None = None
        self._others = self._late = 0
        self.hint = (
            f"{_LOOPBACK} takes what this computer sends itself; give udp://0.0.0.0:{number} for a board on the network"
            if self._address[0] == _LOOPBACK
            else f"let the board send to port {number} of this computer's address, and open it in the firewall"
        )

    def open(self) -> None:
        """Bind the port."""
        opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER_BYTES)
            opened.settimeout(_POLL_S)
            opened.bind(self._address)
        except OSError:
            opened.close()
            raise
        self._socket = opened

    def read(self, size: int, /) -> bytes:
        """Return the next datagram, or nothing after a short wait."""
        assert self._socket is not None
        try:
            data, sender = self._socket.recvfrom(_LARGEST)
        except TimeoutError:
            return b""
        if self._board is not None and sender[0] != self._board[0]:
            self._others += 1
            return b""
        self._board = sender
        if self._form is None:
            return data
        if isinstance(self._form.layout, TextLayout) and not data.endswith(b"\n"):
            data += b"\n"
        if self._is_late(data, self._form):
            self._late += 1
            return b""
        return data

    def _is_late(self, data: bytes, form: FrameFormat) -> bool:
        """Whether the samples of a datagram came before, or belong before those that came."""
        packets = form.layout.scanner().feed(data)
        packets = packets[form.is_sample(packets)]
        if not len(packets):
            return False
        times = packets[form.clock_field].astype(np.int64)
        if self._newest is not None:
            behind = (self._newest - int(times[0])) & form.mask_of(form.clock_field)
            if behind < _LATE_S * form.clock_hz:
                return True
        self._newest = int(times[-1])
        return False

    def write(self, data: bytes, /) -> None:
        """Send bytes to where the board's datagrams come from; dropped before one has come."""
        if self._socket is not None and self._board is not None:
            self._socket.sendto(data, self._board)

    def close(self) -> None:
        """Close the port."""
        if self._socket is not None:
            self._socket.close()

    def facts(self) -> dict[str, Any]:
        """Datagrams that came late or twice, and those of others."""
        return {"datagrams_late": self._late, "datagrams_of_others": self._others}
