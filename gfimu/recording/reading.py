"""Reading what others wrote: unpacked to a bounded size, and damage said in one line."""

from __future__ import annotations

import bz2
import json
import lzma
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any

from gfimu.base.errors import GfimuError, InputError, system_errors
from gfimu.base.files.input_file import LARGEST_TEXT, check_input
from gfimu.base.files.memory import MemoryLimit

__all__ = ["LONGEST_LINE", "MOST_COLUMNS", "first_unpacked", "parsing", "read_bytes", "read_json", "unpacked"]

LONGEST_LINE = 2_000_000
"""Numerical: characters of a line, far more than a recording's metadata or samples need."""

MOST_COLUMNS = 20_000
"""Numerical: columns of a table; a recording of a hundred chips with every reference has a thousand."""

_PACKED: Mapping[bytes, tuple[str, Callable[[], Any]]] = {
    b"\x1f\x8b": ("gzip", lambda: zlib.decompressobj(wbits=31)),
    b"BZh": ("bzip2", bz2.BZ2Decompressor),
    b"\xfd7zXZ": ("xz", lambda: lzma.LZMADecompressor(memlimit=_XZ_MEMORY)),
}
_XZ_MEMORY = 1 << 27  # numerical: bytes that unpacking xz may take besides; its highest level needs half of them
_LONGEST_REASON = 120


def read_json(path: str | Path, otherwise: str) -> Any:
    """Return the content of a JSON file.

    Raises
    ------
    InputError
        If it can't be read, or is not JSON: then the message is ``otherwise``.
    """
    file = check_input(path, largest=LARGEST_TEXT)
    with system_errors(file):
        content = file.read_bytes()
    try:
        return json.loads(content.decode("utf-8"))
    except (ValueError, RecursionError):  # also of whole numbers with thousands of digits
        raise InputError(f"{file}: {otherwise}") from None


def read_bytes(path: str | Path, *, grows: float = 1.0) -> bytes:
    """Return the content of an ordinary file, of one packed by gzip, bzip2 or xz what is in it.

    Parameters
    ----------
    path : str or Path
        The file.
    grows : float
        Memory that its reader needs for a byte of the content.

    Raises
    ------
    InputError
        If the file can't be read, is a damaged packed file, or needs more memory than its limit.
    """
    file = check_input(path)
    limit = MemoryLimit.of(file)
    with system_errors(file):
        limit.needs(grows * file.stat().st_size)
        data = file.read_bytes()
    return unpacked(data, limit, grows=grows)


def unpacked(data: bytes, limit: MemoryLimit, *, grows: float = 1.0) -> bytes:
    """Return what is in the bytes of a file that gzip, bzip2 or xz packed; other bytes as they are.

    Raises
    ------
    InputError
        If they are damaged, or what is in them needs more memory than the limit.
    """
    found = _packing(data)
    if found is None:
        return data
    mark, kind, start = found
    pieces: list[bytes] = []
    left = int(limit.most / grows)
    rest = data
    try:
        while rest.startswith(mark):  # members one after the other
            packed = start()
            pieces.append(packed.decompress(rest, left + 1))
            left -= len(pieces[-1])
            if left < 0:
                limit.needs(grows * sum(map(len, pieces)), at_least=True)
            if not packed.eof:
                raise _damaged(limit.source, kind, "cut off")
            rest = packed.unused_data.lstrip(b"\x00")
    except (zlib.error, lzma.LZMAError, OSError, EOFError) as error:
        raise _damaged(limit.source, kind, str(error)) from None
    return b"".join(pieces)


def first_unpacked(head: bytes) -> bytes:
    """Return the first bytes of what is in a packed file from its own first bytes; as they are where it is not packed.

    Bytes that can't be unpacked are none.
    """
    found = _packing(head)
    if found is None:
        return head
    try:
        return bytes(found[2]().decompress(head, len(head)))
    except (zlib.error, lzma.LZMAError, OSError, EOFError):
        return b""


def _packing(data: bytes) -> tuple[bytes, str, Callable[[], Any]] | None:
    """Return by what bytes are packed: its mark, its name, and what unpacks them; None where they are not."""
    return next(((mark, *how) for mark, how in _PACKED.items() if data.startswith(mark)), None)


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


def _damaged(source: str, kind: str, reason: str) -> InputError:
    return InputError(f"{source}: damaged {kind} file ({reason}); copy it again")
