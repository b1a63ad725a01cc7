"""Files that are read: ordinary ones only, unpacked to a bounded size, and damage said in one line."""

from __future__ import annotations

import stat
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from gfimu.errors import GfimuError, InputError

__all__ = [
    "LONGEST_LINE",
    "MOST_COLUMNS",
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

_LEAST_UNPACKED = 64 << 20  # numerical: bytes that any file may unpack to
_MOST_PACKED = 25.0  # numerical: bytes from one packed byte; text of readings packs to a fifth, constant text further
_BLOCK = 1 << 20
_LONGEST_REASON = 120


def check_input(path: str | Path) -> Path:
    """Return the path of a file that can be read.

    Raises
    ------
    InputError
        If it is missing, a folder, a device or a pipe, or its name can't be one.
    """
    file = Path(path)
    try:
        mode = file.stat().st_mode
    except FileNotFoundError:
        raise InputError(f"{_short(file)}: no such file; check the path") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{_short(file)}: {reason}; check the path") from None
    if stat.S_ISDIR(mode):
        raise InputError(f"{_short(file)}: is a directory; give a file")
    if not stat.S_ISREG(mode):
        raise InputError(f"{_short(file)}: is no ordinary file; write its content to one first")
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


def read_bytes(path: str | Path) -> bytes:
    """Return the content of an ordinary file, of a gzip file what is in it.

    Raises
    ------
    InputError
        If the file can't be read, or is a damaged gzip file or one that unpacks to far more than readings do.
    """
    file = check_input(path)
    try:
        data = file.read_bytes()
    except OSError as error:
        raise InputError(f"{file}: {error.strerror or error}; check the path") from None
    return unpacked(data, str(file)) if data.startswith(b"\x1f\x8b") else data


def unpacked(data: bytes, source: str) -> bytes:
    """Return what is in the bytes of a gzip file.

    Raises
    ------
    InputError
        If they are damaged, or hold far more than readings do.
    """
    most = max(_LEAST_UNPACKED, int(_MOST_PACKED * len(data)))
    found = bytearray()
    rest = data
    try:
        while rest.startswith(b"\x1f\x8b"):  # members one after the other
            packed = zlib.decompressobj(wbits=31)
            found += packed.decompress(rest, most - len(found) + 1)
            if len(found) > most:
                raise InputError(
                    f"{source}: unpacks to more than {most >> 20} MB, as no recording does; unpack it and look"
                )
            if not packed.eof:
                raise _damaged(source, "cut off")
            rest = packed.unused_data.lstrip(b"\x00")
    except zlib.error as error:
        raise _damaged(source, str(error)) from None
    return bytes(found)


@contextmanager
def parsing(source: str | Path, what: str, remedy: str) -> Iterator[None]:
    """Turn whatever a parser of another library raises on a damaged file into an `InputError` of one line.

    Parameters
    ----------
    source : str or Path
        The file, for the message.
    what : str
        What it should be, ``HDF5 file`` say.
    remedy : str
        What to do.
    """
    try:
        yield
    except GfimuError:
        raise
    except MemoryError:
        raise InputError(f"{source}: {what} that needs more memory than there is; {remedy}") from None
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
