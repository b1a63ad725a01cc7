"""Settings of the board for `gfimu record`, and the functions that are called while it records."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from gfimu.commands.shell import completion
from gfimu.commands.shell.declare import Option
from gfimu.commands.shell.options import ARRAY, BAUD, RANGE, RATE

if TYPE_CHECKING:
    from firmware_bridge.host.chip_selftest import AxisSelfTest
    from firmware_bridge.host.finder import Found
    from gfimu.array.array import AccelerometerArray

__all__ = ["BoardSettings", "RecordCallbacks"]

_FORMAT = Option(
    "Frame format: lpc1768 or mimu4444. Or a TOML file (gfimu new frame). Else lpc1768, or what is found.", "FORMAT",
    name="--format", offers=completion.frames,
)  # fmt: skip
_RECONNECT = Option(
    "Wait this long, s, for a port that is not there yet and for a lost connection (else: 0 and 60).", least=0.0
)


@dataclass(frozen=True)
class BoardSettings:
    """What board is on the line, and what it is asked for.

    Parameters
    ----------
    rate : int, optional
        Sample rate that the board is asked for, 10 to 3200 Hz.
    range_g : int, optional
        Range that it is asked for: ±2, 4, 8 or 16 g.
    form : str
        Frame format: a key of `firmware_bridge.frames.frame_format.FORMATS`, or a TOML file; else ``lpc1768``, or what
        is found. Klipper and phyphox send samples and have none.
    array : str
        Array on the board; by default the one that the board states, or the format's. A board of the format ``lpc1768``
        that states none is recorded without an array, with a `gfimu.base.errors.RecordingWarning` that names the arrays
        that it may be. It may have fewer chips than four: then the array's chips are the first ones.
    baud : int, optional
        Bits per second. By default the speed at which the board is, raised if the sample rate needs more.
    reconnect : float, optional
        Wait this long for a port that is not there yet, and for a lost connection, s; by default the port has to be
        there at once, and a lost connection is waited for a minute.

    Examples
    --------
    >>> import gfimu
    >>> board = gfimu.BoardSettings(rate=800, range_g=8, array="cube12")
    >>> gfimu.record("/dev/ttyACM0", "run.parquet", board=board)  # doctest: +SKIP
    """

    rate: Annotated[int | None, RATE.also(", asked of the board, 10 to 3200")] = None
    range_g: Annotated[int | None, RANGE.also(", asked of the board", name="--range")] = None
    form: Annotated[str, _FORMAT] = ""
    array: Annotated[str, ARRAY.also("; else the one that the board states, or the format's")] = ""
    baud: Annotated[int | None, BAUD.also("; else as the board is, raised if the rate needs it")] = None
    reconnect: Annotated[float | None, _RECONNECT] = None


@dataclass(frozen=True)
class RecordCallbacks:
    """What is called while a recording is made.

    Parameters
    ----------
    on_text : callable, optional
        Is given a line of text with the angular rate a few times a second.
    on_fault : callable, optional
        Is given a sentence when a channel contradicts the others, and when it does so no longer
        (`gfimu.rate.health.live`). The recording has every channel all the same.
    on_note : callable, optional
        Is given a sentence on what is shown: that the filter is being compiled, that it catches up.
    on_find, on_try : callable, optional
        Are given each board that is found, and each port before it is tried.
    on_self_test : callable, optional
        Is given the results of the self-test, channel by channel.
    choose_array : callable, optional
        Is asked for the array, of those that may be on the board, if neither the call nor the board states it.
    stop : callable, optional
        Asked often; True ends the recording.

    Examples
    --------
    >>> import gfimu
    >>> callbacks = gfimu.RecordCallbacks(on_fault=print, on_note=print)
    >>> gfimu.record("/dev/ttyACM0", "run.parquet", callbacks=callbacks)  # doctest: +SKIP
    """

    on_text: Callable[[str], None] | None = None
    on_fault: Callable[[str], None] | None = None
    on_note: Callable[[str], None] | None = None
    on_find: "Callable[[Found], None] | None" = None
    on_try: Callable[[str], None] | None = None
    on_self_test: "Callable[[list[AxisSelfTest]], None] | None" = None
    choose_array: "Callable[[tuple[AccelerometerArray, ...]], str] | None" = None
    stop: Callable[[], bool] | None = None
