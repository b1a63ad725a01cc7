"""Under `gfimu convert`: a recording in another format."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from gfimu.errors import InputError
from gfimu.files.outputs import EXPORT, writes

if TYPE_CHECKING:
    from gfimu.geometry.array import AccelerometerArray
    from gfimu.importing import ColumnMap
    from gfimu.recording import Recording
    from gfimu.recording.mapped import MappedFile

__all__ = ["convert"]


@writes(reads=("source", "array", "column_map"), target=EXPORT)
def convert(
    source: Recording | str | Path | MappedFile | Sequence[str | Path],
    target: str | Path | None = None,
    *,
    array: AccelerometerArray | str | Path | None = None,
    column_map: ColumnMap | str | Path | None = None,
    map_set: Sequence[str] = (),
    drop: str | Sequence[str] = (),
    table: str | None = None,
) -> Recording:
    """Read a recording in any format that is known, in m/s², and write it as CSV, Parquet, MCAP or EuRoC.

    Parameters
    ----------
    source : Recording, str, Path or MappedFile
        The recording, or its file: CSV, Parquet, a MIMU4444 stream, or a foreign file with its column map;
        one file per chip on a common clock, with a map.
    target : str or Path, optional
        Recording to write: ``.csv`` or ``.parquet``; ``.mcap`` with a topic of ``sensor_msgs/Imu`` per tri-axial chip;
        ``.euroc``, a folder in the layout of EuRoC / ASL.
    array : AccelerometerArray, str or Path, optional
        Array whose channels must be there; every channel found by default.
    column_map : ColumnMap, str or Path, optional
        What the columns of a foreign file are: a map, its name or TOML file (``--map``); see `gfimu.inspect`.
    map_set : sequence of str
        Keys of that map to set, such as ``"time.unit=ms"`` (``--map-set``); without a map they are all of it.
    drop : str or sequence of str
        Rows to leave out, counted and reported: ``corrupt``, ``out_of_range``, ``missing``, ``duplicates``,
        ``unordered`` (see `gfimu.recording.filtered`).
    table : str, optional
        With a map: the table, topic or member of a file that holds several.

    Raises
    ------
    InputError
        If the source can't be read, or the target can't be written where it is asked for.
    """
    from gfimu.commands.opened import as_array, by_map, files_by_map
    from gfimu.recording import Recording
    from gfimu.recording.carried_array import carried_array
    from gfimu.recording.formats import open_recording
    from gfimu.recording.mapped import MappedFile

    drawing = None if array is None else as_array(array)
    given = _given(source)
    changes = [*map_set, *_dropping(drop)]
    if isinstance(given[0], Recording | MappedFile):
        given = [by_map(given[0], None, changes), *given[1:]]
    elif column_map is not None or changes:
        files = [one for one in given if isinstance(one, str | Path)]
        given = [files_by_map(files, column_map, table, changes)]
    if len(given) > 1:
        raise InputError(f"{given[1]}: several files need --map, which says what the columns of each chip's file are")
    recording = given[0] if isinstance(given[0], Recording) else open_recording(given[0], array=drawing)
    if drawing is not None:
        recording = recording.carrying(drawing)
    elif "array_toml" in recording.metadata:
        named = os.fspath(given[0]) if isinstance(given[0], str | os.PathLike) else "the recording"
        carried_array(recording.metadata, source=named)  # a damaged one is not passed on
    if target is not None:
        _write(recording, Path(target))
    return recording


def _dropping(drop: str | Sequence[str]) -> list[str]:
    """Return the change of a column map that leaves rows out."""
    kinds = drop if isinstance(drop, str) else ",".join(drop)
    return [f"drop={kinds}"] if kinds else []


def _write(recording: Recording, target: Path) -> None:
    """Write a recording in the format that the ending of a file says."""
    if target.suffix in {".mcap", ".euroc"}:
        from gfimu.exporting import write_euroc, write_mcap

        (write_mcap if target.suffix == ".mcap" else write_euroc)(target, recording)
    else:
        recording.write(target)


def _given(
    source: Recording | str | Path | MappedFile | Sequence[str | Path],
) -> list[Recording | str | Path | MappedFile]:
    """Return one source or several as a list."""
    return list(source) if isinstance(source, list | tuple) else [source]  # type: ignore[list-item]
