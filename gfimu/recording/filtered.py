"""Recordings with rows left out on request (``drop`` of a column map), each kind counted and reported.

``corrupt``: a channel has a value that can be no measurement, as 1e19. ``out_of_range``: a channel reads more than its
part can. ``missing``: a channel has no value, as in a burst of NaN. ``wrong_read``: a chip or a tachometer has a value
that is zero or a multiple of those around it, as of a misread register or a lost pulse. ``duplicates``: the time of
another row. ``unordered``: a time that goes back, or a wild one. Without the request such values of `corrupt` rows
alone are left out, `missing` ones stay missing, and a recording of gfimu's whose times do not increase is refused.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.parts.plausible import rails_of_array
from gfimu.base.errors import InputError, warn
from gfimu.base.files.metadata import schema_metadata
from gfimu.recording.doubts.judge import doubts_of
from gfimu.recording.importing.clock import increasing_times
from gfimu.recording.importing.column_map import ColumnMap, TimeSpec
from gfimu.recording.importing.recognise import map_hint
from gfimu.recording.mimu4444 import is_mimu4444, read_mimu4444
from gfimu.recording.recording import Recording
from gfimu.recording.tables.arrow import ArrowStream
from gfimu.recording.tables.column_file import open_columns
from gfimu.recording.tables.table_columns import TableColumns

__all__ = ["filtered_recording", "recording_of", "rows_between"]

_SAID = {
    "corrupt": "with a value that can be no measurement",
    "out_of_range": "with a reading beyond the range of its part",
    "missing": "in which a channel has no value",
    "wrong_read": "with a reading that is zero or a multiple of those around it",
}


def filtered_recording(
    source: str | Path | ArrowStream,
    column_map: ColumnMap,
    *,
    array: AccelerometerArray | None = None,
    unit: str | None = "m_s2",
) -> Recording:
    """Read a recording of gfimu's without the rows that a map without columns leaves out.

    Parameters
    ----------
    source : str, Path or table
        As for `gfimu.Recording.read`, or a MIMU4444 stream.
    column_map : ColumnMap
        Its ``drop``, ``skip_rows``, ``time.start_s`` and ``time.stop_s`` count.
    array : AccelerometerArray, optional
        The array whose channels must be there; the recording's own by default.
    unit : {"m_s2", "lsb"} or None
        Unit of the readings in memory; None keeps raw counts where the file has them.

    Raises
    ------
    InputError
        As `gfimu.Recording.read`; also if no rows are left.
    """
    if isinstance(source, str | Path) and is_mimu4444(source):
        recording = read_mimu4444(source)
        recording = recording.slice(min(column_map.skip_rows, len(recording)))
        return _chosen_rows(recording, column_map, np.isnan(recording.readings), str(source), array)
    table = open_columns(source)
    if "t_s" not in table.names:
        hint = map_hint(source) if isinstance(source, str | Path) else ""
        raise InputError(f"{table.file}: column t_s is missing; every recording needs it" + (f"; {hint}" * bool(hint)))
    found = table.read_as_found(table.names)
    times = [block[0] for block in table.blocks(["t_s"])]
    t = (np.concatenate(times) if times else np.empty(0))[column_map.skip_rows :]
    if not len(t):
        raise InputError(f"{table.file}: no samples below the first {column_map.skip_rows}; skip fewer rows")
    kept, metadata = np.ones(len(t), dtype=bool), table.metadata
    if {"duplicates", "unordered"} & set(column_map.drop):
        increasing = increasing_times(t, 0.0, f"{table.file}: column t_s", drop=column_map.drop)
        kept, metadata = increasing.rows, _counted(table.metadata, increasing.dropped)
        for note in increasing.notes:
            warn(note)
    columns = {name: values[column_map.skip_rows :][kept] for name, values in found.items()}
    if unit is None:
        unit = "lsb" if any(name.endswith("_lsb") for name in table.names) else "m_s2"
    return recording_of(columns, metadata, column_map, str(table.file), array=array, unit=unit)


def recording_of(
    columns: Mapping[str, NDArray[Any]],
    metadata: Mapping[str, Any],
    column_map: ColumnMap,
    source: str,
    *,
    array: AccelerometerArray | None,
    unit: str = "m_s2",
) -> Recording:
    """Return columns that are named as in a recording as one, without the rows that a map leaves out.

    They pass the reader of the project's own tables, so that the same checks hold.
    """
    arrow = {name: pa.array(values, from_pandas=True) for name, values in columns.items()}
    table = TableColumns(pa.table(arrow).replace_schema_metadata(schema_metadata(metadata)))
    table.file = source
    recording = Recording.read(table, array=array, unit=unit)  # type: ignore[arg-type]
    names = (next(name for name in columns if name.startswith(f"{channel}_")) for channel in recording.channels)
    absent = np.column_stack([np.isnan(next(iter(table.blocks([name])))[0]) for name in names])
    return _chosen_rows(recording, column_map, absent, source, array)


def _without_rows(
    recording: Recording,
    drop: Collection[str],
    *,
    absent: NDArray[np.bool_],
    source: str,
    array: AccelerometerArray | None = None,
) -> Recording:
    """Return a recording without rows that are corrupt, out of range or lack a value, where that is asked for.

    Parameters
    ----------
    recording : Recording
        As it was read: corrupt values are NaN.
    drop : collection of str
        ``corrupt``, ``out_of_range``, ``missing``, ``wrong_read``; other kinds were left out when the times were read.
    absent : ndarray of bool, shape (n, c)
        Readings that the file itself had not.
    source : str
        The file, for messages.
    array : AccelerometerArray, optional
        The array whose parts state the range; the recording's own by default.

    Raises
    ------
    InputError
        If the range of no part is known, or no rows are left.
    """
    unknown = np.isnan(recording.readings)
    rows = {"corrupt": (unknown & ~absent).any(axis=1), "missing": absent.any(axis=1)}
    if "wrong_read" in drop:
        rows["wrong_read"] = _misread(recording)
    if "out_of_range" in drop:
        rows["out_of_range"] = _out_of_range(recording, array or recording.array, source)
    kept = np.ones(len(recording), dtype=bool)
    counts = {}
    for kind, said in _SAID.items():
        found = rows.get(kind, ~kept) & kept
        if kind not in drop or not found.any():
            continue
        kept &= ~found
        counts[kind] = int(found.sum())
        warn(f"{source}: left out {counts[kind]} rows {said}")
    if not counts:
        return recording
    if not kept.any():
        dead = [name for name, gone in zip(recording.channels, absent.T, strict=True) if gone.all()]
        why = f"; channel {', '.join(dead)} has no value at all" if dead else ""
        raise InputError(
            f"{source}: no rows are left without those to drop ({', '.join(counts)}){why}; drop fewer kinds"
        )
    return replace(
        recording,
        t_s=recording.t_s[kept],
        readings=recording.readings[kept],
        reference={name: values[kept] for name, values in recording.reference.items()},
        extra={name: values[kept] for name, values in recording.extra.items()},
        metadata=_counted(recording.metadata, counts),
    )


def rows_between(t_s: NDArray[np.float64], spec: TimeSpec, source: str) -> NDArray[np.bool_]:
    """Mark the samples (n,) from ``start_s`` to ``stop_s`` after the first one.

    Raises
    ------
    InputError
        If there are none.
    """
    since = t_s - t_s[0]
    rows = np.ones(len(t_s), dtype=bool)
    if spec.start_s is not None:
        rows &= since >= spec.start_s - 1e-9
    if spec.stop_s is not None:
        rows &= since <= spec.stop_s + 1e-9
    if not rows.any():
        raise InputError(
            f"{source}: no samples from time.start_s to time.stop_s; the recording lasts {since[-1]:.6g} s"
        )
    return rows


def _chosen_rows(
    recording: Recording,
    column_map: ColumnMap,
    absent: NDArray[np.bool_],
    source: str,
    array: AccelerometerArray | None,
) -> Recording:
    rows = np.flatnonzero(rows_between(recording.t_s, column_map.time, source))
    first, stop = int(rows[0]), int(rows[-1]) + 1
    taken = recording.slice(first, stop)
    return _without_rows(taken, column_map.drop, absent=absent[first:stop], source=source, array=array)


def _misread(recording: Recording) -> NDArray[np.bool_]:
    """Mark the rows (n,) in which a register of a chip, or a reference rate, was misread."""
    found = np.zeros(len(recording), dtype=bool)
    for one in doubts_of(recording):
        if one.kind == "wrong_read":
            found[one.rows] = True
    return found


def _out_of_range(recording: Recording, array: AccelerometerArray | None, source: str) -> NDArray[np.bool_]:
    """Mark the rows (n,) in which a channel reads more than its part can."""
    if recording.unit != "m_s2" or array is None:
        raise InputError(f"{source}: to drop out_of_range, give the array with --array; its parts state their range")
    rails = dict(zip(array.channels, rails_of_array(array), strict=True))
    most = np.array([rails.get(name, np.inf) for name in recording.channels])
    if np.isinf(most).all():
        raise InputError(f"{source}: to drop out_of_range, add full_range_m_s2 to the array's part file")
    return np.asarray((np.abs(recording.readings) > most).any(axis=1))


def _counted(metadata: Mapping[str, Any], counts: Mapping[str, int]) -> dict[str, Any]:
    """Return metadata with the counts of dropped rows added to those that are there."""
    if not counts:
        return dict(metadata)
    before = metadata.get("dropped_rows")
    known = dict(before) if isinstance(before, Mapping) else {}
    return {**metadata, "dropped_rows": known | {kind: known.get(kind, 0) + n for kind, n in counts.items()}}
