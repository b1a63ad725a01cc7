"""The columns of foreign tables that a map names, in SI units on the times of one clock."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.errors import InputError
from gfimu.importing.clock import Times, times_of
from gfimu.importing.column_map import REFERENCE_KINDS, ColumnMap, ColumnSpec
from gfimu.importing.notation import factor_of
from gfimu.importing.raw_table import RawFile, RawTable
from gfimu.importing.recognise import fitting_maps
from gfimu.importing.splitting import split_file

__all__ = ["Piece", "at_times", "merged_piece", "piece_of"]

_GAP = 1.5  # sample periods, from which values are not interpolated


@dataclass(frozen=True)
class Piece:
    """What one file gives: times, and columns in SI on them."""

    source: str
    times: Times
    channels: Mapping[str, NDArray[np.float64]]
    reference: Mapping[str, NDArray[np.float64]]
    other: Mapping[str, NDArray[Any]]


def piece_of(raw: RawFile, chosen: ColumnMap) -> Piece:
    """Return the columns of one file in SI units, those of other tables of it at the times of the first."""
    if chosen.split_by:
        raw = split_file(raw, chosen.split_by, raw.source)
    table = _without_first(_table(raw, chosen), chosen.skip_rows, raw.source)
    times = times_of(table, chosen.time, raw.source, drop=chosen.drop)
    if not len(times.t_s):
        raise InputError(f"{raw.source}: no samples; record again or give another file")
    notes = [*table.notes, *times.notes]
    others: dict[str, Times] = {}
    columns: dict[str, NDArray[np.float64]] = {}
    used = {table.find(chosen.time.column)} if chosen.time.column is not None else set()
    for name, spec in {**chosen.channels, **chosen.reference}.items():
        kind = "acceleration" if name in chosen.channels else REFERENCE_KINDS[name]
        required = name in chosen.channels and chosen.is_required(name)
        if spec.table and not raw.has(spec.table) and not required:
            continue
        other = raw.table(spec.table) if spec.table else table
        column = other.find(spec.column)
        if column is None and required:
            raise InputError(f"{raw.source}: table {spec.table!r} has no column {_shown(spec.column)} for {name}")
        if column is None:
            continue
        values = _values(other, column, spec, kind, chosen)
        if other.name == table.name:
            used.add(column)
            columns[name] = values[times.rows]
            continue
        if other.name not in others:
            others[other.name] = times_of(other, chosen.time, raw.source, drop=chosen.drop)
            notes += [note for note in others[other.name].notes if note not in notes]
        theirs = others[other.name]
        columns[name] = at_times(times.t_s + (times.origin_s - theirs.origin_s), theirs.t_s, values[theirs.rows])
    channels = {name: columns[name] for name in chosen.channels if name in columns}
    if any(spec.table and spec.table != table.name for spec in chosen.channels.values()):
        notes.append(f"{raw.source}: chips of other tables are interpolated to the sample times of {table.name!r}")
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
        {name: columns[name] for name in chosen.reference if name in columns},
        {name: values[times.rows] for name, values in rest.items()},
    )


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
    hint = f"; it looks like --map {others[0]}" if others else "; gfimu inspect prints a map to start from"
    raise InputError(
        f"{raw.source}: map {chosen.name!r} needs column {', '.join(lacking[fewest])}; the file has {has}{hint}"
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
    chips = _chips(first.channels)
    notes = list(first.times.notes)
    for number, (piece, shift) in enumerate(zip(pieces[1:], shifts[1:], strict=True), start=1):
        notes += piece.times.notes
        notes.append(f"{piece.source}: interpolated to the sample times of {first.source}")
        for name, values in piece.channels.items():
            chip, axis = name[:-1], name[-1]
            channels[f"{_chip_name(chips, chip, number)}{axis}"] = at_times(t, piece.times.t_s + shift, values)
    return Piece(
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
