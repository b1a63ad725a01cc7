"""Agreeing on a speed with the board: where it is now, and as fast as the samples need."""

from __future__ import annotations

import time
from collections.abc import Callable

from firmware_bridge.frames.commands import Command, encode_command
from firmware_bridge.frames.decoder import FrameFormat
from firmware_bridge.host.finder import SPEEDS, Found, Listener, has_speed, search_speed
from firmware_bridge.host.link import Chunk, Link

__all__ = ["change_speed", "line_up", "needed_baud"]

_BITS_PER_BYTE = 10
_SPARE = 1.02  # room for answers between the samples
_SETTLE_S = 0.05  # the board finishes what it is sending, then changes
_FALL_BACK_TRIES = 4


def needed_baud(form: FrameFormat, rate_hz: float) -> int:
    """Return the least speed that carries a sample rate, bits per second."""
    return int(_SPARE * form.layout.size * _BITS_PER_BYTE * rate_hz)


def line_up(
    link: Link,
    form: FrameFormat,
    baud: int | None = None,
    *,
    least_baud: int = 0,
    stop: Callable[[], bool] = lambda: False,
) -> tuple[Found, list[Chunk]] | None:
    """Find the speed of the board on an open port, and change it if another is asked for or the samples need more.

    Parameters
    ----------
    link : Link
        The open port.
    form : FrameFormat
        Format of the board.
    baud : int, optional
        Speed asked for, bits per second; by default the board's own if it suffices.
    least_baud : int
        Least speed for the samples, bits per second (`needed_baud`).
    stop : callable
        Asked between two speeds; True ends the search.

    Returns
    -------
    tuple of Found and list of Chunk, or None
        The board, and what it sent at the speed that is used now; None if nothing was understood.
    """
    first = baud or link.baud
    others = [speed for speed in SPEEDS if speed != first] if has_speed(link.port) else []
    result = search_speed(link, [form], [first, *others], stop)
    if result is None or result[0].identity is None:
        return result
    found = result[0].baud
    wanted = sorted(speed for speed in SPEEDS if speed >= least_baud > found) if baud is None else [baud]
    for speed in wanted:
        changed = change_speed(link, form, found, speed) if speed != found else None
        if changed is not None:
            return changed
    return result


def change_speed(link: Link, form: FrameFormat, before: int, baud: int) -> tuple[Found, list[Chunk]] | None:
    """Ask the board for another speed and follow it; where that is not understood, go back and return None.

    A board that got no command at the new speed goes back, too, when it receives what it can't read.
    """
    link.write(encode_command(Command.SET_BAUD, baud))
    time.sleep(_SETTLE_S)
    result = search_speed(link, [form], [baud])
    if result is not None:
        return result
    link.set_baud(before)
    for _ in range(_FALL_BACK_TRIES):
        if Listener([form]).listen(link) is not None:
            break
    return None
