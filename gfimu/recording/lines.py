"""Lines of a recording for the live filter: from a finished file, or from one that is still being written."""

from __future__ import annotations

import contextlib
import json
import math
import os
import socket
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import numpy as np

from gfimu.base.errors import InputError
from gfimu.base.files.input_file import check_input, first_bytes, is_ordinary
from gfimu.base.files.memory import MemorySize, with_memory
from gfimu.recording.reading import LONGEST_LINE
from gfimu.recording.recording import Recording

__all__ = ["recording_lines", "source_lines", "whole_lines"]

_LOOK_AGAIN_S = 0.1
_PARQUET = b"PAR1"


def source_lines(
    source: str | Path | Iterable[str], max_memory: MemorySize | None = None, *, follow: bool = False
) -> Iterable[str]:
    """Return the lines of a source as they arrive.

    Parameters
    ----------
    source : str, Path or iterable of str
        ``-`` for standard input, a recording, ``host:port`` of a TCP server, or the lines themselves.
    max_memory : int or str, optional
        Memory that reading a recording may take (`gfimu.base.files.memory`).
    follow : bool
        Of a recording: wait for more (`recording_lines`).

    Raises
    ------
    InputError
        If the source can't be opened.
    """
    if not isinstance(source, str | Path):
        return source
    if source == "-":
        return whole_lines(sys.stdin.readline, "the stream")
    if is_ordinary(source):
        return recording_lines(with_memory(source, max_memory), follow=follow)
    host, colon, port = str(source).removeprefix("socket://").rpartition(":")
    if not colon or not port.isdigit():
        raise InputError(f"--from {str(source)!r}: no such file; give a recording, - for standard input, or host:port")
    return _socket_lines(str(source), host, int(port))


def _socket_lines(source: str, host: str, port: int) -> Iterator[str]:
    """Yield the lines that a TCP server sends."""
    try:
        connection = socket.create_connection((host, port), timeout=10)  # numerical: s
    except OSError as error:
        raise InputError(f"--from {source!r}: {error.strerror or error}; start the server first") from None
    connection.settimeout(None)
    with connection, connection.makefile("r", encoding="utf-8", errors="replace") as stream:
        yield from whole_lines(stream.readline, source)


def recording_lines(path: str | Path, *, follow: bool = False) -> Iterator[str]:
    """Yield the lines of a recording as CSV text, metadata and header first.

    Parameters
    ----------
    path : str or Path
        CSV file, Parquet file, or what `gfimu record` has written so far under either name.
    follow : bool
        Wait for more at the end of a file that is being written, until it is finished: replaced by the final recording
        (whose samples have all been read by then) or removed.

    Raises
    ------
    InputError
        If the file can't be read.
    """
    file = check_input(path)
    magic = first_bytes(file, len(_PARQUET))
    return _finished(file) if magic == _PARQUET else _text(file, follow=follow)


def whole_lines(read: Callable[[int], str], source: str | Path) -> Iterator[str]:
    """Yield the lines of a stream up to its end; the last one may have none.

    Raises
    ------
    InputError
        If a line goes on without end.
    """
    while line := read(LONGEST_LINE):
        if len(line) >= LONGEST_LINE:
            raise InputError(f"{source}: a line is longer than {LONGEST_LINE} characters; send a line per sample")
        yield line


def _finished(file: Path) -> Iterator[str]:
    """Lines of a Parquet file."""
    recording = Recording.read(file)
    for key, value in recording.metadata.items():
        yield f"# {key}: {json.dumps(value)}\n"
    gyro = [name for name in recording.reference if name.startswith("gyro_")]
    yield ",".join(["t_s", *(f"{channel}_m_s2" for channel in recording.channels), *gyro]) + "\n"
    table = np.column_stack([recording.t_s, recording.readings, *(recording.reference[name] for name in gyro)])
    for row in table.tolist():
        yield ",".join("" if math.isnan(value) else repr(value) for value in row) + "\n"


def _text(file: Path, *, follow: bool) -> Iterator[str]:
    """Whole lines of a text file as they are there, or as they arrive."""
    waiting = ""
    with file.open(encoding="utf-8", errors="replace", newline="") as stream:
        while True:
            replaced = follow and not _is_same(file, stream.fileno())  # asked before the last look for more
            for text in whole_lines(stream.readline, file):
                waiting += text
                if waiting.endswith("\n"):
                    yield waiting
                    waiting = ""
            if not follow or replaced:
                break
            time.sleep(_LOOK_AGAIN_S)
    if waiting and not follow:
        yield waiting


def _is_same(file: Path, number: int) -> bool:
    """Whether the path still leads to the open file."""
    with contextlib.suppress(OSError):
        return os.path.samestat(file.stat(), os.fstat(number))
    return False
