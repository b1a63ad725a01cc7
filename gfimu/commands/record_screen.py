"""What `gfimu record` prints as it goes: boards, self-test, the angular rate, and what was recorded in the end."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import typer

from firmware_bridge.host.chip_selftest import AxisSelfTest
from firmware_bridge.host.finder import Found
from firmware_bridge.host.record_report import BoardsFound, Recorded, RecordReport
from gfimu.array.array import AccelerometerArray
from gfimu.base.declared import Table, table
from gfimu.base.errors import InputError
from gfimu.commands.record_settings import RecordCallbacks
from gfimu.commands.shell.output import console, print_json, print_paths, print_text
from gfimu.commands.shell.printing import print_blocks

__all__ = ["record_on_screen"]


def record_on_screen(record: Callable[..., RecordReport | None], given: Mapping[str, Any], *, as_json: bool) -> None:
    """Call the function of the command with its arguments, and print what happens.

    Raises
    ------
    typer.Exit
        With code 1 if a chip failed the self-test and nothing was recorded.
    """
    screen, port, wait = console(), given["port"], given["board"].reconnect
    interactive = screen.is_terminal and not as_json
    if interactive and wait and port and "://" not in port and not Path(port).exists():
        screen.print(f"waiting for {port}, up to {wait:g} s")
    found = BoardsFound()
    report = record(**given, callbacks=_callbacks(found, interactive=interactive, as_json=as_json))
    if report is None:
        if as_json:
            print_json(found.to_dict())
        if any(axis.verdict != "passed" for axis in found.self_test):
            raise typer.Exit(1)
        return
    if interactive:
        screen.print()
    files = {"recording": given["out"]} | ({} if given["rrd"] is None else {"rrd": given["rrd"]})
    if as_json:
        print_json(Recorded(report, found, files).to_dict())
        return
    source = found.boards[0].port if found.boards else port
    print_blocks([Table(f"recorded from {source}", ("quantity", "value"), report.facts())])
    print_paths(files.items())


def _callbacks(found: BoardsFound, *, interactive: bool, as_json: bool) -> RecordCallbacks:
    """Return what prints while a recording is made, and notes what is found before it."""
    screen, messages = console(), console(stderr=True)

    def say(text: str) -> None:
        messages.print(f"{' ' * 100}\r{text}" if interactive else f"gfimu: {text}", soft_wrap=True)

    def name_board(board: Found) -> None:
        found.boards.append(board)
        if not as_json:
            screen.print(board.sentence(), soft_wrap=True)

    def show_axes(tested: Sequence[AxisSelfTest]) -> None:
        found.self_test.extend(tested)
        if not as_json:
            columns = "channel shift_g least_g greatest_g noise_g verdict"
            print_blocks([table("self-test of the chips", tested, columns)])

    quiet = RecordCallbacks(on_fault=say, on_note=say, on_find=name_board, on_self_test=show_axes)
    if not interactive:
        return quiet
    return replace(
        quiet,
        on_text=lambda text: screen.print(text, end="\r"),
        on_try=lambda name: screen.print(f"looking at {name} …", end="\r"),
        choose_array=_ask_for_array if sys.stdin.isatty() else None,
    )


def _ask_for_array(candidates: tuple[AccelerometerArray, ...]) -> str:
    """Ask for the array on the board until the answer is one, or empty."""
    from firmware_bridge.host.mounting.on_board import mounting_words

    print_text("The board does not state how its chips are mounted (docs/how_to/bench.md, Which array):")
    for array in candidates:
        print_text(f"  {array.name}: {mounting_words(array)}")
    while True:
        name = str(typer.prompt("array (a name, a file, or Enter to leave it open)", default="", show_default=False))
        if not name.strip():
            return ""
        try:
            AccelerometerArray.load(name)
        except InputError as error:
            print_text(str(error))
        else:
            return name
