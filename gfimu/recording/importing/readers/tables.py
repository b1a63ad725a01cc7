"""Files that hold tables by themselves: Parquet, and an archive of text files."""

from __future__ import annotations

import zipfile
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from gfimu.base.errors import InputError
from gfimu.base.files.memory import MemoryLimit, MemoryLimitError
from gfimu.recording.importing.column_map import TextSpec
from gfimu.recording.importing.raw_table import RawFile, RawTable
from gfimu.recording.importing.readers.text import GROWS, table_of_text
from gfimu.recording.reading import parsing
from gfimu.recording.tables.arrow import as_found
from gfimu.recording.tables.column_file import open_parquet
from gfimu.recording.tables.table_columns import TableColumns

__all__ = ["archive_format", "read_archive", "read_arrow", "read_parquet", "table_file"]


def read_parquet(path: Path, text: TextSpec = TextSpec()) -> RawFile:
    """Read a Parquet file."""
    with parsing(path, "Parquet file", "write it again", enforced=False):
        file = open_parquet(path)
        names = (
            file.schema_arrow.names
        )  # one column after the other: in Arrow's form and NumPy's, all take twice as much
        return RawFile(str(path), "parquet", {"": _arrow_table((one, file.read([one]).column(one)) for one in names)})


def read_arrow(path: Path, text: TextSpec = TextSpec()) -> RawFile:
    """Read an Arrow file (Feather 2)."""
    with parsing(path, "Arrow file", "write it again"):  # Arrow's own pools would take memory in advance
        table = pa.ipc.open_file(path.read_bytes(), memory_pool=pa.system_memory_pool()).read_all()
        MemoryLimit.of(path).needs(2 * table.nbytes)
        return RawFile(str(path), "arrow", {"": _arrow_table(zip(table.column_names, table.columns, strict=True))})


def _arrow_table(found: Iterable[tuple[str, pa.ChunkedArray]]) -> RawTable:
    """Return Arrow columns as NumPy's."""
    columns: dict[str, NDArray[Any]] = {}
    for name, column in found:
        kind = column.type
        if pa.types.is_timestamp(kind):
            columns[name] = column.cast(pa.timestamp("ns")).to_numpy().astype("datetime64[ns]")
        elif pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind):
            columns[name] = as_found(column if not pa.types.is_decimal(kind) else column.cast(pa.float64()))
        elif pa.types.is_dictionary(kind):
            columns[name] = as_found(column)
        else:
            columns[name] = np.array(column.to_pylist(), dtype=object)
    return RawTable("", columns)


def table_file(source: Any) -> RawFile:
    """Return a table object of pandas, polars or pyarrow as a file of one table.

    Raises
    ------
    InputError
        If it is no such table, has a column without a name, or repeats one.
    """
    name = TableColumns(source).file
    table = pa.Table.from_pandas(source) if hasattr(source, "reset_index") else pa.table(source)
    return RawFile(name, "table", {"": _arrow_table(zip(table.column_names, table.columns, strict=True))})


def archive_format(path: Path) -> str:
    """Return the format of a zip archive by the names of what is in it.

    Raises
    ------
    InputError
        If it is an OpenDocument spreadsheet, which is not read.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
    except (zipfile.BadZipFile, OSError, ValueError, RuntimeError):  # also of a version that is not implemented
        return "zip"
    if "content.xml" in names:
        raise InputError(f"{path}: an OpenDocument spreadsheet; save it as .xlsx or .csv")
    if any(name.startswith("xl/") for name in names):
        return "excel"
    return "numpy" if names and all(name.endswith(".npy") for name in names) else "zip"


def read_archive(path: Path, text: TextSpec = TextSpec()) -> RawFile:
    """Read the text files of a zip archive, each as a table."""
    limit = MemoryLimit.of(path)
    with parsing(path, "archive", "copy it again", enforced=False), zipfile.ZipFile(path) as archive:
        members = [one for one in archive.infolist() if Path(one.filename).suffix.lower() in {".csv", ".txt", ".tsv"}]
        limit.needs(GROWS * sum(member.file_size for member in members))
        tables = {one.filename: _member(archive.read(one), path, one.filename, text, limit) for one in members}
    found = {name: table for name, table in tables.items() if table is not None}
    if not found:
        raise InputError(f"{path}: no text file with numbers in the archive; unpack it and give the recording")
    return RawFile(str(path), "zip", found)


def _member(data: bytes, path: Path, name: str, text: TextSpec, limit: MemoryLimit) -> RawTable | None:
    try:
        return replace(table_of_text(data, f"{path}/{name}", text, limit), name=name)
    except MemoryLimitError:
        raise
    except InputError:
        return None  # a description, not a table
