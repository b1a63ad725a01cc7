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

import warnings
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from gfimu.base.errors import InputError, RecordingWarning
from gfimu.base.optional_packages import require
from gfimu.commands.record_settings import BoardSettings, RecordCallbacks
from gfimu.commands.shell.declare import Group, Option, command
from gfimu.commands.shell.options import DURATION, PORT, RECORDING_OUT, RRD

if TYPE_CHECKING:
    from firmware_bridge.frames.decoder import StreamCounts
    from firmware_bridge.frames.frame_format import FrameFormat
    from firmware_bridge.host.finder import Found
    from firmware_bridge.host.live import LiveView
    from firmware_bridge.host.mounting.fit import FirstSamples
    from firmware_bridge.host.record_report import RecordReport
    from firmware_bridge.host.recorder import Batch
    from gfimu.array.array import AccelerometerArray
    from gfimu.rate.health.fault import ChannelFault

__all__ = ["record"]


def _results() -> tuple[type, ...]:
    from firmware_bridge.host.record_report import BoardsFound, Recorded

    return Recorded, BoardsFound


def _run(given: dict[str, Any], as_json: bool) -> None:
    from gfimu.commands.record_screen import record_on_screen

    record_on_screen(record, given, as_json=as_json)


_BOARD = Group(
    BoardSettings, "The board: ``gfimu.BoardSettings(rate=800, array='cube12')``; by default as it is, or says."
)


@command(results=_results, run=_run)
def record(
    port: Annotated[
        str,
        PORT.also(
            ": a device, a pseudo-terminal, socket://host:port, udp://address:port, klipper:///socket?chip=NAME, "
            "or phyphox://address:port",
            reads=True,
        ),
    ] = "",
    out: Annotated["str | Path | None", RECORDING_OUT] = None,
    *,
    find: Annotated[bool, Option("Look for the board: every port or --port, every speed and format.")] = False,
    self_test: Annotated[bool, Option("Test the chips first, at rest, against the data sheet's limits.")] = False,
    duration: Annotated[float | None, DURATION.also("; else until Ctrl-C", least=0.0)] = None,
    board: Annotated["BoardSettings | None", _BOARD] = None,
    rrd: Annotated["str | Path | None", RRD.also(" while recording")] = None,
    live: Annotated[bool, Option("Show rate, health and scene in the rerun viewer meanwhile.")] = False,
    callbacks: Annotated[
        "RecordCallbacks | None",
        Option("What is called meanwhile: ``gfimu.RecordCallbacks(on_fault=print)``.", shell=False),
    ] = None,
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
    from firmware_bridge.host.mounting.fit import FirstSamples
    from firmware_bridge.host.recorder import record as record_port
    from firmware_bridge.sources.ports import has_own_samples, port_format
    from gfimu.array.array import AccelerometerArray

    board, callbacks = board or BoardSettings(), callbacks or RecordCallbacks()
    if (find or self_test) and has_own_samples(port):
        raise InputError(f"{port}: --find and --self-test are for boards that answer; leave them out")
    if find:
        found = _found(port, board.form, callbacks)
        port, board = found.port, replace(board, form=found.form)
    if self_test:
        from firmware_bridge.host.chip_selftest import check_chips

        tested = check_chips(_needed(port), baud=board.baud, form=board.form or "lpc1768", array=board.array)
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
    port = _needed(port)
    setup = [set_range(board.range_g)] if board.range_g is not None else []
    setup += [set_rate(board.rate)] if board.rate is not None else []
    form = port_format(port, board.form, board.array)
    samples = FirstSamples()
    view = _LateView(form, callbacks, rrd, live=live)
    if board.array or not form.array_is_assumed:
        view.open(AccelerometerArray.load(board.array or form.array))

    def take(batch: "Batch", counts: "StreamCounts") -> None:
        samples(batch, counts)
        view(batch, counts)

    try:
        report = record_port(
            port, out, duration_s=duration, form=board.form, array=board.array, baud=board.baud, setup=tuple(setup),
            reconnect_s=board.reconnect, on_batch=take, on_array=view.open, choose_array=callbacks.choose_array,
            stop=callbacks.stop,
        )  # fmt: skip
    except BaseException:
        view.close(keep=False)
        raise
    view.close()
    _warn_of_array(report, samples, form, view.array)
    return replace(report, faults=tuple(entry for fault in view.faults for entry in fault.entries()))


def _warn_of_array(
    report: "RecordReport", samples: "FirstSamples", form: "FrameFormat", array: "AccelerometerArray | None"
) -> None:
    """Warn where the array of a recording is open, or contradicted by the board or by what it sent."""
    from firmware_bridge.host.mounting.fit import open_array_text, other_array_text
    from firmware_bridge.host.mounting.on_board import candidate_arrays
    from gfimu.array.array import AccelerometerArray

    if not report.array:
        texts = [open_array_text(candidate_arrays(form), samples, _count_size(form, None), str(report.path))]
    else:
        carried = array or AccelerometerArray.load(report.array)  # one that was stated late is a shipped one
        texts = [other_array_text(report.board_array, carried)]
        texts += [one.text for one in samples.findings(carried, _count_size(form, carried))]
    for text in texts:
        if text:
            warnings.warn(f"{report.path}: {text}", RecordingWarning, stacklevel=3)


def _count_size(form: "FrameFormat", array: "AccelerometerArray | None") -> float:
    """Size of a count, m/s²."""
    from gfimu.array.array import AccelerometerArray
    from gfimu.array.parts.part import Part

    carried = AccelerometerArray.load(form.array) if array is None else array
    return form.count_m_s2 or Part.load(carried.chips[0].part, carried.part_files).lsb


def _needed(port: str) -> str:
    if not port:
        raise InputError("give the board's port with --port, or look for the board with --find")
    return port


def _found(port: str, form: str, callbacks: RecordCallbacks) -> "Found":
    """Return the first board that is found."""
    from firmware_bridge.host.finder import SPEEDS, find_boards

    boards = find_boards([port] if port else [], [form] if form else [], on_try=callbacks.on_try)
    if not boards:
        speeds = ", ".join(str(speed) for speed in sorted(SPEEDS))
        raise InputError(
            f"{port or 'serial ports'}: no board answers or sends {form or 'a known format'} at {speeds} baud; "
            "check power, cable and --format (docs/how_to/bench.md)"
        )
    if callbacks.on_find is not None:
        for board in boards:
            callbacks.on_find(board)
    return boards[0]


class _LateView:
    """The live view of a recording, opened when its array is settled; without one no rate is shown."""

    def __init__(
        self, form: "FrameFormat", callbacks: RecordCallbacks, rrd: "str | Path | None", *, live: bool
    ) -> None:
        self._form, self._callbacks, self._rrd, self._live = form, callbacks, rrd, live
        self.array: AccelerometerArray | None = None
        self._view: LiveView | None = None
        self._opened = False
        if live:
            require("--live", "rerun")
            from gfimu.visual.viewer import check_display

            check_display()

    def open(self, array: "AccelerometerArray | None") -> None:
        """Open the view of an array; raises `InputError` if a picture is asked for and the array is not known."""
        self.array = array
        said = self._callbacks
        has_picture = self._live or self._rrd is not None
        if self._opened or not (has_picture or said.on_text is not None or said.on_fault is not None):
            return
        self._opened = True
        if array is None:
            if has_picture:
                raise InputError(
                    "--live and --rrd draw the array, which the board does not state; give it with --array"
                )
            return
        picture = None
        if has_picture:
            from gfimu.visual.viewer import quiet_sdk

            quiet_sdk()
            from gfimu.visual.live import LivePicture

            picture = LivePicture(array)
        from firmware_bridge.host.live import LiveView

        self._view = LiveView(
            array, _count_size(self._form, array), on_text=said.on_text, on_fault=said.on_fault, on_note=said.on_note,
            rrd=None if self._rrd is None else Path(self._rrd), viewer=self._live, picture=picture,
        )  # fmt: skip

    def __call__(self, batch: "Batch", counts: "StreamCounts") -> None:
        if self._view is not None:
            self._view(batch, counts)

    def close(self, *, keep: bool = True) -> None:
        """Close the view."""
        if self._view is not None:
            self._view.close(keep=keep)

    @property
    def faults(self) -> "tuple[ChannelFault, ...]":
        """Faults of channels that were seen."""
        return () if self._view is None else self._view.faults
