"""Under `gfimu record`: a recording from a board on a port."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from gfimu.errors import InputError, RecordingWarning
from gfimu.files.outputs import RECORDING, RERUN, writes
from gfimu.optional_packages import require

if TYPE_CHECKING:
    from firmware_bridge.frames.decoder import StreamCounts
    from firmware_bridge.frames.frame_format import FrameFormat
    from firmware_bridge.host.chip_selftest import AxisSelfTest
    from firmware_bridge.host.finder import Found
    from firmware_bridge.host.live import LiveView
    from firmware_bridge.host.mounting.fit import FirstSamples
    from firmware_bridge.host.recorder import Batch, RecordReport
    from gfimu.geometry.array import AccelerometerArray
    from gfimu.integrity.fault import ChannelFault

__all__ = ["record"]


@writes(reads=("port", "array"), out=RECORDING, rrd=RERUN)
def record(
    port: str = "",
    out: str | Path | None = None,
    *,
    find: bool = False,
    self_test: bool = False,
    duration: float | None = None,
    rate: int | None = None,
    range_g: int | None = None,
    form: str = "",
    array: str = "",
    baud: int | None = None,
    reconnect: float | None = None,
    rrd: str | Path | None = None,
    live: bool = False,
    on_text: Callable[[str], None] | None = None,
    on_fault: Callable[[str], None] | None = None,
    on_note: Callable[[str], None] | None = None,
    on_find: Callable[[Found], None] | None = None,
    on_try: Callable[[str], None] | None = None,
    on_self_test: Callable[[list[AxisSelfTest]], None] | None = None,
    choose_array: Callable[[tuple[AccelerometerArray, ...]], str] | None = None,
    stop: Callable[[], bool] | None = None,
) -> RecordReport | None:
    """Record from a board, real or virtual, until the duration ends, ``stop`` returns true, or Ctrl-C.

    Parameters
    ----------
    port : str
        Device, pseudo-terminal, ``socket://host:port``, ``udp://address:port``, ``klipper:///socket?chip=NAME``, or
        ``phyphox://address:port``; may be left out with ``find``.
    out : str or Path, optional
        Recording to write, ``.csv`` or ``.parquet``; can be read while it grows. May be left out with ``find``.
    find : bool
        Look for boards first: on ``port`` or every serial port, at the usual speeds, in ``form`` or every format. With
        ``out``, the first that is found is recorded.
    self_test : bool
        Test the chips first, while the unit rests: the shift under self-test against the data sheet's limits at 3.3 V.
    duration : float, optional
        Length, s of board time; by default until stopped.
    rate : int, optional
        Ask the board for this sample rate, 10 to 3200 Hz.
    range_g : int, optional
        Ask the board for ±2, 4, 8 or 16 g (``--range``).
    form : str
        Frame format (``--format``): a key of `firmware_bridge.frames.frame_format.FORMATS`; else ``lpc1768``, or
        what is found. Klipper and phyphox send samples and have none.
    array : str
        Array on the board (``--array``); by default the one that the board states, or the format's. A board of the
        format ``lpc1768`` that states none is recorded without an array, with a `gfimu.errors.RecordingWarning` that
        names the arrays that it may be. It may have fewer chips than four: then the array's chips are the first ones.
    baud : int, optional
        Bits per second. By default the speed at which the board is, raised if the sample rate needs more.
    reconnect : float, optional
        Wait this long for a port that is not there yet, and for a lost connection, s; by default the port has to be
        there at once, and a lost connection is waited for a minute.
    rrd : str or Path, optional
        Rerun recording to write while recording.
    live : bool
        Open the rerun viewer and show what comes in: rate, health of the channels, readings, scene (``--live``, also
        ``--view``). A viewer that is closed does not end the recording.
    on_text : callable, optional
        Is given a line of text with the angular rate a few times a second.
    on_fault : callable, optional
        Is given a sentence when a channel contradicts the others, and when it does so no longer
        (`gfimu.integrity.live`). The recording has every channel all the same.
    on_note : callable, optional
        Is given a sentence on what is shown: that the filter is being compiled, that it catches up.
    on_find, on_try : callable, optional
        Are given each board that is found, and each port before it is tried.
    on_self_test : callable, optional
        Is given the results of the self-test, channel by channel.
    choose_array : callable, optional
        Is asked for the array, of those that may be on the board, if neither ``array`` nor the board states it.
    stop : callable, optional
        Asked often; True ends the recording.

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
    from gfimu.geometry.array import AccelerometerArray

    if (find or self_test) and has_own_samples(port):
        raise InputError(f"{port}: --find and --self-test are for boards that answer; leave them out")
    if find:
        found = _found(port, form, on_find, on_try)
        port, form = found.port, found.form
    if self_test:
        from firmware_bridge.host.chip_selftest import check_chips

        tested = check_chips(_needed(port), baud=baud, form=form or "lpc1768", array=array)
        if on_self_test is not None:
            on_self_test(tested)
    if out is None:
        given = {"duration": duration, "rate": rate, "range": range_g, "rrd": rrd, "live": live or None, "baud": baud}
        without = [f"--{name}" for name, value in given.items() if value is not None]
        if without or not (find or self_test):
            raise InputError(f"{', '.join(without) or 'record'}: give the recording to write with --out")
        return None
    port = _needed(port)
    setup = [set_range(range_g)] if range_g is not None else []
    setup += [set_rate(rate)] if rate is not None else []
    form_read = port_format(port, form, array)
    samples = FirstSamples()
    view = _LateView(form_read, (on_text, on_fault, on_note), rrd, live=live)
    if array or not form_read.array_is_assumed:
        view.open(AccelerometerArray.load(array or form_read.array))

    def take(batch: Batch, counts: StreamCounts) -> None:
        samples(batch, counts)
        view(batch, counts)

    try:
        report = record_port(
            port, out, duration_s=duration, form=form, array=array, baud=baud, setup=tuple(setup),
            reconnect_s=reconnect, on_batch=take, on_array=view.open, choose_array=choose_array, stop=stop,
        )  # fmt: skip
    except BaseException:
        view.close(keep=False)
        raise
    view.close()
    _warn_of_array(report, samples, form_read, view.array)
    return replace(report, faults=tuple(entry for fault in view.faults for entry in fault.entries()))


def _warn_of_array(
    report: RecordReport, samples: FirstSamples, form: FrameFormat, array: AccelerometerArray | None
) -> None:
    """Warn where the array of a recording is open, or contradicted by the board or by what it sent."""
    from firmware_bridge.host.mounting.fit import open_array_text, other_array_text
    from firmware_bridge.host.mounting.on_board import candidate_arrays
    from gfimu.geometry.array import AccelerometerArray

    if not report.array:
        texts = [open_array_text(candidate_arrays(form), samples, _count_size(form, None), str(report.path))]
    else:
        carried = array or AccelerometerArray.load(report.array)  # one that was stated late is a shipped one
        texts = [other_array_text(report.board_array, carried)]
        texts += [one.text for one in samples.findings(carried, _count_size(form, carried))]
    for text in texts:
        if text:
            warnings.warn(f"{report.path}: {text}", RecordingWarning, stacklevel=3)


def _count_size(form: FrameFormat, array: AccelerometerArray | None) -> float:
    """Size of a count, m/s²."""
    from gfimu.geometry.array import AccelerometerArray
    from gfimu.parts.part import Part

    carried = AccelerometerArray.load(form.array) if array is None else array
    return form.count_m_s2 or Part.load(carried.chips[0].part, carried.part_files).lsb


def _needed(port: str) -> str:
    if not port:
        raise InputError("give the board's port with --port, or look for the board with --find")
    return port


def _found(
    port: str, form: str, on_find: Callable[[Found], None] | None, on_try: Callable[[str], None] | None
) -> Found:
    """Return the first board that is found."""
    from firmware_bridge.host.finder import SPEEDS, find_boards

    boards = find_boards([port] if port else [], [form] if form else [], on_try=on_try)
    if not boards:
        speeds = ", ".join(str(speed) for speed in sorted(SPEEDS))
        raise InputError(
            f"{port or 'serial ports'}: no board answers or sends {form or 'a known format'} at {speeds} baud; "
            "check power, cable and --format (docs/how_to/bench.md)"
        )
    for board in boards:
        if on_find is not None:
            on_find(board)
    return boards[0]


class _LateView:
    """The live view of a recording, opened when its array is settled; without one no rate is shown."""

    def __init__(
        self,
        form: FrameFormat,
        say: tuple[Callable[[str], None] | None, Callable[[str], None] | None, Callable[[str], None] | None],
        rrd: str | Path | None,
        *,
        live: bool,
    ) -> None:
        self._form, self._say, self._rrd, self._live = form, say, rrd, live
        self.array: AccelerometerArray | None = None
        self._view: LiveView | None = None
        self._opened = False
        if live:
            require("--live", "rerun")
            from gfimu.files.rerun_stream import check_display

            check_display()

    def open(self, array: AccelerometerArray | None) -> None:
        """Open the view of an array; raises `InputError` if a picture is asked for and the array is not known."""
        self.array = array
        on_text, on_fault, on_note = self._say
        has_picture = self._live or self._rrd is not None
        if self._opened or not (has_picture or on_text is not None or on_fault is not None):
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
            from gfimu.files.rerun_stream import quiet_sdk

            quiet_sdk()
            from gfimu.visual.live import LivePicture

            picture = LivePicture(array)
        from firmware_bridge.host.live import LiveView

        self._view = LiveView(
            array, _count_size(self._form, array), on_text=on_text, on_fault=on_fault, on_note=on_note,
            rrd=None if self._rrd is None else Path(self._rrd), viewer=self._live, picture=picture,
        )  # fmt: skip

    def __call__(self, batch: Batch, counts: StreamCounts) -> None:
        if self._view is not None:
            self._view(batch, counts)

    def close(self, *, keep: bool = True) -> None:
        """Close the view."""
        if self._view is not None:
            self._view.close(keep=keep)

    @property
    def faults(self) -> tuple[ChannelFault, ...]:
        """Faults of channels that were seen."""
        return () if self._view is None else self._view.faults
