"""Opening a recording whatever wrote it: the project's CSV and Parquet, or a stream that has an importer."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import cast

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError
from gfimu.base.files.input_file import is_there
from gfimu.base.files.memory import MemorySize, with_memory
from gfimu.base.plugins import plugins
from gfimu.recording.carried_array import carried_array, check_all_channels
from gfimu.recording.importing.recognise import map_hint
from gfimu.recording.mapped import MappedFile, RecordingSource
from gfimu.recording.mimu4444 import is_mimu4444, read_mimu4444
from gfimu.recording.recording import Recording
from gfimu.recording.tables.arrow import ArrowStream
from gfimu.recording.tables.column_file import ColumnFile, open_columns

__all__ = ["FORMATS", "RecordingFormat", "format_of_recording", "formats", "is_estimate", "open_recording", "open_run"]

_OF_ESTIMATE = {"omega_x_rad_s", "omega_x_std_rad_s", "q_w", "p_x_m_s2"}


@dataclass(frozen=True)
class RecordingFormat:
    """A file format that holds a whole recording, so that no column map is needed.

    Parameters
    ----------
    summary : str
        Program or device that writes such files, one line.
    recognises : callable
        From a path to whether the file is of this format, by its first bytes.
    read : callable
        From a path to a `Recording` that carries its array; raises `InputError` for a file that it can't read.
    """

    summary: str
    recognises: Callable[[str | Path], bool]
    read: Callable[[str | Path], Recording]


FORMATS: Mapping[str, RecordingFormat] = {
    "mimu4444": RecordingFormat("byte stream of a MIMU4444 board", is_mimu4444, read_mimu4444)
}
"""Formats of gfimu by name, besides its own CSV and Parquet."""


def formats() -> dict[str, RecordingFormat]:
    """Return the formats of whole recordings by name, those of other packages (``gfimu.formats``) first."""
    return {**plugins("gfimu.formats", RecordingFormat, FORMATS), **FORMATS}


def format_of_recording(path: object) -> RecordingFormat | None:
    """Return the format that a file is of, or None: a file of gfimu's own, or one that needs a column map."""
    if not isinstance(path, str | Path):
        return None
    return next((one for one in formats().values() if one.recognises(path)), None)


def open_recording(
    path: RecordingSource, *, array: AccelerometerArray | None = None, max_memory: MemorySize | None = None
) -> Recording:
    """Read a recording from a CSV or Parquet file, a MIMU4444 stream, a foreign file with its map, or a table object.

    Parameters
    ----------
    path : str, Path, MappedFile, table or Recording
        The recording; one that is read already is returned as it is.
    array : AccelerometerArray, optional
        The array whose channels must be there; by default every channel found is read.
    max_memory : int or str, optional
        Memory that reading a file may take, bytes or ``"2GB"``; by default four times its size and 500 MB.

    Raises
    ------
    InputError
        As `gfimu.Recording.read`, and the reader of the format.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.open_recording("run.parquet")  # doctest: +SKIP
    """
    if isinstance(path, Recording):
        return path
    if isinstance(path, MappedFile):
        return path.with_memory(max_memory).read(array)
    if isinstance(path, str | Path):
        path = with_memory(path, max_memory)
    whole = format_of_recording(path)
    if whole is not None:
        return whole.read(cast("str | Path", path))
    with _hinting_at_maps(path):
        return Recording.read(path, array=array)


@contextmanager
def _hinting_at_maps(path: str | Path | ArrowStream) -> Iterator[None]:
    """Add to the error of a file that is no recording of gfimu's by which column map it may be read."""
    try:
        yield
    except InputError as error:
        hint = map_hint(path) if isinstance(path, str | Path) and is_there(path) else ""
        if not hint:
            raise
        raise type(error)(f"{error}; {hint}") from None


def open_run(path: RecordingSource, array: AccelerometerArray | None = None) -> tuple[Recording, AccelerometerArray]:
    """Read a recording together with its array.

    Parameters
    ----------
    path : str, Path, MappedFile, table or Recording
        The recording, as `open_recording` takes it.
    array : AccelerometerArray, optional
        The array; by default the one that the recording carries or, as older ones do, names.

    Raises
    ------
    InputError
        As `open_recording`; also if the array is neither given nor in the recording, is damaged there, or does not
        have the channels of the recording.
    """
    if array is not None:
        return open_recording(path, array=array), array
    if isinstance(path, Recording):
        return path, path.own_array()
    if isinstance(path, MappedFile):
        recording = path.read()
        return recording, recording.own_array(f"{path}: the column map names no array; give it with --array")
    whole = format_of_recording(path)
    if whole is not None:
        recording = whole.read(cast("str | Path", path))
        return recording, recording.own_array(f"{path}: the recording does not name its array; give it with --array")
    if isinstance(path, str | Path):
        with _hinting_at_maps(path):
            table_of_file = open_columns(path)
            if set(table_of_file.names) >= _OF_ESTIMATE:
                raise InputError(f"{path}: an estimate, no recording; gfimu view shows it; give its recording here")
            if "t_s" not in table_of_file.names:
                Recording.read(path)  # raises what is missing first of all
            own = _own_array(table_of_file, Path(path).parent)
            return Recording.read(path, array=own), own
    table = open_columns(path)  # an Arrow stream can be read only once
    own = _own_array(table, None)
    return Recording.read(cast("ArrowStream", table), array=own), own


def is_estimate(path: str | Path) -> bool:
    """Whether a file holds an estimate of the motion, as `gfimu estimate` writes them, and no readings."""
    if Path(path).suffix not in {".csv", ".parquet"}:
        return False
    try:
        return set(open_columns(path).names) >= _OF_ESTIMATE
    except InputError:
        return False


def _own_array(table: ColumnFile, beside: Path | None) -> AccelerometerArray:
    """Return the array that a recording carries or names."""
    own = carried_array(table.metadata, source=table.file, beside=beside)
    if own is None:
        way = "with --array" if isinstance(table.file, Path) else "as array="
        raise InputError(f"{table.file}: the recording does not name its array; give it {way}")
    if "array_toml" in table.metadata:
        check_all_channels(table.names, own, table.file)
    return own
