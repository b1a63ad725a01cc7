"""HDF5 files, as of MATLAB 7.3 and netCDF 4: the data sets of numbers that lie in the file itself."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from gfimu.base.errors import InputError
from gfimu.base.files.memory import MemoryLimit
from gfimu.base.optional_packages import require
from gfimu.recording.importing.column_map import TextSpec
from gfimu.recording.importing.raw_table import RawFile
from gfimu.recording.importing.readers.matrices import Gathered, is_gathered
from gfimu.recording.reading import parsing

__all__ = ["read_hdf5"]

_FILTERS = {1, 2, 3, 4, 5, 6, 32000}  # of HDF5 itself, and the LZF of h5py; another is loaded as code
_LARGEST_ATTRIBUTE = 1000  # numerical: bytes of one that may state something about the samples


def read_hdf5(path: Path, text: TextSpec = TextSpec()) -> RawFile:
    """Read the data sets of an HDF5 file; those of equal length are one table."""
    require(f"{path}: HDF5", "h5py")
    import h5py

    limit = MemoryLimit.of(path)
    found = Gathered()
    sets: list[tuple[str, Any, list[str]]] = []

    def look(name: str, item: Any) -> None:
        for key in item.attrs:
            if item.attrs.get_id(key).get_storage_size() <= _LARGEST_ATTRIBUTE:
                found.add(f"{name}.{key}".lstrip("."), item.attrs[key])
        if isinstance(item, h5py.Dataset) and item.attrs.get("MATLAB_class") != b"char":
            _check_own(path, name, item)
            fields = _fields_of_numbers(item.dtype)
            if fields is not None and (is_gathered(item.shape) or item.size == 1):
                sets.append((name, item, fields))

    def follow(name: str, link: Any) -> str | None:
        return name if isinstance(link, h5py.ExternalLink) else None

    with parsing(path, "HDF5 file", "write it again"), h5py.File(path, "r") as file:
        if (outside := file.visititems_links(follow)) is not None:
            raise InputError(f"{path}: {_shown(outside)} is a link to another file; copy the data into this one")
        look("", file)
        file.visititems(look)
        found.matrices.clear()  # what attributes hold are no samples
        limit.needs(sum(_size(item, fields) for _, item, fields in sets))
        for name, item, fields in sets:
            found.add(name.replace("/", "."), (item.fields(fields) if fields else item)[()])
    return found.file(path, "hdf5")


def _check_own(path: Path, name: str, item: Any) -> None:
    """Refuse a data set that lies in another file, or that a program of another's would unpack; nothing is read."""
    made = item.id.get_create_plist()
    if made.get_external_count():
        raise InputError(f"{path}: data set {_shown(name)} lies in another file; write it into this one")
    if item.is_virtual:
        raise InputError(f"{path}: data set {_shown(name)} is put together of other files; write it into this one")
    unknown = [
        kind for kind in (made.get_filter(index)[0] for index in range(made.get_nfilters())) if kind not in _FILTERS
    ]
    if unknown:
        raise InputError(
            f"{path}: data set {_shown(name)} is packed by filter {unknown[0]}, which is not HDF5's; use gzip"
        )


def _fields_of_numbers(kind: np.dtype[Any]) -> list[str] | None:
    """Return which fields of a data set hold numbers: none by name where all of it does, None where nothing does."""
    if kind.names is None:
        return [] if kind.kind in "iuf" else None
    return [name for name in kind.names if kind[name].base.kind in "iuf"] or None


def _size(item: Any, fields: list[str]) -> int:
    """Return the memory that reading a data set takes, bytes: itself, and a chunk that is unpacked."""
    width = sum(item.dtype[name].itemsize for name in fields) or item.dtype.itemsize
    chunk = math.prod(item.chunks) * item.dtype.itemsize if item.chunks else 0
    return math.prod(item.shape) * width + chunk


def _shown(name: str) -> str:
    return repr(name[:80])
