"""Under `gfimu inspect`: what a file of unknown layout seems to hold."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, cast

from gfimu.errors import InputError
from gfimu.files.outputs import COLUMN_MAP, writes

if TYPE_CHECKING:
    from gfimu.files.table import ArrowStream
    from gfimu.importing import Inspection
    from gfimu.recording.mapped import RecordingLike

__all__ = ["inspect"]


@writes(reads=("file",), out=COLUMN_MAP)
def inspect(file: RecordingLike, *, table: str = "", out: str | Path | None = None) -> Inspection:
    """Analyse a file of unknown layout: columns, units, rate, gaps, rails, corrupt values, chips, a map to start from.

    Parameters
    ----------
    file : str, Path, table or Recording
        A table of pandas, polars or pyarrow, a recording, or a file: text, JSON, Parquet, zip of text, Excel, MATLAB,
        HDF5, ULog, MCAP, ROS bag.
    table : str
        Table, topic or member to look at; by default the one with the most accelerations.
    out : str or Path, optional
        Column map to write, ``.toml``.

    Raises
    ------
    InputError
        If the file can't be read, is neither a path nor a table, is a stream of a MIMU4444, which needs no map, or
        holds no accelerations that a map to write could name.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.inspect("log.csv")  # doctest: +SKIP
    """
    from gfimu.commands.opened import is_arrays
    from gfimu.files.atomic_file import write_text
    from gfimu.importing import inspect_file
    from gfimu.recording import Recording
    from gfimu.recording.mimu4444 import is_mimu4444

    if is_arrays(file):
        raise InputError(
            "NumPy arrays: they have no columns to look at; gfimu.Recording.from_arrays(t_s, readings, array, unit=…) "
            "makes a recording of them"
        )
    if isinstance(file, Recording):
        source = file.to_arrow()
    else:
        source = os.fspath(file) if isinstance(file, str | os.PathLike) else cast("ArrowStream", file)
    if isinstance(source, str) and is_mimu4444(source):
        raise InputError(
            f"{file}: a MIMU4444 stream, which needs no column map; gfimu convert {file} run.parquet reads it"
        )
    found = inspect_file(source, table=table)
    if out is not None:
        if found.column_map is None:
            if found.is_own:
                raise InputError(f"{found.source}: {found.reasons[0]}; no map was written")
            raise InputError(f"{found.source}: no three columns that look like accelerations; no map was written")
        write_text(out, found.map_text())
    return found
