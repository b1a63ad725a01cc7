"""`gfimu record`: make a recording from a board on a serial port."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from gfimu.cli.output import JsonOption, console, print_json, print_paths, print_table

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="record")(_record)


def _record(
    port: Annotated[str, typer.Option("--port", help="Device, pseudo-terminal, or socket://host:port.")],
    out: Annotated[Path, typer.Option("--out", help="Recording to write, .csv or .parquet.")],
    duration: Annotated[
        float | None, typer.Option("--duration", min=0.0, help="Length in s; else until Ctrl-C.")
    ] = None,
    rate: Annotated[
        int | None, typer.Option("--rate", help="Ask the board for this sample rate, 10 to 3200 Hz.")
    ] = None,
    range_g: Annotated[int | None, typer.Option("--range", help="Ask the board for ±2, 4, 8 or 16 g.")] = None,
    form: Annotated[str, typer.Option("--format", help="Frame format: lpc1768 or mimu4444.")] = "lpc1768",
    array: Annotated[str, typer.Option("--array", help="Array on the board; else the format's.")] = "",
    baud: Annotated[int, typer.Option("--baud", help="Bits per second; without meaning on a socket.")] = 1_562_500,
    reconnect: Annotated[float, typer.Option("--reconnect", help="Wait this long for a lost connection, s.")] = 60.0,
    rrd: Annotated[Path | None, typer.Option("--rrd", help="Rerun recording to write while recording.")] = None,
    view: Annotated[bool, typer.Option("--view", help="Open the rerun viewer and show what comes in.")] = False,
    json: JsonOption = False,
) -> None:
    """Record from a board (real or virtual), with the angular rate shown as it comes.

    The file can be read while it grows; if the program is killed, at most the last half second is missing.

    Example: gfimu record --port /dev/ttyUSB0 --out run.parquet --rate 800 --duration 60
    """
    from firmware_bridge.commands import set_range, set_rate
    from firmware_bridge.frames import frame_format
    from firmware_bridge.live import LiveView
    from firmware_bridge.recorder import record
    from gfimu.array import AccelerometerArray
    from gfimu.part import Part

    carried = AccelerometerArray.load(array or frame_format(form).array)
    setup = [set_range(range_g)] if range_g is not None else []
    setup += [set_rate(rate)] if rate is not None else []
    interactive = console.is_terminal and not json
    live = None
    if interactive or rrd is not None or view:
        lsb = Part.load(carried.chips[0].part, carried.part_files).lsb
        show = (lambda text: console.print(text, end="\r", highlight=False)) if interactive else None
        live = LiveView(carried, lsb, on_text=show, rrd=rrd, viewer=view)
    try:
        report = record(
            port, out, duration_s=duration, form=form, array=array, baud=baud, setup=tuple(setup),
            reconnect_s=reconnect, on_batch=live,
        )  # fmt: skip
    finally:
        if live is not None:
            live.close()
    if interactive:
        console.print()
    written = {"recording": out} | ({"rrd": rrd} if rrd is not None else {})
    if json:
        print_json(asdict(report) | {"files": written})
        return
    stream, clock, identity = report.stream, report.clock, report.identity
    rows = [
        ("samples", stream.samples),
        ("duration", f"{report.duration_s:.2f} s"),
        ("lost", stream.lost),
        ("corrupt", stream.corrupt),
        ("bytes skipped", stream.skipped_bytes),
        ("board restarts", stream.restarts),
        ("connection breaks", report.breaks),
    ]
    if clock is not None:
        rows.append(
            ("host clock against board", f"{clock.rate_error * 1e6:+.1f} ± {clock.rate_error_std * 1e6:.1f} ppm")
        )
    if identity is not None:
        rows.append(("firmware", f"{identity.firmware}, {identity.rate_hz} Hz, ±{identity.range_g} g"))
    rows += [(f"status {name}", number) for name, number in report.status_counts.items()]
    print_table(f"recorded from {port}", ("quantity", "value"), rows)
    print_paths(written.items())
