"""Files that are read: ordinary ones only, unpacked to a bounded size, and damage said in one line."""

from __future__ import annotations

import math
import os
import stat
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path

from gfimu.base.errors import GfimuError, InputError
from gfimu.base.files.memory import MemoryLimit

__all__ = [
    "LARGEST_TEXT",
    "LONGEST_LINE",
    "MOST_COLUMNS",
    "as_path",
    "check_input",
    "is_ordinary",
    "is_there",
    "parsing",
    "read_bytes",
    "unpacked",
]

LONGEST_LINE = 2_000_000
"""Numerical: characters of a line, far more than a recording's metadata or samples need."""

MOST_COLUMNS = 20_000
"""Numerical: columns of a table; a recording of a hundred chips with every reference has a thousand."""

LARGEST_TEXT = 20_000_000
"""Numerical: bytes of a TOML file, or of a calibration as JSON; in memory they may take 25 times as much."""

_GZIP = b"\x1f\x8b"
_LONGEST_REASON = 120


def as_path(path: str | os.PathLike[str]) -> Path:
    """Return a path; one that carries a limit of memory (`gfimu.base.files.memory.with_memory`) stays as it is."""
    return path if isinstance(path, Path) else Path(path)


def check_input(path: str | Path, *, largest: float = math.inf) -> Path:
    """Return the path of a file that can be read.

    Raises
    ------
    InputError
        If it is missing, a folder, a device or a pipe, has more bytes than ``largest``, or its name can't be one.
    """
    file = as_path(path)
    try:
        stated = file.stat()
        mode = stated.st_mode
    except FileNotFoundError:
        raise InputError(f"{_short(file)}: no such file; check the path") from None
    except (OSError, ValueError) as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or error
        raise InputError(f"{_short(file)}: {reason}; check the path") from None
    if stat.S_ISDIR(mode):
        raise InputError(f"{_short(file)}: is a directory; give a file")
    if not stat.S_ISREG(mode):
        raise InputError(f"{_short(file)}: is no ordinary file; write its content to one first")
    if stated.st_size > largest:
        raise InputError(f"{_short(file)}: has more than {largest / 1e6:g} MB, as no such file has; give another")
    return file


def is_ordinary(path: str | Path) -> bool:
    """Whether there is an ordinary file; false too for a name that can't be one."""
    try:
        return stat.S_ISREG(Path(path).stat().st_mode)
    except (OSError, ValueError):
        return False


def is_there(path: str | Path) -> bool:
    """Whether there is a file or a folder; false too for a name that can't be one."""
    try:
        Path(path).stat()
    except (OSError, ValueError):
        return False
    return True


def read_bytes(path: str | Path, *, grows: float = 1.0) -> bytes:
    """Return the content of an ordinary file, of a gzip file what is in it.

    Parameters
    ----------
    path : str or Path
        The file.
    grows : float
        Memory that its reader needs for a byte of the content.

    Raises
    ------
    InputError
        If the file can't be read, is a damaged gzip file, or needs more memory than its limit.
    """
    file = check_input(path)
    limit = MemoryLimit.of(file)
    try:
        limit.needs(grows * file.stat().st_size)
        data = file.read_bytes()
    except OSError as error:
        raise InputError(f"{file}: {error.strerror or error}; check the path") from None
    if not data.startswith(_GZIP):
        return data
    return unpacked(data, limit, grows=grows)


def unpacked(data: bytes, limit: MemoryLimit, *, grows: float = 1.0) -> bytes:
    """Return what is in the bytes of a gzip file.

    Raises
    ------
    InputError
        If they are damaged, or what is in them needs more memory than the limit.
    """
    pieces: list[bytes] = []
    left = int(limit.most / grows)
    rest = data
    try:
        while rest.startswith(_GZIP):  # members one after the other
            packed = zlib.decompressobj(wbits=31)
            pieces.append(packed.decompress(rest, left + 1))
            left -= len(pieces[-1])
            if left < 0:
                limit.needs(grows * sum(map(len, pieces)), at_least=True)
            if not packed.eof:
                raise _damaged(limit.source, "cut off")
            rest = packed.unused_data.lstrip(b"\x00")
    except zlib.error as error:
        raise _damaged(limit.source, str(error)) from None
    return b"".join(pieces)


@contextmanager
def parsing(source: str | Path, what: str, remedy: str, *, enforced: bool = True) -> Iterator[None]:
    """Turn whatever a parser of another library raises on a damaged file into an `InputError` of one line.

    Parameters
    ----------
    source : str or Path
        The file, for the message, with its limit of memory.
    what : str
        What it should be, ``HDF5 file`` say.
    remedy : str
        What to do.
    enforced : bool
        Whether the system keeps the parser to the limit of the file; not where the parser itself takes memory in
        advance, as Arrow does.
    """
    limit = MemoryLimit.of(source)
    try:
        with limit.enforced() if enforced else nullcontext():
            yield
    except GfimuError:
        raise
    except MemoryError:
        raise limit.exceeded() from None
    except RecursionError:
        raise InputError(f"{source}: {what} nested too deeply; {remedy}") from None
    except Exception as error:  # noqa: BLE001  parsers raise whatever a damaged file leads to
        reason = " ".join(str(error).split())[:_LONGEST_REASON] or type(error).__name__
        raise InputError(f"{source}: damaged {what} ({reason}); {remedy}") from None


def _damaged(source: str, reason: str) -> InputError:
    return InputError(f"{source}: damaged gzip file ({reason}); copy it again")


def _short(file: Path) -> str:
    """Return the name of a file, the middle left out where no system has such long ones."""
    text = str(file)
    return text if len(text) < 1000 else f"{text[:100]}…{text[-100:]}"
