"""Files that hold tables by themselves: Parquet, Arrow, an archive of text files, the sheets of a workbook."""

from __future__ import annotations

import datetime as dt
import zipfile
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from gfimu.base.errors import InputError
from gfimu.base.files.memory import MemoryLimit, MemoryLimitError
from gfimu.base.optional_packages import require
from gfimu.recording.importing.column_map import TextSpec
from gfimu.recording.importing.raw_table import RawFile, RawTable
from gfimu.recording.importing.readers.records import tables_of_json
from gfimu.recording.importing.readers.text import GROWS, table_of_text
from gfimu.recording.reading import parsing
from gfimu.recording.tables.arrow import as_found
from gfimu.recording.tables.column_file import open_parquet
from gfimu.recording.tables.table_columns import TableColumns

__all__ = ["archive_format", "read_archive", "read_arrow", "read_excel", "read_parquet", "table_file"]

_MEMBERS = {".csv", ".txt", ".tsv", ".json"}
_TIMES_SHEET = 5.0  # numerical: memory for a byte of a workbook's XML, unpacked, measured
_ROW = 60  # numerical: bytes of an empty row, of which a file of two rows may state millions


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
    """Read the text and JSON files of a zip archive, each as a table."""
    limit = MemoryLimit.of(path)
    tables: dict[str, RawTable] = {}
    with parsing(path, "archive", "copy it again", enforced=False), zipfile.ZipFile(path) as archive:
        members = [one for one in archive.infolist() if Path(one.filename).suffix.lower() in _MEMBERS]
        limit.needs(GROWS * sum(member.file_size for member in members))
        for one in members:
            tables |= _member(archive.read(one), path, one.filename, text, limit)
    if not tables:
        raise InputError(f"{path}: no text file with numbers in the archive; unpack it and give the recording")
    return RawFile(str(path), "zip", tables)


def _member(data: bytes, path: Path, name: str, text: TextSpec, limit: MemoryLimit) -> dict[str, RawTable]:
    """Return the tables of a file within a file by name; none of a description, which is no table."""
    try:
        if name.lower().endswith(".json"):
            found = tables_of_json(data, f"{path}/{name}", limit)
        else:
            found = {"": table_of_text(data, f"{path}/{name}", text, limit)}
    except MemoryLimitError:
        raise
    except InputError:
        return {}
    names = {key: f"{name} {key}".strip() for key in found}
    return {names[key]: replace(one, name=names[key]) for key, one in found.items()}


def read_excel(path: Path, text: TextSpec = TextSpec()) -> RawFile:
    """Read the sheets of an Excel workbook (xlsx), each as a table."""
    require(f"{path}: an Excel workbook", "openpyxl", instead="save the sheet as CSV")
    import openpyxl

    limit = MemoryLimit.of(path)
    tables: dict[str, RawTable] = {}
    with parsing(path, "workbook", "save the sheet as CSV"):
        with zipfile.ZipFile(path) as archive:
            limit.needs(_TIMES_SHEET * sum(one.file_size for one in archive.infolist()))
        tabs = msgspec.structs.replace(text, separator="tab", decimal=".")
        book = openpyxl.load_workbook(path, read_only=True, data_only=True, keep_links=False)
        for sheet in book.worksheets:
            sheet.reset_dimensions()  # a file may state a million columns; rows are as long as they are
            lines, size = [], 0
            for row in sheet.iter_rows(values_only=True):
                lines.append("\t".join(_cell(one) for one in row))
                size += len(lines[-1]) + _ROW
                limit.needs(GROWS * size, at_least=True)
            tables |= _member("\n".join(lines).encode(), path, sheet.title, tabs, limit)
    if not tables:
        raise InputError(f"{path}: no sheet with numbers in columns; save the recording as CSV")
    return RawFile(str(path), "excel", tables)


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, dt.datetime):
        return value.isoformat(sep=" ")
    return str(value).replace("\t", " ").replace("\n", " ")
