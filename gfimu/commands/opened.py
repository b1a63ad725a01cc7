"""What the functions accept in place of an object: a path, or a name of a shipped model."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias, TypeGuard, cast

from gfimu.base.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from gfimu.array.array import AccelerometerArray
    from gfimu.base.files.memory import MemorySize
    from gfimu.calibration.result import Calibration
    from gfimu.model.world_model import WorldModel
    from gfimu.recording import Recording
    from gfimu.recording.importing import ColumnMap
    from gfimu.recording.mapped import MappedFile, RecordingLike
    from gfimu.recording.tables.arrow import ArrowStream

Source: TypeAlias = "Recording | str | Path | MappedFile | ArrowStream"
"""A recording, or what its readers take."""

__all__ = [
    "Source",
    "array_of",
    "as_array",
    "as_arrays",
    "as_calibration",
    "as_run",
    "as_runs",
    "as_source",
    "as_twin",
    "files_by_map",
    "is_arrays",
    "name_of",
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


def as_arrays(
    arrays: AccelerometerArray | str | Path | Sequence[AccelerometerArray | str | Path],
) -> list[AccelerometerArray]:
    """Return one or several arrays, each given as `as_array` takes it."""
    from gfimu.array.array import AccelerometerArray

    return [as_array(one) for one in ([arrays] if isinstance(arrays, AccelerometerArray | str | Path) else arrays)]


def array_of(recording: Recording) -> AccelerometerArray:
    """Return the array that a recording carries.

    Raises
    ------
    InputError
        If it carries none, or names one that is not known here.
    """
    array = recording.array
    if array is None:
        raise InputError("the recording does not carry its array; give it as array")
    return array


def as_run(recording: Source, array: AccelerometerArray | str | Path | None) -> tuple[Recording, AccelerometerArray]:
    """Return a recording with its array; the recording's own array if none is given."""
    from gfimu.recording import Recording
    from gfimu.recording.formats import open_run

    drawing = None if array is None else as_array(array)
    if isinstance(recording, Recording):
        return recording, drawing or array_of(recording)
    return open_run(recording, drawing)


def as_source(
    recording: RecordingLike,
    array: AccelerometerArray | str | Path | None = None,
    column_map: ColumnMap | str | Path | None = None,
    max_memory: MemorySize | None = None,
) -> Source:
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
    from gfimu.recording.mapped import MappedFile

    if is_arrays(recording):
        return _of_arrays(recording, array, mapped=column_map is not None)
    if not isinstance(recording, Recording | str | Path | MappedFile):
        return _of_table(recording, array, column_map)
    if isinstance(recording, str | Path):
        recording = with_memory(recording, max_memory)
        return recording if column_map is None else files_by_map([recording], column_map)
    if isinstance(recording, MappedFile):
        recording = recording.with_memory(max_memory)
    if column_map is None:
        return recording
    if isinstance(recording, MappedFile):
        from gfimu.recording.importing import load_map

        return replace(recording, column_map=load_map(column_map))
    raise InputError("a map is for a file, and this recording has been read already; give its file")


def is_arrays(recording: object) -> TypeGuard[tuple[ArrayLike, ArrayLike]]:
    """Whether it is a pair of times and readings."""
    import numpy as np  # here: help and completion must not wait for it

    kinds = (np.ndarray, list)
    return isinstance(recording, tuple) and len(recording) == 2 and all(isinstance(one, kinds) for one in recording)


def _of_arrays(
    recording: tuple[ArrayLike, ArrayLike], array: AccelerometerArray | str | Path | None, *, mapped: bool
) -> Recording:
    from gfimu.recording import Recording

    if mapped:
        raise InputError("a map is for a file or a table; arrays of numbers have no columns to map")
    if array is None:
        raise InputError("NumPy arrays: times and readings do not name their array; give it as array=")
    return Recording.from_arrays(*recording, as_array(array))


def _of_table(
    table: object,
    array: AccelerometerArray | str | Path | None,
    column_map: ColumnMap | str | Path | None,
) -> Source:
    from gfimu.recording.tables.table_columns import TableColumns

    if column_map is None:
        return cast("Source", table if isinstance(table, TableColumns) else TableColumns(table))
    from gfimu.recording.importing import load_map
    from gfimu.recording.mapped import mapped_recording

    chosen = load_map(column_map)
    return mapped_recording(cast("ArrowStream", table), chosen, array=None if array is None else as_array(array))


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
    recording: Source,
    array: AccelerometerArray | str | Path | None,
    calibration: Calibration | str | Path | None,
) -> tuple[Recording, AccelerometerArray]:
    """Return recording and array, corrected by the calibration where there is one."""
    from gfimu.calibration.run_file import open_calibrated_run
    from gfimu.recording import Recording

    if calibration is None:
        return as_run(recording, array)
    unit = as_calibration(calibration)
    if isinstance(recording, Recording):
        run, geometry = as_run(recording, array)
        return unit.apply(run), unit.calibrated_array(geometry)
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
