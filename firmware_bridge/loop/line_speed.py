"""What a serial receiver makes of bytes that were sent at another speed."""

from __future__ import annotations

import sys

import numpy as np

__all__ = ["as_received", "terminal_baud"]

_BITS = 10  # start, eight data bits with the lowest first, stop
_SAME = 0.03  # the last bit of a character is sampled within a third of a bit of its middle: nothing is misread
_TCGETS2 = 0x802C542A  # Linux: terminal attributes with the speed as a number
_SPEED_AT = -4  # the output speed is the last word of struct termios2


def as_received(data: bytes, sent_baud: float, read_baud: float) -> tuple[bytes, int]:
    """Return what a receiver reads, and how many of these bytes have no stop bit where it should be.

    Parameters
    ----------
    data : bytes
        Characters of eight bits, sent without a pause after an idle line, one stop bit.
    sent_baud, read_baud : float
        Speed of the sender and of the receiver, bits per second.

    Notes
    -----
    The receiver waits for the falling edge of a start bit and samples each bit in its middle by its own clock, as UARTs
    do; a start bit that is over by then is a disturbance and is ignored.
    """
    ratio = sent_baud / read_baud  # bits of the sender per bit of the receiver
    if abs(ratio - 1.0) <= _SAME or not data:
        return data, 0
    octets = np.frombuffer(data, dtype=np.uint8)
    line = np.ones((len(octets), _BITS), dtype=np.int8)
    line[:, 0] = 0
    line[:, 1:9] = np.unpackbits(octets[:, None], axis=1, bitorder="little")
    bits = line.ravel()
    falling = np.flatnonzero(np.diff(bits, prepend=1) < 0)
    read, errors = bytearray(), 0
    at = 0.0
    while True:
        place = np.searchsorted(falling, at)
        if place == len(falling):
            return bytes(read), errors
        edge = float(falling[place])
        middles = (edge + (np.arange(_BITS) + 0.5) * ratio).astype(np.int64)
        seen = np.where(middles < len(bits), bits[np.minimum(middles, len(bits) - 1)], 1)  # an idle line is high
        if seen[0]:
            at = edge + 1.0
            continue
        read.append(int(np.packbits(seen[1:9].astype(np.uint8), bitorder="little")[0]))
        errors += int(seen[9] == 0)
        at = edge + (_BITS - 0.5) * ratio


def terminal_baud(descriptor: int) -> int | None:
    """Speed that a program has set on a terminal, bits per second; None where the system does not say."""
    if sys.platform != "linux":
        return None
    import fcntl

    attributes = fcntl.ioctl(descriptor, _TCGETS2, bytes(44))
    return int.from_bytes(attributes[_SPEED_AT:], sys.byteorder) or None
