"""The readers by the name of their format, and which one a file needs."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from gfimu.base.errors import InputError, check_name
from gfimu.base.files.input_file import as_path, first_bytes
from gfimu.base.plugins import plugins
from gfimu.recording.importing.column_map import TextSpec
from gfimu.recording.importing.raw_table import RawFile
from gfimu.recording.importing.readers.hdf5 import read_hdf5
from gfimu.recording.importing.readers.logs import read_bag, read_mcap, read_ulog
from gfimu.recording.importing.readers.matlab import read_matlab
from gfimu.recording.importing.readers.matrices import read_numpy
from gfimu.recording.importing.readers.records import read_json
from gfimu.recording.importing.readers.tables import (
    archive_format,
    read_archive,
    read_arrow,
    read_excel,
    read_parquet,
)
from gfimu.recording.importing.readers.text import is_text, read_text
from gfimu.recording.reading import first_unpacked

__all__ = ["READERS", "Reader", "format_of", "read_foreign", "readers"]


@dataclass(frozen=True)
class Reader:
    """How files of one foreign format become tables.

    Parameters
    ----------
    read : callable
        From a path and the layout of a text file to a `RawFile`; raises `InputError` for a file that it can't read.
    marks : tuple of bytes
        What a file of this format begins with, one of these.
    """

    read: Callable[[Path, TextSpec], RawFile]
    marks: tuple[bytes, ...]

    @property
    def summary(self) -> str:
        """What it reads, one line."""
        return (self.read.__doc__ or "").strip().partition("\n")[0]


READERS: Mapping[str, Reader] = {
    "text": Reader(read_text, ()),
    "parquet": Reader(read_parquet, (b"PAR1",)),
    "arrow": Reader(read_arrow, (b"ARROW1",)),
    "zip": Reader(read_archive, (b"PK\x03\x04",)),
    "excel": Reader(read_excel, ()),
    "json": Reader(read_json, (b'{"', b"{\n", b"{\r", b'[{"', b"[\n", b"[\r", b"[[")),
    "matlab": Reader(read_matlab, (b"MATL",)),
    "hdf5": Reader(read_hdf5, (b"\x89HDF",)),
    "numpy": Reader(read_numpy, (b"\x93NUMPY",)),
    "ulog": Reader(read_ulog, (b"ULog",)),
    "mcap": Reader(read_mcap, (b"\x89MCA",)),
    "rosbag": Reader(read_bag, (b"#ROS", b"SQLi")),
}
"""Readers of gfimu by the name of the format."""

_NOT_READ: Mapping[str, tuple[bytes, ...]] = {
    "an Excel 97 workbook; save it as .xlsx or .csv": (b"\xd0\xcf\x11\xe0",),
    "a LabVIEW TDMS file; export it as .lvm or .csv": (b"TDSm",),
    "a Python pickle, which could run code; save the arrays as .npz": (
        b"\x80\x02",
        b"\x80\x03",
        b"\x80\x04",
        b"\x80\x05",
    ),
}
_PACKABLE = ("text", "json")  # formats that are read packed by gzip, bzip2 or xz


def readers() -> dict[str, Reader]:
    """Return the readers by the name of their format, those of other packages (``gfimu.readers``) first."""
    return {**plugins("gfimu.readers", Reader, READERS), **READERS}


def format_of(path: Path) -> str:
    """Return the format of a file by its first bytes.

    Raises
    ------
    InputError
        If it is missing, empty, or of no format that is known.
    """
    if os.path.isdir(path):  # noqa: PTH112  false for a name that is too long
        if (path / "metadata.yaml").is_file():
            return "rosbag"
        raise InputError(f"{path}: a folder that is no ROS 2 bag; give a file")
    packed = first_bytes(path, 4096)
    if not packed:
        raise InputError(f"{path}: empty file; record again or give another file")
    head = first_unpacked(packed)
    plain = head.removeprefix(b"\xef\xbb\xbf").lstrip() if head.lstrip()[:1] in {b"{", b"["} else head
    known = readers()
    marked = (name for name, reader in known.items() if reader.marks and plain.startswith(reader.marks))
    name = next(marked, "text" if is_text(head) else "")
    if not name:
        unknown = f"a binary file of unknown format; known are {', '.join(known)}"
        raise InputError(
            f"{path}: {next((what for what, marks in _NOT_READ.items() if head.startswith(marks)), unknown)}"
        )
    if head is not packed and name not in _PACKABLE:
        raise InputError(f"{path}: a packed {name} file; unpack it")
    return archive_format(path) if name == "zip" else name


def read_foreign(path: str | Path, kind: str = "", text: TextSpec = TextSpec()) -> RawFile:
    """Read a file of a foreign format into tables.

    Parameters
    ----------
    path : str or Path
        The file.
    kind : str
        Name of the format; by the content if empty.
    text : TextSpec
        Layout of a text file where it is known.

    Raises
    ------
    InputError
        If the file can't be read as that.
    """
    file = as_path(path)
    found = format_of(file)
    name = kind or found
    known = readers()
    check_name("format", name, known)
    if name != found and {name, found} != {"matlab", "hdf5"}:  # MATLAB 7.3 writes HDF5
        raise InputError(f"{file}: holds {found}, not {name}; give a map for {found}")
    return known[name].read(file, text)
