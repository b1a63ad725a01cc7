"""What the functions accept in place of an object: a path, or a name of a shipped model."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeGuard, cast

from gfimu.base.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from gfimu.array.array import AccelerometerArray
    from gfimu.base.files.memory import MemorySize
    from gfimu.calibration.result import Calibration
    from gfimu.model.world_model import WorldModel
    from gfimu.recording import Recording
    from gfimu.recording.importing import ColumnMap
    from gfimu.recording.mapped import MappedFile, RecordingLike, RecordingSource
    from gfimu.recording.tables.arrow import ArrowStream

__all__ = [
    "as_array",
    "as_calibrated_run",
    "as_calibration",
    "as_runs",
    "as_source",
    "as_twin",
    "files_by_map",
    "is_arrays",
    "name_of",
    "names_of",
]


def as_array(array: AccelerometerArray | str | Path) -> AccelerometerArray:
    """Return an array given as such, by name, as an array file (.toml), or as the sites of an MJCF file (.xml)."""
    if not isinstance(array, str | Path):
        return array
    from gfimu.array.array import AccelerometerArray, check_chips

    if str(array).endswith(".xml"):
        from sim.rigs.mjcf_array import array_from_mjcf

        drawn = array_from_mjcf(array)
        check_chips(len(drawn.chips), array)
        return drawn

    return AccelerometerArray.load(array)


def as_source(
    recording: RecordingLike,
    array: AccelerometerArray | str | Path | None = None,
    column_map: ColumnMap | str | Path | None = None,
    max_memory: MemorySize | None = None,
) -> RecordingSource:
    """Return what stands for a recording as the readers take it: the one way in for files, tables and arrays.

    Parameters
    ----------
    recording : Recording, str, Path, table, or tuple of arrays
        A recording or a file is returned as it is, a foreign file with its column map where one is given. A table of
        pandas, polars or pyarrow is opened like a file. Times (n,), s, and readings (n, c), m/s², become a recording.
    array : AccelerometerArray, str or Path, optional
        The array, which arrays of numbers need.
    column_map : ColumnMap, str or Path, optional
        The map, its name or file.
    max_memory : int or str, optional
        Memory that reading a file may take (`gfimu.base.files.memory`).

    Raises
    ------
    InputError
        If there is no such map, a key is wrong, or the arrays of numbers have no array or don't fit it.
    """
    from gfimu.base.files.memory import with_memory
    from gfimu.recording import Recording
    from gfimu.recording.importing import load_map
    from gfimu.recording.mapped import MappedFile, mapped_recording
    from gfimu.recording.tables.table_columns import TableColumns

    if is_arrays(recording):
        if column_map is not None:
            raise InputError("a map is for a file or a table; arrays of numbers have no columns to map")
        if array is None:
            raise InputError("NumPy arrays: times and readings do not name their array; give it as array=")
        return Recording.from_arrays(*recording, as_array(array))
    if not isinstance(recording, Recording | str | Path | MappedFile):
        if column_map is None:
            table = recording if isinstance(recording, TableColumns) else TableColumns(recording)
            return cast("RecordingSource", table)
        geometry = None if array is None else as_array(array)
        return mapped_recording(cast("ArrowStream", recording), column_map, array=geometry)
    if isinstance(recording, str | Path):
        recording = with_memory(recording, max_memory)
        return recording if column_map is None else files_by_map([recording], column_map)
    if isinstance(recording, MappedFile):
        bounded = recording.with_memory(max_memory)
        return bounded if column_map is None else replace(bounded, column_map=load_map(column_map))
    if column_map is not None:
        raise InputError("a map is for a file, and this recording has been read already; give its file")
    return recording


def is_arrays(recording: object) -> TypeGuard[tuple[ArrayLike, ArrayLike]]:
    """Whether it is a pair of times and readings."""
    import numpy as np  # here: help and completion must not wait for it

    kinds = (np.ndarray, list)
    return isinstance(recording, tuple) and len(recording) == 2 and all(isinstance(one, kinds) for one in recording)


def files_by_map(files: Sequence[str | Path], column_map: ColumnMap | str | Path) -> MappedFile:
    """Return files of chips on one clock with their column map; raises `InputError` if there is no such map."""
    from gfimu.base.files.input_file import as_path
    from gfimu.recording.importing import load_map
    from gfimu.recording.mapped import MappedFile

    first, *others = (as_path(file) for file in files)
    return MappedFile(first, load_map(column_map), tuple(others))


def as_calibration(calibration: Calibration | str | Path) -> Calibration:
    """Return a calibration given as such or as a file."""
    if not isinstance(calibration, str | Path):
        return calibration
    from gfimu.calibration.result import load_calibration

    return load_calibration(calibration)


def as_calibrated_run(
    recording: RecordingSource,
    array: AccelerometerArray | str | Path | None,
    calibration: Calibration | str | Path | None = None,
) -> tuple[Recording, AccelerometerArray]:
    """Return a recording with its array, corrected by the calibration where there is one.

    Without an array it is the recording's own.
    """
    from gfimu.calibration.run_file import open_calibrated_run

    unit = None if calibration is None else as_calibration(calibration)
    return open_calibrated_run(recording, unit, None if array is None else as_array(array))


def as_twin(twin: WorldModel | str | Path, *, allow_code: bool) -> WorldModel:
    """Return a twin given as such, by name, as a twin file, or as a world model of one's own (``rig.py:function``).

    Raises
    ------
    InputError
        If there is none of that name, it can't be used, or it is a file that names code and may not (``allow_code``).
    """
    if not isinstance(twin, str | Path):
        return twin
    from gfimu.model.own_rig import load_model
    from sim.twin import Twin

    return load_model(twin, allow_code=allow_code) or Twin.load(twin)


def as_runs(recordings: RecordingLike | Sequence[RecordingLike]) -> list[RecordingLike]:
    """Return recordings given as one of them, or as a list or tuple of several."""
    several = isinstance(recordings, list | tuple) and not is_arrays(recordings)
    return list(recordings) if several else [recordings]  # type: ignore[arg-type, list-item]


def name_of(recording: object) -> str:
    """Return the name of a recording's file, for messages; empty for an object."""
    return os.path.basename(os.fspath(recording)) if isinstance(recording, str | os.PathLike) else ""  # noqa: PTH119


def names_of(runs: Sequence[RecordingSource]) -> list[str]:
    """Return names of recordings for people: file names where they distinguish them."""
    paths = [Path(run) if isinstance(run, str | os.PathLike) else None for run in runs]
    short = [f"run {number}" if path is None else path.name for number, path in enumerate(paths, start=1)]
    if len(set(short)) == len(short):
        return short
    return [name if path is None else str(path) for path, name in zip(paths, short, strict=True)]
