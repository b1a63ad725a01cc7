"""Live filtering of a text stream: CSV lines in, one line of estimate per sample out."""

from __future__ import annotations

import csv
import itertools
import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.parts.part import Part
from gfimu.array.parts.plausible import largest_of_array
from gfimu.base.declared import Declared, figure
from gfimu.base.errors import InputError
from gfimu.rate.health.live.watched_filter import WatchedRateFilter
from gfimu.rate.live import LiveRateFilter
from gfimu.rate.references import Reference
from gfimu.rate.result import RateEstimate
from gfimu.rate.sensing import SensorErrors
from gfimu.rate.settings import FilterSettings
from gfimu.recording import Recording
from gfimu.recording.doubts.judge import examine
from gfimu.recording.quantities import GYRO_COLUMNS, READING_UNITS
from gfimu.recording.tables.column_file import head_line

__all__ = ["LiveSample", "SkippedLine", "examined_lines", "filter_stream", "read_head", "stream_samples"]

_START_S = 3.0  # of a stream, which are examined
_FEWEST, _MOST = 50, 5000  # numerical: samples of that start, whatever the rate


@dataclass(frozen=True)
class StreamSample:
    """One sample of a stream.

    Parameters
    ----------
    t_s : float
        Its time, s.
    readings : ndarray, shape (c,)
        Specific force of the array's channels, m/s²; NaN where one is missing.
    gyro : ndarray, shape (3,), or None
        Gyro readings, rad/s, where they were asked for.
    """

    t_s: float
    readings: NDArray[np.float64]
    gyro: NDArray[np.float64] | None


@dataclass(frozen=True, kw_only=True)
class LiveSample(Declared):
    """The estimate at one sample."""

    t_s: Annotated[float, figure("Its time.", "s")]
    omega_rad_s: Annotated[list[float] | None, figure("Angular rate, body axes.", "rad/s")]
    omega_std_rad_s: Annotated[
        list[float] | None, figure("Its standard deviation; null where it is not known.", "rad/s")
    ]
    rate_rad_s: Annotated[float | None, figure("About a known axis: the rate.", "rad/s", absent=True)] = None
    rate_std_rad_s: Annotated[
        float | None, figure("About a known axis: its standard deviation.", "rad/s", absent=True)
    ] = None
    alpha_rad_s2: Annotated[
        float | None, figure("About a known axis: the angular acceleration.", "rad/s²", absent=True)
    ] = None
    angle_rad: Annotated[float | None, figure("About a known axis: the angle.", "rad", absent=True)] = None
    nis: Annotated[float, figure("Normalised innovation squared.")]
    nis_dof: Annotated[int, figure("Its degrees of freedom.")]
    sign: Annotated[str, figure("Whether the sign of the rate is known, decided or undecided.")]
    noise_scale: Annotated[float | None, figure("How much larger the noise is than stated.", absent=True)] = None
    omega_sign_probability: Annotated[
        float | None, figure("Probability that the sign of the rate is right.", absent=True)
    ] = None
    rest: Annotated[bool | None, figure("True where a block of rest ended.", absent=True)] = None
    health: Annotated[
        list[int] | None,
        figure("Of each channel: 0 used, 1 excluded, 2 missing, 3 saturated, 4 stuck.", absent=True),
    ] = None
    fault: Annotated[dict[str, Any] | None, figure("What was wrong with the line or its channels.", absent=True)] = None


@dataclass(frozen=True)
class SkippedLine(Declared):
    """A line that could not be read, and was skipped."""

    fault: Annotated[str, figure("What was wrong with it.")]


@dataclass(frozen=True)
class StreamLayout:
    """Where the columns of a stream are.

    Parameters
    ----------
    time : int
        Column of ``t_s``.
    channels : tuple of int
        Columns of the array's channels, in its order.
    factors : tuple of float
        Factor of each to m/s².
    gyro : tuple of int
        Columns of the gyro; empty without one.
    width : int
        Number of columns.
    """

    time: int
    channels: tuple[int, ...]
    factors: tuple[float, ...]
    gyro: tuple[int, ...]
    width: int

    @classmethod
    def from_header(
        cls, names: list[str], array: AccelerometerArray, metadata: Mapping[str, Any] | None = None
    ) -> StreamLayout:
        """Find the columns by their names, unit included, as in a recording's CSV file.

        Parameters
        ----------
        names : list of str
            Names of the columns.
        array : AccelerometerArray
            The array.
        metadata : mapping, optional
            ``lsb_m_s2`` is the size of a raw count; else the parts of the array give it.

        Raises
        ------
        InputError
            If a column is missing or its unit is unknown.
        """
        columns = [name.strip() for name in names]
        if "t_s" not in columns:
            start = ",".join(columns)[:80]
            raise InputError(f"the stream's first line lacks t_s; it must name the columns, and reads {start!r}")
        places, factors = [], []
        for channel in array.channels:
            found = [name for name in columns if name.rpartition("_")[0] == channel or name == f"{channel}_m_s2"]
            if not found:
                raise InputError(f"the stream lacks channel {channel} of array {array.name!r}, as {channel}_m_s2")
            unit = found[0][len(channel) + 1 :]
            if unit not in READING_UNITS:
                raise InputError(f"column {found[0]!r}: unknown unit {unit!r}; valid: {', '.join(READING_UNITS)}")
            factor = READING_UNITS[unit]
            if factor is None:
                factor = _count_size(metadata or {}, array, channel)
            places.append(columns.index(found[0]))
            factors.append(factor)
        gyro = (
            tuple(columns.index(name) for name in GYRO_COLUMNS) if all(name in columns for name in GYRO_COLUMNS) else ()
        )
        return cls(columns.index("t_s"), tuple(places), tuple(factors), gyro, len(columns))


def _count_size(metadata: Mapping[str, Any], array: AccelerometerArray, channel: str) -> float:
    """Size of a raw count, m/s²: as the stream states it, else by the channel's part."""
    size = metadata.get("lsb_m_s2")
    if size is None:
        return Part.load(next(chip.part for chip in array.chips if channel in chip.channels), array.part_files).lsb
    if not isinstance(size, int | float) or not 0 < size < np.inf:
        raise InputError(f"the stream's lsb_m_s2 is {size!r}; give the size of one count in m/s²")
    return float(size)


def read_head(lines: Iterable[str]) -> tuple[dict[str, Any], Iterator[str]]:
    """Read the leading ``# key: value`` lines of a stream.

    Returns
    -------
    metadata : dict
        What they state; values are JSON where they can be read as such.
    lines : iterator of str
        The whole stream, those lines included.
    """
    rest = iter(lines)
    head: list[str] = []
    metadata: dict[str, Any] = {}
    for line in rest:
        head.append(line)
        if line.strip() and not line.startswith("#"):
            break
        metadata |= head_line(line)
    return metadata, itertools.chain(head, rest)


def examined_lines(
    lines: Iterable[str], array: AccelerometerArray, rate: float, *, force: bool = False
) -> Iterator[str]:
    """Pass lines on, and examine the samples of the first seconds as a recording once they are there.

    Parameters
    ----------
    lines : iterable of str
        Lines of a stream, from the one that names the columns on.
    array : AccelerometerArray
        The array.
    rate : float
        Nominal sample rate, Hz.
    force : bool
        Whether to go on where the checks refuse the samples (`gfimu.recording.doubts`).
    """
    wanted = min(max(_FEWEST, round(_START_S * rate)), _MOST)
    head: list[str] = []
    samples = 0
    for line in lines:
        if samples <= wanted:
            head.append(line)
            samples += bool(line.strip()) and not line.startswith("#")
            if samples > wanted:  # the line that names the columns is none
                _examine(head, array, rate, force=force)
        yield line
    if samples <= wanted:
        _examine(head, array, rate, force=force)


def _examine(lines: list[str], array: AccelerometerArray, rate: float, *, force: bool) -> None:
    """Check the first samples of a stream; what can't be read is left to the filter."""
    found = [one for one in stream_samples(lines, array) if isinstance(one, StreamSample) and np.isfinite(one.t_s)]
    later = np.diff([one.t_s for one in found], prepend=-np.inf) > 0.0
    kept = [one for one, is_later in zip(found, later, strict=True) if is_later]
    times = np.array([one.t_s for one in kept])
    if len(kept) < _FEWEST or np.any(np.diff(times) <= 0.0):
        return
    readings = np.array([one.readings for one in kept])
    run = Recording.from_arrays(times, readings, array, metadata={"sample_rate_hz": float(rate)})
    examine(run, array, source="the stream's start", force=force)


def filter_stream(
    lines: Iterable[str],
    array: AccelerometerArray,
    errors: SensorErrors,
    period: float,
    settings: FilterSettings | None = None,
    *,
    fuse_gyro: bool = False,
    watched: WatchedRateFilter | None = None,
) -> Iterator[str]:
    """Filter a stream of CSV lines, sample by sample.

    The first line that is no comment names the columns (``t_s``, ``a11_m_s2`` … or raw counts, ``a11_lsb`` …, whose
    size a line ``# lsb_m_s2: …`` before it or the array's part gives). Each estimate is one JSON line:
    ``t_s``, ``omega_rad_s``, ``omega_std_rad_s``, ``nis`` and its degrees of freedom, ``rest`` where a block of rest
    ended, ``sign``, ``noise_scale`` and ``omega_sign_probability`` (from the samples so far; as in an estimate file),
    and ``fault`` where something was wrong with the line or its channels. A line that can't be read is reported and
    skipped. With a filter that watches its channels each line has ``health``, one number per channel of
    the array, and a line with ``event``, ``faults`` and ``text`` comes when a channel is excluded, or used again.

    Parameters
    ----------
    lines : iterable of str
        The stream.
    array : AccelerometerArray
        The array.
    errors : SensorErrors
        Errors of its sensors.
    period : float
        Nominal sample period, s.
    settings : FilterSettings, optional
        Start, quadrature, rest.
    fuse_gyro : bool
        Whether to use the stream's gyro columns.
    watched : WatchedRateFilter, optional
        A filter that watches its channels, in place of one by ``settings``.

    Yields
    ------
    str
        JSON lines.

    Raises
    ------
    InputError
        If the first line doesn't name the columns.
    """
    live = watched or LiveRateFilter(
        array, errors, period, settings, references=[Reference.gyro(errors)] if fuse_gyro else []
    )
    reported: dict[str, Any] = live.report.to_dict()
    for sample in stream_samples(lines, array, gyro=fuse_gyro):
        if isinstance(sample, str):
            yield json.dumps(SkippedLine(sample).to_dict())
            continue
        try:
            found = live.push(sample.t_s, sample.readings, sample.gyro)
        except InputError as error:
            yield json.dumps(SkippedLine(str(error)).to_dict())
            continue
        faults = live.report.to_dict()
        news = {key: value for key, value in faults.items() if value != reported[key]}
        reported = faults
        yield from _lines(found, news, None if watched is None else watched.health)
        if watched is not None:
            yield from (json.dumps(event) for event in watched.take_news())
    yield from _lines(live.finish(), {}, None if watched is None else watched.health)


def stream_samples(
    lines: Iterable[str], array: AccelerometerArray, *, gyro: bool = False
) -> Iterator[StreamSample | str]:
    """Yield the samples of a stream of CSV lines; of a line that can't be read a sentence that says why.

    Parameters
    ----------
    lines : iterable of str
        The stream, as `filter_stream` takes it.
    array : AccelerometerArray
        The array.
    gyro : bool
        Whether the stream's gyro columns are needed.

    Raises
    ------
    InputError
        If the first line doesn't name the columns.
    """
    layout: StreamLayout | None = None
    largest = largest_of_array(array)
    metadata, stream = read_head(lines)
    for line in stream:
        if not line.strip() or line.startswith("#"):
            continue
        try:
            cells = next(csv.reader([line]), [])
        except csv.Error as error:
            yield f"{error}; line skipped"
            continue
        if layout is None:
            layout = StreamLayout.from_header(cells, array, metadata)
            if gyro and not layout.gyro:
                raise InputError(f"the stream lacks {', '.join(GYRO_COLUMNS)}; send them, or leave --gyro out")
            continue
        try:
            values = _numbers(cells, layout)
        except InputError as error:
            yield str(error)
            continue
        readings = values[list(layout.channels)] * layout.factors
        readings[np.abs(readings) > largest] = np.nan  # a corrupt value counts as missing
        yield StreamSample(float(values[layout.time]), readings, values[list(layout.gyro)] if gyro else None)


def _numbers(cells: list[str], layout: StreamLayout) -> np.ndarray:
    """Numbers of one line; an empty cell is a missing reading."""
    if len(cells) != layout.width:
        raise InputError(f"line has {len(cells)} columns, the first line {layout.width}; skipped")
    try:
        return np.array([float(cell) if cell.strip() else np.nan for cell in cells])
    except ValueError as error:
        raise InputError(f"{error}; line skipped") from None


def _lines(found: RateEstimate, faults: dict[str, Any], health: list[int] | None) -> Iterator[str]:
    std, last = found.std, len(found) - 1
    for k in range(len(found)):
        sample = LiveSample(
            t_s=float(found.t_s[k]),
            omega_rad_s=found.omega[k].tolist() if np.isfinite(found.omega[k]).all() else None,
            omega_std_rad_s=std[k].tolist() if np.isfinite(std[k]).all() else None,
            nis=float(found.nis[k]),
            nis_dof=int(found.nis_dof[k]),
            sign=found.sign.state,
            noise_scale=None if found.scale is None else float(found.scale[k]),
            omega_sign_probability=None if found.sign_probability is None else float(found.sign_probability[k]),
            rest=True if found.rest[k] else None,
            health=health,
            fault=faults if faults and k == last else None,
        )
        yield json.dumps(sample.to_dict())
