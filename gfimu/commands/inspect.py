"""Show what a file holds (columns, units, rate, gaps, rails, corrupt values, chips) and a column map to start from.

Examples
--------
gfimu inspect log.csv
# Write the column map, edit it, and import with it
gfimu inspect log.csv --out log_map.toml
gfimu convert log.csv run.parquet --map log_map.toml
"""

import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

from gfimu.base.errors import InputError
from gfimu.base.files.outputs import OutputFile
from gfimu.commands import given
from gfimu.commands.shell.declare import Option, command
from gfimu.commands.shell.options import TABLE, file_argument

if TYPE_CHECKING:
    from gfimu.recording.importing import Inspection
    from gfimu.recording.tables.arrow import ArrowStream

__all__ = ["inspect"]

_COLUMN_MAP = OutputFile("a column map", (".toml",))
_FILE = file_argument("Text, gzipped or zipped, JSON, Parquet, Excel, MATLAB, HDF5, ULog, MCAP, ROS bag.", "FILE")
_OUT = Option("Column map to write (.toml), to edit and give as --map.", "FILE", writes=_COLUMN_MAP, what="map")


@command(report=lambda found, values: replace(found, shows_map=values["out"] is None), doing="looking at the file")
def inspect(
    file: Annotated[given.Run, _FILE],
    *,
    table: Annotated[str, TABLE.also(" By default the one with the most accelerations.")] = "",
    out: Annotated["str | Path | None", _OUT] = None,
    max_memory: given.Memory = None,
) -> "Inspection":
    """Analyse a file of unknown layout: columns, units, rate, gaps, rails, corrupt values, chips, a map to start from.

    A table of pandas, polars or pyarrow, or a recording, may stand in place of the file.

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
    from gfimu.base.files.atomic_file import write_text
    from gfimu.base.files.memory import with_memory
    from gfimu.commands.opened import is_arrays
    from gfimu.recording import Recording
    from gfimu.recording.importing import inspect_file
    from gfimu.recording.mimu4444 import is_mimu4444

    if is_arrays(file):
        raise InputError(
            "NumPy arrays: they have no columns to look at; gfimu.Recording.from_arrays(t_s, readings, array, unit=…) "
            "makes a recording of them"
        )
    if isinstance(file, Recording):
        source = file.to_arrow()
    else:
        path = os.fspath(file) if isinstance(file, str | os.PathLike) else None
        source = cast("ArrowStream", file) if path is None else with_memory(path, max_memory)
    if isinstance(source, str | Path) and is_mimu4444(source):
        raise InputError(
            f"{file}: a MIMU4444 stream, which needs no column map; gfimu convert {file} run.parquet reads it"
        )
    found = inspect_file(source, table=table)
    if out is not None:
        if found.column_map is None:
            if found.is_own:
                raise InputError(f"{found.source}: {found.reasons[0]}; no map was written")
            raise InputError(f"{found.source}: no three columns that look like accelerations; no map was written")
        write_text(out, found.map_toml)
    return found
