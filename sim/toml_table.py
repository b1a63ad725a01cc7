"""Reading a table of a TOML file key by key, so that every mistake is named with its remedy."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from gfimu.errors import InputError

__all__ = ["TomlTable"]

_MISSING: Any = object()


class TomlTable:
    """One table of a TOML file; `finish` complains about keys that nobody asked for.

    Parameters
    ----------
    data : mapping
        The table.
    where : str
        File and table, for messages.

    Raises
    ------
    InputError
        From the readers: for a missing key, a value of another type, a number out of its range, or an unknown key.
    """

    def __init__(self, data: Any, where: str) -> None:
        if not isinstance(data, Mapping):
            raise InputError(f"{where}: must be a table of keys and values, not {data!r}")
        self._data = data
        self._where = where
        self._asked: list[str] = []

    def __contains__(self, key: str) -> bool:
        return key in self._data

    def raw(self, key: str, default: Any = _MISSING) -> Any:
        """Return a value as TOML gave it."""
        self._asked.append(key)
        if key in self._data:
            return self._data[key]
        if default is _MISSING:
            raise InputError(f"{self._where}: key {key!r} is missing; add it")
        return default

    def number(
        self, key: str, default: float = _MISSING, *, above: float = -math.inf, least: float = -math.inf
    ) -> float:
        """Return a finite number greater than ``above`` and not less than ``least``."""
        value = self.raw(key, default)
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise InputError(f"{self._where}: {key} = {value!r} must be a finite number")
        if value <= above or value < least:
            bound = f"greater than {above:g}" if value <= above else f"at least {least:g}"
            raise InputError(f"{self._where}: {key} = {value!r} must be {bound}")
        return float(value)

    def numbers(self, key: str, count: int, default: Sequence[float] = _MISSING) -> list[float]:
        """Return a list of ``count`` finite numbers."""
        value = self.raw(key, default)
        good = isinstance(value, list | tuple) and len(value) == count
        if not good or any(
            isinstance(v, bool) or not isinstance(v, int | float) or not math.isfinite(v) for v in value
        ):
            raise InputError(f"{self._where}: {key} = {value!r} must be a list of {count} finite numbers")
        return [float(v) for v in value]

    def text(self, key: str, default: str = _MISSING, *, choices: Sequence[str] = ()) -> str:
        """Return a string, one of ``choices`` where they are given."""
        value = self.raw(key, default)
        if not isinstance(value, str) or (choices and value not in choices):
            remedy = f"must be one of {', '.join(choices)}" if choices else "must be a string"
            raise InputError(f"{self._where}: {key} = {value!r} {remedy}")
        return value

    def whole(self, key: str, default: int | None = _MISSING, *, least: int = 0) -> int | None:
        """Return a whole number of at least ``least``, or None where that is the default and the key is missing."""
        value = self.raw(key, default)
        if value is None and key not in self._data:
            return None
        if isinstance(value, bool) or not isinstance(value, int) or value < least:
            raise InputError(f"{self._where}: {key} = {value!r} must be a whole number of at least {least}")
        return value

    def flag(self, key: str, default: bool) -> bool:
        """Return true or false."""
        value = self.raw(key, default)
        if not isinstance(value, bool):
            raise InputError(f"{self._where}: {key} = {value!r} must be true or false")
        return value

    def table(self, key: str) -> TomlTable:
        """Return a table within this one, empty where it is missing."""
        return TomlTable(self.raw(key, {}), f"{self._where}: [{key}]")

    def tables(self, key: str) -> list[TomlTable]:
        """Return an array of tables within this one, empty where it is missing."""
        value = self.raw(key, [])
        if not isinstance(value, list):
            raise InputError(f"{self._where}: {key} must be an array of tables: [[{key}]]")
        return [TomlTable(entry, f"{self._where}: [[{key}]] {place}") for place, entry in enumerate(value, start=1)]

    def finish(self) -> None:
        """Raise for keys that were never asked for, listing the valid ones."""
        for key in self._data:
            if key not in self._asked:
                valid = ", ".join(sorted(set(self._asked)))
                raise InputError(f"{self._where}: unknown key {key!r}; valid: {valid}")
