"""Tables of named columns in CSV or Parquet files, with metadata, read and written block by block.

Both formats carry the same metadata: Parquet as key–value pairs of the file, CSV as leading ``# key: value`` lines;
values are JSON. A block is small against the table, so reading needs no second copy of the data.
"""

from __future__ import annotations

import csv
import os
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import pyarrow as pa
import pyarrow.csv as pa_csv
import pyarrow.parquet as pq
from numpy.typing import NDArray

from gfimu.base.errors import InputError, one_line
from gfimu.base.files.atomic_file import atomic_path
from gfimu.base.files.input_file import check_input, first_bytes
from gfimu.base.files.memory import JSON_GROWS, MemoryLimit
from gfimu.base.files.metadata import schema_metadata, to_json
from gfimu.recording.reading import LONGEST_LINE, MOST_COLUMNS
from gfimu.recording.tables.arrow import (
    ArrowStream,
    arrow_column,
    as_found,
    column_type,
    from_json,
    metadata_of_schema,
    numbers,
)
from gfimu.recording.tables.table_columns import TableColumns

__all__ = ["ColumnFile", "check_columns", "head_line", "open_columns", "open_parquet", "write_columns"]

_BLOCK_BYTES = 1 << 20
_BLOCK_ROWS = 1 << 16
_ROW_GROUP_ROWS = 1 << 18
_NUMBER = 8  # bytes of a number, and of a reference to a word
_OBJECT = 256  # numerical: bytes of a value within lists or tables
_WORD_GROWS = 12  # numerical: bytes of a short word of Python for one of the file
_TEXTS = {pa.string(), pa.large_string(), pa.binary(), pa.large_binary()}
_MISSING = ["", "nan", "NaN", "NAN", "NA", "N/A", "null", "NULL"]


class ColumnFile(Protocol):
    """An open table: its column names, metadata, an upper bound of its rows, and its blocks."""

    names: list[str]
    metadata: dict[str, Any]
    max_rows: int

    @property
    def file(self) -> Path | str:
        """The file, or what messages call the table."""
        ...

    def blocks(self, columns: Sequence[str]) -> Iterator[list[NDArray[np.float64]]]:
        """Yield the named columns as numbers, block by block; missing values are NaN."""
        ...

    def read_as_found(self, columns: Sequence[str]) -> dict[str, NDArray[Any]]:
        """Return columns with the type the file gives them (numbers or text)."""
        ...

    def place(self, row: int) -> str:
        """Say where a row (from 0) stands in the file, for messages."""
        ...


def open_columns(source: str | Path | ArrowStream | ColumnFile) -> ColumnFile:
    """Open a CSV or Parquet file (recognised by content), or a table object.

    Raises
    ------
    InputError
        If the file is missing, empty, binary but not Parquet, damaged, or repeats a column name; or if ``source`` is
        neither a path nor a table.
    """
    if not isinstance(source, str | Path):
        return source if isinstance(source, TableColumns) else TableColumns(source)
    file = check_input(source)
    magic = first_bytes(file, 4)
    if not magic:
        raise InputError(f"{file}: empty file; record again or give another file")
    table: ColumnFile = _ParquetColumns(file) if magic == b"PAR1" else _CsvColumns(file)
    check_columns(file, len(table.names))
    repeated = sorted(name for name, times in Counter(table.names).items() if times > 1)
    if repeated:
        raise InputError(f"{file}: column {_cell(repeated[0])} appears twice; keep one")
    return table


def head_line(line: str) -> dict[str, Any]:
    """Return the metadata of one ``# key: value`` line at the head of a CSV file; empty if it holds none."""
    key, colon, value = line.lstrip("# ").partition(":")
    return {key.strip(): from_json(value.strip())} if colon else {}


def write_columns(path: str | Path, columns: Mapping[str, NDArray[Any]], metadata: Mapping[str, Any]) -> None:
    """Write columns of equal length to a ``.csv`` or ``.parquet`` file, whole or not at all.

    NaN becomes an empty cell in CSV and stays NaN in Parquet; numbers are written so that they read back exactly.

    Raises
    ------
    InputError
        If the extension is neither ``.csv`` nor ``.parquet``, a metadata key can't stand in a CSV line, or the folder
        can't be written to.
    GfimuError
        If writing fails, as on a full disk.
    """
    file = Path(path)
    if file.suffix == ".parquet":
        with atomic_path(file) as temporary:
            _write_parquet(temporary, columns, metadata)
    elif file.suffix == ".csv":
        for key in metadata:
            if key != key.strip() or not key or any(mark in key for mark in ":\r\n"):
                raise InputError(f"{file}: metadata key {key!r} can't stand in a CSV file; rename it")
        with atomic_path(file) as temporary:
            _write_csv(temporary, columns, metadata)
    else:
        raise InputError(f"{file}: unknown file format {file.suffix!r}; use .csv or .parquet")


def _write_parquet(file: Path, columns: Mapping[str, NDArray[Any]], metadata: Mapping[str, Any]) -> None:
    fields = [(name, column_type(values)) for name, values in columns.items()]
    schema = pa.schema(fields, metadata=schema_metadata(metadata))
    # Readings are nearly random in their low bits: a dictionary would only cost time and memory.
    with pq.ParquetWriter(file, schema, compression="zstd", use_dictionary=False, write_page_checksum=True) as writer:
        for rows in _row_blocks(columns, _ROW_GROUP_ROWS):
            writer.write_table(pa.table([arrow_column(values[rows]) for values in columns.values()], schema=schema))


def _write_csv(file: Path, columns: Mapping[str, NDArray[Any]], metadata: Mapping[str, Any]) -> None:
    with file.open("w", encoding="utf-8", newline="") as text:
        for key, value in metadata.items():
            text.write(f"# {key}: {to_json(value)}\n")
        csv.writer(text, lineterminator="\n").writerow(map(one_line, columns))
    options = pa_csv.WriteOptions(include_header=False, quoting_style="needed")
    with file.open("ab") as stream:
        for rows in _row_blocks(columns, _BLOCK_ROWS):
            block = pa.table({name: pa.array(values[rows], from_pandas=True) for name, values in columns.items()})
            pa_csv.write_csv(block, stream, options)


def _row_blocks(columns: Mapping[str, NDArray[Any]], size: int) -> Iterator[slice]:
    n = len(next(iter(columns.values())))
    for start in range(0, n, size):
        yield slice(start, min(start + size, n))


def open_parquet(file: Path) -> pq.ParquetFile:
    """Open a Parquet file whose columns fit into memory; those of text are read as numbers of their words.

    Raises
    ------
    InputError
        If it is damaged, has too many columns, or needs more memory than the limit of the file.
    """
    limit = MemoryLimit.of(file)
    try:
        with file.open("rb") as stream:
            stream.seek(-8, os.SEEK_END)
            footer = int.from_bytes(stream.read(4), "little")
        limit.needs(min(footer, file.stat().st_size) * JSON_GROWS)  # names, and metadata as JSON
        metadata = pq.read_metadata(file)
        check_columns(file, metadata.num_columns)
        fields = list(metadata.schema.to_arrow_schema())
        limit.needs(_parquet_need(metadata, fields))
        # Buffered reading streams pages; without it a whole column chunk would be held beside the data.
        return pq.ParquetFile(
            file,
            metadata=metadata,
            read_dictionary=[one.name for one in fields if one.type in _TEXTS],
            pre_buffer=False,
            buffer_size=1 << 20,
            page_checksum_verification=True,
        )
    except (pa.ArrowException, OSError, UnicodeDecodeError, RecursionError) as error:  # names of columns are UTF-8
        raise InputError(f"{file}: damaged Parquet file ({_first_line(error)}); write it again") from None


def _parquet_need(metadata: pq.FileMetaData, fields: Sequence[pa.Field]) -> int:
    """Return the memory that all columns of a Parquet file take, bytes, by the number of their values.

    The size of the file says little: a packed page may repeat one number a million times.
    """
    need = place = 0
    for field in fields:
        first, place = place, place + _leaves(field.type)
        for leaf in range(first, place):
            if place == first + 1 and not field.type.num_fields and field.type not in _TEXTS:
                need += max(metadata.schema.column(leaf).length, _NUMBER) * metadata.num_rows
                continue
            for group in range(metadata.num_row_groups):
                chunk = metadata.row_group(group).column(leaf)
                if field.type in _TEXTS:  # each different word once
                    need += _NUMBER * chunk.num_values + _WORD_GROWS * chunk.total_uncompressed_size
                else:  # lists and tables in cells: a word may be repeated
                    is_text = chunk.physical_type == "BYTE_ARRAY"
                    need += chunk.num_values * (_OBJECT + (chunk.total_uncompressed_size if is_text else 0))
    return need


def _leaves(kind: pa.DataType) -> int:
    """Return how many columns of numbers or words a column of an Arrow type has."""
    return sum(_leaves(kind.field(place).type) for place in range(kind.num_fields)) or 1


def check_columns(file: Path | str, count: int) -> None:
    """Raise `InputError` for more columns than any recording has."""
    if count > MOST_COLUMNS:
        raise InputError(f"{file}: has {count} columns, more than {MOST_COLUMNS}; write those of the recording")


class _ParquetColumns:
    """Columns of a Parquet file."""

    def __init__(self, file: Path) -> None:
        self.file = file
        self._parquet = open_parquet(file)
        try:
            schema = self._parquet.schema_arrow
            self.names: list[str] = list(schema.names)
        except (pa.ArrowException, UnicodeDecodeError) as error:
            raise self._damaged(error) from None
        self._types = dict(zip(self.names, schema.types, strict=True))
        self.max_rows: int = self._parquet.metadata.num_rows
        self.metadata = metadata_of_schema(self._parquet.metadata.metadata)

    def blocks(self, columns: Sequence[str]) -> Iterator[list[NDArray[np.float64]]]:
        for name in columns:
            kind = self._types[name]
            if not (pa.types.is_floating(kind) or pa.types.is_integer(kind)):
                kind = kind.value_type if pa.types.is_dictionary(kind) else kind
                raise InputError(f"{self.file}: column {name} holds {kind}, not numbers; write it as numbers")
        try:
            for batch in self._parquet.iter_batches(batch_size=_BLOCK_ROWS, columns=list(columns), use_threads=False):
                yield [numbers(batch.column(name)) for name in columns]
        except (pa.ArrowException, OSError) as error:
            raise self._damaged(error) from None

    def read_as_found(self, columns: Sequence[str]) -> dict[str, NDArray[Any]]:
        try:
            return {name: as_found(self._parquet.read(columns=[name]).column(name)) for name in columns}
        except (pa.ArrowException, OSError) as error:
            raise self._damaged(error) from None

    def place(self, row: int) -> str:
        return f"sample {row + 1}"

    def _damaged(self, error: Exception) -> InputError:
        return InputError(f"{self.file}: damaged Parquet file ({_first_line(error)}); write it again")


class _CsvColumns:
    """Columns of a CSV file with optional leading ``# key: value`` lines."""

    def __init__(self, file: Path) -> None:
        self.file = file
        self.metadata: dict[str, Any] = {}
        self._header_lines = 0
        header = ""
        limit, head = MemoryLimit.of(file), 0
        try:
            with file.open(encoding="utf-8-sig") as stream:
                while line := stream.readline(LONGEST_LINE):
                    self._header_lines += 1
                    if len(line) >= LONGEST_LINE:
                        raise InputError(f"{file}: a line is longer than {LONGEST_LINE} characters; write it again")
                    if "\x00" in line:
                        raise self._binary()
                    if line.strip() and not line.startswith("#"):
                        header = line
                        break
                    head += len(line)
                    limit.needs(head * JSON_GROWS, at_least=True)
                    self.metadata |= head_line(line)
        except UnicodeDecodeError:
            raise self._binary() from None
        if not header:
            raise InputError(f"{file}: no header line; the first line must name the columns, such as t_s,a11_m_s2")
        self.names = [name.strip() for name in _cells_of(header.strip(), str(file), skipinitialspace=True)]
        if len(self.names) == 1 and any(mark in header for mark in ";\t"):
            raise InputError(f"{file}: columns are not separated by commas; write it with commas")
        self.max_rows = _count_lines(file) - self._header_lines
        limit.needs(_NUMBER * self.max_rows * len(self.names))

    def blocks(self, columns: Sequence[str]) -> Iterator[list[NDArray[np.float64]]]:
        if self.max_rows == 0:
            return
        convert = pa_csv.ConvertOptions(
            include_columns=list(columns),
            column_types=dict.fromkeys(columns, pa.float64()),
            null_values=_MISSING,
        )
        try:
            with pa_csv.open_csv(self.file, read_options=self._read_options(), convert_options=convert) as reader:
                for batch in reader:
                    yield [numbers(column) for column in batch.columns]
        except (pa.ArrowException, OSError) as error:
            if "Empty CSV" not in str(error):
                raise self._locate(columns, error) from None

    def read_as_found(self, columns: Sequence[str]) -> dict[str, NDArray[Any]]:
        if not columns:  # an empty list of columns means all of them to the CSV reader
            return {}
        read = self._read_options()
        convert = pa_csv.ConvertOptions(include_columns=list(columns), null_values=_MISSING)
        try:
            table = pa_csv.read_csv(self.file, read_options=read, convert_options=convert)
        except pa.ArrowException:
            # A column that turns from numbers to text further down: keep it as text.
            convert.column_types = dict.fromkeys(columns, pa.string())
            try:
                table = pa_csv.read_csv(self.file, read_options=read, convert_options=convert)
            except pa.ArrowException as error:
                raise self._locate(columns, error) from None
        return {name: as_found(table.column(name)) for name in columns}

    def place(self, row: int) -> str:
        samples = -1
        with self.file.open(encoding="utf-8-sig", errors="replace") as stream:
            for number, line in enumerate(stream, start=1):
                samples += number > self._header_lines and bool(line.strip())
                if samples == row:
                    return f"line {number}"
        return f"sample {row + 1}"

    def _read_options(self) -> pa_csv.ReadOptions:
        return pa_csv.ReadOptions(
            column_names=self.names, skip_rows=self._header_lines, block_size=_BLOCK_BYTES, use_threads=False
        )

    def _binary(self) -> InputError:
        return InputError(f"{self.file}: binary data, not a table; give a .csv or .parquet file")

    def _locate(self, columns: Sequence[str], error: Exception) -> InputError:
        """Find the line and column that the CSV reader refused."""
        wanted = {self.names.index(name): name for name in columns}
        with self.file.open(encoding="utf-8-sig", errors="replace", newline=None) as stream:
            for number, line in enumerate(stream, start=1):
                if number <= self._header_lines or not line.strip():
                    continue
                cells = _cells_of(line.rstrip("\r\n").replace("\x00", "�"), f"{self.file}: line {number}")
                if len(cells) != len(self.names):
                    return InputError(
                        f"{self.file}: line {number} has {len(cells)} columns, the header {len(self.names)}; "
                        "the file is cut off or damaged there"
                    )
                for place, name in wanted.items():
                    if cells[place] not in _MISSING and not _is_number(cells[place]):
                        return InputError(
                            f"{self.file}: line {number}, column {name}: {_cell(cells[place])} is not a "
                            "number; leave the cell empty where a value is missing"
                        )
        return InputError(f"{self.file}: not a readable CSV file ({_first_line(error)}); write it again")


def _cells_of(line: str, source: str, *, skipinitialspace: bool = False) -> list[str]:
    """Return the cells of a line of a CSV file."""
    try:
        return next(csv.reader([line], skipinitialspace=skipinitialspace), [])
    except csv.Error as error:
        raise InputError(f"{source}: can't be read as cells ({error}); write it again") from None


def _cell(text: str) -> str:
    """Return the begin of a cell, for messages."""
    return repr(text.strip()[:40])


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return "_" not in cell  # Python reads 1_000 as a number, files don't


def _count_lines(file: Path) -> int:
    """Upper bound of the lines of a file, whatever ends them."""
    feeds = returns = 0
    with file.open("rb") as stream:
        while block := stream.read(_BLOCK_BYTES):
            feeds += block.count(b"\n")
            returns += block.count(b"\r")
    return max(feeds, returns) + 1


def _first_line(error: Exception) -> str:
    return str(error).splitlines()[0][:120] if str(error) else type(error).__name__
