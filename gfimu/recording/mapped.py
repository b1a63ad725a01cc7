"""Recordings from foreign files by a map of their columns: in SI units, checked like every other recording."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError, warn
from gfimu.base.files.input_file import as_path
from gfimu.base.files.memory import MemorySize, with_memory
from gfimu.recording.carried_array import array_metadata
from gfimu.recording.filtered import filtered_recording, recording_of, rows_between
from gfimu.recording.importing.column_map import UNMAPPED, ColumnMap, load_map
from gfimu.recording.importing.piece import Piece, combined_file, merged_piece, piece_of
from gfimu.recording.importing.readers import read_foreign
from gfimu.recording.importing.readers.tables import table_file
from gfimu.recording.recording import Recording
from gfimu.recording.tables.arrow import ArrowStream

_FEWEST = 50  # samples of two loggers, whose clocks are compared
_SURE = 5.0  # standard deviations from which two clocks differ

__all__ = ["MappedFile", "RecordingLike", "RecordingSource", "mapped_recording", "mapped_reference"]


@dataclass(frozen=True)
class MappedFile(os.PathLike[str]):
    """A foreign file with the column map by which it is read; may be given wherever a path of a recording may.

    Parameters
    ----------
    path : Path
        The file.
    column_map : ColumnMap
        What its columns are.
    others : tuple of Path
        Files of further chips on the same clock, in the order of the array's chips.

    Examples
    --------
    >>> from pathlib import Path
    >>> import gfimu
    >>> gfimu.MappedFile(Path("log.csv"), column_map).read()  # doctest: +SKIP
    """

    path: Path
    column_map: ColumnMap
    others: tuple[Path, ...] = ()

    def __fspath__(self) -> str:
        return str(self.path)

    def __str__(self) -> str:
        return str(self.path)

    def with_memory(self, max_memory: MemorySize | None) -> MappedFile:
        """Return the files with how much memory reading each may take (`gfimu.base.files.memory`)."""
        path, *others = (as_path(with_memory(one, max_memory)) for one in (self.path, *self.others))
        return replace(self, path=path, others=tuple(others))

    def read(self, array: AccelerometerArray | None = None, *, unit: str | None = "m_s2") -> Recording:
        """Return the recording; see `mapped_recording`, and `gfimu.recording.filtered` for a map without columns.

        ``unit`` holds for a map without columns: ``lsb`` keeps raw counts, None keeps them where the file has them.
        """
        if self.column_map.is_own:
            if self.others:
                raise InputError(f"{self.others[0]}: several files need a map of their columns (--map)")
            return filtered_recording(self.path, self.column_map, array=array, unit=unit)
        return mapped_recording([self.path, *self.others], self.column_map, array=array)


RecordingSource = Recording | str | Path | MappedFile | ArrowStream
"""A recording, which its readers return as it is, or what they read one from."""

RecordingLike = RecordingSource | tuple[ArrayLike, ArrayLike]
"""What stands for a recording in the arguments of a command: itself, its file, a table of pandas, polars or pyarrow, or
times (n,), s, with readings (n, c), m/s²."""


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
        A file of any format of `gfimu.recording.importing.readers`, a table of pandas, polars or pyarrow, or one file
        per chip on a common clock: the later ones are interpolated to the times of the first. Or one file per sensor,
        where the map names the later ones as tables.
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
    if isinstance(source, str | Path | list | tuple):
        paths = [source] if isinstance(source, str | Path) else source
        files = [read_foreign(path, chosen.format, chosen.text) for path in paths]
    else:
        files = [table_file(source)]
    whole = combined_file(files, chosen)
    pieces = [piece_of(one, chosen) for one in (files if whole is None else [whole])]
    geometry = array or (AccelerometerArray.load(chosen.array) if chosen.array and len(pieces) == 1 else None)
    for piece in pieces[1:]:
        _refuse_another_clock(pieces[0], piece)
    merged = merged_piece(pieces)
    for note in merged.times.notes:
        warn(note)
    return _recording(merged, chosen, geometry, [file.source for file in files])


def _refuse_another_clock(first: Piece, second: Piece) -> None:
    """Refuse two loggers whose readings agree at other times than their files state."""
    from gfimu.recording.joining.series import ReferenceSeries, align_series

    one, other = (
        ReferenceSeries(
            piece.source,
            piece.times.t_s + piece.times.origin_s - first.times.origin_s,
            piece.reference,
            channels=piece.channels,
        )
        for piece in (first, second)
    )
    if min(len(one.t_s), len(other.t_s)) < _FEWEST:
        return
    found = align_series(one, other)
    if found is None or found.doubts:
        return
    late = found.apart(np.array([-0.5, 0.0, 0.5]) * found.overlap_s + found.middle_s)
    allowed = one.period + other.period + _SURE * found.largest_std  # less is a delay of a filter, not a clock
    if np.abs(late).max() > allowed:
        raise InputError(
            f"{second.source}: its clock is not that of {first.source}: what both read agrees where its times are "
            f"moved by {late[1]:+.5g} ± {found.offset_std:.2g} s (rate error {100.0 * found.rate_error:+.3f} %); "
            f"gfimu join {first.source} {second.source} --map MAP --array ARRAY --out RUN aligns the two"
        )


def mapped_reference(
    path: str | Path, column_map: ColumnMap
) -> tuple[NDArray[np.float64], dict[str, NDArray[np.float64]], float, dict[str, NDArray[np.float64]]]:
    """Read the references, and the channels if it has any, of a foreign file by a map of its columns.

    Returns
    -------
    t_s : ndarray, shape (m,)
        Times, s.
    columns : dict of str to ndarray, shape (m,)
        References by their name, SI.
    origin_s : float
        Time on the file's clock at which ``t_s`` is zero, s.
    channels : dict of str to ndarray, shape (m,)
        Channels by their name, m/s².

    Raises
    ------
    InputError
        As `mapped_recording`; also if the map names no reference and no channel that the file has.
    """
    piece = piece_of(read_foreign(path, column_map.format, column_map.text), column_map)
    if not piece.reference and not piece.channels:
        raise InputError(
            f"{path}: map {column_map.name!r} gives no reference; add one under [reference], as tacho_rad_s"
        )
    for note in piece.times.notes:
        warn(note)
    rows = rows_between(piece.times.t_s, column_map.time, piece.source)
    reference, channels = (
        {name: values[rows] for name, values in one.items()} for one in (piece.reference, piece.channels)
    )
    return piece.times.t_s[rows], reference, piece.times.origin_s, channels


def _recording(piece: Piece, chosen: ColumnMap, array: AccelerometerArray | None, sources: list[str]) -> Recording:
    """Return the recording of a piece, with the channel names of an array."""
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
        columns[f"{UNMAPPED}{'_'.join(name.split())}"] = values
    metadata: dict[str, Any] = {"column_map": chosen.name, "source_files": [Path(source).name for source in sources]}
    if piece.times.origin_s:
        metadata["time_origin_s"] = piece.times.origin_s
    if array is not None:
        metadata |= array_metadata(array)
    if piece.times.dropped:
        metadata["dropped_rows"] = dict(piece.times.dropped)
    recording = recording_of(columns, metadata, chosen, piece.source, array=array)
    return replace(recording, unit_from="column_map")
