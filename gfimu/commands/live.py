"""Estimate the angular rate while samples arrive: CSV lines in, one JSON line per sample out.

The first line that is no comment names the columns as in a recording (t_s, a11_m_s2, … or raw counts, a11_lsb, …).
Array and rate may stand in comment lines before it, as gfimu record writes them. An estimate comes two samples
after its own. Where a channel contradicts the others, a line says which, how and since when; it is left out.

Examples
--------
gfimu live --from run.parquet --follow
# From another machine
ssh pi cat /data/run.csv | gfimu live --array cube12 --rate 100
# A wheel by two chips
gfimu live --from socket://pi:4000 --array wheel.toml --axis z --hub free
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

from gfimu.base.errors import InputError, check_name
from gfimu.commands import given
from gfimu.commands.known_axis import AXIS_ALONE, AxisLike, as_known_axis
from gfimu.commands.shell.declare import Option, command
from gfimu.commands.shell.options import ARRAY, BIAS_STD_M_S2, FORCE, GYRO, KEEP_FAULTY, RATE, START, STARTS

__all__ = ["live"]

_RATES = 1e-3, 1e6  # Hz
_FROM = Option(
    "Where samples come from: - (standard input), a recording, or host:port of a TCP server.", name="--from", kind=str,
    reads=True,
)  # fmt: skip


def _results() -> tuple[type, ...]:
    from gfimu.rate.health.live.channel_watch import HealthEvent
    from gfimu.rate.stream import LiveSample, SkippedLine

    return (LiveSample, SkippedLine, HealthEvent)


def _print_lines(values: Mapping[str, Any], as_json: bool) -> None:
    """Print the lines as they come: each is JSON in any case; with --json an error is one too."""
    from gfimu.commands.shell.stop_signals import write_line

    del as_json
    for line in live(**values):
        write_line(line)


@command(results=_results, run=_print_lines)
def live(
    array: Annotated[given.Array, ARRAY.also("; else the stream's own")] = None,
    rate: Annotated[float | None, RATE.also(", nominal; else the stream's own")] = None,
    *,
    source: Annotated["str | Path | Iterable[str]", _FROM] = "-",
    follow: Annotated[bool, Option("With a recording: go on reading while gfimu record writes it.")] = False,
    scale_std: Annotated[float, Option("Uncertainty of the scale factors, a ratio (0.01 is 1 %).")] = 0.0,
    bias_std_m_s2: Annotated[float | None, BIAS_STD_M_S2.also("; else the data sheets'")] = None,
    start: Annotated[str, START] = "any",
    gyro: Annotated[bool, GYRO] = False,
    axis: Annotated[AxisLike, AXIS_ALONE] = None,
    keep_faulty: Annotated[bool, KEEP_FAULTY] = False,
    max_memory: given.Memory = None,
    force: Annotated[bool, FORCE] = False,
) -> Iterator[str]:
    """Estimate the angular rate while samples arrive: CSV lines in, one JSON line per sample out.

    ``source`` may be the lines themselves. A channel that contradicts the others is left out while it does so
    (`gfimu.rate.health.live`): from a rest at the start on, else from when the rate has settled.

    Returns
    -------
    iterator of str
        JSON lines, as `gfimu.rate.stream.filter_stream`; an estimate comes two samples after its own. About an axis as
        `gfimu.rate.axis.live.axis_stream`; the first estimates come after a second.

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
    from gfimu.commands.opened import as_array
    from gfimu.rate.health.live.watched_filter import WatchedRateFilter
    from gfimu.rate.live import LiveRateFilter
    from gfimu.rate.references import Reference
    from gfimu.rate.sensing import SensorErrors
    from gfimu.rate.settings import FilterSettings
    from gfimu.rate.stream import examined_lines, filter_stream, read_head
    from gfimu.recording.carried_array import carried_array
    from gfimu.recording.lines import source_lines

    check_name("start", start, STARTS)
    metadata, lines = read_head(source_lines(source, max_memory, follow=follow))
    geometry = carried_array(metadata, source="the stream") if array is None else as_array(array)
    if geometry is None:
        raise InputError("--array is missing, and the stream does not state its array; give --array")
    if rate is None:
        rate = metadata.get("sample_rate_hz", metadata.get("time_stamp_rate_hz"))
    if rate is None:
        raise InputError("--rate is missing, and the stream does not state its sample rate; give it")
    if not isinstance(rate, int | float) or not _RATES[0] <= rate <= _RATES[1]:
        raise InputError(f"--rate {rate}: must be positive, {_RATES[0]:g} to {_RATES[1]:g} Hz")
    lines = examined_lines(lines, geometry, rate, force=force)
    about = as_known_axis(axis).of(geometry)
    if about is not None:
        from gfimu.rate.axis.live import axis_stream

        if gyro or scale_std or bias_std_m_s2 is not None:
            raise InputError("--gyro, --scale-std and --bias-std-m-s2 have no use with a known axis; leave them out")
        return axis_stream(lines, geometry, about, rate, at_rest=True if start == "rest" else None)
    biases: dict[str, Any] = {} if bias_std_m_s2 is None else {"bias_std": bias_std_m_s2}
    errors = SensorErrors.of_recording(geometry, metadata, rate, **biases)
    if scale_std:
        errors = replace(errors, scale_std=scale_std)
    settings = FilterSettings.starting(start)
    watched = None
    if not keep_faulty:
        is_sure = scale_std > 0.0 or "calibration" in metadata
        live = LiveRateFilter(
            geometry, errors, 1.0 / rate, settings, references=[Reference.gyro(errors)] if gyro else []
        )
        watched = WatchedRateFilter.of(live, errors, calibrated=is_sure)
    return filter_stream(lines, geometry, errors, 1.0 / rate, settings, fuse_gyro=gyro, watched=watched)
