"""Opening a recording in the unit that a calibration works in."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np
import pyarrow as pa

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError
from gfimu.base.files.input_file import is_ordinary
from gfimu.calibration.imu_tk import read_text_triad
from gfimu.calibration.poses import UNTIMED
from gfimu.calibration.result import Calibration
from gfimu.recording import Recording
from gfimu.recording.carried_array import array_difference
from gfimu.recording.formats import format_of_recording, open_run
from gfimu.recording.mapped import MappedFile, RecordingSource, mapped_reference
from gfimu.recording.tables.column_file import open_columns

__all__ = ["open_calibrated", "open_calibrated_run", "open_poses", "open_references", "open_uncalibrated"]

_TEXT = (".txt", ".txt.gz")


def open_uncalibrated(path: RecordingSource, *, array: AccelerometerArray | None = None) -> Recording:
    """Read a recording to calibrate from: raw counts stay counts, other units become m/s².

    CSV and Parquet recordings, MIMU4444 streams, and plain text of rows ``time x y z`` (``.txt``, ``.txt.gz``) as
    raw counts of one triad.

    Raises
    ------
    InputError
        As `gfimu.Recording.read` and the importers.
    """
    return _open(path, array, None)


def open_poses(path: RecordingSource, *, array: AccelerometerArray | None = None) -> Recording:
    """Read a recording as `open_uncalibrated`, or a CSV or Parquet table of poses, which has no times.

    Raises
    ------
    InputError
        As `open_uncalibrated`.
    """
    if isinstance(path, str | Path) and not str(path).endswith(_TEXT) and format_of_recording(path) is None:
        table = open_columns(path)
        if not any(name == "t" or name.startswith("t_") for name in table.names):
            columns = table.read_as_found(table.names)
            numbers = np.arange(len(next(iter(columns.values()))), dtype=float)
            unit = "lsb" if any(name.endswith("_lsb") for name in columns) else "m_s2"
            read = Recording.from_table(pa.table({"t_s": numbers, **columns}), array=array, unit=unit)
            return replace(read, metadata={**read.metadata, UNTIMED: True})
    return open_uncalibrated(path, array=array)


def open_references(path: RecordingSource) -> Recording:
    """Read a recording that may hold references alone, such as a gyro on a rate table.

    Raises
    ------
    InputError
        As `gfimu.Recording.read`, `gfimu.recording.mapped.mapped_reference` and the importers.
    """
    if isinstance(path, Recording):
        return path
    if isinstance(path, MappedFile) and path.column_map.reference and not path.column_map.channels:
        t, columns, *_ = mapped_reference(path.path, path.column_map)
        return Recording(t, np.empty((len(t), 0)), (), columns)
    if isinstance(path, MappedFile):
        return path.read(None)
    whole = format_of_recording(path)
    if whole is not None:
        return whole.read(cast("Path", path))
    return Recording.read(path, needs_channels=False)


def open_calibrated(path: RecordingSource, calibration: Calibration | None) -> Recording:
    """Read a recording in the unit of a calibration and correct it; without one as `open_uncalibrated`.

    Raises
    ------
    InputError
        As `gfimu.Recording.read`, or if the calibration does not fit the recording.
    """
    if calibration is None:
        return open_uncalibrated(path)
    return calibration.apply(_open(path, None, "lsb" if calibration.unit == "lsb" else "m_s2"))


def open_calibrated_run(
    path: RecordingSource, calibration: Calibration | None, array: AccelerometerArray | None = None
) -> tuple[Recording, AccelerometerArray]:
    """Read a recording with its array and correct both by a calibration, where there is one.

    Readings are corrected by the error models, positions where they were fitted.

    Raises
    ------
    InputError
        As `gfimu.recording.formats.open_run`, or if the calibration does not fit the recording.
    """
    recording, geometry = open_run(path, array)
    if calibration is None:
        return recording, geometry
    if calibration.unit == "lsb" and not isinstance(path, Recording):
        if isinstance(path, MappedFile):
            recording = path.read(geometry, unit="lsb")
        elif format_of_recording(path) is None:
            recording = Recording.read(path, array=geometry, unit="lsb")
    corrected, calibrated = calibration.apply(recording), calibration.calibrated_array(geometry)
    if not isinstance(path, Recording) and _carries(
        recording, geometry
    ):  # another array of its own stays in it, so that the difference is reported
        corrected = corrected.carrying(calibrated)
    return corrected, calibrated


def _carries(recording: Recording, array: AccelerometerArray) -> bool:
    """Whether a recording carries the geometry of ``array``."""
    try:
        own = recording.array
    except InputError:
        return False
    return own is not None and not array_difference(own, array)


def _open(path: RecordingSource, array: AccelerometerArray | None, unit: str | None) -> Recording:
    if isinstance(path, Recording):
        return path
    if isinstance(path, MappedFile):
        return path.read(array, unit=unit)
    if isinstance(path, str | Path) and str(path).endswith(_TEXT) and is_ordinary(path):
        return read_text_triad(path)
    whole = format_of_recording(path)
    if whole is not None:
        return whole.read(cast("Path", path))
    if unit is None:
        names = open_columns(path).names
        unit = "lsb" if any(name.endswith("_lsb") for name in names) else "m_s2"
    return Recording.read(path, array=array, unit=unit)
