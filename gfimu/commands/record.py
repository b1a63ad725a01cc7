"""Under `gfimu record`: a recording from a board on a port."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from gfimu.files.outputs import RECORDING, RERUN, writes

if TYPE_CHECKING:
    from firmware_bridge.live import LiveView
    from firmware_bridge.recorder import RecordReport

__all__ = ["record"]


@writes(reads=("port", "array"), out=RECORDING, rrd=RERUN)
def record(
    port: str,
    out: str | Path,
    *,
    duration: float | None = None,
    rate: int | None = None,
    range_g: int | None = None,
    form: str = "lpc1768",
    array: str = "",
    baud: int = 1_562_500,
    reconnect: float | None = None,
    rrd: str | Path | None = None,
    view: bool = False,
    on_text: Callable[[str], None] | None = None,
    on_fault: Callable[[str], None] | None = None,
    stop: Callable[[], bool] | None = None,
) -> RecordReport:
    """Record from a board, real or virtual, until the time is up, ``stop`` says so, or Ctrl-C.

    Parameters
    ----------
    port : str
        Device, pseudo-terminal, or ``socket://host:port``.
    out : str or Path
        Recording to write, ``.csv`` or ``.parquet``; can be read while it grows.
    duration : float, optional
        Length, s of board time; by default until stopped.
    rate : int, optional
        Ask the board for this sample rate, 10 to 3200 Hz.
    range_g : int, optional
        Ask the board for ±2, 4, 8 or 16 g (``--range``).
    form : str
        Frame format (``--format``): a key of `firmware_bridge.frames.FORMATS`.
    array : str
        Array on the board; the format's by default.
    baud : int
        Bits per second; without meaning on a socket.
    reconnect : float, optional
        Wait this long for a port that is not there yet, and for a lost connection, s; by default the port has to be
        there at once, and a lost connection is waited for a minute.
    rrd : str or Path, optional
        Rerun recording to write while recording.
    view : bool
        Open the rerun viewer and show what comes in.
    on_text : callable, optional
        Is given a line of text with the angular rate a few times a second.
    on_fault : callable, optional
        Is given a sentence when a channel contradicts the others, and when it does so no longer
        (`gfimu.integrity.live`). The recording has every channel all the same.
    stop : callable, optional
        Asked often; True ends the recording.

    Raises
    ------
    InputError
        If the port can't be opened, nothing that is a frame comes, or an output can't be written where it is asked for.
    """
    from firmware_bridge.commands import set_range, set_rate
    from firmware_bridge.recorder import record as record_port

    setup = [set_range(range_g)] if range_g is not None else []
    setup += [set_rate(rate)] if rate is not None else []
    live = None
    if on_text is not None or on_fault is not None or rrd is not None or view:
        live = _live_view(form, array, on_text, on_fault, rrd, view=view)
    try:
        report = record_port(
            port, out, duration_s=duration, form=form, array=array, baud=baud, setup=tuple(setup),
            reconnect_s=reconnect, on_batch=live, stop=stop,
        )  # fmt: skip
    except BaseException:
        if live is not None:
            live.close(keep=False)
        raise
    if live is None:
        return report
    live.close()
    return replace(report, faults=tuple(entry for fault in live.faults for entry in fault.entries()))


def _live_view(
    form: str,
    array: str,
    on_text: Callable[[str], None] | None,
    on_fault: Callable[[str], None] | None,
    rrd: str | Path | None,
    *,
    view: bool,
) -> LiveView:
    from firmware_bridge.frames import frame_format
    from firmware_bridge.live import LiveView
    from gfimu.geometry.array import AccelerometerArray
    from gfimu.parts.part import Part

    carried = AccelerometerArray.load(array or frame_format(form).array)
    lsb = Part.load(carried.chips[0].part, carried.part_files).lsb
    picture = None
    if rrd is not None or view:
        from gfimu.visual.live import LivePicture

        picture = LivePicture(carried)
    return LiveView(
        carried, lsb, on_text=on_text, on_fault=on_fault, rrd=None if rrd is None else Path(rrd), viewer=view,
        picture=picture,
    )  # fmt: skip
