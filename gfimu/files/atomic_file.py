"""Writing a file so that it is either whole or not there."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from gfimu.errors import InputError, WriteError
from gfimu.files.outputs import check_parent

__all__ = ["atomic_path", "write_text"]


@contextmanager
def atomic_path(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path in the same folder that replaces ``path`` when the block ends well.

    Raises
    ------
    InputError
        If the folder does not exist or can't be written to, or ``path`` is a folder; no folder is made.
    WriteError
        If writing fails in the block, on a full disk say; ``path`` is then as it was before.
    """
    target = Path(path)
    check_parent(target)
    if target.is_dir():
        raise InputError(f"{target}: is a directory; name a file in it")
    try:
        handle, name = tempfile.mkstemp(prefix=f".{target.stem}-", suffix=target.suffix, dir=target.parent)
    except OSError as error:
        raise InputError(f"{target}: {error.strerror or error}; choose a folder that can be written") from None
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)  # mkstemp makes files private; the result is an ordinary file
        temporary.replace(target)
    except OSError as error:
        raise WriteError(target, error) from error
    finally:
        temporary.unlink(missing_ok=True)


def write_text(path: str | Path, text: str) -> None:
    """Write UTF-8 text to ``path``, whole or not at all."""
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
