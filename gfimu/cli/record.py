"""`gfimu record`: make a recording from a board on a serial port."""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gfimu.cli import completion
from gfimu.cli.output import console, print_json, print_paths, print_table, print_text
from gfimu.cli.shared_options import JsonOption, shared

if TYPE_CHECKING:
    from firmware_bridge.host.chip_selftest import AxisSelfTest
    from firmware_bridge.host.finder import Found
    from gfimu.geometry.array import AccelerometerArray

__all__ = ["register"]

_STATED = {"host": "given", "board": "stated by the board", "format": "the format's", "answer": "as answered"}


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="record")(_record)


def _record(
    port: Annotated[
        str,
        shared(
            "--port",
            more=": a device, a pseudo-terminal, socket://host:port, "
            "udp://address:port, klipper:///socket?chip=NAME, or phyphox://address:port",
        ),
    ] = "",
    out: Annotated[Path | None, typer.Option("--out", help="Recording to write (.csv, .parquet).")] = None,
    find: Annotated[
        bool, typer.Option("--find", help="Look for the board: every port or --port, every speed and format.")
    ] = False,
    self_test: Annotated[
        bool, typer.Option("--self-test", help="Test the chips first, at rest, against the data sheet's limits.")
    ] = False,
    duration: Annotated[float | None, shared("--duration", more="; else until Ctrl-C", min=0.0)] = None,
    rate: Annotated[int | None, shared("--rate", more=", asked of the board, 10 to 3200")] = None,
    range_g: Annotated[int | None, shared("--range", more=", asked of the board")] = None,
    form: Annotated[
        str,
        typer.Option(
            "--format",
            metavar="FORMAT",
            autocompletion=completion.frames,
            help="Frame format: lpc1768 or mimu4444. Or a TOML file (gfimu new frame). Else lpc1768, or what is found.",
        ),
    ] = "",
    array: Annotated[str, shared("--array", more="; else the one that the board states, or the format's")] = "",
    baud: Annotated[int | None, shared("--baud", more="; else as the board is, raised if the rate needs it")] = None,
    reconnect: Annotated[
        float | None,
        typer.Option(
            "--reconnect",
            min=0.0,
            help="Wait this long, s, for a port that is not there yet and for a lost connection (else: 0 and 60).",
        ),
    ] = None,
    rrd: Annotated[Path | None, shared("--rrd", more=" while recording")] = None,
    live: Annotated[
        bool, typer.Option("--live", "--view", help="Show rate, health and scene in the rerun viewer meanwhile.")
    ] = False,
    json: JsonOption = False,
) -> None:
    """Record from a board (real or virtual), with the angular rate shown as it comes.

    If the recording begins with a rest, channels that contradict the others are named while it is made. The file can
    be read while it grows; if the program is killed, at most the last half second is missing. Ctrl-C ends the recording
    and keeps it (exit code 0). Exit code 1 if a chip fails the self-test.

    Examples
    --------
    gfimu record --port /dev/ttyUSB0 --out run.parquet --rate 800 --duration 60
    # Find the board and test its chips first
    gfimu record --find --self-test --out run.parquet
    # A 3-D printer's Klipper
    gfimu record --port "klipper:///tmp/klippy_uds?chip=hotend,bed" --array pair.toml --out run.parquet
    """
    from gfimu.commands.record import record

    screen = console()
    interactive = screen.is_terminal and not json
    if interactive and reconnect and port and "://" not in port and not Path(port).exists():
        screen.print(f"waiting for {port}, up to {reconnect:g} s")
    messages = console(stderr=True)

    def say(text: str) -> None:
        messages.print(f"{' ' * 100}\r{text}" if interactive else f"gfimu: {text}", soft_wrap=True)

    boards: list[Found] = []

    def name_board(board: Found) -> None:
        boards.append(board)
        if not json:
            screen.print(f"{board.port}: {_description(board)}", soft_wrap=True)

    axes: list[AxisSelfTest] = []

    def show_axes(tested: list[AxisSelfTest]) -> None:
        axes.extend(tested)
        if not json:
            _print_self_test(tested)

    can_ask = interactive and sys.stdin.isatty()
    report = record(
        port,
        out,
        find=find,
        self_test=self_test,
        duration=duration,
        rate=rate,
        range_g=range_g,
        form=form,
        array=array,
        baud=baud,
        reconnect=reconnect,
        rrd=rrd,
        live=live,
        on_text=(lambda text: screen.print(text, end="\r")) if interactive else None,
        on_fault=say,
        on_note=say,
        on_find=name_board,
        on_self_test=show_axes,
        choose_array=_ask_for_array if can_ask else None,
        on_try=(lambda name: screen.print(f"looking at {name} …", end="\r")) if interactive else None,
    )
    outcome = {"boards": [asdict(board) for board in boards], "self_test": [asdict(axis) for axis in axes]}
    if report is None or out is None:
        if json:
            print_json(outcome)
        if any(axis.verdict != "passed" for axis in axes):
            raise typer.Exit(1)
        return
    port = boards[0].port if boards else port
    if interactive:
        screen.print()
    written = {"recording": out} | ({"rrd": rrd} if rrd is not None else {})
    if json:
        print_json(asdict(report) | outcome | {"files": written})
        return
    stream, clock, identity = report.stream, report.clock, report.identity
    rows = [
        ("samples", stream.samples),
        ("duration", f"{report.duration_s:.2f} s"),
        ("lost", stream.lost),
        ("corrupt", stream.corrupt),
        ("bytes skipped", stream.skipped_bytes),
        ("samples that follow no other, refused", stream.unconfirmed),
        ("board restarts", stream.restarts),
        ("connection breaks", report.breaks),
    ]
    if clock is not None:
        rows.append(
            ("host clock against board", f"{clock.rate_error * 1e6:+.1f} ± {clock.rate_error_std * 1e6:.1f} ppm")
        )
    if identity is not None:
        faulty = ", ".join(str(number) for number, is_faulty in enumerate(identity.faulty, start=1) if is_faulty)
        if faulty:
            rows.append(("chips that do not hold their settings", faulty))
        rows.append(("firmware", f"{identity.firmware}, {identity.rate_hz} Hz, ±{identity.range_g} g"))
    rows.append(("array", f"{report.array} ({_STATED[report.array_stated_by]})" if report.array else "not known"))
    if report.temperature_degC is not None:
        rows.append(("temperature", "{:.2f} to {:.2f} °C".format(*report.temperature_degC)))
    if report.baud is not None:
        rows.append(("speed of the line", f"{report.baud} baud"))
    rows += [(f"status {name}", number) for name, number in report.status_counts.items()]
    rows += [(name.replace("_", " "), _short(value)) for name, value in report.source.items()]
    print_table(f"recorded from {port}", ("quantity", "value"), rows)
    print_paths(written.items())


def _ask_for_array(candidates: tuple[AccelerometerArray, ...]) -> str:
    """Ask for the array on the board until the answer is one, or empty."""
    from firmware_bridge.host.mounting.on_board import mounting_words
    from gfimu.errors import InputError
    from gfimu.geometry.array import AccelerometerArray

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


def _short(value: Any) -> str:
    """Return a fact on a source as text: numbers to six digits, parts with their names."""
    if isinstance(value, dict):
        return ", ".join(f"{name} {_short(part)}" for name, part in value.items())
    if isinstance(value, list):
        return ", ".join(map(_short, value))
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _description(board: Found) -> str:
    """Return a line on a board: speed, format, and what it says about itself."""
    line = f"{board.form} at {board.baud} baud" + (f", array {board.array}" if board.array else "")
    if (identity := board.identity) is None:
        return f"{line}, sends without answering"
    chips = [
        "answers" if ok else "faulty" if bad else "missing"
        for ok, bad in zip(identity.present, identity.faulty, strict=True)
    ]
    return (
        f"{line}, firmware {identity.firmware}, {identity.rate_hz} Hz, ±{identity.range_g} g, "
        f"{'sends' if identity.streaming else 'stopped'}; chips 1 to {len(chips)}: {', '.join(chips)}; "
        f"last reset: {identity.reset_cause}"
    )


def _print_self_test(tested: list[AxisSelfTest]) -> None:
    rows = [
        (
            one.channel,
            f"{one.shift_g:+.3f}",
            f"{one.least_g:+.2f} … {one.greatest_g:+.2f}",
            f"{1e3 * one.noise_g:.1f}",
            one.verdict,
        )
        for one in tested
    ]
    print_table("self-test of the chips", ("channel", "shift, g", "limits, g", "noise, mg", "result"), rows)
