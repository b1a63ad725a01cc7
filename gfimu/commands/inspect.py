"""Under `gfimu inspect`: what a file of unknown layout seems to hold."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from gfimu.errors import InputError
from gfimu.files.outputs import COLUMN_MAP, writes

if TYPE_CHECKING:
    from gfimu.importing import Inspection

__all__ = ["inspect"]


@writes(reads=("file",), out=COLUMN_MAP)
def inspect(file: str | Path, *, table: str = "", out: str | Path | None = None) -> Inspection:
    """Analyse a file of unknown layout: columns, units, rate, gaps, rails, corrupt values, chips, a map to start from.

    Parameters
    ----------
    file : str or Path
        Text, JSON, Parquet, zip of text, Excel, MATLAB, HDF5, ULog, MCAP, ROS bag.
    table : str
        Table, topic or member to look at; by default the one with the most accelerations.
    out : str or Path, optional
        Column map to write, ``.toml``.

    Raises
    ------
    InputError
        If it is no path, or the file can't be read, is a stream of a MIMU4444, which needs no map, or holds no
        accelerations that a map to write could name.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.inspect("log.csv")  # doctest: +SKIP
    """
    from gfimu.files.atomic_file import write_text
    from gfimu.importing import inspect_file
    from gfimu.recording.mimu4444 import is_mimu4444

    if not isinstance(file, str | Path):
        raise InputError(
            f"inspect needs the path of a file, not a {type(file).__name__}: the columns of a table have names in "
            "memory; give it to gfimu.Recording.from_table with units=, or write it to a .parquet or .csv file"
        )
    if is_mimu4444(file):
        raise InputError(
            f"{file}: a MIMU4444 stream, which needs no column map; gfimu convert {file} run.parquet reads it"
        )
    found = inspect_file(file, table=table)
    if out is not None:
        if found.column_map is None:
            if found.is_own:
                raise InputError(f"{file}: {found.reasons[0]}; no map was written")
            raise InputError(f"{file}: no three columns that look like accelerations; no map was written")
        write_text(out, found.map_text())
    return found
