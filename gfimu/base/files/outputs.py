"""What a command writes, checked before its work begins: nothing that was there is destroyed by a slip of the hand.

A file to write must have an extension that its writer supports, lie in a folder that exists and can be written to, and
be none of the files that the command reads, nor another of its outputs; symbolic and hard links are seen through.
`check_outputs` is the check; a command makes it before its function is called.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from gfimu.base.errors import InputError
from gfimu.base.optional_packages import require

__all__ = ["RECORDING", "RERUN", "Output", "OutputFile", "OutputFolder", "check_outputs", "check_parent", "same_file"]


@dataclass(frozen=True)
class OutputFile:
    """A file that a command writes.

    Parameters
    ----------
    what : str
        What the file is, for messages.
    suffixes : tuple of str
        File name extensions that its writer supports.
    needs : mapping of str to tuple of str
        Optional packages (`gfimu.base.optional_packages`) that writing takes, by extension; none for an extension not
        here.
    any_case : bool
        Whether capital letters in the extension are as good.
    """

    what: str
    suffixes: tuple[str, ...]
    needs: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    any_case: bool = False

    def check_suffix(self, path: Path) -> None:
        """Raise `InputError` for an extension that the writer does not support."""
        if (path.suffix.lower() if self.any_case else path.suffix) in self.suffixes:
            return
        if len(self.suffixes) == 1:
            raise InputError(f"{path}: {self.what} ends in {self.suffixes[0]}; name it so")
        raise InputError(
            f"{path}: unknown file format {path.suffix!r} for {self.what}; use {' or '.join(self.suffixes)}"
        )

    def check_packages(self, path: Path) -> None:
        """Raise `MissingPackageError` where a package is not installed that writes files of this extension."""
        require(f"{path}: {self.what}", *self.needs.get(path.suffix.lower(), ()))

    def files(self, path: Path) -> list[Path]:
        """Return the files that will be replaced."""
        return [path]


@dataclass(frozen=True)
class OutputFolder:
    """A folder that a command writes; the folder itself may be made, the one above it must exist.

    Parameters
    ----------
    names : tuple of str
        Files that it will hold, relative to it; another file of the same name is replaced.
    needs : tuple of str
        Optional packages (`gfimu.base.optional_packages`) that writing them takes.
    meanings : tuple of str
        What each of the files is, where a command names all of them and not their folder alone.
    """

    names: tuple[str, ...]
    needs: tuple[str, ...] = ()
    meanings: tuple[str, ...] = ()

    def check_suffix(self, path: Path) -> None:
        """Accept any name: folders have no extension."""

    def check_packages(self, path: Path) -> None:
        """Raise `MissingPackageError` where a package is not installed that writes one of the files."""
        require(f"{path}: what is written there", *self.needs)

    def files(self, path: Path) -> list[Path]:
        """Return the files that will be replaced."""
        return [path / name for name in self.names]


Output = OutputFile | OutputFolder

RECORDING = OutputFile("a recording", (".csv", ".parquet"))
RERUN = OutputFile("a rerun recording", (".rrd",), {".rrd": ("rerun",)})


def check_parent(path: Path) -> None:
    """Raise `InputError` unless the folder above a path exists and can be written to; nothing is made."""
    parent = path.parent
    if not parent.exists():
        raise InputError(f"{path}: there is no folder {parent}; make it first, or choose a folder that exists")
    if not parent.is_dir():
        raise InputError(f"{path}: {parent} is a file; choose a folder that can be written")
    if not os.access(parent, os.W_OK | os.X_OK):
        raise InputError(f"{path}: permission denied; choose a folder that can be written")


def check_outputs(outputs: Iterable[tuple[str, str | Path, Output]], inputs: Iterable[str | Path] = ()) -> None:
    """Check all that will be written against what is there and what is read; nothing is made or changed.

    Parameters
    ----------
    outputs : iterable of (str, path, OutputFile or OutputFolder)
        Name of the argument, its value, and what is written there.
    inputs : iterable of path
        Files that are read.

    Raises
    ------
    InputError
        If an output has the wrong extension, its folder does not exist or can't be written to, it is a folder where a
        file is meant (or the reverse), or it is an input or another output, also through a link.
    """
    try:
        _check(outputs, [Path(path) for path in inputs])
    except OSError as error:  # a name too long, a circle of links
        raise InputError(f"{error.filename}: {error.strerror or error}; choose another name") from None


def _check(outputs: Iterable[tuple[str, str | Path, Output]], read: list[Path]) -> None:
    written: list[tuple[str, Path]] = []
    for name, value, output in outputs:
        path = Path(value)
        output.check_suffix(path)
        output.check_packages(path)
        check_parent(path)
        _check_kind(path, output)
        for file in output.files(path):
            for source in read:
                if same_file(file, source):
                    through = "" if file == source else f" is the same file as {source} and"
                    raise InputError(f"{file}:{through} is read by this command; choose another {_option(name)}")
            for other, earlier in written:
                if same_file(file, earlier):
                    raise InputError(
                        f"{file}: {_option(other)} and {_option(name)} name the same file; choose two different ones"
                    )
            written.append((name, file))


def _check_kind(path: Path, output: Output) -> None:
    if isinstance(output, OutputFolder):
        if path.exists() and not path.is_dir():
            raise InputError(f"{path}: is a file; choose a folder")
        if path.is_dir() and not os.access(path, os.W_OK | os.X_OK):
            raise InputError(f"{path}: permission denied; choose a folder that can be written")
    elif path.is_dir():
        raise InputError(f"{path}: is a folder; name a file in it")
    elif path.exists() and not path.is_file():
        raise InputError(f"{path}: is not an ordinary file; choose another name")


def same_file(first: Path, second: Path) -> bool:
    """Whether two paths are one file, whether or not it exists yet."""
    try:
        return first.samefile(second)
    except OSError:
        return os.path.normcase(os.path.realpath(first)) == os.path.normcase(os.path.realpath(second))
    except ValueError:  # a name that can't be one
        return False


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"
