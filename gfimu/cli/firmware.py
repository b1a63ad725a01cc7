"""`gfimu firmware`: the LPC1768 image in the emulator: run, build, selftest, trace, faults."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gfimu.cli.output import JsonOption, console, print_json, print_paths, print_table, progress

if TYPE_CHECKING:
    from firmware_bridge.board_process import BoardProcess
    from sim.ride import Ride

__all__ = ["register"]

ScenarioOption = Annotated[str, typer.Option("--scenario", help="Scenario whose motion the board rides.")]
SeedOption = Annotated[int, typer.Option("--seed", min=0, help="Seed of the chips and the noise.")]
ImageOption = Annotated[str, typer.Option("--image", help="Image: gfimu, selfcheck, or an ELF or .bin file.")]
RateOption = Annotated[int, typer.Option("--rate", help="Sample rate asked of the firmware, 10 to 3200 Hz.")]
PythonOption = Annotated[
    bool, typer.Option("--pure-python", help="Run all peripherals in Python: slower, the same result.")
]

_BOOT_S = 0.02


def register(app: typer.Typer) -> None:
    """Add the commands."""
    group = typer.Typer(help="The LPC1768 image in the emulator: run, build, selftest, trace, faults.")
    group.command(name="run")(_run)
    group.command(name="build")(_build)
    group.command(name="selftest")(_selftest)
    group.command(name="trace")(_trace)
    group.command(name="faults")(_faults)
    app.add_typer(group, name="firmware")


def _ride(scenario: str, seed: int) -> Ride:
    from sim.ride import Ride

    return Ride(scenario, seed=seed)


def _board(ride: Ride, image: str, seed: int, *, pure_python: bool, trace: bool = False) -> BoardProcess:
    from firmware_bridge.board_process import BoardProcess
    from firmware_bridge.physics import RidePhysics
    from firmware_bridge.virtual_run import typical_chips

    fast = False if pure_python else None
    return BoardProcess(RidePhysics(ride), image=image, chips=typical_chips(seed), fast=fast, trace=trace)


def _run(
    scenario: ScenarioOption = "paper_run",
    port: Annotated[str | None, typer.Option("--port", help="pty, or tcp:PORT (0: any free one).")] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Without a port: record what the board sends to this .csv or .parquet.")
    ] = None,
    duration: Annotated[
        float | None, typer.Option("--duration", min=0.0, help="Virtual time, s; else the scenario's.")
    ] = None,
    rate: RateOption = 100,
    range_g: Annotated[int, typer.Option("--range", help="Range asked of the firmware: 2, 4, 8 or 16 g.")] = 16,
    realtime: Annotated[
        bool, typer.Option("--realtime/--no-realtime", help="With a port: keep pace with the clock on the wall.")
    ] = True,
    seed: SeedOption = 0,
    image: ImageOption = "gfimu",
    pure_python: PythonOption = False,
    json: JsonOption = False,
) -> None:
    """Run the firmware on an emulated board that rides a scenario: behind a port, or straight into a recording.

    Example: gfimu firmware run --scenario paper_run --port pty

    Example: gfimu firmware run --scenario paper_run --out run.parquet --rate 800
    """
    from firmware_bridge.board_process import require_emulator
    from gfimu.errors import InputError

    require_emulator()
    if (port is None) == (out is None):
        raise InputError("give either --port (pty or tcp:PORT) or --out (a recording)")
    if port is None and out is not None:
        _run_to_file(scenario, out, duration, rate, range_g, seed, image, pure_python=pure_python, json=json)
    elif port is not None:
        _run_behind_port(scenario, port, duration, rate, range_g, seed, image, realtime, pure_python, json)


def _run_to_file(
    scenario: str, out: Path, duration: float | None, rate: int, range_g: int, seed: int, image: str,
    *, pure_python: bool, json: bool,
) -> None:  # fmt: skip
    from firmware_bridge.journal import check_target
    from firmware_bridge.virtual_run import record_virtual
    from gfimu.errors import GfimuError

    check_target(out)
    ride = _ride(scenario, seed)
    with progress(f"running {image}", total=1.0) as done:
        run = record_virtual(
            ride, duration or ride.duration, rate_hz=rate, range_g=range_g, image=image,
            fast=False if pure_python else None, progress=done,
        )  # fmt: skip
    try:
        run.recording.write(out)
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else str(error)
        raise GfimuError(f"{out}: {reason}; nothing was written: free space and run again") from None
    if json:
        print_json(
            {
                "stream": asdict(run.stream),
                "identity": None if run.identity is None else asdict(run.identity),
                "warnings": run.warnings,
                "files": [out],
            }
        )
        return
    rows: list[tuple[str, Any]] = [
        ("samples", f"{run.stream.samples} at {rate} Hz"),
        ("lost", run.stream.lost),
        ("corrupt", run.stream.corrupt),
    ]
    if run.identity is not None:
        rows.append(("firmware", run.identity.firmware))
    print_table(f"{scenario} on the emulated board", ("quantity", "value"), rows)
    _print_warnings(run.warnings)
    print_paths([("recording", out)])


def _print_warnings(warnings: Sequence[str]) -> None:
    for warning in warnings:
        console.print(f"[yellow]warning[/yellow] from the board: {warning}", highlight=False, soft_wrap=True)


def _run_behind_port(
    scenario: str, port: str, duration: float | None, rate: int, range_g: int, seed: int, image: str,
    realtime: bool, pure_python: bool, json: bool,
) -> None:  # fmt: skip
    from firmware_bridge.commands import set_range, set_rate
    from firmware_bridge.virtual_port import open_port, serve

    setup = set_range(range_g) + set_rate(rate)
    ride = _ride(scenario, seed)
    line = open_port(port)
    try:
        with _board(ride, image, seed, pure_python=pure_python) as board:
            board.run_for(_BOOT_S)
            board.receive(setup)
            if not json:
                console.print(f"board on [bold]{line.name}[/bold]; Ctrl-C ends it", highlight=False)
                console.print(f"  gfimu record --port {line.name} --out run.parquet", highlight=False)
            report = serve(board, line, duration_s=duration, realtime=realtime)
            warnings = board.warnings()
    finally:
        line.close()
    if json:
        print_json(asdict(report) | {"port": line.name, "warnings": warnings})
        return
    print_table(
        f"{scenario} behind {line.name}",
        ("quantity", "value"),
        [
            ("virtual time", f"{report.virtual_s:.2f} s"),
            ("real time", f"{report.wall_s:.2f} s"),
            ("bytes sent", report.sent),
            ("bytes nobody read", report.refused),
            ("bytes from the host", report.received),
        ],
    )
    _print_warnings(warnings)


def _build(
    image: Annotated[str, typer.Argument(help="Image: gfimu or selfcheck.")] = "gfimu",
    out: Annotated[Path | None, typer.Option("--out", help="Folder for the image; else the package's own.")] = None,
    define: Annotated[
        list[str] | None,
        typer.Option("--define", metavar="NAME=VALUE", help="Preprocessor definition; may be repeated."),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Compile the firmware from its C sources with the compiler of the ziglang package.

    Example: gfimu firmware build --out build --define GFIMU_SPI_HZ=1000000U
    """
    from firmware_bridge.lpc1768.build import build
    from gfimu.errors import InputError

    defines = {}
    for item in define or []:
        name, equals, value = item.partition("=")
        if not equals or not name.isidentifier():
            raise InputError(f"--define {item!r}: write NAME=VALUE")
        defines[name] = value
    report = build(image, out, defines=defines)
    if json:
        print_json(asdict(report))
        return
    print_table(
        f"image {image}",
        ("quantity", "value"),
        [
            ("compiler", report.compiler),
            ("code and constants", f"{report.text_bytes} bytes of flash"),
            ("memory", f"{report.data_bytes + report.bss_bytes} bytes, and the stack"),
            ("SHA-256", report.sha256),
        ],
    )
    print_paths([("ELF file with symbols", report.elf), ("image for the flash", report.binary)])


def _selftest(json: JsonOption = False) -> None:
    """Check the emulator and the firmware: interrupts, the chips' self-test, the image, both ways of running.

    Example: gfimu firmware selftest
    """
    from firmware_bridge.selftest import run_selftest

    rows = run_selftest()
    if json:
        print_json({"passed": all(row.passed for row in rows), "checks": [asdict(row) for row in rows]})
    else:
        cells = [(row.check, "passed" if row.passed else "FAILED", row.measured) for row in rows]
        print_table("self-test", ("check", "result", "measured"), cells)
    if not all(row.passed for row in rows):
        raise typer.Exit(1)


def _trace(
    out: Annotated[Path, typer.Option("--out", help="Trace to write: .vcd for GTKWave, or .rrd for rerun.")],
    scenario: ScenarioOption = "rest",
    duration: Annotated[float, typer.Option("--duration", min=0.0, help="Virtual time to trace, s.")] = 0.05,
    skip: Annotated[float, typer.Option("--skip", min=0.0, help="Virtual time before the trace, s.")] = 0.0,
    rate: RateOption = 800,
    seed: SeedOption = 0,
    image: ImageOption = "gfimu",
    json: JsonOption = False,
) -> None:
    """Trace register accesses and interrupts of the firmware.

    Example: gfimu firmware trace --out trace.vcd --duration 0.02
    """
    from firmware_bridge.board.trace import write_rrd, write_vcd
    from firmware_bridge.board_process import require_emulator
    from firmware_bridge.commands import set_rate
    from gfimu.errors import InputError

    require_emulator()
    if out.suffix not in {".vcd", ".rrd"}:
        raise InputError(f"{out}: unknown trace format {out.suffix!r}; use .vcd or .rrd")
    setup = set_rate(rate)
    with _board(_ride(scenario, seed), image, seed, pure_python=True, trace=True) as board:
        if skip:
            board.run_for(min(skip, _BOOT_S))
            board.receive(setup)
            board.run_for(max(0.0, skip - _BOOT_S))
            board.take_trace()
        board.run_for(duration)
        events = board.take_trace()
    (write_vcd if out.suffix == ".vcd" else write_rrd)(out, events)
    entered = sum(event.kind == "enter" for event in events)
    if json:
        print_json({"events": len(events), "exceptions": entered, "files": [out]})
        return
    rows = [("register accesses", sum(event.source != "cpu" for event in events)), ("exceptions", entered)]
    print_table(f"{duration:g} s of {image}", ("quantity", "value"), rows)
    print_paths([("trace", out)])


def _faults(seed: SeedOption = 0, json: JsonOption = False) -> None:
    """Break the wire, the supply and the chips, one after another, and show what the host makes of it.

    Example: gfimu firmware faults
    """
    from firmware_bridge.fault_campaign import run_campaign

    with progress("faults", total=1.0) as done:
        rows = run_campaign(seed=seed, progress=done)
    if json:
        print_json(
            {
                "passed": all(row.passed for row in rows),
                "faults": [asdict(row) | {"passed": row.passed} for row in rows],
            }
        )
    else:
        header = ("fault", "whole", "decoded", "invented", "lost", "corrupt", "board reports", "result")
        cells = [
            (
                row.fault.replace("_", " "),
                row.frames_whole,
                row.frames_decoded,
                row.invented,
                row.counts.lost,
                row.counts.corrupt,
                ", ".join(row.reported).replace("_", " ") or ("restart" if row.counts.restarts else "-"),
                "passed" if row.passed else "FAILED",
            )
            for row in rows
        ]
        print_table("faults and what the host makes of them", header, cells, note="frames: arrived whole, accepted")
    if not all(row.passed for row in rows):
        raise typer.Exit(1)
