"""When the conversions behind one sample take place, for chips that may be set up differently."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from sim.chips.adxl345 import SensorSettings, conversion_offsets
from sim.chips.data_sheet import DataSheet

__all__ = ["conversion_groups"]


def conversion_groups(
    array: AccelerometerArray, settings: SensorSettings
) -> list[tuple[NDArray[np.float64], NDArray[np.intp]]]:
    """Return the channels that convert alike: their conversions against the sample, s, and their columns.

    Parameters
    ----------
    array : AccelerometerArray
        The array; a chip's own output data rate goes before that of the settings.
    settings : SensorSettings
        How the other chips are set up.
    """
    groups: dict[tuple[float, ...], list[int]] = {}
    for index, chip in enumerate(array.chips):
        sheet = DataSheet.load(chip.part, array.part_files)
        offsets = tuple(conversion_offsets(settings.of(chip), sheet).tolist())
        groups.setdefault(offsets, []).extend(np.flatnonzero(array.chip_of_channel == index).tolist())
    return [(np.array(offsets), np.array(columns)) for offsets, columns in groups.items()]
