"""The process of a check: reads a request from its standard input, writes the report to its standard output.

Unicorn (GPL-2) is loaded in this process only.
"""

from __future__ import annotations

import gc
import json
import sys
import time
from collections.abc import Iterator
from dataclasses import asdict, replace
from typing import Any

from firmware_bridge.adxl345.device import Adxl345
from firmware_bridge.adxl345.registers import TICKS_PER_SECOND
from firmware_bridge.frames.commands import (
    FAST_BAUD,
    RATES_HZ,
    Command,
    Identity,
    encode_command,
    parse_message,
    set_range,
    set_rate,
)
from firmware_bridge.frames.decoder import SampleDecoder
from firmware_bridge.loop.physics import RestPhysics
from firmware_bridge.lpc1768.elf import ElfImage
from firmware_bridge.strict.board import STUCK, StrictBoard
from firmware_bridge.strict.findings import Finding
from firmware_bridge.strict.image import load_image
from firmware_bridge.strict.rules.memory import StackWatch
from firmware_bridge.strict.rules.waiting import NO_TIME_OUT, UNBOUNDED
from firmware_bridge.strict.watch import Policy

__all__ = ["answer", "run_board", "run_with_commands", "run_with_input"]

_BROKEN_S = 1.0
_TYPED = b"gfimu ?\r\n"
_BOOT_S = 0.05
_SETTLE_S = 0.02
_STARTS = 64
_PERIODS = 4  # of sampling between two commands: in the first the board carries one out
_SET_UP_S = 2e-3  # to write and read back every register of four chips
_GOLDEN = 0.618034  # multiples of it, modulo 1, cover all phases evenly, however many there are
_WORD_BITS, _STOP_BIT, _PARITY = 3, 4, 8
_PARITIES = "OE10"


def run_board(board: StrictBoard, seconds: float, limit_s: float) -> str:
    """Run for a span of virtual time; return why it ended earlier, or nothing."""
    begin = time.monotonic()
    end = board.now + round(seconds * TICKS_PER_SECOND)
    while board.now < end:
        if not board.run_slice(end):
            return "nothing more can come of the program"
        if time.monotonic() - begin > limit_s:
            return f"it took longer than {limit_s:g} s of real time"
    return ""


def run_with_input(board: StrictBoard, seconds: float, limit_s: float) -> str:
    """Run as `run_board` does; half-way, somebody types at every UART that was set up."""
    begin = time.monotonic()
    ended = run_board(board, seconds / 2.0, limit_s)
    if ended:
        return ended
    for uart in board.uarts:
        if uart.divisor > 1:
            uart.receive(_TYPED)
    return run_board(board, seconds / 2.0, max(0.0, limit_s - (time.monotonic() - begin)))


def run_with_commands(board: StrictBoard, limit_s: float) -> str:
    """Boot a board; if it sends an identity of the firmware (docs/reference/frames.md), send it every command."""
    begin = time.monotonic()
    ended = run_board(board, _BOOT_S, limit_s)
    for uart in board.uarts:
        identity = None if ended else _identity(bytes(uart.sent))
        if identity is not None:
            for command, rest_s in _commands(identity, keeps_speed=board.policy.baud is not None):
                uart.receive(command)
                ended = run_board(board, rest_s, max(0.0, limit_s - (time.monotonic() - begin)))
                if ended:
                    break
    return ended


def _identity(sent: bytes) -> Identity | None:
    """Return what an image has said about itself in frames of the firmware, if it has."""
    decoder = SampleDecoder()
    decoder.feed(sent)
    messages = [parse_message(packet) for packet in decoder.messages]
    return next((message for message in messages if isinstance(message, Identity)), None)


def _commands(identity: Identity, *, keeps_speed: bool) -> Iterator[tuple[bytes, float]]:
    """Yield every command of the firmware, at all phases of its sampling, and how long it runs after each, s.

    Unless the line has to keep its speed, samples are taken at the highest rate: a command meets one most often there.
    """
    rate_hz = identity.rate_hz if keeps_speed else RATES_HZ[1]
    start, stop, identify = (encode_command(one) for one in (Command.START, Command.STOP, Command.IDENTIFY))
    set_up = [
        set_rate(rate_hz),
        set_range(identity.range_g, full_resolution=identity.full_resolution),
        *(encode_command(Command.SELF_TEST, on) for on in (1, 0)),
    ]
    if not keeps_speed:
        yield encode_command(Command.SET_BAUD, FAST_BAUD), _SETTLE_S
    yield set_rate(rate_hz), _SETTLE_S
    for index, command in enumerate([start] * _STARTS + 2 * [*set_up, stop, identify, start]):
        yield command, _SET_UP_S * (command in set_up) + (_PERIODS + index * _GOLDEN % 1.0) / rate_hz


def _board(image: ElfImage, request: dict[str, Any], stuck: str | None = None) -> StrictBoard:
    physics = RestPhysics()
    chips = [Adxl345(lambda *asked, number=number: physics(number, *asked)) for number in range(int(request["chips"]))]
    return StrictBoard(image, chips, policy=Policy(baud=request["baud"]), stuck=stuck)


def _with_broken_parts(image: ElfImage, request: dict[str, Any]) -> list[Finding]:
    """Run the image with one part after another that never becomes ready; waits without an end are findings."""
    found = []
    for name, part in STUCK.items():
        board = _board(image, request, stuck=name)
        run_board(board, _BROKEN_S, request["limit_s"])
        found += [
            replace(
                finding, rule=NO_TIME_OUT.name, severity=NO_TIME_OUT.severity.value, remedy=NO_TIME_OUT.remedy,
                what=f"{part.title}: {finding.what}",
            )
            for finding in board.findings()
            if finding.rule == UNBOUNDED.name
        ]  # fmt: skip
    return found


def _character(line_control: int) -> str:
    """Bits, parity and stop bits of a UART, as in ``8N1`` (UM10360 14.4.7)."""
    parity = _PARITIES[line_control >> 4 & 3] if line_control & _PARITY else "N"
    return f"{5 + (line_control & _WORD_BITS)}{parity}{2 if line_control & _STOP_BIT else 1}"


def _stack(board: StrictBoard) -> StackWatch:
    return next(watch for watch in board.watches if isinstance(watch, StackWatch))


def answer(request: dict[str, Any]) -> dict[str, Any]:
    """Check an image (`firmware_bridge.strict.check.CheckOptions`); return the fields of a `CheckReport`."""
    image = load_image(request["image"])
    board = _board(image, request)
    gc.freeze()
    gc.disable()  # nothing that a board does while it runs makes cycles
    ended = run_with_input(board, request["seconds"], request["limit_s"])
    findings = list(board.findings())
    stacks = [_stack(board)]
    if any(_identity(bytes(uart.sent)) for uart in board.uarts):
        commanded = _board(image, request)
        ended = ended or run_with_commands(commanded, request["limit_s"])
        known = {(one.rule, one.pc) for one in findings}  # what breaks a rule without commands does so with them
        findings += [one for one in commanded.findings() if (one.rule, one.pc) not in known]
        stacks.append(_stack(commanded))
    if request["broken_parts"]:
        findings += _with_broken_parts(image, request)
    return {
        "image": request["image"],
        "virtual_s": board.seconds,
        "ended": ended,
        "accesses": board.accesses,
        "exceptions": board.exceptions,
        "resets": board.resets,
        "sent": [len(uart.take_sent()[0]) for uart in board.uarts],
        "baud": [uart.baud for uart in board.uarts],
        "character": [_character(uart.line_control) for uart in board.uarts],
        "stack_bytes": max((stack.used for stack in stacks if stack.used is not None), default=None),
        "stack_room": stacks[0].room,
        "started_at": board.started_at,
        "findings": [asdict(finding) for finding in findings],
    }


if __name__ == "__main__":
    sys.stdout.write(json.dumps(answer(json.load(sys.stdin))))
