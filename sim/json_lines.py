"""Files of JSON lines, packed where their name ends in ``.xz``: the stored form of outcomes, answers and judgements."""

from __future__ import annotations

import lzma
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from gfimu.base.errors import InputError, system_errors
from gfimu.base.files.atomic_file import atomic_path
from gfimu.base.files.input_file import is_ordinary

__all__ = ["read_lines", "six_digits", "write_lines"]

_PACKED = ".xz"
_MOST_BYTES = 1 << 30  # unpacked; a study of ten thousand outcomes has 30 MB


def read_lines(path: str | Path, remedy: str) -> list[bytes]:
    """Return the lines of a file.

    Parameters
    ----------
    path : str or Path
        The file, packed if its name ends in ``.xz``.
    remedy : str
        What to give instead of a file that can't be read, as a clause.

    Raises
    ------
    InputError
        If the file is not there, can't be read, is not packed by xz, or unpacks to more than a gigabyte.
    """
    file = Path(path)
    if not is_ordinary(file):
        raise InputError(f"{file}: no such file; {remedy}")
    with system_errors(file, remedy):
        content = file.read_bytes()
    if file.suffix != _PACKED:
        return content.splitlines()
    unpacker = lzma.LZMADecompressor()
    try:
        content = unpacker.decompress(content, _MOST_BYTES)
    except lzma.LZMAError:
        raise InputError(f"{file}: not packed by xz; {remedy}") from None
    if not unpacker.eof:
        raise InputError(f"{file}: cut off, or unpacks to more than {_MOST_BYTES >> 20} MB; {remedy}")
    return content.splitlines()


def write_lines(path: str | Path, lines: Iterable[str]) -> None:
    """Write lines, whole or not at all, packed where the name ends in ``.xz``."""
    content = "".join(f"{line}\n" for line in lines).encode()
    with atomic_path(path) as part:
        part.write_bytes(lzma.compress(content, preset=9) if Path(path).suffix == _PACKED else content)


def six_digits(value: Any) -> Any:
    """Return a JSON value with its numbers rounded to six digits, as it is stored."""
    if isinstance(value, dict):
        return {key: six_digits(item) for key, item in value.items()}
    if isinstance(value, list):
        return [six_digits(item) for item in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value
