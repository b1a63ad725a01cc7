"""The rate vector of a body that turns about a known axis only: its tachometer times the axis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gfimu.array.array import AccelerometerArray
from gfimu.recording.recording import Recording

__all__ = ["with_axis_gyro"]

_COLUMNS = ("gyro_x_rad_s", "gyro_y_rad_s", "gyro_z_rad_s")


def with_axis_gyro(recording: Recording, array: AccelerometerArray) -> Recording:
    """Return a recording whose tachometer stands for a gyro, where the array turns about a known axis.

    A wheel on a moving body has no gyro, and its hub's acceleration is unknown: it is a free body whose rate is along
    the axle.

    Parameters
    ----------
    recording : Recording
        With ``tacho_rad_s``; one that has a gyro, or no tachometer, is returned as it is.
    array : AccelerometerArray
        Its ``turning_axis`` gives the direction in the body.
    """
    have = recording.reference
    if array.turning_axis is None or "tacho_rad_s" not in have or any(name in have for name in _COLUMNS):
        return recording
    direction = array.turning_axis.direction / np.linalg.norm(array.turning_axis.direction)
    gyro = {name: have["tacho_rad_s"] * part for name, part in zip(_COLUMNS, direction, strict=True)}
    return replace(recording, reference={**have, **gyro})
