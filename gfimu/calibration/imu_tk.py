"""Reader of the plain text recordings that calibration data sets such as IMU-TK's come in."""

from __future__ import annotations

import io
import warnings
from pathlib import Path

import numpy as np

from gfimu.base.errors import InputError
from gfimu.base.files.input_file import as_path
from gfimu.recording import Recording
from gfimu.recording.reading import read_bytes

__all__ = ["read_text_triad"]

_LONGEST_REASON = 160


def read_text_triad(path: str | Path) -> Recording:
    """Read a text file of rows ``time x y z``: seconds and raw counts of one triad.

    Parameters
    ----------
    path : str or Path
        Text file, optionally gzipped, columns separated by blanks; lines that start with # are skipped.

    Returns
    -------
    Recording
        Readings with ``unit="lsb"``.

    Raises
    ------
    InputError
        If the file is missing or not four columns of numbers, or its time does not increase.
    """
    file = as_path(path)
    content = read_bytes(file)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of a file without a row: refused below
            table = np.loadtxt(io.StringIO(content.decode()), ndmin=2)
    except (ValueError, UnicodeDecodeError) as error:
        reason = " ".join(str(error).split())[:_LONGEST_REASON]
        raise InputError(f"{file}: not rows of four numbers ({reason}); columns are time, x, y, z") from None
    if table.shape[1] != 4 or len(table) < 2:
        raise InputError(f"{file}: {table.shape[0]} rows of {table.shape[1]} columns; needed: time, x, y, z")
    backwards = np.diff(table[:, 0]) <= 0
    if backwards.any() or not np.isfinite(table).all():
        raise InputError(
            f"{file}: time does not increase at row {int(np.argmax(backwards)) + 2}, or a value is not finite"
        )
    return Recording(table[:, 0], table[:, 1:], ("a11", "a12", "a13"), unit="lsb", metadata={"source": file.name})
