"""Recordings from foreign files by a map of their columns: in SI units, checked like every other recording."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from gfimu.errors import InputError, RecordingWarning
from gfimu.files.table import ArrowStream, schema_metadata
from gfimu.files.table_columns import TableColumns
from gfimu.geometry.array import AccelerometerArray
from gfimu.importing.clock import Times, times_of
from gfimu.importing.column_map import REFERENCE_KINDS, ColumnMap, ColumnSpec, load_map
from gfimu.importing.notation import factor_of
from gfimu.importing.raw_table import RawFile, RawTable
from gfimu.importing.readers import read_foreign
from gfimu.importing.readers.tables import arrow_table
from gfimu.importing.recognise import fitting_maps
from gfimu.recording.carried_array import array_metadata
from gfimu.recording.filtered import filtered_recording, rows_between, without_rows
from gfimu.recording.recording import Recording

__all__ = ["MappedFile", "mapped_recording", "mapped_reference"]

_GAP = 1.5  # sample periods, from which values are not interpolated


@dataclass(frozen=True)
class MappedFile(os.PathLike[str]):
    """A foreign file with the map by which it is read; stands wherever a recording's path does.

    Parameters
    ----------
    path : Path
        The file.
    column_map : ColumnMap
        What its columns are.
    others : tuple of Path
        Files of further chips on the same clock, in the order of the array's chips.
    """

    path: Path
    column_map: ColumnMap
    others: tuple[Path, ...] = ()

    def __fspath__(self) -> str:
        return str(self.path)

    def __str__(self) -> str:
        return str(self.path)

    def read(self, array: AccelerometerArray | None = None, *, unit: str | None = "m_s2") -> Recording:
        """Return the recording; see `mapped_recording`, and `gfimu.recording.filtered` for a map without columns.

        ``unit`` holds for a map without columns: ``lsb`` keeps raw counts, None keeps them where the file has them.
        """
        if self.column_map.is_own:
            if self.others:
                raise InputError(f"{self.others[0]}: several files need a map of their columns (--map)")
            return filtered_recording(self.path, self.column_map, array=array, unit=unit)
        return mapped_recording([self.path, *self.others], self.column_map, array=array)


@dataclass(frozen=True)
class _Piece:
    """What one file gives: times, and columns in SI on them."""

    source: str
    times: Times
    channels: Mapping[str, NDArray[np.float64]]
    reference: Mapping[str, NDArray[np.float64]]
    other: Mapping[str, NDArray[Any]]


def mapped_recording(
    source: str | Path | ArrowStream | Sequence[str | Path],
    column_map: ColumnMap | str | Path,
    *,
    array: AccelerometerArray | None = None,
) -> Recording:
    """Read foreign data by a map of their columns.

    Parameters
    ----------
    source : str, Path, table, or sequence of paths
        A file of any format of `gfimu.importing.readers`, a table of pandas, polars or pyarrow, or one file per chip
        on a common clock: the later ones are interpolated to the times of the first.
    column_map : ColumnMap, str or Path
        The map, its name, or its TOML file.
    array : AccelerometerArray, optional
        The array; by default the map's, if it names one. Channels that are named otherwise in the map are taken in
        the array's order.

    Raises
    ------
    InputError
        If the file can't be read, lacks a column of the map, or its times do not increase.
    """
    chosen = load_map(column_map)
    if chosen.is_own and not isinstance(source, list | tuple):
        return filtered_recording(source, chosen, array=array)  # type: ignore[arg-type]
    if not chosen.channels:
        raise InputError(f"map {chosen.name!r} has references only; a recording needs [channels]")
    if isinstance(source, str | Path):
        pieces = [_piece(read_foreign(source, chosen.format, chosen.text), chosen)]
    elif isinstance(source, list | tuple):
        pieces = [_piece(read_foreign(one, chosen.format, chosen.text), chosen) for one in source]
    else:
        table = TableColumns(source)
        pieces = [_piece(RawFile(table.file, "table", {"": _as_raw(source)}), chosen)]
    geometry = array or (AccelerometerArray.load(chosen.array) if chosen.array and len(pieces) == 1 else None)
    merged = _between(_merged(pieces), chosen)
    for note in merged.times.notes:
        warnings.warn(note, RecordingWarning, stacklevel=2)
    return _recording(merged, chosen, geometry, [one.source for one in pieces])


def mapped_reference(
    path: str | Path, column_map: ColumnMap
) -> tuple[NDArray[np.float64], dict[str, NDArray[np.float64]], float]:
    """Read the references alone of a foreign file by a map of its columns.

    Returns
    -------
    t_s : ndarray, shape (m,)
        Times, s.
    columns : dict of str to ndarray, shape (m,)
        References by their name, SI.
    origin_s : float
        Time on the file's clock at which ``t_s`` is zero, s.

    Raises
    ------
    InputError
        As `mapped_recording`; also if the map names no reference that the file has.
    """
    piece = _between(_piece(read_foreign(path, column_map.format, column_map.text), column_map), column_map)
    if not piece.reference:
        raise InputError(
            f"{path}: map {column_map.name!r} gives no reference; add one under [reference], as tacho_rad_s"
        )
    for note in piece.times.notes:
        warnings.warn(note, RecordingWarning, stacklevel=2)
    return piece.times.t_s, dict(piece.reference), piece.times.origin_s


def _as_raw(source: Any) -> RawTable:
    table = pa.Table.from_pandas(source) if hasattr(source, "reset_index") else pa.table(source)
    return arrow_table(table)


def _piece(raw: RawFile, chosen: ColumnMap) -> _Piece:
    """Return the columns of one file in SI units."""
    table = _without_first(_table(raw, chosen), chosen.skip_rows, raw.source)
    times = times_of(table, chosen.time, raw.source, drop=chosen.drop)
    if not len(times.t_s):
        raise InputError(f"{raw.source}: no samples; record again or give another file")
    used = {table.find(chosen.time.column)} if chosen.time.column is not None else set()
    notes = [*table.notes, *times.notes]
    channels = {}
    for name, spec in chosen.channels.items():
        column = table.find(spec.column)
        if column is None:
            continue  # optional, as `_table` has looked for the others
        used.add(column)
        channels[name] = _values(table, column, spec, "acceleration", chosen)[times.rows]
    silent = _before_the_first(channels)
    if silent:
        notes.append(f"{raw.source}: every channel reads zero up to row {silent}, which counts as missing")
        for values in channels.values():
            values[:silent] = np.nan
    reference = {}
    for name, spec in chosen.reference.items():
        other = raw.table(spec.table) if spec.table and spec.table in raw.tables else table
        column = other.find(spec.column)
        if column is None or (spec.table and spec.table not in raw.tables):
            continue
        values = _values(other, column, spec, REFERENCE_KINDS[name], chosen)
        if other is table:
            used.add(column)
            reference[name] = values[times.rows]
        else:
            theirs = times_of(other, chosen.time, raw.source)
            mine = times.t_s + (times.origin_s - theirs.origin_s)
            reference[name] = _at(mine, theirs.t_s, values[theirs.rows])
    rest = {name: values for name, values in table.columns.items() if name not in used} if chosen.keep_other else {}
    return _Piece(
        raw.source,
        replace(times, notes=tuple(notes)),
        channels,
        reference,
        {name: values[times.rows] for name, values in rest.items()},
    )


def _without_first(table: RawTable, rows: int, source: str) -> RawTable:
    """Return a table without its first rows."""
    if not rows:
        return table
    if rows >= len(table):
        raise InputError(f"{source}: skip_rows = {rows} leaves none of {len(table)} rows; skip fewer")
    return replace(table, columns={name: values[rows:] for name, values in table.columns.items()})


def _between(piece: _Piece, chosen: ColumnMap) -> _Piece:
    """Return the samples from the map's ``start_s`` to its ``stop_s`` after the first one."""
    rows = rows_between(piece.times.t_s, chosen.time, piece.source)
    if rows.all():
        return piece
    groups = (
        {name: values[rows] for name, values in one.items()} for one in (piece.channels, piece.reference, piece.other)
    )
    return _Piece(piece.source, replace(piece.times, t_s=piece.times.t_s[rows]), *groups)


def _table(raw: RawFile, chosen: ColumnMap) -> RawTable:
    """Return the table that has all columns that the map needs."""
    candidates = [raw.table(chosen.table)] if chosen.table and len(raw.tables) > 1 else list(raw.tables.values())
    lacking = [_lacking(table, chosen) for table in candidates]
    for table, missing in zip(candidates, lacking, strict=True):
        if not missing:
            return table
    fewest = min(range(len(candidates)), key=lambda place: len(lacking[place]))
    has = ", ".join(repr(name) for name in list(candidates[fewest].columns)[:12])
    others = [name for name in fitting_maps(raw) if name != chosen.name]
    hint = f"; it looks like --map {others[0]}" if others else "; gfimu inspect prints a map to start from"
    raise InputError(
        f"{raw.source}: map {chosen.name!r} needs column {', '.join(lacking[fewest])}; the file has {has}{hint}"
    )


def _lacking(table: RawTable, chosen: ColumnMap) -> list[str]:
    needed = [spec.column for name, spec in chosen.channels.items() if chosen.is_required(name)]
    needed += [spec.column for name, spec in chosen.reference.items() if chosen.is_required(name) and not spec.table]
    if chosen.time.column is not None:
        needed.append(chosen.time.column)
    return [_shown(column) for column in needed if table.find(column) is None]


def _shown(column: str | int | tuple[str | int, ...]) -> str:
    return repr(column) if isinstance(column, str | int) else " or ".join(repr(one) for one in column)


def _values(table: RawTable, column: str, spec: ColumnSpec, kind: str, chosen: ColumnMap) -> NDArray[np.float64]:
    """Return a column in SI units; numbers that stand for a missing value are NaN."""
    numbers = np.array(table.numbers(column))
    for missing in chosen.missing:
        numbers[numbers == missing] = np.nan
    return (numbers - spec.offset) * (spec.scale * factor_of(spec.unit, kind))


def _before_the_first(channels: Mapping[str, NDArray[np.float64]]) -> int:
    """Return how many rows at the start read exactly zero everywhere: the sensor had not measured yet."""
    if not channels:
        return 0
    zero = np.all([values == 0.0 for values in channels.values()], axis=0)
    return 0 if zero.all() else int(np.argmin(zero))


def _merged(pieces: Sequence[_Piece]) -> _Piece:
    """Return one piece with the chips of all: the later ones at the times of the first, where all were measured."""
    first = pieces[0]
    if len(pieces) == 1:
        return first
    start, end = first.times.t_s[0], first.times.t_s[-1]
    shifts = [one.times.origin_s - first.times.origin_s for one in pieces]
    start = max(one.times.t_s[0] + shift for one, shift in zip(pieces, shifts, strict=True))
    end = min(one.times.t_s[-1] + shift for one, shift in zip(pieces, shifts, strict=True))
    rows = (first.times.t_s >= start) & (first.times.t_s <= end)
    if rows.sum() < 2:
        raise InputError(
            f"{pieces[0].source} and {pieces[1].source} have no time in common; files of chips need one clock: "
            "gfimu join finds the offset of two"
        )
    t = first.times.t_s[rows]
    channels = {name: values[rows] for name, values in first.channels.items()}
    chips = _chips(first.channels)
    notes = list(first.times.notes)
    for number, (piece, shift) in enumerate(zip(pieces[1:], shifts[1:], strict=True), start=1):
        notes += piece.times.notes
        notes.append(f"{piece.source}: interpolated to the sample times of {first.source}")
        for name, values in piece.channels.items():
            chip, axis = name[:-1], name[-1]
            channels[f"{_chip_name(chips, chip, number)}{axis}"] = _at(t, piece.times.t_s + shift, values)
    return _Piece(
        first.source,
        replace(first.times, t_s=t, notes=tuple(notes)),
        channels,
        {name: values[rows] for name, values in first.reference.items()},
        {name: values[rows] for name, values in first.other.items()},
    )


def _chips(channels: Mapping[str, Any]) -> list[str]:
    return list(dict.fromkeys(name[:-1] for name in channels))


def _chip_name(chips: Sequence[str], chip: str, number: int) -> str:
    """Return the name of a chip of the file with that number: after a1 comes a2, after a1 and a2 a3 and a4."""
    letters = chip.rstrip("0123456789")
    digits = chip[len(letters) :]
    return f"{letters}{int(digits or 0) + number * len(chips)}"


def _at(t: NDArray[np.float64], times: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return values at other times by a cubic spline, (n,); NaN outside and in gaps."""
    known = np.isfinite(values)
    if known.sum() < 4:
        return np.full(len(t), np.nan)
    seen, found = times[known], CubicSpline(times[known], values[known])(t)
    after = np.clip(np.searchsorted(seen, t), 1, len(seen) - 1)
    gap = seen[after] - seen[after - 1] > _GAP * np.median(np.diff(times))
    exact = np.minimum(np.abs(seen[after] - t), np.abs(t - seen[after - 1])) < 1e-9
    found[(gap & ~exact) | (t < seen[0] - 1e-9) | (t > seen[-1] + 1e-9)] = np.nan
    return np.asarray(found)


def _recording(piece: _Piece, chosen: ColumnMap, array: AccelerometerArray | None, sources: list[str]) -> Recording:
    """Return a recording through the reader of the project's own tables, so that the same checks hold."""
    names = list(piece.channels)
    if array is not None and set(names) != set(array.channels):
        if len(names) != array.n_channels:
            raise InputError(
                f"{piece.source}: the map gives {len(names)} channels ({', '.join(names)}), array {array.name!r} has "
                f"{array.n_channels}; give the array that was recorded with --array, or correct the map"
            )
        names = list(array.channels)
    columns: dict[str, NDArray[Any]] = {"t_s": piece.times.t_s}
    columns |= {f"{name}_m_s2": values for name, values in zip(names, piece.channels.values(), strict=True)}
    columns |= dict(piece.reference)
    for name, values in piece.other.items():
        columns[f"raw_{'_'.join(name.split())}"] = values
    metadata: dict[str, Any] = {"column_map": chosen.name, "source_files": [Path(one).name for one in sources]}
    if piece.times.origin_s:
        metadata["time_origin_s"] = piece.times.origin_s
    if array is not None:
        metadata |= array_metadata(array)
    if piece.times.dropped:
        metadata["dropped_rows"] = dict(piece.times.dropped)
    table = TableColumns(pa.table(dict(columns)).replace_schema_metadata(schema_metadata(metadata)))
    table.file = piece.source
    recording = Recording.read(table, array=array)  # type: ignore[arg-type]
    absent = np.column_stack([np.isnan(values) for values in piece.channels.values()])
    return without_rows(recording, chosen.drop, absent=absent, source=piece.source, array=array)
