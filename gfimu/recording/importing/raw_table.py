"""What a foreign file holds before anything is known about it: tables of named columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.base.errors import InputError
from gfimu.recording.units import bracketed_unit

__all__ = ["RawFile", "RawTable"]


@dataclass(frozen=True)
class RawTable:
    """Columns of one table, as the file has them.

    Parameters
    ----------
    name : str
        Name within the file: a topic, a data set, a member of an archive; empty where there is only one table.
    columns : mapping of str to ndarray, shape (n,)
        Numbers (integers where all are), or text as objects. Missing or unreadable numbers are NaN.
    notes : tuple of str
        What was left out on reading, one line each.
    named : bool
        Whether the file itself names its columns.
    preamble : tuple of str
        Lines before the samples, where something may be stated about them.
    """

    name: str
    columns: Mapping[str, NDArray[Any]]
    notes: tuple[str, ...] = ()
    named: bool = True
    preamble: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()), ()))

    def find(self, wanted: str | int | Sequence[str | int]) -> str | None:
        """Return the name of the column that is wanted, or of the first there of several; None without any.

        Letters of either size are the same; a unit in brackets may be left away; a number counts from 1. Underscores
        stand for the blanks of a name, as in a recording of the file.
        """
        names = list(self.columns)
        plain = {_plain(name): name for name in reversed(names)}
        joined = {_plain(name).replace(" ", "_"): name for name in reversed(names)}
        short = {_plain(bracketed_unit(name)[0]): name for name in reversed(names)}
        for one in [wanted] if isinstance(wanted, str | int) else wanted:
            if isinstance(one, int):
                if 1 <= one <= len(names):
                    return names[one - 1]
                continue
            found = plain.get(_plain(one)) or short.get(_plain(one)) or joined.get(_plain(one))
            if found is not None:
                return found
        return None

    def numbers(self, name: str) -> NDArray[np.float64]:
        """Return a column as numbers, (n,); text is missing."""
        values = self.columns[name]
        if values.dtype == object:
            return np.full(len(values), np.nan)
        return np.asarray(values, dtype=float)


@dataclass(frozen=True)
class RawFile:
    """The tables of one file.

    Parameters
    ----------
    source : str
        The file, for messages.
    format : str
        Name of the format.
    tables : mapping of str to RawTable
        By name.
    """

    source: str
    format: str
    tables: Mapping[str, RawTable] = field(default_factory=dict)

    def has(self, name: str) -> bool:
        """Whether there is a table of that name, or exactly one whose name ends so."""
        return name in self.tables or sum(_plain(key).endswith(_plain(name)) for key in self.tables) == 1

    def table(self, name: str) -> RawTable:
        """Return a table by its name or the end of it.

        Raises
        ------
        InputError
            If there is none, or several end so; the message lists the tables.
        """
        found = [one for key, one in self.tables.items() if key == name]
        found = found or [one for key, one in self.tables.items() if _plain(key).endswith(_plain(name))]
        if len(found) == 1:
            return found[0]
        listed = ", ".join(repr(key) for key in list(self.tables)[:12]) or "none"
        fault = "several tables" if found else "no table"
        raise InputError(f"{self.source}: {fault} {name!r}; it has {listed}")


def _plain(name: str) -> str:
    return " ".join(name.strip().strip("\"'").lower().split())
