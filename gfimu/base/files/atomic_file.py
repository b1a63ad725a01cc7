"""Writing a file so that it is either whole or not there."""

from __future__ import annotations

import contextlib
import os
import platform
import shutil
import tempfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from gfimu.base.errors import InputError, WriteError, system_errors
from gfimu.base.files.outputs import check_parent

__all__ = ["atomic_folder", "atomic_path", "write_text"]

_ELSEWHERE = "choose a folder that can be written"


@contextmanager
def atomic_path(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path in the same folder that replaces ``path`` when the block ends well.

    The content and then the folder are flushed to the disk, so that a power cut leaves the old file or the new one.
    What processes of this machine that no longer run left behind in the folder is removed.

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
    _remove_abandoned(target.parent)
    with system_errors(target, _ELSEWHERE):
        handle, name = tempfile.mkstemp(
            prefix=f"{_own_prefix()}{os.getpid()}-", suffix=target.suffix, dir=target.parent
        )
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)  # mkstemp makes files private; the result is an ordinary file
        _flush(temporary)
        temporary.replace(target)
        _flush_folder(target.parent)
    except OSError as error:
        raise WriteError(target, error) from error
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def atomic_folder(path: str | Path) -> Iterator[Path]:
    """Yield a temporary folder whose files replace those of the same names in ``path`` when the block ends well.

    Of two processes that write the same folder at once, all files are those of the later one.

    Raises
    ------
    InputError
        If the folder can't be made or written to; the one above it must exist.
    WriteError
        If writing fails in the block, on a full disk say; the folder then holds what it did before.
    """
    folder = Path(path)
    check_parent(folder)
    with system_errors(folder, _ELSEWHERE):
        folder.mkdir(exist_ok=True)
        _remove_abandoned(folder)
        made = Path(tempfile.mkdtemp(prefix=f"{_own_prefix()}{os.getpid()}-", dir=folder))
    try:
        yield made
        for file in made.iterdir():
            _flush(file)
        with _alone(folder):
            for file in made.iterdir():
                file.replace(folder / file.name)
        _flush_folder(folder)
    except WriteError:
        raise
    except OSError as error:
        raise WriteError(folder, error) from error
    finally:
        shutil.rmtree(made, ignore_errors=True)


@contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Wait until no other process replaces files of a folder, where the system can."""
    try:
        import fcntl
    except ImportError:
        yield
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        with contextlib.suppress(OSError):  # a file system on a network that has no locks
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


def _own_prefix() -> str:
    """Return what names of temporary files begin with; the machine is part of it, as a folder may be on a network."""
    return f".gfimu-{zlib.crc32(platform.node().encode()):08x}-"


def _remove_abandoned(folder: Path) -> None:
    """Remove the temporary files of processes of this machine that no longer run."""
    for file in folder.glob(f"{_own_prefix()}*"):
        number = file.name.removeprefix(_own_prefix()).partition("-")[0]
        if number.isdigit() and not _runs(int(number)):
            with contextlib.suppress(OSError):
                shutil.rmtree(file) if file.is_dir() else file.unlink()


def _runs(process: int) -> bool:
    """Whether a process of this machine runs; true where that can't be known."""
    if os.name != "posix":  # a signal would end it
        return True
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except OSError:
        return True
    return True


def _flush(file: Path) -> None:
    """Bring the content of a file from the system's memory to the disk."""
    with file.open("rb+") as stream:
        os.fsync(stream.fileno())


def _flush_folder(folder: Path) -> None:
    """Bring the names of a folder to the disk, where the system can."""
    with contextlib.suppress(OSError):  # the file is there by now; some file systems flush no folder
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def write_text(path: str | Path, text: str) -> None:
    """Write UTF-8 text to ``path``, whole or not at all."""
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
