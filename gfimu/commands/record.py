"""Record from a board (real or virtual), with the angular rate shown as it comes.

If the recording begins with a rest, channels that contradict the others are named while it is made. The file can be
read while it grows; if the program is killed, at most the last half second is missing. Ctrl-C ends the recording and
keeps it (exit code 0). Exit code 1 if a chip fails the self-test.

Examples
--------
gfimu record --port /dev/ttyUSB0 --out run.parquet --rate 800 --duration 60
# Find the board and test its chips first
gfimu record --find --self-test --out run.parquet
# A 3-D printer's Klipper
gfimu record --port "klipper:///tmp/klippy_uds?chip=hotend,bed" --array pair.toml --out run.parquet
"""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from gfimu.base.errors import InputError, warn
from gfimu.base.optional_packages import require
from gfimu.commands.record_settings import BoardSettings, RecordCallbacks
from gfimu.commands.shell.declare import Group, Option, command
from gfimu.commands.shell.options import DURATION, PORT, RECORDING_OUT, RRD

if TYPE_CHECKING:
    from firmware_bridge.frames.decoder import StreamCounts
    from firmware_bridge.host.record_report import RecordReport
    from firmware_bridge.host.recorder import Batch
    from gfimu.array.array import AccelerometerArray

__all__ = ["record"]


def _run(given: dict[str, Any], as_json: bool) -> None:
    from gfimu.commands.record_screen import record_on_screen

    record_on_screen(record, given, as_json=as_json)


def _results() -> tuple[type, ...]:
    from firmware_bridge.host.record_report import BoardsFound, Recorded

    return Recorded, BoardsFound


_PORT = PORT.also(
    ": a device, a pseudo-terminal, socket://host:port, udp://address:port, klipper:///socket?chip=NAME, "
    "or phyphox://address:port",
    reads=True,
)
_BOARD = Group(
    BoardSettings, "The board: ``gfimu.BoardSettings(rate=800, array='cube12')``; by default as it is, or says."
)
_CALLBACKS = Option("What is called meanwhile: ``gfimu.RecordCallbacks(on_fault=print)``.", shell=False)


@command(results=_results, run=_run)
def record(
    port: Annotated[str, _PORT] = "",
    out: Annotated["str | Path | None", RECORDING_OUT] = None,
    *,
    find: Annotated[bool, Option("Look for the board: every port or --port, every speed and format.")] = False,
    self_test: Annotated[bool, Option("Test the chips first, at rest, against the data sheet's limits.")] = False,
    duration: Annotated[float | None, DURATION.also("; else until Ctrl-C", least=0.0)] = None,
    board: Annotated["BoardSettings | None", _BOARD] = None,
    rrd: Annotated["str | Path | None", RRD.also(" while recording")] = None,
    live: Annotated[bool, Option("Show rate, health and scene in the rerun viewer meanwhile.")] = False,
    callbacks: Annotated["RecordCallbacks | None", _CALLBACKS] = None,
) -> "RecordReport | None":
    """Record from a board, real or virtual, until the duration ends, a callback says so, or Ctrl-C.

    Port and output may be left out with ``find``, which records the first board that is found. The file can be read
    while it grows. A viewer that is closed does not end the recording.

    Returns
    -------
    RecordReport or None
        None if nothing was to be recorded. What the samples show against the array is a warning, too.

    Raises
    ------
    InputError
        If the port can't be opened, nothing that is a frame comes, no board is found, or an output can't be written
        where it is asked for.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.record("/dev/ttyACM0", "run.parquet", duration=30.0)  # doctest: +SKIP
    """
    from firmware_bridge.frames.commands import set_range, set_rate
    from firmware_bridge.host.finder import boards_on
    from firmware_bridge.host.live import LiveView
    from firmware_bridge.host.mounting.fit import FirstSamples, array_doubts
    from firmware_bridge.host.recorder import record as record_port
    from firmware_bridge.sources.ports import has_own_samples, port_format
    from gfimu.array.array import AccelerometerArray
    from gfimu.visual import viewer

    board, callbacks = board or BoardSettings(), callbacks or RecordCallbacks()
    if (find or self_test) and has_own_samples(port):
        raise InputError(f"{port}: --find and --self-test are for boards that answer; leave them out")
    if find:
        boards = boards_on(port, board.form, on_try=callbacks.on_try)
        for found in boards:
            if callbacks.on_find is not None:
                callbacks.on_find(found)
        port, board = boards[0].port, replace(board, form=boards[0].form)
    if not port and (self_test or out is not None):
        raise InputError("give the board's port with --port, or look for the board with --find")
    if self_test:
        from firmware_bridge.host.chip_selftest import check_chips

        tested = check_chips(port, baud=board.baud, form=board.form or "lpc1768", array=board.array)
        if callbacks.on_self_test is not None:
            callbacks.on_self_test(tested)
    if out is None:
        given = {
            "duration": duration, "rate": board.rate, "range": board.range_g, "rrd": rrd, "live": live or None,
            "baud": board.baud,
        }  # fmt: skip
        without = [f"--{name}" for name, value in given.items() if value is not None]
        if without or not (find or self_test):
            raise InputError(f"{', '.join(without) or 'record'}: give the recording to write with --out")
        return None
    setup = [set_range(board.range_g)] if board.range_g is not None else []
    setup += [set_rate(board.rate)] if board.rate is not None else []
    form = port_format(port, board.form, board.array)
    samples = FirstSamples()
    known: AccelerometerArray | None = None
    view: LiveView | None = None
    has_picture = live or rrd is not None

    def settle(array: "AccelerometerArray | None") -> None:
        """Open the live view once the array is settled; without an array no rate is shown."""
        nonlocal known, view
        known = array
        if view is not None or not (has_picture or callbacks.on_text is not None or callbacks.on_fault is not None):
            return
        if array is not None:
            picture = None
            if has_picture:
                viewer.quiet_sdk()
                from gfimu.visual.live import LivePicture  # imports the SDK

                picture = LivePicture(array)
            view = LiveView(
                array, form.count_size(array), on_text=callbacks.on_text, on_fault=callbacks.on_fault,
                on_note=callbacks.on_note, rrd=None if rrd is None else Path(rrd), viewer=viewer if live else None,
                picture=picture,
            )  # fmt: skip
        elif has_picture:
            raise InputError("--live and --rrd draw the array, which the board does not state; give it with --array")

    def take(batch: "Batch", counts: "StreamCounts") -> None:
        samples(batch, counts)
        if view is not None:
            view(batch, counts)

    if live:
        require("--live", "rerun")
        viewer.check_display()
    if board.array or not form.array_is_assumed:  # before the port is opened: a viewer takes a while
        settle(AccelerometerArray.load(board.array or form.array))
    keep = False
    try:
        report = record_port(
            port, out, duration_s=duration, form=board.form, array=board.array, baud=board.baud, setup=tuple(setup),
            reconnect_s=board.reconnect, on_batch=take, on_array=settle, choose_array=callbacks.choose_array,
            stop=callbacks.stop,
        )  # fmt: skip
        keep = True
    finally:
        if view is not None:
            view.close(keep=keep)
    for text in array_doubts(report, samples, form, known):
        warn(f"{report.path}: {text}")
    faults = () if view is None else view.faults
    return replace(report, faults=tuple(entry for fault in faults for entry in fault.entries()))
