"""The readers by the name of their format, and which one a file needs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from gfimu.errors import InputError, unknown_name
from gfimu.importing.column_map import TextSpec
from gfimu.importing.raw_table import RawFile
from gfimu.importing.readers.logs import read_bag, read_mcap, read_ulog
from gfimu.importing.readers.tables import read_archive, read_hdf5, read_matlab, read_parquet
from gfimu.importing.readers.text import is_text, read_text

__all__ = ["READERS", "format_of", "read_foreign"]

READERS: dict[str, Callable[[Path, TextSpec], RawFile]] = {
    "text": read_text,
    "parquet": read_parquet,
    "zip": read_archive,
    "matlab": read_matlab,
    "hdf5": read_hdf5,
    "ulog": read_ulog,
    "mcap": read_mcap,
    "rosbag": read_bag,
}
"""Readers by the name of the format."""

_HEADS = {
    b"PAR1": "parquet",
    b"PK\x03\x04": "zip",
    b"\x89HDF": "hdf5",
    b"ULog": "ulog",
    b"\x89MCA": "mcap",
    b"MATL": "matlab",
    b"#ROS": "rosbag",
    b"SQLi": "rosbag",
    b"\x1f\x8b\x08": "text",
}


def format_of(path: Path) -> str:
    """Return the format of a file by its first bytes.

    Raises
    ------
    InputError
        If it is missing, empty, or of no format that is known.
    """
    if path.is_dir():
        if (path / "metadata.yaml").is_file():
            return "rosbag"
        raise InputError(f"{path}: a folder that is no ROS 2 bag; give a file")
    try:
        with path.open("rb") as stream:
            head = stream.read(4096)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; check the path") from None
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}; check the path") from None
    if not head:
        raise InputError(f"{path}: empty file; record again or give another file")
    for mark, name in _HEADS.items():
        if head.startswith(mark):
            return name
    if is_text(head):
        return "text"
    raise InputError(f"{path}: a binary file of unknown format; known are {', '.join(READERS)}")


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
    file = Path(path)
    found = format_of(file)
    name = kind or found
    if name not in READERS:
        raise unknown_name("format", name, READERS)
    if name != found and {name, found} != {"matlab", "hdf5"}:  # MATLAB 7.3 writes HDF5
        raise InputError(f"{file}: holds {found}, not {name}; give a map for {found}")
    return READERS[name](file, text)
