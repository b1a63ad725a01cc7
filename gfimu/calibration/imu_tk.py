"""Reader of the plain text recordings that calibration data sets such as IMU-TK's come in."""

from __future__ import annotations

import io
import warnings
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gfimu.base.errors import InputError
from gfimu.base.files.input_file import as_path
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.calibration.coverage import fit_sphere
from gfimu.calibration.poses import UNTIMED, TablePolicy, is_pose_table
from gfimu.recording import Recording
from gfimu.recording.importing.guessing.units import NEAR
from gfimu.recording.reading import read_bytes

__all__ = ["read_text_triad"]

_LONGEST_REASON = 160
_GRAVITY = {1.0: STANDARD_GRAVITY, STANDARD_GRAVITY: 1.0}  # length in g and in m/s², and what makes it m/s²


def read_text_triad(path: str | Path) -> Recording:
    """Read a text file of rows ``time x y z``: seconds and raw counts of one triad.

    Rows of three numbers for each chip without a time, or with a running number in its place, are a table of poses, one
    each (`gfimu.calibration.poses`). Their unit is g or m/s² where gravity has that length, and else counts.

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
        If the file is missing or has not that many columns of numbers, or its time does not increase.
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
    if table.shape[1] % 3 == 0 and len(table) >= TablePolicy.fewest:
        return _pose_rows(np.arange(len(table), dtype=float), table, {"source": file.name, UNTIMED: True})
    if table.shape[1] % 3 != 1 or table.shape[1] < 4 or len(table) < 2:
        raise InputError(
            f"{file}: {table.shape[0]} rows of {table.shape[1]} columns; needed: time, x, y, z, or "
            f"{TablePolicy.fewest} or more poses x, y, z"
        )
    backwards = np.diff(table[:, 0]) <= 0
    if backwards.any() or not np.isfinite(table).all():
        raise InputError(
            f"{file}: time does not increase at row {int(np.argmax(backwards)) + 2}, or a value is not finite"
        )
    rows = _pose_rows(table[:, 0], table[:, 1:], {"source": file.name})
    return rows if is_pose_table(rows, "auto") else replace(rows, readings=table[:, 1:], unit="lsb")


def _pose_rows(times: NDArray[np.float64], table: NDArray[np.float64], metadata: Mapping[str, object]) -> Recording:
    """Rows of poses, (p, 3k), in m/s² where the length of gravity shows their unit."""
    try:
        _, radius = fit_sphere(table[np.isfinite(table).all(axis=1), :3])
    except InputError:
        radius = np.nan
    factors = [factor for length, factor in _GRAVITY.items() if abs(radius / length - 1.0) < NEAR]
    channels = tuple(f"a{chip}{axis}" for chip in range(1, table.shape[1] // 3 + 1) for axis in (1, 2, 3))
    unit = "m_s2" if factors else "lsb"
    return Recording(times, table * (factors or [1.0])[0], channels, unit=unit, metadata=metadata)
