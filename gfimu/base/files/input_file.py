"""Files that are read: ordinary ones only."""

from __future__ import annotations

import math
import os
import re
import stat
from pathlib import Path

from gfimu.base.errors import InputError, system_errors

__all__ = ["LARGEST_TEXT", "as_path", "check_input", "first_bytes", "is_ordinary", "is_there"]

LARGEST_TEXT = 20_000_000
"""Numerical: bytes of a TOML file, or of a calibration as JSON; in memory they may take 25 times as much."""


_POINTER = re.compile(rb"version https://git-lfs.{0,400}?\nsize (\d+)", re.DOTALL)
_LONGEST_POINTER = 1024
"""Numerical: bytes; that of Git LFS has to be shorter."""


def as_path(path: str | os.PathLike[str]) -> Path:
    """Return a path; one that carries a limit of memory (`gfimu.base.files.memory.with_memory`) stays as it is."""
    return path if isinstance(path, Path) else Path(path)


def check_input(path: str | Path, *, largest: float = math.inf) -> Path:
    """Return the path of a file that can be read.

    Raises
    ------
    InputError
        If it is missing, a folder, a device or a pipe, has more bytes than ``largest``, its name can't be one, or it is
        a Git LFS pointer to a file that was not fetched.
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
    if stated.st_size < _LONGEST_POINTER:
        with system_errors(file):
            pointer = _POINTER.match(file.read_bytes())
        if pointer:
            size = pointer[1].decode()
            raise InputError(f"{_short(file)}: a Git LFS pointer of a file of {size} bytes; fetch it with git lfs pull")
    return file


def first_bytes(path: str | Path, count: int) -> bytes:
    """Return so many bytes of the begin of a file; raises `InputError` as `check_input`."""
    file = check_input(path)
    with system_errors(file), file.open("rb") as stream:
        return stream.read(count)


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


def _short(file: Path) -> str:
    """Return the name of a file, the middle left out where no system has such long ones."""
    text = str(file)
    return text if len(text) < 1000 else f"{text[:100]}…{text[-100:]}"
