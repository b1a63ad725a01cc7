"""Which board is on which port, at which speed: by listening, and by asking for its identity."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated

from firmware_bridge.frames.commands import ArrayName, Identity
from firmware_bridge.frames.decoder import FORMATS, FrameFormat, SampleDecoder, frame_format
from firmware_bridge.host.link import Chunk, Link
from gfimu.base.declared import Declared, figure
from gfimu.base.errors import InputError

__all__ = ["SPEEDS", "Found", "Listener", "boards_on", "find_boards", "has_speed", "search_speed"]

SPEEDS = (115_200, 1_562_500, 921_600, 460_800, 1_000_000, 230_400, 57_600, 9_600)
"""Speeds to try, the usual ones first, bits per second."""

_LISTEN_S = 0.5  # long enough for four samples at 10 Hz and for an answer
_SAMPLES = 3  # in a row, for a board that is only listened to


@dataclass(frozen=True)
class Found(Declared):
    """A board that answers or sends."""

    port: Annotated[str, figure("Where it is.")]
    baud: Annotated[int, figure("Speed at which it was understood.", "bit/s")]
    form: Annotated[str, figure("Frame format.")]
    identity: Annotated[Identity | None, figure("What it states about itself; null if it only sends.")]
    array: Annotated[str, figure("The array that it states; empty if it states none.")] = ""

    def sentence(self) -> str:
        """Return port, speed, format, and what the board says about itself."""
        line = f"{self.port}: {self.form} at {self.baud} baud" + (f", array {self.array}" if self.array else "")
        if (identity := self.identity) is None:
            return f"{line}, sends without answering"
        chips = [
            "answers" if present else "faulty" if faulty else "missing"
            for present, faulty in zip(identity.present, identity.faulty, strict=True)
        ]
        return (
            f"{line}, firmware {identity.settings}, {'sends' if identity.streaming else 'stopped'}; "
            f"chips 1 to {len(chips)}: {', '.join(chips)}; last reset: {identity.reset_cause}"
        )


class Listener:
    """Listens to a line at one speed until something in one of the formats is understood."""

    def __init__(self, forms: Sequence[FrameFormat]) -> None:
        self._decoders = [SampleDecoder(form) for form in forms]
        self.chunks: list[Chunk] = []
        self.array = ""  # that the board states

    def listen(self, link: Link) -> tuple[FrameFormat, Identity | None] | None:
        """Ask, and return the format that is understood with the identity if one came; None if there is none."""
        begin = time.monotonic()  # before the question: some answer at once
        end = begin + _LISTEN_S
        for decoder in self._decoders:
            if decoder.format.dialogue is not None:
                link.write(decoder.format.dialogue.identify)
        best: FrameFormat | None = None
        while (remaining := end - time.monotonic()) > 0.0:
            chunk = link.read(min(remaining, 0.05))
            if chunk is None or chunk.host_s < begin:  # what was read before may be of another speed
                continue
            self.chunks.append(chunk)
            for decoder in self._decoders:
                decoder.feed(chunk.data)
                identity, self.array = _statements(decoder)
                if identity is not None:
                    return decoder.format, identity
                if decoder.counts.samples >= _SAMPLES:
                    best = decoder.format
            if best is not None and best.dialogue is None:
                break
        return None if best is None else (best, None)


def _statements(decoder: SampleDecoder) -> tuple[Identity | None, str]:
    """Return the newest identity among the messages, and the name of the array; empty if none was stated."""
    dialogue = decoder.format.dialogue
    found = [] if dialogue is None else [dialogue.parse(packet) for packet in reversed(decoder.messages)]
    identity = next((message for message in found if isinstance(message, Identity)), None)
    return identity, next((message.name for message in found if isinstance(message, ArrayName)), "")


def search_speed(
    link: Link, forms: Sequence[FrameFormat], speeds: Sequence[int], stop: Callable[[], bool] = lambda: False
) -> tuple[Found, list[Chunk]] | None:
    """Try one speed after another on an open port; return what was found, and what was read at its speed."""
    for baud in speeds:
        if stop():
            break
        link.set_baud(baud)
        listener = Listener(forms)
        understood = listener.listen(link)
        if understood is not None:
            form, identity = understood
            return Found(link.port, baud, form.name, identity, listener.array), listener.chunks
    return None


def find_boards(
    ports: Sequence[str] = (),
    forms: Sequence[str] = (),
    *,
    on_try: Callable[[str], None] | None = None,
) -> list[Found]:
    """Find the boards on some ports, or on all serial ports of this computer.

    Parameters
    ----------
    ports : sequence of str
        Ports to try; by default those that the system lists.
    forms : sequence of str
        Names of the frame formats to try; by default all.
    on_try : callable, optional
        Is given the name of each port before it is tried.

    Raises
    ------
    InputError
        If there is no port, or if a port that was named can't be opened.
    """
    from serial.tools.list_ports import comports

    names = list(ports) or sorted(port.device for port in comports() if port.hwid != "n/a")
    if not names:
        raise InputError("no serial port on this computer; plug in the board, or name a port with --port")
    tried = [frame_format(name) for name in forms or FORMATS]
    found = []
    for name in names:
        if on_try is not None:
            on_try(name)
        try:
            with Link(name, baud=SPEEDS[0]) as link:
                result = search_speed(link, tried, SPEEDS if has_speed(name) else SPEEDS[:1])
        except InputError:
            if ports:
                raise
            continue  # another program has it, or this user may not open it
        if result is not None:
            found.append(result[0])
    return found


def boards_on(port: str = "", form: str = "", *, on_try: Callable[[str], None] | None = None) -> list[Found]:
    """Return the boards on a port, or on all, that have a format, or any; at least one.

    Raises
    ------
    InputError
        If there is no board, or the port can't be opened.
    """
    boards = find_boards([port] if port else [], [form] if form else [], on_try=on_try)
    if not boards:
        speeds = ", ".join(str(speed) for speed in sorted(SPEEDS))
        raise InputError(
            f"{port or 'serial ports'}: no board answers or sends {form or 'a known format'} at {speeds} baud; "
            "check power, cable and --format (docs/how_to/bench.md)"
        )
    return boards


def has_speed(port: str) -> bool:
    """Whether a port has a speed that both ends have to agree on."""
    return "://" not in port
