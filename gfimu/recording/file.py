"""Reading a recording's file: which columns are channels, references or unknown, and their factors to SI."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.parts.part import Part
from gfimu.array.parts.plausible import MOST_CORRUPT, largest_of_array, largest_of_part, largest_reference
from gfimu.base.errors import CorruptValueWarning, InputError, UnitError, warn
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.recording.carried_array import carried_array
from gfimu.recording.quantities import READING_UNITS, REFERENCE_UNITS, TIME_COLUMNS, reference_quantity
from gfimu.recording.tables.arrow import ArrowStream
from gfimu.recording.tables.column_file import ColumnFile, open_columns
from gfimu.recording.tables.table_columns import TableColumns

__all__ = ["RecordingContent", "read_recording_file"]

_CHANNEL = re.compile(r"([A-Za-z]+[0-9]+)_(.+)")
_TIME_UNIT_LIKE = re.compile(r"(m|u|µ|n)?s|sec|seconds?|min|h|ticks?")
_DEFAULT_LSB = 0.0039 * STANDARD_GRAVITY
_UNITS = ("m_s2", "lsb")
_LARGEST_COUNT = 2.0**31
_LONGEST_TIME = 1e12


@dataclass(frozen=True)
class RecordingContent:
    """What a recording's file holds, in SI (readings in m/s² or raw counts)."""

    t_s: NDArray[np.float64]
    readings: NDArray[np.float64]
    channels: tuple[str, ...]
    reference: Mapping[str, NDArray[np.float64]]
    metadata: Mapping[str, Any]
    extra: Mapping[str, NDArray[Any]]


@dataclass(frozen=True)
class _Column:
    """A column of the file, the name of what it holds, its factor to the unit in memory, its largest value there."""

    source: str
    name: str
    factor: float
    largest: float


def read_recording_file(
    path: str | Path | ArrowStream | ColumnFile,
    array: AccelerometerArray | None,
    unit: str,
    *,
    needs_channels: bool = True,
) -> RecordingContent:
    """Read a CSV or Parquet file block by block, or a table object, into arrays of its final size.

    Parameters
    ----------
    path : str, Path or table
        The file, or a table (see `gfimu.recording.tables.table_columns.TableColumns`).
    array : AccelerometerArray or None
        The array whose channels must be there; None takes every channel found.
    unit : {"m_s2", "lsb"}
        Unit of the readings in memory.
    needs_channels : bool
        Refuse a file of references alone.

    Raises
    ------
    InputError
        As `gfimu.Recording.read`.
    """
    if unit not in _UNITS:
        raise UnitError(f"unknown unit {unit!r} for readings; valid: {', '.join(_UNITS)}")
    table = open_columns(path)
    if "t_s" not in table.names:
        _refuse_other_time_unit(table)
        remedy = table.time_remedy if isinstance(table, TableColumns) else ""
        raise InputError(
            f"{table.file}: column t_s is missing; every recording needs the sample time in seconds"
            + (f"; {remedy}" if remedy else "")
        )
    references = _reference_columns(table)
    channels = _channel_columns(table, array, _own_array(table), unit, needs_channels=needs_channels)
    known = {"t_s", *(column.source for column in (*channels, *references))}

    time = np.empty(table.max_rows)
    readings = np.empty((table.max_rows, len(channels)))
    reference = {column.name: np.empty(table.max_rows) for column in references}
    corrupt = _Corrupt(table)
    filled = 0
    sources = ["t_s", *(column.source for column in (*channels, *references))]
    for times, *values in table.blocks(sources):
        rows = slice(filled, filled + len(times))
        _check_times(table, times, filled, time[filled - 1] if filled else -np.inf)
        time[rows] = times
        targets = [readings[rows, index] for index in range(len(channels))]
        targets += [reference[column.name][rows] for column in references]
        for column, numbers, target in zip((*channels, *references), values, targets, strict=True):
            with np.errstate(over="ignore"):  # what becomes infinite is left out
                np.multiply(numbers, column.factor, out=target)
            corrupt.leave_out(column, target, numbers, filled)
        filled += len(times)
    if filled == 0:
        raise InputError(f"{table.file}: no samples below the header; record again or give another file")
    extra = table.read_as_found([name for name in table.names if name not in known])
    metadata = corrupt.report([column.name for column in channels], int(np.isfinite(readings[:filled]).sum()))
    return RecordingContent(
        time[:filled],
        readings[:filled],
        tuple(column.name for column in channels),
        {name: values[:filled] for name, values in reference.items()},
        metadata,
        extra,
    )


class _Corrupt:
    """Values of a file that can be no measurement: left out, counted by column, the first one remembered."""

    def __init__(self, table: ColumnFile) -> None:
        self._table = table
        self._counts: dict[str, int] = {}
        self._first = ""

    def leave_out(
        self, column: _Column, values: NDArray[np.float64], found: NDArray[np.float64], first_row: int
    ) -> None:
        """Turn impossible ``values``, in the unit in memory, into NaN; ``found`` are the same as the file has them."""
        bad = np.abs(found) > column.largest / column.factor  # false for NaN, a missing value
        if not bad.any():
            return
        if not self._counts:
            row = int(np.argmax(bad))
            self._first = f"{self._table.place(first_row + row)}, column {column.source}: {found[row]:g}"
        values[bad] = np.nan
        self._counts[column.name] = self._counts.get(column.name, 0) + int(bad.sum())

    def report(self, channels: Sequence[str], intact: int) -> dict[str, Any]:
        """Warn of what was left out, and return the metadata with the counts; ``intact`` readings are left.

        Raises `InputError` if most readings were impossible: then it is their unit that is wrong.
        """
        file, metadata = self._table.file, self._table.metadata
        if not self._counts:
            return metadata
        lost = sum(count for name, count in self._counts.items() if name in channels)
        if lost > MOST_CORRUPT * (lost + intact):
            raise InputError(
                f"{file}: {self._first} can't be a reading, as most in this file; check the unit in the column's name, "
                "or leave the cell empty where a value is missing"
            )
        names = ", ".join(f"{name} {count}" for name, count in self._counts.items())
        warn(
            f"{file}: left out {sum(self._counts.values())} corrupt values ({names}), the first at {self._first}",
            CorruptValueWarning,
        )
        before = metadata.get("corrupt_values")
        known = {} if not isinstance(before, dict) else {n: c for n, c in before.items() if isinstance(c, int)}
        return metadata | {"corrupt_values": known | {n: c + known.get(n, 0) for n, c in self._counts.items()}}


def _own_array(table: ColumnFile) -> AccelerometerArray | None:
    """Return the array whose text the file carries; None without one, or where it is damaged."""
    try:
        return carried_array(table.metadata) if "array_toml" in table.metadata else None
    except InputError:
        return None  # reported where the array itself is needed


def _channel_columns(
    table: ColumnFile,
    array: AccelerometerArray | None,
    own: AccelerometerArray | None,
    unit: str,
    *,
    needs_channels: bool,
) -> list[_Column]:
    """Find the columns of the channels; an unknown unit, two units of one channel or a missing one is an error."""
    found: dict[str, tuple[str, str]] = {}
    for name in table.names:
        channel, suffix = _split_channel(name, array or own)
        if channel is None and array is None:
            channel, suffix = _split_channel(name, None)
        if channel is None:
            continue
        if suffix not in READING_UNITS:
            if array is None and not re.fullmatch(r"a[0-9]{2}", channel):
                continue
            valid = ", ".join(f"{channel}_{valid_unit}" for valid_unit in READING_UNITS)
            raise UnitError(f"{table.file}: column {name!r}: unknown unit {suffix!r}; valid: {valid}")
        if channel in found:
            raise InputError(f"{table.file}: channel {channel} appears as {found[channel][0]} and {name}; keep one")
        found[channel] = (name, suffix)
    wanted = tuple(found) if array is None else array.channels
    missing = [f"{channel}_m_s2" for channel in wanted if channel not in found]
    if not wanted and not needs_channels:
        return []
    if not wanted:
        raise InputError(f"{table.file}: no column holds a reading; name them a11_m_s2 … (or _g, _mg, _lsb)")
    if missing:
        raise _missing_channels(table, missing, array)
    largest = _largest_readings(table, array or own, wanted) if unit == "m_s2" else [_LARGEST_COUNT] * len(wanted)
    return [
        _Column(
            found[channel][0], channel, _reading_factor(table, array or own, channel, found[channel][1], unit), most
        )
        for channel, most in zip(wanted, largest, strict=True)
    ]


def _missing_channels(table: ColumnFile, missing: Sequence[str], array: AccelerometerArray | None) -> InputError:
    """Return the error of channels that a table lacks; names without a unit have a remedy of their own."""
    place = "" if array is None else f" of array {array.name!r}"
    if len(missing) == 1:
        found, remedy = f"column {missing[0]}{place} is missing", "add it"
    else:
        shown = ", ".join(missing[:3]) + (f" … ({len(missing)})" if len(missing) > 3 else "")
        found, remedy = f"columns {shown}{place} are missing", "add them"
    bare = [name for name in (one.removesuffix("_m_s2") for one in missing) if name in table.names]
    if bare and isinstance(table, TableColumns):
        remedy = f'{bare[0]} has no unit: gfimu.Recording.from_table(table, array=…, units="m_s2") or "g", "mg", "lsb"'
    elif bare:
        remedy = f"{bare[0]} has no unit: name it {bare[0]}_m_s2, or {bare[0]}_g, {bare[0]}_mg, {bare[0]}_lsb"
    else:
        remedy += " (or _g, _mg, _lsb) or name the array it was made with"
    return InputError(f"{table.file}: {found}; {remedy}")


def _largest_readings(table: ColumnFile, array: AccelerometerArray | None, channels: Sequence[str]) -> list[float]:
    """Return the largest reading that each channel can have, m/s²: by the array's parts, else by the recording's."""
    files = table.metadata.get("parts_toml")
    part = table.metadata.get("part")
    usual = largest_of_part(part if isinstance(part, str) else None, files if isinstance(files, dict) else None)
    by_array = {} if array is None else dict(zip(array.channels, largest_of_array(array).tolist(), strict=True))
    return [by_array.get(channel, usual) for channel in channels]


def _split_channel(name: str, array: AccelerometerArray | None) -> tuple[str | None, str]:
    """Split a column name into the channel and its unit; no channel where it isn't one."""
    if array is not None:
        channel = next((channel for channel in array.channels if name.startswith(f"{channel}_")), None)
        return channel, name[len(channel) + 1 :] if channel else ""
    match = _CHANNEL.fullmatch(name)
    return (match[1], match[2]) if match else (None, "")


def _reading_factor(
    table: ColumnFile, array: AccelerometerArray | None, channel: str, channel_unit: str, unit: str
) -> float:
    """Factor from the file's unit of a channel to the unit in memory."""
    if unit == "lsb":
        if channel_unit != "lsb":
            raise UnitError(f"{table.file}: channel {channel} is in {channel_unit}; raw counts are needed here")
        return 1.0
    factor = READING_UNITS[channel_unit]
    return _lsb_size(table, array, channel) if factor is None else factor


def _lsb_size(table: ColumnFile, array: AccelerometerArray | None, channel: str) -> float:
    """Size of one count, m/s²: from the metadata, the array's part, or the ADXL345's 3.9 mg."""
    if "lsb_m_s2" in table.metadata:
        size = table.metadata["lsb_m_s2"]
        if not isinstance(size, int | float) or not 0 < size < np.inf:
            raise InputError(f"{table.file}: metadata lsb_m_s2 is {size!r}; give the size of one count in m/s²")
        return float(size)
    if array is not None and channel in array.channels:
        chip = next(chip for chip in array.chips if channel in chip.channels)
        return Part.load(chip.part, array.part_files).lsb
    part = table.metadata.get("part")
    if part is not None:
        files = table.metadata.get("parts_toml")
        return Part.load(str(part), files if isinstance(files, dict) else None).lsb
    if "array_toml" in table.metadata:
        carried_array(table.metadata, source=table.file)  # raises: a damaged text is no reason to guess the size
    return _DEFAULT_LSB


def _reference_columns(table: ColumnFile) -> list[_Column]:
    """Find the columns of references; a known quantity in an unknown unit, or twice, is an error."""
    found: dict[str, _Column] = {}
    for name in table.names:
        if name in TIME_COLUMNS.values():
            found[name] = _Column(name, name, 1.0, _LONGEST_TIME)
            continue
        quantity = reference_quantity(name)
        if quantity is None or quantity == "t":
            continue
        units = REFERENCE_UNITS[quantity]
        suffix = name[len(quantity) + 1 :]
        if suffix not in units:
            valid = ", ".join(f"{quantity}_{unit}" for unit in units)
            raise UnitError(f"{table.file}: column {name!r}: unknown unit {suffix!r}; valid: {valid}")
        if quantity in found:
            raise InputError(f"{table.file}: {quantity} appears as {found[quantity].source} and {name}; keep one")
        column = f"{quantity}_{next(iter(units))}"
        found[quantity] = _Column(name, column, units[suffix], largest_reference(column))
    return list(found.values())


def _refuse_other_time_unit(table: ColumnFile) -> None:
    for name in table.names:
        if name.startswith("t_") and _TIME_UNIT_LIKE.fullmatch(name[2:]):
            raise UnitError(f"{table.file}: column {name!r}: unknown unit {name[2:]!r} for the time; valid: t_s")


def _check_times(table: ColumnFile, times: NDArray[np.float64], first_row: int, before: float) -> None:
    """Refuse a sample without a time, or not later than the sample before it."""
    bad = ~(np.abs(times) <= _LONGEST_TIME)
    if bad.any():
        row = int(np.argmax(bad))
        fault = "missing" if np.isnan(times[row]) else f"{times[row]:g}"
        raise InputError(
            f"{table.file}: {table.place(first_row + row)}: t_s is {fault}; every sample needs its time in seconds"
        )
    backwards = np.diff(times, prepend=before) <= 0
    if backwards.any():
        row = int(np.argmax(backwards))
        previous = times[row - 1] if row else before
        raise InputError(
            f"{table.file}: {table.place(first_row + row)}: t_s does not increase "
            f"({previous:.9g} s, then {times[row]:.9g} s); sort by time or drop the repeated samples "
            "(gfimu convert --drop duplicates,unordered)"
        )
