"""Functions of `gfimu firmware` on the LPC1768 image in the emulator: run, build, selftest, trace, faults, check."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

from numpy.typing import NDArray

from gfimu.commands.former_arguments import former_arguments
from gfimu.errors import InputError
from gfimu.files.outputs import RECORDING, TRACE, OutputFolder, writes
from gfimu.optional_packages import require
from gfimu.results import TableResult, one_row

if TYPE_CHECKING:
    from firmware_bridge.loop.board_process import BoardProcess
    from firmware_bridge.loop.fault_campaign import FaultReport
    from firmware_bridge.loop.selftest import SelfTestReport
    from firmware_bridge.loop.virtual_port import ServeReport
    from firmware_bridge.loop.virtual_run import VirtualRun
    from firmware_bridge.lpc1768.build import BuildReport
    from firmware_bridge.strict.check import CheckReport
    from sim.ride import Ride

__all__ = ["TraceCounts", "build", "check", "faults", "run", "selftest", "trace"]

_BOOT_S = 0.02

IMAGES = OutputFolder(("gfimu.elf", "gfimu.bin", "gfimu.toml", "selfcheck.elf", "selfcheck.bin", "selfcheck.toml"))
"""What a folder of built images may hold."""


@dataclass(frozen=True)
class TraceCounts(TableResult):
    """What a trace holds.

    Parameters
    ----------
    events : int
        All events.
    accesses : int
        Register accesses of the peripherals.
    exceptions : int
        Exceptions entered.
    """

    events: int
    accesses: int
    exceptions: int

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row of the counts."""
        return one_row(vars(self))

    def _heading(self) -> str:
        return "Trace of the firmware"


@overload
def run(
    *,
    scenario: str | Path = ...,
    port: None = ...,
    out: str | Path | None = ...,
    duration: float | None = ...,
    rate: int = ...,
    range_g: int = ...,
    seed: int = ...,
    image: str | Path = ...,
    pure_python: bool = ...,
    progress: Callable[[float], None] | None = ...,
) -> VirtualRun: ...


@overload
def run(
    *,
    scenario: str | Path = ...,
    port: str,
    duration: float | None = ...,
    rate: int = ...,
    range_g: int = ...,
    realtime: bool = ...,
    seed: int = ...,
    image: str | Path = ...,
    pure_python: bool = ...,
    on_open: Callable[[str], None] | None = ...,
) -> ServeReport: ...


@writes(reads=("scenario", "image"), out=RECORDING)
def run(
    *,
    scenario: str | Path = "paper_run",
    port: str | None = None,
    out: str | Path | None = None,
    duration: float | None = None,
    rate: int = 100,
    range_g: int = 16,
    realtime: bool = True,
    seed: int = 0,
    image: str | Path = "gfimu",
    pure_python: bool = False,
    progress: Callable[[float], None] | None = None,
    on_open: Callable[[str], None] | None = None,
) -> VirtualRun | ServeReport:
    """Run the firmware on an emulated board that rides a scenario: behind a port, or straight into a recording.

    Parameters
    ----------
    scenario : str or Path
        Scenario whose motion the board rides.
    port : str, optional
        ``pty``, or ``tcp:PORT`` (0: any free one); without it the samples are decoded here.
    out : str or Path, optional
        Without a port: recording to write, ``.csv`` or ``.parquet``.
    duration : float, optional
        Virtual time, s; without a port the scenario's by default, behind one without end.
    rate : int
        Sample rate asked of the firmware, 10 to 3200 Hz.
    range_g : int
        Range asked of the firmware: 2, 4, 8 or 16 g (``--range``).
    realtime : bool
        Behind a port: keep pace with the clock on the wall.
    seed : int
        Seed of the chips and the noise.
    image : str or Path
        Image: gfimu, selfcheck, or an ELF or .bin file.
    pure_python : bool
        Run all peripherals in Python: slower, the same result.
    progress : callable, optional
        Without a port: called with the share done, 0 to 1.
    on_open : callable, optional
        Behind a port: called with the port's name when the board answers there.

    Returns
    -------
    VirtualRun or ServeReport
        The recording with its counts; behind a port what went through it.

    Raises
    ------
    InputError
        If the emulator is not installed, an argument is wrong, the port can't be opened, or the output can't be written
        where it is asked for.
    """
    require("gfimu firmware run", "unicorn", "mujoco")
    if port is not None and out is not None:
        raise InputError("give either --port (pty or tcp:PORT) or --out (a recording)")
    ride = _ride(scenario, seed)
    if port is not None:
        return _behind_port(ride, port, duration, (rate, range_g), seed, image, realtime, pure_python, on_open)
    from firmware_bridge.loop.virtual_run import record_virtual

    result = record_virtual(
        ride, duration or ride.duration, rate_hz=rate, range_g=range_g, image=image,
        fast=False if pure_python else None, progress=progress,
    )  # fmt: skip
    if out is not None:
        result.recording.write(out)
    return result


def _behind_port(
    ride: Ride, port: str, duration: float | None, setup: tuple[int, int], seed: int, image: str | Path,
    realtime: bool, pure_python: bool, on_open: Callable[[str], None] | None,
) -> ServeReport:  # fmt: skip
    """Serve the board on a port until the time is up or Ctrl-C."""
    from firmware_bridge.frames.commands import sample_at, set_range
    from firmware_bridge.loop.virtual_port import open_port, serve

    rate, range_g = setup
    commands = set_range(range_g) + sample_at(rate)
    line = open_port(port)
    try:
        with _board(ride, image, seed, pure_python=pure_python) as board:
            board.run_for(_BOOT_S)
            board.receive(commands)
            if on_open is not None:
                on_open(line.name)
            report = serve(board, line, duration_s=duration, realtime=realtime)
            return replace(report, warnings=tuple(board.warnings()))
    finally:
        line.close()


@writes(reads=("image", "array"), out=IMAGES)
def build(
    image: str = "gfimu",
    *,
    out: str | Path | None = None,
    array: str = "",
    baud: int | None = None,
    define: Mapping[str, str] | None = None,
) -> BuildReport:
    """Compile the firmware from its C sources with the compiler of the ziglang package.

    Parameters
    ----------
    image : str
        Image: gfimu or selfcheck.
    out : str or Path, optional
        Folder for the image, made if it isn't there; the package's own by default.
    array : str
        Name of the array on the board, which the board then states to the host (``GFIMU_ARRAY``); none by default.
    baud : int, optional
        Speed of the line after power-on, bits per second (``GFIMU_BOOT_BAUD``); 115,200 by default.
    define : mapping of str to str, optional
        Preprocessor definitions.

    Raises
    ------
    InputError
        If the compiler is not installed, the image is unknown or the folder can't be written.
    GfimuError
        If the sources do not compile.
    """
    from firmware_bridge.lpc1768.build import build as build_image

    speed = {} if baud is None else {"GFIMU_BOOT_BAUD": f"{baud}U"}
    return build_image(image, out, array=array, defines={**speed, **(define or {})})


def selftest() -> SelfTestReport:
    """Check the emulator and the firmware: interrupts, the chips' self-test, the image, both ways of running."""
    from firmware_bridge.loop.selftest import run_selftest

    return run_selftest()


@writes(reads=("scenario", "image"), out=TRACE)
def trace(
    out: str | Path,
    *,
    scenario: str | Path = "rest",
    duration: float = 0.05,
    skip: float = 0.0,
    rate: int = 800,
    seed: int = 0,
    image: str | Path = "gfimu",
) -> TraceCounts:
    """Trace register accesses and interrupts of the firmware.

    Parameters
    ----------
    out : str or Path
        Trace to write: ``.vcd`` for GTKWave, or ``.rrd`` for rerun.
    scenario, rate, seed, image
        As for `run`.
    duration, skip : float
        Virtual time to trace, and before the trace, s.

    Raises
    ------
    InputError
        If the emulator is not installed, or the output can't be written where it is asked for.
    """
    require("gfimu firmware trace", "unicorn", "mujoco")
    from firmware_bridge.board.trace import write_rrd, write_vcd
    from firmware_bridge.frames.commands import sample_at

    setup = sample_at(rate)
    with _board(_ride(scenario, seed), image, seed, pure_python=True, trace=True) as board:
        if skip:
            board.run_for(min(skip, _BOOT_S))
            board.receive(setup)
            board.run_for(max(0.0, skip - _BOOT_S))
            board.take_trace()
        board.run_for(duration)
        events = board.take_trace()
    path = Path(out)
    (write_vcd if path.suffix == ".vcd" else write_rrd)(path, events)
    return TraceCounts(
        len(events), sum(event.source != "cpu" for event in events), sum(event.kind == "enter" for event in events)
    )


def faults(*, seed: int = 0, progress: Callable[[float], None] | None = None) -> FaultReport:
    """Break the wire, the supply and the chips, one after another, and return what the host makes of it."""
    from firmware_bridge.loop.fault_campaign import run_campaign

    return run_campaign(seed=seed, progress=progress)


@former_arguments(seconds="duration")
def check(
    image: str | Path = "gfimu",
    *,
    duration: float = 3.0,
    chips: int = 4,
    baud: int | None = None,
    time_limit: float = 60.0,
) -> CheckReport:
    """Run an image on a board that reports what a real LPC1768 would not forgive.

    Parameters
    ----------
    image : str or Path
        Image: gfimu, selfcheck, or an ELF or .bin file.
    duration : float
        Virtual time to run, s.
    chips : int
        ADXL345s on SSP1, 0 to 4; their chip-selects are P2.0 and so on.
    baud : int, optional
        Speed that the UARTs are meant to send at, baud; any usual one by default.
    time_limit : float
        Real time to spend at most, s.

    Raises
    ------
    InputError
        If the emulator is not installed, an argument is wrong, or the image can't be read or does not fit the LPC1768.
    """
    from firmware_bridge.strict.check import CheckOptions, check_image

    return check_image(image, CheckOptions(duration, chips, baud, time_limit))


def _ride(scenario: str | Path, seed: int) -> Ride:
    from sim.ride import Ride

    return Ride(scenario, seed=seed)


def _board(ride: Ride, image: str | Path, seed: int, *, pure_python: bool, trace: bool = False) -> BoardProcess:
    from firmware_bridge.loop.board_process import BoardProcess
    from firmware_bridge.loop.physics import RidePhysics
    from firmware_bridge.loop.virtual_run import typical_chips
    from gfimu.files.model_files import list_models

    fast = False if pure_python else None
    name = ride.array.name if ride.array.name in list_models("arrays") else ""  # a host knows no other by its name
    return BoardProcess(RidePhysics(ride), image=image, chips=typical_chips(seed), fast=fast, trace=trace, array=name)
