"""Under `gfimu live`: the rate filter on a stream of samples."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from gfimu.commands.former_arguments import former_arguments
from gfimu.errors import InputError

if TYPE_CHECKING:
    from gfimu.geometry.array import AccelerometerArray
    from gfimu.geometry.turning_axis import TurningAxis

__all__ = ["live"]

_RATES = 1e-3, 1e6  # Hz
_START_S = 3.0  # of a stream, which are examined
_FEWEST, _MOST = 50, 5000  # samples of that start


@former_arguments(bias_std="bias_std_m_s2")
def live(
    array: AccelerometerArray | str | Path | None = None,
    rate: float | None = None,
    *,
    source: str | Path | Iterable[str] = "-",
    follow: bool = False,
    scale_std: float = 0.0,
    bias_std_m_s2: float | None = None,
    unknown_start: bool = False,
    gyro: bool = False,
    axis: TurningAxis | str | Sequence[float] | None = None,
    axis_point: Sequence[float] = (0.0, 0.0, 0.0),
    hub: str = "fixed",
    inclination_rad: float | None = None,
    keep_faulty: bool = False,
    force: bool = False,
) -> Iterator[str]:
    """Estimate the angular rate while samples arrive: CSV lines in, one JSON line per sample out.

    Parameters
    ----------
    array : AccelerometerArray, str or Path, optional
        The array, its name or file; by default the one that the stream's comment lines state.
    rate : float, optional
        Nominal sample rate, Hz; by default the one that the stream's comment lines state.
    source : str, Path or iterable of str
        Where samples come from (``--from``): ``-`` for standard input, a recording, ``host:port`` of a TCP server, or
        the lines.
    follow : bool
        With a recording: go on reading while `gfimu.record` writes it.
    scale_std : float
        Uncertainty of the scale factors, a ratio.
    bias_std_m_s2 : float, optional
        Uncertainty of the biases, m/s²; the data sheets' by default.
    unknown_start : bool
        Whether the body may be spinning already.
    gyro : bool
        Whether to fuse the stream's gyro columns.
    axis : TurningAxis, str or sequence of float, optional
        The axis about which alone the array turns: x, y, z, or three numbers, body frame; one chip then suffices. By
        default the array's own, where it can't see all six motions.
    axis_point : sequence of float
        A point of that axis, body frame, m.
    hub : {"fixed", "free"}
        Whether that axis stands still (a table) or moves with a body (a wheel).
    inclination_rad : float, optional
        Angle between that axis and the vertical, rad; by default from the first second.
    keep_faulty : bool
        Use every channel, without looking for faulty ones. By default a channel that contradicts the others is left out
        while it does so (`gfimu.integrity.live`): from a rest at the start on, else from when the rate has settled.
    force : bool
        Go on, with a warning, where the checks of the first seconds would refuse the stream.

    Returns
    -------
    iterator of str
        JSON lines, as `gfimu.rate.stream.filter_stream`; an estimate comes two samples after its own. About an axis as
        `gfimu.known_axis.live.axis_stream`; the first estimates come after a second.

    Raises
    ------
    InputError
        If array or rate are stated nowhere, the rate is not positive, the source can't be opened or its first line that
        is no comment doesn't name the columns. While lines come: if the first seconds show that units, times, array or
        order of the channels are wrong.

    Examples
    --------
    >>> import gfimu
    >>> for line in gfimu.live("cube12", 100.0, source=lines):  # doctest: +SKIP
    ...     print(line)
    """
    import numpy as np

    from gfimu.commands.known_axis import known_axis, turning_axis
    from gfimu.commands.opened import as_array
    from gfimu.rate.kalman import FilterSettings
    from gfimu.rate.sensing import SensorErrors
    from gfimu.rate.stream import filter_stream, read_head
    from gfimu.recording.carried_array import carried_array

    metadata, lines = read_head(_lines(source, follow=follow) if isinstance(source, str | Path) else source)
    geometry = carried_array(metadata, source="the stream") if array is None else as_array(array)
    if geometry is None:
        raise InputError("--array is missing, and the stream does not state its array; give --array")
    if rate is None:
        rate = metadata.get("sample_rate_hz", metadata.get("time_stamp_rate_hz"))
    if rate is None:
        raise InputError("--rate is missing, and the stream does not state its sample rate; give it")
    if not isinstance(rate, int | float) or not _RATES[0] <= rate <= _RATES[1]:
        raise InputError(f"--rate {rate}: must be positive, {_RATES[0]:g} to {_RATES[1]:g} Hz")
    lines = _examined(lines, geometry, rate, force=force)
    about = known_axis(turning_axis(axis, axis_point, hub, inclination_rad), geometry)
    if about is not None:
        from gfimu.known_axis.live import axis_stream

        if gyro or scale_std or bias_std_m_s2 is not None:
            raise InputError("--gyro, --scale-std and --bias-std-m-s2 have no use with a known axis; leave them out")
        return axis_stream(lines, geometry, about, rate, at_rest=not unknown_start)
    biases = {} if bias_std_m_s2 is None else {"bias_std": bias_std_m_s2}
    errors = SensorErrors.from_parts(geometry, rate, scale_std=scale_std, **biases)
    settings = FilterSettings(start_omega=None) if unknown_start else FilterSettings(start_omega=np.zeros(3))
    watched = None
    if not keep_faulty:
        from gfimu.integrity.live.channel_watch import LiveWatch
        from gfimu.integrity.live.watched_filter import WatchedRateFilter
        from gfimu.rate.live import LiveRateFilter

        live = LiveRateFilter(geometry, errors, 1.0 / rate, settings, gyro=gyro)
        is_sure = scale_std > 0.0 or "calibration" in metadata
        stated = errors if is_sure else errors.with_part_gains(geometry)
        watched = WatchedRateFilter(live, LiveWatch(geometry, stated, 1.0 / rate, at_rest=not unknown_start))
    return filter_stream(lines, geometry, errors, 1.0 / rate, settings, fuse_gyro=gyro, watched=watched)


def _examined(lines: Iterator[str], array: AccelerometerArray, rate: float, *, force: bool) -> Iterator[str]:
    """Pass lines on, and examine the samples of the first seconds once they are there."""
    wanted = min(max(_FEWEST, round(_START_S * rate)), _MOST)
    head: list[str] | None = []
    samples = 0
    for line in lines:
        if head is not None:
            head.append(line)
            samples += bool(line.strip()) and not line.startswith("#")
            if samples > wanted:  # the line that names the columns is none
                _examine(head, array, rate, force=force)
                head = None
        yield line
    if head is not None:
        _examine(head, array, rate, force=force)


def _examine(lines: list[str], array: AccelerometerArray, rate: float, *, force: bool) -> None:
    """Check the first samples of a stream as a recording; what can't be read is left to the filter."""
    import numpy as np

    from gfimu.rate.stream import StreamSample, stream_samples
    from gfimu.recording import Recording
    from gfimu.recording.checks import examine

    found = [one for one in stream_samples(lines, array) if isinstance(one, StreamSample) and np.isfinite(one.t_s)]
    later = np.diff([one.t_s for one in found], prepend=-np.inf) > 0.0
    kept = [one for one, is_later in zip(found, later, strict=True) if is_later]
    if len(kept) < _FEWEST or np.any(np.diff([one.t_s for one in kept]) <= 0.0):
        return
    run = Recording.from_arrays(
        [one.t_s for one in kept],
        np.array([one.readings for one in kept]),
        array,
        metadata={"sample_rate_hz": float(rate)},
    )
    examine(run, array, source="the stream's start", force=force)


def _lines(source: str | Path, *, follow: bool) -> Iterator[str]:
    """Lines of the source as they arrive."""
    from gfimu.files.input_file import is_ordinary
    from gfimu.recording.lines import recording_lines

    if source == "-":
        return iter(sys.stdin.readline, "")
    if is_ordinary(source):
        return recording_lines(source, follow=follow)
    host, colon, port = str(source).removeprefix("socket://").rpartition(":")
    if not colon or not port.isdigit():
        raise InputError(f"--from {str(source)!r}: no such file; give a recording, - for standard input, or host:port")
    return _socket_lines(str(source), host, int(port))


def _socket_lines(source: str, host: str, port: int) -> Iterator[str]:
    """Lines that a TCP server sends."""
    import socket

    try:
        connection = socket.create_connection((host, port), timeout=10)
    except OSError as error:
        raise InputError(f"--from {source!r}: {error.strerror or error}; start the server first") from None
    connection.settimeout(None)
    with connection, connection.makefile("r", encoding="utf-8", errors="replace") as stream:
        yield from stream
