"""The LPC1768 image in the emulator: run, build, selftest, trace, faults, check.

Examples
--------
gfimu firmware selftest
# What each command does
gfimu firmware run --help
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypedDict, Unpack, overload

from gfimu.base.errors import InputError
from gfimu.base.files.outputs import RECORDING, OutputFile, OutputFolder
from gfimu.base.optional_packages import require
from gfimu.commands.shell import options
from gfimu.commands.shell.declare import Group, Option, command

if TYPE_CHECKING:
    from firmware_bridge.board.trace import TraceCounts
    from firmware_bridge.loop.fault_campaign import FaultReport
    from firmware_bridge.loop.selftest import SelfTestReport
    from firmware_bridge.loop.virtual_port import ServeReport
    from firmware_bridge.loop.virtual_run import VirtualRun
    from firmware_bridge.lpc1768.build import BuildReport
    from firmware_bridge.strict.check import CheckReport

__all__ = ["build", "check", "faults", "run", "selftest", "trace"]

_EITHER = "give either --port (pty or tcp:PORT) or --out (a recording)"

IMAGES = OutputFolder(("gfimu.elf", "gfimu.bin", "gfimu.toml", "selfcheck.elf", "selfcheck.bin", "selfcheck.toml"))
"""What a folder of built images may hold."""

_RIDDEN = options.SCENARIO.also(", whose motion the board rides")
_ASKED_RATE = options.RATE.also(", asked of the firmware, 10 to 3200")
_NAMED_IMAGE = options.IMAGE.also(argument=True, metavar="[IMAGE]")
_VIRTUAL = options.DURATION.also(", of virtual time", least=0.0)
_OUT = Option("Without a port: recording to write (.csv, .parquet).", "FILE", writes=RECORDING, what="recording")
_REALTIME = Option("With a port: keep pace with the clock on the wall.", name="--realtime/--no-realtime")
_SHARE = Option("Without a port: called with the share done, 0 to 1.", shell=False)
_ON_OPEN = Option("With a port: called with its name when the board answers there.", shell=False)
_FOLDER = Option("Folder to write: the image; else the package's own folder.", "FOLDER", writes=IMAGES)
_ON_BOARD = Option("Name of the array on the board, which the board then states to the host.", "NAME", reads=True)
_VCD_OR_RRD = OutputFile("a trace", (".vcd", ".rrd"), {".rrd": ("rerun",)})
_TRACE = Option("Trace to write (.vcd for GTKWave, .rrd for rerun).", "FILE", writes=_VCD_OR_RRD, what="trace")


def _run_on_shell(given: Mapping[str, Any], as_json: bool) -> None:
    from gfimu.commands.shell.output import print_text
    from gfimu.commands.shell.printing import print_report

    if given["port"] is None and given["out"] is None:
        raise InputError(_EITHER)

    def opened(name: str) -> None:
        # With --json standard output is for the one object at the end; where the board is has to be known before.
        print_text(f"board on {name}; Ctrl-C ends it", stderr=as_json)
        print_text(f"  gfimu record --port {name} --out run.parquet", stderr=as_json)

    print_report(run.__command__, {**given, "on_open": opened}, as_json=as_json)  # type: ignore[attr-defined]


class _Asked(TypedDict, total=False):
    """What can be asked of a run on a port or without one."""

    scenario: str | Path
    duration: float | None
    rate: int
    range_g: int
    seed: int
    image: str | Path
    pure_python: bool


@overload
def run(
    *,
    port: None = ...,
    out: str | Path | None = ...,
    progress: Callable[[float], None] | None = ...,
    **asked: Unpack[_Asked],
) -> "VirtualRun": ...


@overload
def run(
    *, port: str, realtime: bool = ..., on_open: Callable[[str], None] | None = ..., **asked: Unpack[_Asked]
) -> "ServeReport": ...


@command(
    "firmware run", run=_run_on_shell, doing=lambda given: f"running {given['image']}" if given["port"] is None else ""
)
def run(
    *,
    scenario: Annotated[str | Path, _RIDDEN] = "paper_run",
    port: Annotated[str | None, options.PORT.also(" to open: pty, or tcp:PORT (0: any free one)")] = None,
    out: Annotated[str | Path | None, _OUT] = None,
    duration: Annotated[float | None, _VIRTUAL.also("; else the scenario's, with a port without end")] = None,
    rate: Annotated[int, _ASKED_RATE] = 100,
    range_g: Annotated[int, options.RANGE.also(", asked of the firmware", name="--range")] = 16,
    realtime: Annotated[bool, _REALTIME] = True,
    seed: Annotated[int, options.SEED] = 0,
    image: Annotated[str | Path, options.IMAGE] = "gfimu",
    pure_python: Annotated[bool, Option("Run all peripherals in Python: slower, the same result.")] = False,
    progress: Annotated[Callable[[float], None] | None, _SHARE] = None,
    on_open: Annotated[Callable[[str], None] | None, _ON_OPEN] = None,
) -> "VirtualRun | ServeReport":
    """Run the firmware on an emulated board that rides a scenario: behind a port, or straight into a recording.

    Behind a port it runs until the duration is over, without one until Ctrl-C (exit code 0).

    Raises
    ------
    InputError
        If the emulator is not installed, an argument is wrong, the port can't be opened, or the output can't be written
        where it is asked for.

    Shell
    -----
    gfimu firmware run --scenario paper_run --port pty
    # Straight into a recording
    gfimu firmware run --scenario paper_run --out run.parquet --rate 800
    """
    require("gfimu firmware run", "unicorn", "mujoco")
    if port is not None and out is not None:
        raise InputError(_EITHER)
    from firmware_bridge.loop.ridden_board import RiddenBoard
    from firmware_bridge.loop.virtual_run import record_virtual
    from sim.ride import Ride

    ride = Ride(scenario, seed=seed)
    ridden = RiddenBoard(ride, image, False if pure_python else None)
    if port is not None:
        return ridden.serve(port, duration, rate_hz=rate, range_g=range_g, realtime=realtime, on_open=on_open)
    result = record_virtual(
        ride, duration or ride.duration, rate_hz=rate, range_g=range_g, image=image,
        fast=ridden.fast, progress=progress,
    )  # fmt: skip
    if out is None:
        return result
    result.recording.write(out)
    return replace(result, files={"recording": Path(out)})


def _definitions(
    define: Annotated[list[str], Option("Preprocessor definition; may be repeated.", "NAME=VALUE")] = (),  # type: ignore[assignment]
) -> dict[str, str]:
    """Return the definitions that the options of the shell say."""
    defines = {}
    for item in define:
        name, equals, value = item.partition("=")
        if not equals or not name.isidentifier():
            raise InputError(f"--define {item!r}: write NAME=VALUE")
        defines[name] = value
    return defines


@command("firmware build", doing="compiling", files=lambda report, _: {"ELF file": report.elf, "image": report.binary})
def build(
    image: Annotated[str, replace(_NAMED_IMAGE, text="Image: gfimu or selfcheck.")] = "gfimu",
    *,
    out: Annotated[str | Path | None, _FOLDER] = None,
    array: Annotated[str, _ON_BOARD] = "",
    baud: Annotated[int | None, options.BAUD.also(", after power-on; else 115200")] = None,
    define: Annotated[Mapping[str, str] | None, Group(_definitions, "Preprocessor definitions.")] = None,
) -> "BuildReport":
    """Compile the firmware from its C sources with the compiler of the ziglang package.

    Raises
    ------
    InputError
        If the compiler is not installed, the image is unknown or the folder can't be written.
    GfimuError
        If the sources do not compile.

    Shell
    -----
    gfimu firmware build --out build --array cube12_as_built
    # A faster line and a slower bus
    gfimu firmware build --out build --baud 460800 --define GFIMU_SPI_HZ=1000000U
    """
    from firmware_bridge.lpc1768.build import build as build_image

    speed = {} if baud is None else {"GFIMU_BOOT_BAUD": f"{baud}U"}
    return build_image(image, out, array=array, defines={**speed, **(define or {})})


@command(
    "firmware selftest", doing="testing the emulator and the firmware", exit_code=lambda report: int(not report.passed)
)
def selftest() -> "SelfTestReport":
    """Check the emulator and the firmware: interrupts, the chips' self-test, the image, both ways of running.

    On the shell exit code 1 if a check fails. Writes nothing.

    Shell
    -----
    gfimu firmware selftest
    # For a build server
    gfimu firmware selftest --json
    """
    from firmware_bridge.loop.selftest import run_selftest

    return run_selftest()


@command("firmware trace", doing=lambda given: f"tracing {given['image']}")
def trace(
    out: Annotated[str | Path, _TRACE],
    *,
    scenario: Annotated[str | Path, _RIDDEN] = "rest",
    duration: Annotated[float, _VIRTUAL] = 0.05,
    skip: Annotated[float, Option("Virtual time before the trace, s.", "S", least=0.0)] = 0.0,
    rate: Annotated[int, _ASKED_RATE] = 800,
    seed: Annotated[int, options.SEED] = 0,
    image: Annotated[str | Path, options.IMAGE] = "gfimu",
) -> "TraceCounts":
    """Trace register accesses and interrupts of the firmware.

    Raises
    ------
    InputError
        If the emulator is not installed, or the output can't be written where it is asked for.

    Shell
    -----
    gfimu firmware trace --out trace.vcd --duration 0.02
    # For rerun, from half a second on
    gfimu firmware trace --out trace.rrd --skip 0.5
    """
    require("gfimu firmware trace", "unicorn", "mujoco")
    from firmware_bridge.board.trace import write_trace
    from firmware_bridge.loop.ridden_board import RiddenBoard
    from sim.ride import Ride

    ridden = RiddenBoard(Ride(scenario, seed=seed), image, fast=False)
    return write_trace(out, ridden.traced(duration, skip_s=skip, rate_hz=rate))


@command("firmware faults", doing="faults", exit_code=lambda report: int(not report.passed))
def faults(
    *, seed: Annotated[int, options.SEED] = 0, progress: Annotated[Callable[[float], None] | None, options.SHARE] = None
) -> "FaultReport":
    """Break the wire, the supply and the chips, one after another, and show what the host makes of it.

    On the shell exit code 1 if the host takes a fault for data. Writes nothing.

    Shell
    -----
    gfimu firmware faults
    # Other noise
    gfimu firmware faults --seed 3 --json
    """
    from firmware_bridge.loop.fault_campaign import run_campaign

    return run_campaign(seed=seed, progress=progress)


@command(
    "firmware check", doing=lambda given: f"running {given['image']}", exit_code=lambda report: int(report.faults > 0)
)
def check(
    image: Annotated[str | Path, _NAMED_IMAGE] = "gfimu",
    *,
    duration: Annotated[float, _VIRTUAL] = 3.0,
    chips: Annotated[int, options.CHIPS.also(": ADXL345s on SSP1, 0 to 4; their chip-selects are P2.0 and so on")] = 4,
    baud: Annotated[int | None, options.BAUD.also(", that the UARTs are meant to send at; else any usual one")] = None,
    time_limit: Annotated[float, options.TIME_LIMIT.also(least=0.0)] = 60.0,
) -> "CheckReport":
    """Run an image on a board that reports what a real LPC1768 would not forgive.

    On the shell exit code 1 if there are faults. Writes nothing.

    Raises
    ------
    InputError
        If the emulator is not installed, an argument is wrong, or the image can't be read or does not fit the LPC1768.

    Shell
    -----
    gfimu firmware check build/gfimu.elf
    # An image without chips
    gfimu firmware check blinky.bin --chips 0 --baud 115200 --duration 1
    """
    from firmware_bridge.strict.check import CheckOptions, check_image

    return check_image(image, CheckOptions(duration, chips, baud, time_limit))
