"""MATLAB files, read in a process of their own: their parser ends the whole process on some damaged files.

``python -m gfimu.recording.importing.readers.matlab FILE OUT BYTES`` is that process. It writes the vectors and
matrices of numbers to an ``.npz`` file, or a line that says why not to standard error; BYTES is the memory that it may
take.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import zlib
from pathlib import Path
from typing import Any, Literal

import numpy as np

from gfimu.base.child_process import run_module
from gfimu.base.errors import InputError
from gfimu.base.files.input_file import as_path
from gfimu.base.files.memory import MemoryLimit, with_memory
from gfimu.recording.importing.column_map import TextSpec
from gfimu.recording.importing.raw_table import RawFile
from gfimu.recording.importing.readers.hdf5 import read_hdf5
from gfimu.recording.importing.readers.matrices import Gathered
from gfimu.recording.reading import parsing

__all__ = ["read_matlab"]

_LONGEST_S = 120.0  # numerical: that reading a file may take
_TIMES_UNPACKED = 1.5  # numerical: memory for a byte of the variables, measured
_HEADER, _TAG = 128, 8  # bytes, before all variables and before each
_PACKED = 15  # kind of a variable that is packed
_LOOKED_AT = 4096  # bytes that hold its tag
_NEWER = 3  # exit code for a file of version 7.3
_REFUSED = 2


def read_matlab(path: Path, text: TextSpec = TextSpec()) -> RawFile:
    """Read the variables of a MATLAB file; those of equal length are one table."""
    with tempfile.TemporaryDirectory(prefix="gfimu-matlab-") as folder:
        out = Path(folder) / "columns.npz"
        try:
            most = str(MemoryLimit.of(path).most)
            done = run_module(__name__, str(path.resolve()), str(out), most, timeout=_LONGEST_S)
        except subprocess.TimeoutExpired:
            raise InputError(f"{path}: damaged MATLAB file (reading it takes too long); save it again") from None
        if done.returncode == _NEWER:
            return read_hdf5(path, text)
        if done.returncode == _REFUSED:
            reason = done.stderr.decode(errors="replace").strip().splitlines()[-1:] or ["unreadable"]
            raise InputError(f"{path}: {reason[0].removeprefix(f'{path.resolve()}: ')}")
        if done.returncode or not out.exists():
            raise InputError(f"{path}: damaged MATLAB file (its parser fails on it); save it again")
        with np.load(out, allow_pickle=False) as content:
            found = Gathered({name: content[f"c{k}"] for k, name in enumerate(content["names"].tolist())})
            found.lines.extend(content["lines"].tolist())
    return found.file(path, "matlab")


def _main(file: str, out: str, most: str) -> int:
    """Read a file and write its columns; return the exit code."""
    from scipy.io import loadmat

    path = as_path(with_memory(file, int(most)))
    found = Gathered()
    try:
        with parsing(path, "MATLAB file", "save it again"):
            MemoryLimit.of(path).needs(_TIMES_UNPACKED * _unpacked_size(path))
            try:
                content = loadmat(file, simplify_cells=True)
            except NotImplementedError:  # version 7.3 is HDF5
                return _NEWER
            found.add("", {name: value for name, value in content.items() if not name.startswith("__")})
    except InputError as error:
        sys.stderr.write(f"{error}\n")
        return _REFUSED
    columns: dict[str, Any] = {f"c{k}": one for k, one in enumerate(found.matrices.values())}
    np.savez(out, names=np.array(list(found.matrices), dtype=str), lines=np.array(found.lines, dtype=str), **columns)
    return 0


def _unpacked_size(path: Path) -> int:
    """Return the bytes of all variables of a file, unpacked, as their tags state them."""
    size = 0
    with path.open("rb") as stream:
        order: Literal["little", "big"] = "little" if stream.read(_HEADER)[-2:] == b"IM" else "big"
        while len(tag := stream.read(_TAG)) == _TAG:
            kind, length = (int.from_bytes(part, order) for part in (tag[:4], tag[4:]))
            start = stream.tell()
            if kind == _PACKED:
                tag = zlib.decompressobj().decompress(stream.read(min(length, _LOOKED_AT)), _TAG)
            size += int.from_bytes(tag[4:], order)
            stream.seek(start + length)
    return size


if __name__ == "__main__":
    sys.exit(_main(*sys.argv[1:4]))
