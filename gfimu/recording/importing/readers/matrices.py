"""The vectors and matrices of numbers in a file of MATLAB or HDF5 as tables: those of one length belong together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.base.errors import InputError
from gfimu.recording.importing.raw_table import RawFile, RawTable

__all__ = ["gather", "is_gathered", "tables_by_length"]

_MOST_COLUMNS = 64  # of one matrix: what has more is no table of samples


def is_gathered(shape: Sequence[int]) -> bool:
    """Whether numbers of a shape are a vector or a matrix of columns; others are left in the file."""
    lengths = sorted(length for length in shape if length != 1)
    return len(lengths) == 1 or (len(lengths) == 2 and lengths[0] <= _MOST_COLUMNS)


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
    if values.dtype.kind not in "iuf" or values.size < 2 or not is_gathered(values.shape):
        return
    values = np.squeeze(values)
    if values.ndim == 1:
        found[name] = values
    else:
        upright = values if len(values) >= values.shape[1] else values.T
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
