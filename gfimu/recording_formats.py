"""Opening a recording whatever wrote it: the project's CSV and Parquet, or a stream that has an importer."""

from __future__ import annotations

from pathlib import Path

from gfimu.array import AccelerometerArray
from gfimu.carried_array import carried_array, check_all_channels
from gfimu.column_file import open_columns
from gfimu.errors import InputError
from gfimu.mimu4444 import is_mimu4444, read_mimu4444
from gfimu.recording import Recording

__all__ = ["open_recording", "open_run"]


def open_recording(path: str | Path, *, array: AccelerometerArray | None = None) -> Recording:
    """Read a recording from a CSV or Parquet file, or a MIMU4444 stream (told apart by content).

    Raises
    ------
    InputError
        As `gfimu.Recording.read` and `gfimu.mimu4444.read_mimu4444`.
    """
    return read_mimu4444(path) if is_mimu4444(path) else Recording.read(path, array=array)


def open_run(path: str | Path, array: AccelerometerArray | None = None) -> tuple[Recording, AccelerometerArray]:
    """Read a recording together with its array.

    Parameters
    ----------
    path : str or Path
        The recording.
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
    if is_mimu4444(path):
        return read_mimu4444(path), AccelerometerArray.load("mimu4444")
    table = open_columns(path)
    own = carried_array(table.metadata, source=path, beside=Path(path).parent)
    if own is None:
        raise InputError(f"{path}: the recording does not name its array; give it with --array")
    if "array_toml" in table.metadata:
        check_all_channels(table.names, own, path)
    return open_recording(path, array=own), own
