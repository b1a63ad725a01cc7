"""`gfimu firmware`: the LPC1768 image in the emulator: run, build, selftest, trace, faults, check."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from gfimu.cli import completion
from gfimu.cli.command import CommandApp
from gfimu.cli.firmware_check import check
from gfimu.cli.output import print_json, print_paths, print_table, print_text, progress
from gfimu.cli.shared_options import JsonOption, shared

__all__ = ["register"]

ScenarioOption = Annotated[str, shared("--scenario", more=", whose motion the board rides")]
SeedOption = Annotated[int, shared("--seed", min=0)]
ImageOption = Annotated[str, shared("--image")]
RateOption = Annotated[int, shared("--rate", more=", asked of the firmware, 10 to 3200")]
PythonOption = Annotated[
    bool, typer.Option("--pure-python", help="Run all peripherals in Python: slower, the same result.")
]


def register(app: typer.Typer) -> None:
    """Add the commands."""
    group = CommandApp(
        help="The LPC1768 image in the emulator: run, build, selftest, trace, faults, check.\n\nExamples\n--------\n"
        "gfimu firmware selftest\n# What each command does\ngfimu firmware run --help",
        no_args_is_help=True,
    )
    group.command(name="run")(_run)
    group.command(name="build")(_build)
    group.command(name="selftest")(_selftest)
    group.command(name="trace")(_trace)
    group.command(name="faults")(_faults)
    group.command(name="check")(check)
    app.add_typer(group, name="firmware")


def _run(
    scenario: ScenarioOption = "paper_run",
    port: Annotated[str | None, shared("--port", more=" to open: pty, or tcp:PORT (0: any free one)")] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Without a port: recording to write (.csv, .parquet).")
    ] = None,
    duration: Annotated[
        float | None, shared("--duration", more=", of virtual time; else the scenario's", min=0.0)
    ] = None,
    rate: RateOption = 100,
    range_g: Annotated[int, shared("--range", more=", asked of the firmware")] = 16,
    realtime: Annotated[
        bool, typer.Option("--realtime/--no-realtime", help="With a port: keep pace with the clock on the wall.")
    ] = True,
    seed: SeedOption = 0,
    image: ImageOption = "gfimu",
    pure_python: PythonOption = False,
    json: JsonOption = False,
) -> None:
    """Run the firmware on an emulated board that rides a scenario: behind a port, or straight into a recording.

    Behind a port it runs until the scenario ends, or Ctrl-C (exit code 0).

    Examples
    --------
    gfimu firmware run --scenario paper_run --port pty
    # Straight into a recording
    gfimu firmware run --scenario paper_run --out run.parquet --rate 800
    """
    from gfimu.errors import InputError

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
    from gfimu.commands.firmware import run

    with progress(f"running {image}", total=1.0) as done:
        made = run(
            scenario=scenario, out=out, duration=duration, rate=rate, range_g=range_g, seed=seed, image=image,
            pure_python=pure_python, progress=done,
        )  # fmt: skip
    if json:
        print_json(
            {
                "stream": asdict(made.stream),
                "identity": None if made.identity is None else asdict(made.identity),
                "warnings": made.warnings,
                "files": {"recording": out},
            }
        )
        return
    rows: list[tuple[str, Any]] = [
        ("samples", f"{len(made.recording.t_s)} at {made.recording.metadata.get('time_stamp_rate_hz', rate):.1f} Hz"),
        ("lost", made.stream.lost),
        ("corrupt", made.stream.corrupt),
    ]
    if made.identity is not None:
        rows.append(("firmware", made.identity.firmware))
    print_table(f"{scenario} on the emulated board", ("quantity", "value"), rows)
    _print_warnings(made.warnings)
    print_paths([("recording", out)])


def _print_warnings(warnings: Sequence[str]) -> None:
    for warning in warnings:
        print_text(f"warning from the board: {warning}", style="yellow")


def _run_behind_port(
    scenario: str, port: str, duration: float | None, rate: int, range_g: int, seed: int, image: str,
    realtime: bool, pure_python: bool, json: bool,
) -> None:  # fmt: skip
    from gfimu.commands.firmware import run

    names: list[str] = []

    def opened(name: str) -> None:
        names.append(name)
        # With --json standard output is for the one object at the end; where the board is has to be known before.
        print_text(f"board on {name}; Ctrl-C ends it", stderr=json)
        print_text(f"  gfimu record --port {name} --out run.parquet", stderr=json)

    report = run(
        scenario=scenario, port=port, duration=duration, rate=rate, range_g=range_g, realtime=realtime, seed=seed,
        image=image, pure_python=pure_python, on_open=opened,
    )  # fmt: skip
    if json:
        print_json(asdict(report) | {"port": names[0]})
        return
    print_table(
        f"{scenario} behind {names[0]}",
        ("quantity", "value"),
        [
            ("virtual time", f"{report.virtual_s:.2f} s"),
            ("real time", f"{report.wall_s:.2f} s"),
            ("bytes sent", report.sent),
            ("bytes nobody read", report.refused),
            ("bytes from the host", report.received),
        ],
    )
    _print_warnings(report.warnings)


def _build(
    image: Annotated[
        str,
        typer.Argument(
            metavar="[IMAGE]", autocompletion=completion.words("gfimu", "selfcheck"), help="Image: gfimu or selfcheck."
        ),
    ] = "gfimu",
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder to write: the image; else the package's own folder.")
    ] = None,
    array: Annotated[
        str, typer.Option("--array", help="Name of the array on the board, which the board then states to the host.")
    ] = "",
    baud: Annotated[int | None, shared("--baud", more=", after power-on; else 115200")] = None,
    define: Annotated[
        list[str] | None,
        typer.Option("--define", metavar="NAME=VALUE", help="Preprocessor definition; may be repeated."),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Compile the firmware from its C sources with the compiler of the ziglang package.

    Examples
    --------
    gfimu firmware build --out build --array cube12_as_built
    # A faster line and a slower bus
    gfimu firmware build --out build --baud 460800 --define GFIMU_SPI_HZ=1000000U
    """
    from gfimu.commands.firmware import build
    from gfimu.errors import InputError

    defines = {}
    for item in define or []:
        name, equals, value = item.partition("=")
        if not equals or not name.isidentifier():
            raise InputError(f"--define {item!r}: write NAME=VALUE")
        defines[name] = value
    with progress("compiling"):
        report = build(image, out=out, array=array, baud=baud, define=defines)
    if json:
        print_json(asdict(report) | {"files": {"ELF file": report.elf, "image": report.binary}})
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

    Exit code 1 if a check fails. Writes nothing.

    Examples
    --------
    gfimu firmware selftest
    # For a build server
    gfimu firmware selftest --json
    """
    from gfimu.commands.firmware import selftest

    with progress("testing the emulator and the firmware"):
        rows = selftest()
    if json:
        print_json({"passed": all(row.passed for row in rows), "checks": [asdict(row) for row in rows]})
    else:
        cells = [(row.check, "passed" if row.passed else "FAILED", row.measured) for row in rows]
        print_table("self-test", ("check", "result", "measured"), cells)
    if not all(row.passed for row in rows):
        raise typer.Exit(1)


def _trace(
    out: Annotated[Path, typer.Option("--out", help="Trace to write (.vcd for GTKWave, .rrd for rerun).")],
    scenario: ScenarioOption = "rest",
    duration: Annotated[float, shared("--duration", more=", of virtual time", min=0.0)] = 0.05,
    skip: Annotated[float, typer.Option("--skip", min=0.0, help="Virtual time before the trace, s.")] = 0.0,
    rate: RateOption = 800,
    seed: SeedOption = 0,
    image: ImageOption = "gfimu",
    json: JsonOption = False,
) -> None:
    """Trace register accesses and interrupts of the firmware.

    Examples
    --------
    gfimu firmware trace --out trace.vcd --duration 0.02
    # For rerun, from half a second on
    gfimu firmware trace --out trace.rrd --skip 0.5
    """
    from gfimu.commands.firmware import trace

    with progress(f"tracing {image}"):
        found = trace(out, scenario=scenario, duration=duration, skip=skip, rate=rate, seed=seed, image=image)
    if json:
        print_json({"events": found.events, "exceptions": found.exceptions, "files": {"trace": out}})
        return
    rows = [("register accesses", found.accesses), ("exceptions", found.exceptions)]
    print_table(f"{duration:g} s of {image}", ("quantity", "value"), rows)
    print_paths([("trace", out)])


def _faults(seed: SeedOption = 0, json: JsonOption = False) -> None:
    """Break the wire, the supply and the chips, one after another, and show what the host makes of it.

    Exit code 1 if the host takes a fault for data. Writes nothing.

    Examples
    --------
    gfimu firmware faults
    # Other noise
    gfimu firmware faults --seed 3 --json
    """
    from gfimu.commands.firmware import faults

    with progress("faults", total=1.0) as done:
        rows = faults(seed=seed, progress=done)
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
