"""Files of records: JSON, one record per line or all in one."""

from __future__ import annotations

import itertools
import sys
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from gfimu.base.errors import InputError
from gfimu.base.files.memory import MemoryLimit
from gfimu.recording.importing.column_map import TextSpec
from gfimu.recording.importing.raw_table import RawFile, RawTable
from gfimu.recording.importing.readers.text import cell_values
from gfimu.recording.reading import read_bytes

__all__ = ["read_json", "tables_of_json"]

_LEAST_ROWS = 3
_MOST_LINES, _LONGEST_WORDS = 100, 200  # numerical: of what is stated beside the readings, characters of each
_LEAST_SHARE, _SAME_KIND = 0.1, 0.7  # of the rows of the most frequent kind of records; of the keys of one
_MOST_CELLS = 64  # of a list in a record: what has more is no sample
_GROWS: Mapping[bytes, int] = {b"{": 280, b"[": 100, b",": 48, b":": 62}
"""Numerical: memory for an object, a list, a value and a key of JSON while they become columns, bytes, measured."""


def read_json(path: Path, text: TextSpec = TextSpec()) -> RawFile:
    """Read JSON: records one per line, a list of records, or lists of numbers by name."""
    return RawFile(str(path), "json", tables_of_json(read_bytes(path), str(path), MemoryLimit.of(path)))


def tables_of_json(data: bytes, source: str, limit: MemoryLimit) -> dict[str, RawTable]:
    """Return the tables that the bytes of JSON hold, by name, if they fit into a limit of memory."""
    data = data.removeprefix(b"\xef\xbb\xbf").strip()
    limit.needs(len(data) + sum(size * data.count(mark) for mark, size in _GROWS.items()))
    lost = 0
    try:
        content = msgspec.json.decode(data)
    except RecursionError:
        raise InputError(f"{source}: JSON nested too deeply; write a record per sample") from None
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        content, lost = _lines(data)
        if len(content) < _LEAST_ROWS:
            raise InputError(f"{source}: damaged JSON file ({str(error)[:120]}); write it again") from None
    tables = {name: table for name, table in _tables(content, "") if len(table) >= _LEAST_ROWS}
    if not tables:
        raise InputError(f"{source}: JSON without a list of readings; write a record per sample, or a list per column")
    stated = tuple(itertools.islice(_stated(content, ""), _MOST_LINES))
    note = (f"{source}: left out {lost} lines that are no JSON",) if lost else ()
    return {name: replace(one, notes=(*note, *one.notes), preamble=stated) for name, one in tables.items()}


def _stated(content: Any, name: str) -> Iterator[str]:
    """Yield the single values beside the readings, as the sample rate, one line each."""
    if isinstance(content, Mapping):
        for key, one in content.items():
            yield from _stated(one, f"{name}.{key}".lstrip("."))
    elif not isinstance(content, list):
        yield f"{name}: {str(content)[:_LONGEST_WORDS]}"


def _lines(data: bytes) -> tuple[list[Any], int]:
    """Return the records of lines, and how many lines are none, as the last one of a file that was cut off."""
    found, lost = [], 0
    for line in data.splitlines():
        if line.strip():
            try:
                found.append(msgspec.json.decode(line.strip().rstrip(b",")))
            except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
                lost += 1
    return found, lost


def _tables(content: Any, name: str) -> Iterator[tuple[str, RawTable]]:
    """Yield the tables that JSON holds: lists of records, objects of lists or of records by row, deeper ones too."""
    if isinstance(content, list) and content:
        if all(isinstance(one, Mapping) for one in content[:_LEAST_ROWS]):
            yield from _of_records(content, name)
        elif all(isinstance(one, list) for one in content[:_LEAST_ROWS]):
            columns = dict(_side_by_side({"row": content}))
            if "row" not in columns:
                yield name, replace(_table(name, columns), named=False)
            else:
                yield from _of_records([{"row": one} for one in content], name)
    elif isinstance(content, Mapping):
        lists = {key: one for key, one in content.items() if isinstance(one, list) and len(one) >= _LEAST_ROWS}
        plain = {key: one for key, one in lists.items() if not isinstance(one[0], Mapping)}
        lengths = {len(one) for one in plain.values()}
        by_row = all(isinstance(one, Mapping) and "0" in one for one in content.values())
        if by_row:
            yield from _tables({key: list(one.values()) for key, one in content.items()}, name)
            return
        if len(plain) >= 2 and len(lengths) == 1:
            yield name, _table(name, dict(_side_by_side(plain)))
        for key, one in content.items():
            if key not in plain or len(plain) < 2 or len(lengths) != 1:
                yield from _tables(one, f"{name}.{key}".lstrip("."))


def _side_by_side(lists: Mapping[str, list[Any]]) -> Iterator[tuple[str, list[Any]]]:
    """Yield lists of cells as columns, and of lists of as many cells each their places: ``acc[0]``."""
    for key, one in lists.items():
        widths = {len(row) if isinstance(row, list) else 0 for row in one}
        width = max(widths)
        is_flat = len(widths) == 1 and 0 < width <= _MOST_CELLS
        if is_flat and not any(isinstance(cell, list | Mapping) for cell in one[0]):
            yield from ((f"{key}[{index}]", [row[index] for row in one]) for index in range(width))
        else:
            yield key, one


def _of_records(records: list[Any], name: str) -> Iterator[tuple[str, RawTable]]:
    """Yield the table of a list of records; one per set of keys where they differ, as of messages of several kinds."""
    rows = [dict(_flat(one, "")) for one in records if isinstance(one, Mapping)]
    counts = Counter(frozenset(row) for row in rows)
    kinds = [keys for keys, count in counts.items() if count >= _LEAST_SHARE * max(counts.values())]
    shared = frozenset.intersection(*kinds) if kinds else frozenset()
    if len(kinds) < 2 or len(shared) >= _SAME_KIND * max(map(len, kinds)):
        kinds = []  # keys are left out here and there
    for group in [[row for row in rows if row.keys() == keys] for keys in kinds] or [rows]:
        own = next((key for key in group[0] if kinds and key not in shared), "")
        own = own.partition("[")[0] if "[" in own else own.rpartition(".")[0] or own
        label = f"{name} {own}".strip()
        keys = dict.fromkeys(key for row in group for key in row)
        yield label, _table(label, {key: [row.get(key) for row in group] for key in keys})


def _flat(record: Mapping[str, Any], before: str) -> Iterator[tuple[str, Any]]:
    """Yield the cells of a record with the names of what they are in: ``acc.x``, ``gyro[0]``."""
    for key, value in record.items():
        name = sys.intern(f"{before}{key}")  # once for all records
        if isinstance(value, Mapping):
            yield from _flat(value, f"{name}.")
        elif isinstance(value, list) and len(value) <= _MOST_CELLS:
            for index, one in enumerate(value):
                if isinstance(one, Mapping):
                    yield from _flat(one, f"{name}[{index}].")
                else:
                    yield f"{name}[{index}]", one
        elif not isinstance(value, list):
            yield name, value


def _table(name: str, columns: Mapping[str, list[Any]]) -> RawTable:
    found: dict[str, NDArray[Any]] = {}
    notes = []
    for key, cells in columns.items():
        whole = all(type(cell) is int and abs(cell) < 2**63 for cell in cells)
        numbers = [one for one in cells if isinstance(one, int | float) and not isinstance(one, bool)]
        if whole:
            found[key] = np.array(cells, dtype=np.int64)
        elif numbers and len(numbers) + sum(one is None for one in cells) == len(cells):
            found[key] = np.array([np.nan if one is None else float(one) for one in cells])
        else:
            texts = pa.array(["" if one is None else str(one) for one in cells], pa.string())
            values, unreadable = cell_values(texts, ".")
            if values is not None:
                found[key] = values
            if unreadable:
                notes.append(f"column {key}: {unreadable} cells are no numbers and count as missing")
    return RawTable(name, found, tuple(notes))
