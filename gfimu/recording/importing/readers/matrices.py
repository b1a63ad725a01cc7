"""The vectors and matrices of numbers of MATLAB, HDF5 and NumPy as tables: those of one length belong together."""

from __future__ import annotations

import itertools
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.base.errors import InputError
from gfimu.base.files.memory import MemoryLimit
from gfimu.recording.importing.column_map import TextSpec
from gfimu.recording.importing.raw_table import RawFile, RawTable
from gfimu.recording.reading import parsing

__all__ = ["Gathered", "is_gathered", "read_numpy"]

_MOST_COLUMNS = 64  # of one matrix: what has more is no table of samples
_LONGEST_WORDS = 200  # numerical: characters of a text that may state something about the samples
_MOST_LINES = 100  # numerical: of what is stated


def is_gathered(shape: Sequence[int]) -> bool:
    """Whether numbers of a shape are a vector or a matrix of columns; others are left in the file."""
    lengths = sorted(length for length in shape if length != 1)
    return len(lengths) == 1 or (len(lengths) == 2 and lengths[0] <= _MOST_COLUMNS)


@dataclass
class Gathered:
    """What the values of a file hold: matrices of one sample per row, and lines of what single values state."""

    matrices: dict[str, NDArray[Any]] = field(default_factory=dict)
    lines: list[str] = field(default_factory=list)

    def add(self, name: str, value: Any) -> None:
        """Collect a value: a vector, a matrix, a structure or a list of them; a single number or a text as a line."""
        if isinstance(value, list) and value and all(isinstance(one, Mapping) for one in value):
            by_key = {key: [np.asarray(one.get(key)) for one in value] for key in value[0]}
            alike = {key for key, parts in by_key.items() if len({part.shape for part in parts}) == 1}
            stacked = {key for key in alike if by_key[key][0].size < len(value)}
            value = {
                key: np.stack(parts) if key in stacked else dict(zip(map(str, itertools.count(1)), parts, strict=False))
                for key, parts in by_key.items()
            }
        if isinstance(value, Mapping):
            for key, item in value.items():
                self.add(f"{name}.{key}".lstrip("."), item)
            return
        values = np.asarray(value)
        if values.dtype.names:
            self.add(name, {key: values[key] for key in values.dtype.names})
        elif values.size == 1 and values.dtype.kind in "iufUS" and len(self.lines) < _MOST_LINES:
            self.lines.append(f"{name}: {str(values.item())[:_LONGEST_WORDS]}")
        elif values.dtype.kind in "iuf" and values.size > 1 and is_gathered(values.shape):
            values = np.squeeze(values)
            rows = values.reshape(len(values), -1)
            self.matrices[name] = rows if len(rows) >= rows.shape[1] else rows.T

    def file(self, path: Path, kind: str) -> RawFile:
        """Return the matrices by their length, that of most columns first; the columns of one alone have no names."""
        if not self.matrices:
            raise InputError(f"{path}: no vector or matrix of numbers; save the readings as one")
        by_length: dict[int, dict[str, NDArray[Any]]] = {}
        for name, rows in self.matrices.items():
            by_length.setdefault(len(rows), {})[name] = rows
        tables = []
        for length, group in by_length.items():
            named = len(group) > 1 or next(iter(group.values())).shape[1] == 1
            columns = {
                f"{name}_{place}" if rows.shape[1] > 1 and named else name if named else f"column_{place}": column
                for name, rows in group.items()
                for place, column in enumerate(rows.T, start=1)
            }
            tables.append(RawTable(f"{length} rows", columns, named=named, preamble=tuple(self.lines)))
        tables.sort(key=lambda one: -len(one.columns))
        return RawFile(str(path), kind, {one.name: one for one in tables})


def read_numpy(path: Path, text: TextSpec = TextSpec()) -> RawFile:
    """Read the arrays of a NumPy file (.npy, .npz) that need no pickle; those of equal length are one table."""
    found = Gathered()
    with parsing(path, "NumPy file", "save it again"):
        size = path.stat().st_size
        if zipfile.is_zipfile(path):
            with zipfile.ZipFile(path) as archive:
                size = sum(one.file_size for one in archive.infolist())
        MemoryLimit.of(path).needs(2 * size)
        content = np.load(path, allow_pickle=False)
        found.add(
            "", {name: content[name] for name in content} if isinstance(content, np.lib.npyio.NpzFile) else content
        )
    return found.file(path, "numpy")
