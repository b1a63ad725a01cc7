"""The columns of foreign tables that a map names, in SI units on the times of one clock."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.base.errors import InputError, did_you_mean
from gfimu.recording.importing.clock import Times, times_of
from gfimu.recording.importing.column_map import REFERENCE_KINDS, ColumnMap, ColumnSpec, TimeSpec
from gfimu.recording.importing.raw_table import RawFile, RawTable
from gfimu.recording.importing.recognise import fitting_maps
from gfimu.recording.importing.splitting import split_file
from gfimu.recording.quantities import TIME_COLUMNS
from gfimu.recording.units import factor_of

__all__ = ["Piece", "at_times", "chip_names", "combined_file", "merged_piece", "nearest_rows", "piece_of"]

_GAP = 1.5  # sample periods, from which values are not interpolated
_SLOWER = 1.5  # sample periods of the channels, between the values of a reference that keeps its own times
_NEAR = 0.75  # sample periods, up to which a value belongs to a row


@dataclass(frozen=True)
class Piece:
    """What one file gives: times, and columns in SI on them."""

    source: str
    times: Times
    channels: Mapping[str, NDArray[np.float64]]
    reference: Mapping[str, NDArray[np.float64]]
    other: Mapping[str, NDArray[Any]]


def piece_of(raw: RawFile, chosen: ColumnMap) -> Piece:
    """Return the columns of one file in SI units on the times of its channels.

    A reference that comes less often than the channels keeps its own times (see `nearest_rows`). Other columns of
    another table or with times of their own are interpolated, with a note.
    """
    if chosen.split_by:
        raw = split_file(raw, chosen.split_by, raw.source, wanted=_tables_named(chosen))
    whole = table = _without_first(_table(raw, chosen), chosen.skip_rows, raw.source)
    specs = {**chosen.channels, **chosen.reference}
    if any(spec.has_own_times for spec in specs.values()):
        table = _filled(table, chosen.time.column, [spec.column for spec in chosen.channels.values()])
    times = times_of(table, chosen.time, raw.source, drop=chosen.drop)
    if not len(times.t_s):
        raise InputError(f"{raw.source}: no samples; record again or give another file")
    notes = [*table.notes, *times.notes]
    others: dict[tuple[str, object, float | None], tuple[RawTable, Times]] = {}
    columns: dict[str, NDArray[np.float64]] = {}
    used = {table.find(chosen.time.column)} if chosen.time.column is not None else set()
    used |= {table.find(spec.time) for spec in specs.values() if spec.time is not None}
    interpolated: dict[str, list[str]] = {}
    for name, spec in specs.items():
        kind = "acceleration" if name in chosen.channels else REFERENCE_KINDS[name]
        required = name in chosen.channels and chosen.is_required(name)
        if spec.table and not raw.has(spec.table) and not required:
            notes += [f"{raw.source}: no table {spec.table!r}, so no {name}"] if chosen.is_required(name) else []
            continue
        other = raw.table(spec.table) if spec.table else table
        column = other.find(spec.column)
        if column is None and required:
            raise InputError(f"{raw.source}: table {spec.table!r} has no column {_shown(spec.column)} for {name}")
        if column is None:
            continue
        if other.name == table.name:
            used.add(column)
        if other.name == table.name and not spec.has_own_times:
            columns[name] = _values(table, column, spec, kind, chosen)[times.rows]
            continue
        key = (other.name, spec.time, spec.rate_hz)
        if key not in others:
            others[key] = _own_times(whole if other is table else other, column, spec, chosen, raw.source)
            notes += [note for note in others[key][1].notes if note not in notes]
        rows, theirs = others[key]
        values = _values(rows, column, spec, kind, chosen)[theirs.rows]
        t = theirs.t_s + (theirs.origin_s - times.origin_s)
        if name in TIME_COLUMNS and name in chosen.reference and _is_slower(t, times.t_s):
            columns[name], columns[TIME_COLUMNS[name]] = nearest_rows(times.t_s, t, values)
        else:
            columns[name] = at_times(times.t_s, t, values)
            interpolated.setdefault(other.name if other.name != table.name else "", []).append(name)
    channels = {name: columns[name] for name in chosen.channels if name in columns}
    notes += _interpolation_notes(raw.source, table.name, interpolated)
    silent = _before_the_first(channels)
    if silent:
        notes.append(f"{raw.source}: every channel reads zero up to row {silent}, which counts as missing")
        for values in channels.values():
            values[:silent] = np.nan
    rest = {name: values for name, values in table.columns.items() if name not in used} if chosen.keep_other else {}
    return Piece(
        raw.source,
        replace(times, notes=tuple(notes)),
        channels,
        {name: values for name, values in columns.items() if name not in chosen.channels},
        {name: values[times.rows] for name, values in rest.items()},
    )


def combined_file(files: Sequence[RawFile], chosen: ColumnMap) -> RawFile | None:
    """Return one file with the tables of several, named by file, where the map names all but the first; None else."""
    named = _tables_named(chosen)
    names = [Path(file.source).name for file in files]
    if len(files) < 2 or not all(any(name.endswith(one) for one in named) for name in names[1:]):
        return None
    tables = {
        name if len(one.tables) == 1 else f"{key} of {name}": replace(table, name=name)
        for name, one in zip(names, files, strict=True)
        for key, table in one.tables.items()
    }
    return RawFile(files[0].source, files[0].format, {key: replace(table, name=key) for key, table in tables.items()})


def _tables_named(chosen: ColumnMap) -> set[str]:
    """Return the tables that the map names."""
    specs = (*chosen.channels.values(), *chosen.reference.values())
    return {one for one in (chosen.table, *(spec.table for spec in specs)) if one}


def _own_times(
    table: RawTable, column: str, spec: ColumnSpec, chosen: ColumnMap, source: str
) -> tuple[RawTable, Times]:
    """Return the rows of a table that a column with its own times, or of another table, has, and their times."""
    if not spec.has_own_times:
        return table, times_of(table, chosen.time, source, drop=chosen.drop)
    table = _filled(table, spec.time, [column])
    own = TimeSpec(
        column=spec.time, unit=chosen.time.unit, scale=chosen.time.scale, rate_hz=spec.rate_hz, wrap=chosen.time.wrap
    )
    return table, times_of(table, own, source, drop=chosen.drop)


def _filled(
    table: RawTable,
    time: str | int | tuple[str | int, ...] | None,
    columns: Sequence[str | int | tuple[str | int, ...]],
) -> RawTable:
    """Return the rows of a table that have a time, or, without times, those up to the last one with a value."""
    if time is not None:
        name = table.find(time)
        if name is None:
            return table
        values = table.columns[name]
        kept = np.array([one not in (None, "") for one in values]) if values.dtype == object else ~np.isnan(values)
    else:
        names = [name for column in columns if (name := table.find(column)) is not None]
        known = np.any([np.isfinite(table.numbers(name)) for name in names], axis=0)
        kept = np.arange(len(table)) <= np.max(np.flatnonzero(known), initial=-1)
    return replace(table, columns={name: values[kept] for name, values in table.columns.items()})


def _is_slower(t: NDArray[np.float64], channels: NDArray[np.float64]) -> bool:
    """Whether values at times (k,) come less often than the channels, at times (n,)."""
    if len(t) < 2 or len(channels) < 2:
        return True
    return float(np.median(np.diff(t))) > _SLOWER * float(np.median(np.diff(channels)))


def _interpolation_notes(source: str, table: str, interpolated: Mapping[str, Sequence[str]]) -> list[str]:
    """Say which columns were interpolated, by the table that they come from; empty for the channels' own."""
    where = f" of {table!r}" if table else ""
    return [
        f"{source}: {', '.join(names)}{f' of table {name!r}' if name else ''} interpolated to the sample times{where}"
        for name, names in interpolated.items()
    ]


def nearest_rows(
    t: NDArray[np.float64], times: NDArray[np.float64], values: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Put values at times of their own into the nearest rows of a recording.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Times of the rows, s.
    times, values : ndarray, shape (m,)
        Times, s, and values; NaN where there is none.

    Returns
    -------
    values, times : ndarray, shape (n,)
        Value of each row, and when it was read, s: of several to a row their means, NaN in rows without one and for
        values more than three quarters of a sample period from every row.
    """
    nearest = np.clip(np.searchsorted(t, times), 1, len(t) - 1)
    nearest = nearest - (times - t[nearest - 1] < t[nearest] - times)
    known = (np.abs(t[nearest] - times) <= _NEAR * float(np.median(np.diff(t)))) & np.isfinite(values)
    rows, place = np.unique(nearest[known], return_inverse=True)
    count = np.bincount(place, minlength=len(rows))
    found, read = np.full(len(t), np.nan), np.full(len(t), np.nan)
    found[rows] = np.bincount(place, values[known], minlength=len(rows)) / count
    read[rows] = np.bincount(place, times[known], minlength=len(rows)) / count
    return found, read


def _without_first(table: RawTable, rows: int, source: str) -> RawTable:
    """Return a table without its first rows."""
    if not rows:
        return table
    if rows >= len(table):
        raise InputError(f"{source}: skip_rows = {rows} leaves none of {len(table)} rows; skip fewer")
    return replace(table, columns={name: values[rows:] for name, values in table.columns.items()})


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
    near = did_you_mean(lacking[fewest][0].strip("'"), candidates[fewest].columns)
    hint = f"; it looks like --map {others[0]}" if others else "; gfimu inspect prints a map to start from"
    raise InputError(
        f"{raw.source}: map {chosen.name!r} needs column {', '.join(lacking[fewest])}; "
        f"the file has {has}{near.rstrip('?')}{hint}"
    )


def _lacking(table: RawTable, chosen: ColumnMap) -> list[str]:
    needed = [
        spec.column
        for name, spec in chosen.channels.items()
        if chosen.is_required(name) and spec.table in {"", table.name}
    ]
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


def merged_piece(pieces: Sequence[Piece]) -> Piece:
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
    chips = list(dict.fromkeys(name[:-1] for name in first.channels))
    notes = list(first.times.notes)
    for number, (piece, shift) in enumerate(zip(pieces[1:], shifts[1:], strict=True), start=1):
        notes += piece.times.notes
        notes.append(f"{piece.source}: interpolated to the sample times of {first.source}")
        for name, values in piece.channels.items():
            channels[f"{_chip_name(chips, name[:-1], number)}{name[-1]}"] = at_times(t, piece.times.t_s + shift, values)
    return Piece(
        first.source,
        replace(first.times, t_s=t, notes=tuple(notes)),
        channels,
        {name: values[rows] for name, values in first.reference.items()},
        {name: values[rows] for name, values in first.other.items()},
    )


def chip_names(first: Sequence[str], second: Sequence[str]) -> list[str]:
    """Return names of a second file's channels beside the first one's: its chips are numbered after those."""
    chips = list(dict.fromkeys(name[:-1] for name in first))
    return [f"{_chip_name(chips, name[:-1], 1)}{name[-1]}" for name in second]


def _chip_name(chips: Sequence[str], chip: str, number: int) -> str:
    """Return the name of a chip of the file with that number: after a1 comes a2, after a1 and a2 a3 and a4."""
    letters = chip.rstrip("0123456789")
    digits = chip[len(letters) :]
    return f"{letters}{int(digits or 0) + number * len(chips)}"


def at_times(t: NDArray[np.float64], times: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return values at other times by a cubic spline, (n,); NaN outside and in gaps."""
    known = np.isfinite(values)
    if known.sum() < 4:
        return np.full(len(t), np.nan)
    from scipy.interpolate import CubicSpline  # takes a while, and few recordings need it

    seen, found = times[known], CubicSpline(times[known], values[known])(t)
    after = np.clip(np.searchsorted(seen, t), 1, len(seen) - 1)
    gap = seen[after] - seen[after - 1] > _GAP * np.median(np.diff(times))
    exact = np.minimum(np.abs(seen[after] - t), np.abs(t - seen[after - 1])) < 1e-9
    found[(gap & ~exact) | (t < seen[0] - 1e-9) | (t > seen[-1] + 1e-9)] = np.nan
    return np.asarray(found)
