"""Files that hold tables by themselves: Parquet, MATLAB and HDF5, and an archive of text files."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from gfimu.errors import InputError
from gfimu.files.input_file import parsing
from gfimu.files.table_columns import TableColumns
from gfimu.importing.column_map import TextSpec
from gfimu.importing.raw_table import RawFile, RawTable
from gfimu.importing.readers.text import table_of_text
from gfimu.optional_packages import require

__all__ = ["arrow_table", "gather", "read_archive", "read_hdf5", "read_parquet", "table_file", "tables_by_length"]

_MOST_UNPACKED = 64 << 20  # bytes that any archive may unpack to
_MOST_PACKED = 25  # bytes from one packed byte
_MOST_COLUMNS = 64  # of one matrix: what has more is no table of samples


def read_parquet(path: Path, text: TextSpec = TextSpec()) -> RawFile:
    """Read a Parquet file."""
    with parsing(path, "Parquet file", "write it again"):
        return RawFile(str(path), "parquet", {"": arrow_table(pq.read_table(path))})


def arrow_table(table: pa.Table) -> RawTable:
    """Return the columns of an Arrow table."""
    columns: dict[str, NDArray[Any]] = {}
    for name in table.column_names:
        column = table.column(name)
        kind = column.type
        if pa.types.is_timestamp(kind):
            columns[name] = column.cast(pa.timestamp("ns")).to_numpy().astype("datetime64[ns]")
        elif pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind):
            values = column if not pa.types.is_decimal(kind) else column.cast(pa.float64())
            columns[name] = np.array(values.to_numpy())
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
    return RawFile(name, "table", {"": arrow_table(table)})


def read_archive(path: Path, text: TextSpec = TextSpec()) -> RawFile:
    """Read the text files of a zip archive, each as a table."""
    with parsing(path, "archive", "copy it again"), zipfile.ZipFile(path) as archive:
        members = [one for one in archive.namelist() if Path(one).suffix.lower() in {".csv", ".txt", ".tsv"}]
        most = max(_MOST_UNPACKED, _MOST_PACKED * path.stat().st_size)
        if sum(archive.getinfo(one).file_size for one in members) > most:
            raise InputError(f"{path}: unpacks to more than {most >> 20} MB, as no recording does; unpack it and look")
        tables = {one: _member(archive.read(one), path, one, text) for one in members}
    found = {name: table for name, table in tables.items() if table is not None}
    if not found:
        raise InputError(f"{path}: no text file with numbers in the archive; unpack it and give the recording")
    return RawFile(str(path), "zip", found)


def _member(data: bytes, path: Path, name: str, text: TextSpec) -> RawTable | None:
    try:
        return replace(table_of_text(data, f"{path}/{name}", text), name=name)
    except InputError:
        return None  # a description, not a table


def read_hdf5(path: Path, text: TextSpec = TextSpec()) -> RawFile:
    """Read the data sets of an HDF5 file; those of equal length are one table."""
    require(f"{path}: HDF5", "h5py")
    import h5py

    found: dict[str, NDArray[Any]] = {}

    def take(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and item.shape:
            gather(name.replace("/", "."), item[()], found)

    with parsing(path, "HDF5 file", "write it again"), h5py.File(path, "r") as file:
        file.visititems(take)
    return tables_by_length(path, "hdf5", found)


def gather(name: str, value: Any, found: dict[str, NDArray[Any]]) -> None:
    """Collect the columns of a value: a vector, a matrix, a structure of them."""
    if isinstance(value, Mapping):
        for key, item in value.items():
            gather(f"{name}.{key}", item, found)
        return
    values = np.asarray(value)
    if values.dtype.names:
        for key in values.dtype.names:
            gather(f"{name}.{key}", values[key], found)
        return
    if values.dtype.kind not in "iuf" or values.size < 2:
        return
    values = np.squeeze(values)
    if values.ndim == 1:
        found[name] = values
    elif values.ndim == 2:
        upright = values if len(values) >= values.shape[1] else values.T
        if upright.shape[1] <= _MOST_COLUMNS:
            found |= {f"{name}_{place}": column for place, column in enumerate(upright.T, start=1)}


def tables_by_length(path: Path, kind: str, found: Mapping[str, NDArray[Any]]) -> RawFile:
    """Group columns by their length: the samples of one clock belong together."""
    if not found:
        raise InputError(f"{path}: no vector or matrix of numbers; save the readings as one")
    lengths = sorted(
        {len(values) for values in found.values()}, key=lambda n: -sum(len(v) == n for v in found.values())
    )
    tables = {
        f"{length} rows": RawTable(f"{length} rows", {key: v for key, v in found.items() if len(v) == length})
        for length in lengths
    }
    return RawFile(str(path), kind, tables)
