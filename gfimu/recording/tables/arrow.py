"""Columns as table objects: a pandas table, or an Arrow stream that polars, pyarrow, DuckDB and others take.

The metadata go with the columns: as ``attrs`` of a pandas table, and as JSON in the schema of an Arrow stream.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

__all__ = ["ArrowStream", "arrow_column", "as_found", "column_type", "from_json", "metadata_of_schema", "numbers"]

_FOREIGN_METADATA = {"ARROW:schema", "pandas"}
_PANDAS_ATTRS = "PANDAS_ATTRS"


@runtime_checkable
class ArrowStream(Protocol):
    """Anything that hands out its columns by the Arrow interface: a table of pandas, polars, pyarrow, DuckDB."""

    def __arrow_c_stream__(self, requested_schema: Any = None) -> Any:
        """Return the columns as a stream."""
        ...


def column_type(values: NDArray[Any]) -> pa.DataType:
    """Return the Arrow type of a column."""
    return pa.array(values).type if values.dtype == object else pa.from_numpy_dtype(values.dtype)


def from_json(text: str) -> Any:
    """Return the value that a metadata text holds; the text itself where it is no JSON."""
    try:
        return json.loads(text)
    except (ValueError, RecursionError):  # also of whole numbers with thousands of digits
        return text


def metadata_of_schema(pairs: Mapping[bytes, bytes] | None) -> dict[str, Any]:
    """Return the metadata that the schema of an Arrow table or a Parquet file holds, also as pandas writes them."""
    texts = {key.decode(errors="replace"): value.decode(errors="replace") for key, value in (pairs or {}).items()}
    found = {key: from_json(text) for key, text in texts.items() if key not in _FOREIGN_METADATA}
    attrs = found.pop(_PANDAS_ATTRS, None)
    return {**attrs, **found} if isinstance(attrs, dict) else found


def numbers(column: pa.Array | pa.ChunkedArray) -> NDArray[np.float64]:
    """Numbers of an Arrow column; nulls become NaN."""
    return np.asarray(as_found(column), dtype=np.float64)


def arrow_column(values: NDArray[Any]) -> pa.Array:
    """Return an array (n,) as an Arrow column; pandas, where installed, is not imported for numbers."""
    if values.dtype.kind in "fiu" and values.dtype.isnative:
        kind = pa.from_numpy_dtype(values.dtype)
        return pa.Array.from_buffers(kind, len(values), [None, pa.py_buffer(np.ascontiguousarray(values))])
    return pa.array(values)


def as_found(column: pa.Array | pa.ChunkedArray) -> NDArray[Any]:
    """Return an Arrow column as an array of its own kind; pandas, where installed, is not imported for numbers."""
    if pa.types.is_float64(column.type) and not column.null_count:
        chunks = column.chunks if isinstance(column, pa.ChunkedArray) else [column]
        return np.concatenate([np.from_dlpack(chunk) for chunk in chunks]) if chunks else np.empty(0)
    if pa.types.is_dictionary(column.type):  # each word once, whatever the number of rows
        whole = column.unify_dictionaries().combine_chunks() if isinstance(column, pa.ChunkedArray) else column
        words = np.array([*whole.dictionary.to_pylist(), None], dtype=object)
        return words[whole.indices.fill_null(len(words) - 1).to_numpy()]
    values = column.to_numpy() if isinstance(column, pa.ChunkedArray) else column.to_numpy(zero_copy_only=False)
    return np.asarray(values)
