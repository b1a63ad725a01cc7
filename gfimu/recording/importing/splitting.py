"""Tables in which a column names the chip or sensor of each row (long format), as one table for each."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.base.errors import InputError
from gfimu.recording.importing.dates import nanoseconds_of
from gfimu.recording.importing.raw_table import RawFile, RawTable

__all__ = ["Split", "find_split", "split_file"]

_MOST_CHIPS = 64
_LEAST_SHARE = 0.1  # of the rows of the most frequent value, below which a value is a mistake or a message
_NAMES = re.compile(
    r"sensor|^id$|_id$|chip|node|addr|imu|device|^mac|channel|topic|^type$|^name$|unit|board|^tag|source|probe",
    re.IGNORECASE,
)


def split_file(raw: RawFile, column: str | int, source: str, *, wanted: Collection[str] = ()) -> RawFile:
    """Return a file with a table for each value of a column, named ``sensor=1``.

    Values in few rows are taken for mistakes, but those of the tables ``wanted``.

    Raises
    ------
    InputError
        If no table has that column, or it has more values than there can be chips.
    """
    tables: dict[str, RawTable] = {}
    for table in raw.tables.values():
        name = table.find(column)
        if name is None:
            continue
        values, places = _values(table, name, wanted)
        if len(values) > _MOST_CHIPS:
            raise InputError(
                f"{source}: split_by = {column!r} would make {len(values)} tables; give the column that names the chip"
            )
        for index, value in enumerate(values):
            rows = places == index
            columns = {key: one[rows] for key, one in table.columns.items() if key != name}
            key = f"{name}={value}"
            tables[key] = RawTable(key, columns, table.notes if index == 0 else (), table.named, table.preamble)
    if not tables:
        listed = ", ".join(repr(name) for table in raw.tables.values() for name in list(table.columns)[:12])
        raise InputError(f"{source}: no column {column!r} to split by; the file has {listed}")
    return RawFile(raw.source, raw.format, tables)


@dataclass(frozen=True)
class Split:
    """A column whose values divide the rows of a table.

    Parameters
    ----------
    column : str
        Its name.
    is_part : bool
        Whether its values name parts of a recording, one after the other, and not chips.
    """

    column: str
    is_part: bool = False


def find_split(table: RawTable, times: str | None) -> Split | None:
    """Return the column that names the chip or the part of each row; None where each row has all chips.

    That of chips has few values, each in many rows, and the time increases within each but not over all rows; or it is
    called like a chip, its values take turns, and each of them has rows enough. That of parts is text, each of its
    values stands in one block of rows, and the time does not go on from block to block.

    Parameters
    ----------
    table : RawTable
        The table.
    times : str, optional
        Its column of times, where that is known.
    """
    for name, column in table.columns.items():
        if name == times or (column.dtype != object and column.dtype.kind not in "iu"):
            continue
        values, places = _values(table, name)
        counts = np.bincount(places[places >= 0], minlength=len(values))
        if not 2 <= len(values) <= _MOST_CHIPS or counts.min() < max(20, _LEAST_SHARE * counts.max()):
            continue
        edges = np.flatnonzero(np.diff(places) != 0)
        turns = len(edges) / max(len(places) - 1, 1)
        named = _NAMES.search(name) is not None
        if (named and turns > 0.3) or ((named or turns > 0.3) and times is not None and _sorts(table, times, places)):
            return Split(name)
        if column.dtype == object and times and len(edges) == len(values) - 1 and not nanoseconds_of(column)[1].all():
            steps = np.diff(_increasing(table, times).astype(float))
            if np.all(np.abs(steps[edges] - np.median(steps)) > np.median(steps)):
                return Split(name, is_part=True)
    return None


def _values(table: RawTable, name: str, wanted: Collection[str] = ()) -> tuple[list[str], NDArray[np.int64]]:
    """Return the values of a column in their order, and which one each row has; -1 for rare and empty ones.

    Rare ones of tables that are ``wanted`` stay.
    """
    texts = np.array(["" if value is None else str(value).strip()[:80] for value in table.columns[name].tolist()])
    values, places, counts = np.unique(texts, return_inverse=True, return_counts=True)
    named = np.array([any(f"{name}={value}".lower().endswith(one.lower()) for one in wanted) for value in values])
    usual = ((counts >= _LEAST_SHARE * counts.max()) | named) & (values != "")
    order = [index for index in range(len(values)) if usual[index]]
    if all(re.fullmatch(r"-?\d+", values[place]) for place in order):
        order.sort(key=lambda place: int(values[place]))
    number = np.full(len(values), -1)
    number[order] = np.arange(len(order))
    return [str(values[place]) for place in order], np.asarray(number[places], dtype=np.int64)


def _increasing(table: RawTable, times: str) -> NDArray[Any]:
    """Return a column of times as numbers that increase with the time, (n,), in any unit."""
    t = table.columns[times]
    if t.dtype == object or t.dtype.kind == "M":
        return nanoseconds_of(t)[0] if t.dtype == object else t.astype(np.int64)
    return t


def _sorts(table: RawTable, times: str, places: NDArray[np.int64]) -> bool:
    """Whether the times increase within each chip, but not over all rows."""
    t = _increasing(table, times)
    if np.all(np.diff(t) > 0):
        return False
    return all(float(np.mean(np.diff(t[places == one]) > 0)) > 0.95 for one in range(int(places.max()) + 1))
