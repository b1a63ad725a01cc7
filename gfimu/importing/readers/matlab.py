"""MATLAB files, read in a process of their own: their parser ends the whole process on some damaged files.

``python -m gfimu.importing.readers.matlab FILE OUT`` is that process. It writes the vectors and matrices of numbers to
an ``.npz`` file, or a line that says why not to standard error.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.errors import InputError
from gfimu.files.input_file import parsing
from gfimu.importing.column_map import TextSpec
from gfimu.importing.raw_table import RawFile
from gfimu.importing.readers.tables import gather, read_hdf5, tables_by_length

__all__ = ["read_matlab"]

_LONGEST_S = 120.0  # numerical: that reading a file may take
_NEWER = 3  # exit code for a file of version 7.3
_REFUSED = 2


def read_matlab(path: Path, text: TextSpec = TextSpec()) -> RawFile:
    """Read the variables of a MATLAB file; those of equal length are one table."""
    with tempfile.TemporaryDirectory(prefix="gfimu-matlab-") as folder:
        out = Path(folder) / "columns.npz"
        try:
            done = subprocess.run(
                [sys.executable, "-m", __name__, str(path.resolve()), str(out)],
                capture_output=True,
                timeout=_LONGEST_S,
                check=False,
            )
        except subprocess.TimeoutExpired:
            raise InputError(f"{path}: damaged MATLAB file (reading it takes too long); save it again") from None
        if done.returncode == _NEWER:
            return read_hdf5(path, text)
        if done.returncode == _REFUSED:
            reason = done.stderr.decode(errors="replace").strip().splitlines()[-1:] or ["unreadable"]
            raise InputError(f"{path}: {reason[0]}")
        if done.returncode or not out.exists():
            raise InputError(f"{path}: damaged MATLAB file (its parser fails on it); save it again")
        with np.load(out, allow_pickle=False) as content:
            found = dict(
                zip(content["names"].tolist(), (content[f"c{k}"] for k in range(len(content["names"]))), strict=True)
            )
    return tables_by_length(path, "matlab", found)


def _main(file: str, out: str) -> int:
    """Read a file and write its columns; return the exit code."""
    from scipy.io import loadmat

    found: dict[str, NDArray[Any]] = {}
    try:
        with parsing("", "MATLAB file", "save it again"):
            try:
                content = loadmat(file, simplify_cells=True)
            except NotImplementedError:  # version 7.3 is HDF5
                return _NEWER
            for name, value in content.items():
                if not name.startswith("__"):
                    gather(name, value, found)
    except InputError as error:
        sys.stderr.write(f"{str(error).removeprefix(': ')}\n")
        return _REFUSED
    columns: dict[str, Any] = {f"c{k}": one for k, one in enumerate(found.values())}
    np.savez(out, names=np.array(list(found), dtype=str), **columns)
    return 0


if __name__ == "__main__":
    sys.exit(_main(*sys.argv[1:3]))
