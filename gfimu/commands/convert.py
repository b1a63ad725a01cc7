"""Under `gfimu convert`: a recording in another format."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from gfimu.files.outputs import RECORDING, writes

if TYPE_CHECKING:
    from gfimu.geometry.array import AccelerometerArray
    from gfimu.recording import Recording
    from gfimu.recording.mapped import MappedFile

__all__ = ["convert"]


@writes(reads=("source", "array"), target=RECORDING)
def convert(
    source: Recording | str | Path | MappedFile,
    target: str | Path | None = None,
    *,
    array: AccelerometerArray | str | Path | None = None,
) -> Recording:
    """Read a recording in any format that is known, in m/s², and write it as CSV or Parquet.

    Parameters
    ----------
    source : Recording, str, Path or MappedFile
        The recording, or its file: CSV, Parquet, a MIMU4444 stream, or a foreign file with its column map.
    target : str or Path, optional
        Recording to write, ``.csv`` or ``.parquet``.
    array : AccelerometerArray, str or Path, optional
        Array whose channels must be there; every channel found by default.

    Raises
    ------
    InputError
        If the source can't be read, or the target can't be written where it is asked for.
    """
    from gfimu.commands.opened import as_array
    from gfimu.recording import Recording
    from gfimu.recording.carried_array import carried_array
    from gfimu.recording.formats import open_recording

    drawing = None if array is None else as_array(array)
    recording = source if isinstance(source, Recording) else open_recording(source, array=drawing)
    if drawing is not None:
        recording = recording.carrying(drawing)
    elif "array_toml" in recording.metadata:
        named = os.fspath(source) if isinstance(source, str | os.PathLike) else "the recording"
        carried_array(recording.metadata, source=named)  # a damaged one is not passed on
    if target is not None:
        recording.write(target)
    return recording
