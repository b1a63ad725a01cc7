"""Tri-axial chips of a recording, each as an inertial unit of its own."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray, Chip
from gfimu.base.errors import InputError
from gfimu.recording import Recording
from gfimu.recording.quantities import GYRO_COLUMNS
from gfimu.recording.timing.reference_times import reference_on_rows

__all__ = ["ChipStream", "chips_of", "stamps_ns"]


@dataclass(frozen=True)
class ChipStream:
    """One chip's specific force, and the rate beside it.

    Parameters
    ----------
    chip : Chip
        The chip with its place and axes; at the origin along the body axes where the recording carries no array.
    force : ndarray, shape (n, 3)
        Along its sensing axes, m/s².
    rate : ndarray, shape (n, 3), or None
        Of the recording's gyro, along the same axes, rad/s.
    """

    chip: Chip
    force: NDArray[np.float64]
    rate: NDArray[np.float64] | None


def chips_of(recording: Recording) -> Iterator[ChipStream]:
    """Yield the tri-axial chips of a recording.

    Raises
    ------
    InputError
        If a chip has not three axes at right angles, as these formats need.
    """
    array = recording.array
    chips = array.chips if array is not None else _guessed(recording)
    gyro = None
    recording = reference_on_rows(recording)  # a message has one time
    if all(name in recording.reference for name in GYRO_COLUMNS):
        gyro = np.column_stack([recording.reference[name] for name in GYRO_COLUMNS])
    for chip in chips:
        if chip.axes.shape != (3, 3) or np.abs(chip.axes @ chip.axes.T - np.eye(3)).max() > 1e-3:
            raise InputError(
                f"chip {chip.name} has not three axes at right angles, as this format needs; write .csv or .parquet"
            )
        one = AccelerometerArray("one", (chip,))
        yield ChipStream(chip, recording.for_array(one), None if gyro is None else gyro @ chip.axes.T)


def _guessed(recording: Recording) -> tuple[Chip, ...]:
    names = dict.fromkeys(channel[:-1] for channel in recording.channels)
    return tuple(Chip(name, np.zeros(3), np.eye(3)) for name in names)


def stamps_ns(recording: Recording) -> NDArray[np.int64]:
    """Return the times as nanoseconds on the clock of the file that the recording came from, (n,)."""
    origin = recording.metadata.get("time_origin_s", 0.0)
    first = round(float(origin) * 1e9) if isinstance(origin, int | float) else 0
    return first + np.round(recording.t_s * 1e9).astype(np.int64)
