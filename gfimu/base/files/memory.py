"""How much memory reading a file may take: each reader states its need before it reads, and a limit refuses the rest.

The limit is four times the file's size plus 500 MB, or what its reader is given (``max_memory``, ``--max-memory``),
which travels with the path of the file (`with_memory`). `MemoryLimit.needs` compares a need with it. Work that a file
asks for, such as a simulation, may take half of the machine's memory (`MemoryLimit.of_work`).
"""

from __future__ import annotations

import math
import os
import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from gfimu.base.errors import InputError

__all__ = ["JSON_GROWS", "MemoryLimit", "MemoryLimitError", "MemorySize", "with_memory"]

MemorySize = int | str
"""Bytes, or a text as ``"6GB"``."""

JSON_GROWS = 25
"""Numerical: bytes of Python's objects for a byte of JSON or TOML, at most (``{},`` is a dictionary of 72 bytes)."""

_TIMES_FILE = 4  # of the file's size: numbers of text become two to four times as long in memory
_PLUS = 500_000_000  # bytes besides, for a small file that is packed well
_UNITS = {"": 1, "k": 10**3, "m": 10**6, "g": 10**9, "ki": 1 << 10, "mi": 1 << 20, "gi": 1 << 30}
_SIZE = re.compile(r"(\d{1,12}(?:\.\d{1,9})?)\s*([kmg]i?)?b?")
_ONE_PARSER = threading.RLock()  # the system's limit is that of the whole process


class MemoryLimitError(InputError):
    """A file that needs more memory than its limit."""


if TYPE_CHECKING:
    _SystemPath = Path
else:
    _SystemPath = type(Path())  # before Python 3.12 only the system's own class can be derived from


class _BoundedPath(_SystemPath):
    """A path of a file to read, with the memory in bytes that reading it may take."""

    max_memory: int | None = None


def with_memory(path: str | Path, max_memory: MemorySize | None) -> str | Path:
    """Return a path that carries how much memory reading its file may take; the path as it is for None.

    Raises
    ------
    InputError
        If it is no size.
    """
    if max_memory is None:
        return path
    bounded = _BoundedPath(path)
    bounded.max_memory = _bytes_of(max_memory)
    return bounded


@dataclass(frozen=True)
class MemoryLimit:
    """How much memory reading a file may take.

    Parameters
    ----------
    source : str
        The file, for messages.
    most : int
        Memory, bytes.
    """

    source: str
    most: int

    @classmethod
    def of(cls, path: str | Path) -> MemoryLimit:
        """Return the limit that a path carries (`with_memory`), else four times the file's size and 500 MB."""
        own = path.max_memory if isinstance(path, _BoundedPath) else None
        return cls(str(path), _TIMES_FILE * _size(Path(path)) + _PLUS if own is None else own)

    @classmethod
    def of_work(cls, path: str | Path) -> MemoryLimit:
        """Return the limit of work that a file asks for: what its path carries, else half of the machine's memory."""
        return cls.of(path) if isinstance(path, _BoundedPath) else cls(str(path), _half_of_this_machine())

    def needs(self, size: float, *, at_least: bool = False) -> None:
        """Refuse a file that needs more memory than the limit.

        Parameters
        ----------
        size : float
            Memory that reading it needs, bytes.
        at_least : bool
            Whether that is what was met so far and the rest is not known, as in a stream.

        Raises
        ------
        InputError
            With the file, its need, the limit and the option that raises it.
        """
        if size > self.most and at_least:
            raise self.exceeded()
        if size > self.most:
            raise MemoryLimitError(
                f"{self.source}: needs about {_shown(size)}, the limit is {_shown(self.most)}; "
                f"--max-memory {_rounded_up(size)} is enough"
            )

    def exceeded(self) -> MemoryLimitError:
        """Return the error of a file that needs more memory than the limit, nobody knows how much."""
        return MemoryLimitError(
            f"{self.source}: needs more memory than the limit of {_shown(self.most)}; --max-memory allows more"
        )

    @contextmanager
    def enforced(self) -> Iterator[None]:
        """Let the system refuse memory beyond the limit to a parser of another library, where the system can.

        A net below `needs`: the sizes that a hostile file states need not be those that it unpacks to.
        """
        with _ONE_PARSER:
            try:
                import resource

                pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[5])
                soft, hard = resource.getrlimit(resource.RLIMIT_DATA)
                new = pages * resource.getpagesize() + self.most + _PLUS
            except (ImportError, OSError):
                yield
                return
            if soft != resource.RLIM_INFINITY:
                new = min(new, soft)
            resource.setrlimit(resource.RLIMIT_DATA, (new, hard))
            try:
                yield
            finally:
                with suppress(ValueError):
                    resource.setrlimit(resource.RLIMIT_DATA, (soft, hard))


def _half_of_this_machine() -> int:
    """Return half of the memory of this machine, bytes; 500 MB where the system doesn't say."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 2
    except (AttributeError, OSError, ValueError):
        return _PLUS


def _bytes_of(size: MemorySize) -> int:
    if isinstance(size, int) and size > 0:
        return size
    found = _SIZE.fullmatch(size.strip().lower()) if isinstance(size, str) else None
    most = 0 if found is None else int(float(found[1]) * _UNITS[found[2] or ""])
    if most <= 0:
        raise InputError(f"max_memory {str(size)[:40]!r}: no size; write it as 800MB or 6GB")
    return most


def _size(path: Path) -> int:
    """Return the size of a file, or of the files of a folder, bytes; 0 where there is none."""
    try:
        return sum(one.stat().st_size for one in path.iterdir()) if path.is_dir() else path.stat().st_size
    except (OSError, ValueError):
        return 0


def _shown(size: float) -> str:
    return f"{size / 1e9:.2g} GB" if size >= 1e8 else f"{size / 1e6:.2g} MB"


def _rounded_up(size: float) -> str:
    """Return a size that is enough, as an option takes it."""
    return f"{math.ceil(size / 1e9)}GB" if size > 1e9 else f"{10 * math.ceil(size / 1e7)}MB"
