"""Columns of a table object (pandas, polars, pyarrow, anything with the Arrow interface), read like those of a file."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from numbers import Number
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from gfimu.base.errors import InputError
from gfimu.recording.tables.arrow import ArrowStream, arrow_column, metadata_of_schema, numbers

__all__ = ["TableColumns"]


class TableColumns:
    """An open table: its column names, metadata and columns (see `gfimu.recording.tables.column_file.ColumnFile`).

    Parameters
    ----------
    source : object
        A pandas table, or anything with ``__arrow_c_stream__``. The index of a pandas table is used where it is named
        ``t_s``, and its ``attrs`` are the metadata; those of other tables are in their schema.

    Raises
    ------
    InputError
        If it is no such table, has a column without a name, or repeats one.

    Attributes
    ----------
    time_remedy : str
        How to make the column ``t_s`` of a pandas table whose index is the time; empty for other tables.
    """

    def __init__(self, source: Any) -> None:
        kind = type(source)
        self.file = f"{kind.__module__.partition('.')[0]} {kind.__name__}".removeprefix("builtins ")
        self.time_remedy = ""
        self._column: Callable[[str], Any]
        self._found: Callable[[str], NDArray[Any]]
        if hasattr(source, "attrs") and hasattr(source, "reset_index"):
            self._open_pandas(source)
        elif isinstance(source, ArrowStream):
            self._open_arrow(source)
        else:
            raise InputError(
                f"{self.file}: neither a path nor a table; give a .csv or .parquet file, a table of pandas, polars "
                "or pyarrow, or times and readings, (t, a)"
            )

    @classmethod
    def of(cls, columns: Mapping[str, NDArray[Any]], metadata: Mapping[str, Any], name: str) -> TableColumns:
        """Open columns in memory under a name for messages."""
        table = cls(pa.table({key: arrow_column(values) for key, values in columns.items()}))
        table.file, table.metadata = name, dict(metadata)
        return table

    def _open_pandas(self, table: Any) -> None:
        if table.index.name == "t_s" and "t_s" not in table.columns:
            table = table.reset_index()
        self.time_remedy = _time_remedy(table)
        self.names: list[str] = self._checked(list(table.columns))
        self.max_rows: int = len(table)
        self.metadata: dict[str, Any] = {str(key): value for key, value in table.attrs.items()}
        self._column = lambda name: pa.array(table[name], from_pandas=True)
        self._found = lambda name: table[name].to_numpy()

    def _open_arrow(self, source: ArrowStream) -> None:
        try:
            table = pa.table(source)
        except (pa.ArrowException, TypeError, ValueError) as error:
            raise InputError(f"{self.file}: can't be read as a table ({str(error).splitlines()[0][:120]})") from None
        self.names = self._checked(table.column_names)
        self.max_rows = table.num_rows
        self.metadata = metadata_of_schema(table.schema.metadata)
        self._column = table.column
        self._found = lambda name: _as_found(table.column(name))

    def rename(self, names: Mapping[str, str]) -> None:
        """Give columns other names, by their present ones.

        Raises
        ------
        InputError
            If there is no such column, or two would have one name.
        """
        missing = [name for name in names if name not in self.names]
        if missing:
            raise InputError(f"{self.file}: column {missing[0]!r} is missing; it has {', '.join(self.names[:20])}")
        former = {names.get(name, name): name for name in self.names}
        column, found = self._column, self._found
        self.names = self._checked([names.get(name, name) for name in self.names])
        self._column = lambda name: column(former[name])
        self._found = lambda name: found(former[name])

    def _checked(self, names: list[Any]) -> list[str]:
        for name in names:
            if not isinstance(name, str):
                raise InputError(f"{self.file}: column {name!r} has no name; name the columns, such as t_s, a11_m_s2")
            if names.count(name) > 1:
                raise InputError(f"{self.file}: column {name!r} appears twice; keep one")
        return names

    def blocks(self, columns: Sequence[str]) -> Iterator[list[NDArray[np.float64]]]:
        """Yield the named columns as numbers, all rows at once; missing values are NaN."""
        if self.max_rows:
            yield [self._numbers(name) for name in columns]

    def read_as_found(self, columns: Sequence[str]) -> dict[str, NDArray[Any]]:
        """Return columns with the type that the table gives them."""
        return {name: self._found(name) for name in columns}

    def place(self, row: int) -> str:
        """Say where a row (from 0) stands, for messages."""
        return f"sample {row + 1}"

    def _numbers(self, name: str) -> NDArray[np.float64]:
        try:
            column = self._column(name)
        except (pa.ArrowException, TypeError, ValueError, OverflowError):
            raise self._no_number(name) from None
        kind = column.type
        if pa.types.is_null(kind):
            return np.full(len(column), np.nan)
        if not (pa.types.is_floating(kind) or pa.types.is_integer(kind)):
            wanted = "give seconds since the first sample" if pa.types.is_temporal(kind) else "write it as numbers"
            raise InputError(f"{self.file}: column {name} holds {kind}, not numbers; {wanted}")
        return numbers(column)

    def _no_number(self, name: str) -> InputError:
        """Find the value of a column of mixed values that is no number."""
        for row, value in enumerate(self._found(name)):
            if value is not None and (isinstance(value, bool) or not isinstance(value, Number)):
                return InputError(
                    f"{self.file}: {self.place(row)}, column {name}: {str(value).strip()[:40]!r} is not a number; "
                    "leave the cell empty where a value is missing"
                )
        return InputError(f"{self.file}: column {name} holds values that are no numbers; write it as numbers")


def _time_remedy(table: Any) -> str:
    """Return how the index of a pandas table becomes the sample time; empty where it is a plain count of rows."""
    kind = table.index.dtype.kind
    if kind in "mM":
        return 'the index holds times: table["t_s"] = (table.index - table.index[0]).total_seconds()'
    return 'the index holds numbers; if they are seconds: table.index.name = "t_s"' if kind == "f" else ""


def _as_found(column: pa.ChunkedArray) -> NDArray[Any]:
    try:
        return np.asarray(column.to_numpy())
    except (pa.ArrowException, NotImplementedError):  # a kind that NumPy has not
        values = np.empty(len(column), dtype=object)
        values[:] = column.to_pylist()
        return values
