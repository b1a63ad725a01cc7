"""The EuRoC / ASL layout: a folder ``imuN`` per chip, with ``data.csv`` and ``sensor.yaml``."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gfimu.array.parts.part import Part
from gfimu.base.errors import InputError
from gfimu.base.files.atomic_file import write_text
from gfimu.base.files.outputs import check_parent
from gfimu.calibration.exporting.chips import ChipStream, chips_of, stamps_ns
from gfimu.recording import Recording

__all__ = ["write_euroc"]

_HEAD = "#timestamp [ns]," + ",".join(
    [*(f"w_RS_S_{axis} [rad s^-1]" for axis in "xyz"), *(f"a_RS_S_{axis} [m s^-2]" for axis in "xyz")]
)


def write_euroc(folder: str | Path, recording: Recording) -> list[Path]:
    """Write each tri-axial chip of a recording as ``imuN/data.csv`` and ``imuN/sensor.yaml``; returns the files.

    The rate is the recording's gyro, and ``nan`` without one. ``T_BS`` takes a point of the sensor's frame to the
    body's.

    Raises
    ------
    InputError
        If the folder is there already, the one above it is not, or a chip has not three axes at right angles.
    """
    root = Path(folder)
    check_parent(root)
    if root.exists():
        raise InputError(f"{root}: is there already; choose another folder")
    streams = list(chips_of(recording))
    stamps = stamps_ns(recording)
    written = []
    for index, stream in enumerate(streams):
        place = root / f"imu{index}"
        place.mkdir(parents=True)
        rate = np.full_like(stream.force, np.nan) if stream.rate is None else stream.rate
        rows = (
            f"{stamp}," + ",".join(f"{value:.12g}" for value in row)
            for stamp, row in zip(stamps, np.column_stack([rate, stream.force]), strict=True)
        )
        write_text(place / "data.csv", "\n".join([_HEAD, *rows]) + "\n")
        write_text(place / "sensor.yaml", _sensor(stream, recording))
        written += [place / "data.csv", place / "sensor.yaml"]
    return written


def _sensor(stream: ChipStream, recording: Recording) -> str:
    """Return the text of ``sensor.yaml``."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = stream.chip.axes.T, stream.chip.position
    array = recording.array
    lines = [
        "#Default imu sensor yaml file",
        "sensor_type: imu",
        f"comment: chip {stream.chip.name}, {stream.chip.part}",
        "T_BS:",
        "  cols: 4",
        "  rows: 4",
        f"  data: [{', '.join(f'{value:.9g}' for value in pose.ravel())}]",
        f"rate_hz: {recording.sample_rate:.9g}",
    ]
    if array is not None:
        part = Part.load(stream.chip.part, array.part_files)
        density = float(np.mean(part.noise_std_100_hz)) / np.sqrt(100.0)  # of a sample: density · √rate
        lines.append(f"accelerometer_noise_density: {density:.6g}  # m/s^2/sqrt(Hz), data sheet")
    return "\n".join(lines) + "\n"
