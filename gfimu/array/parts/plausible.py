"""What a value in a recording can be at all: beyond that a sample is corrupt, and no measurement.

A damaged file or link gives values such as 1e19, or infinity. They say nothing of the motion, so they are left out
like a missing reading. A reading at the rail of its part is a measurement and stays.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.parts.files import part_table
from gfimu.base.errors import InputError

__all__ = ["MOST_CORRUPT", "largest_of_array", "largest_of_part", "largest_reference", "rails_of_array"]

MOST_CORRUPT = 0.5
"""Share of corrupt readings, of all, beyond which the unit must be wrong and not some samples."""

_RANGES = 10.0  # times a part's full range: eight for a chip set to the wrong range, and its offset and gain error
_BEYOND = 1.2  # times a part's full range: by choice, gain and offset of a part that reads its rail
_LARGEST = 1e4  # m/s², where no part is known: a thousand times gravity
_LARGEST_REFERENCE = {"rad_s": 1e5, "rad": 1e9, "degC": 1e4}  # a million revolutions a minute; years of turning


def rails_of_array(array: AccelerometerArray) -> NDArray[np.float64]:
    """Return what no channel set to its part's full range can read, shape (c,), m/s²; infinite for an unknown part."""
    ranges = {chip.part: _full_range(chip.part, array.part_files) for chip in array.chips}
    return np.array([_BEYOND * ranges[chip.part] for chip in array.chips for _ in chip.channels])


def largest_of_part(part: str | None, files: Mapping[str, str] | None = None) -> float:
    """Return the largest specific force that a reading of a part can be, m/s²; a general limit for an unknown part."""
    full_range = np.inf if part is None else _full_range(part, files)
    return _RANGES * full_range if full_range < np.inf else _LARGEST


def _full_range(part: str, files: Mapping[str, str] | None) -> float:
    """Return the full range of a part, m/s²; infinite where it is not known."""
    try:
        table: Mapping[str, Any] = part_table(part, files or {})[0]
    except InputError:
        return np.inf  # reported where the part is needed
    full_range = table.get("full_range_m_s2")
    usable = isinstance(full_range, int | float) and not isinstance(full_range, bool) and 0 < full_range < np.inf
    return float(full_range) if usable else np.inf  # type: ignore[arg-type]


def largest_of_array(array: AccelerometerArray) -> NDArray[np.float64]:
    """Return the largest reading of each channel by its part, shape (c,), m/s²."""
    parts = {chip.part: largest_of_part(chip.part, array.part_files) for chip in array.chips}
    return np.array([parts[chip.part] for chip in array.chips for _ in chip.channels])


def largest_reference(column: str) -> float:
    """Return the largest value of a reference by its SI column name, in the unit of the name."""
    return next((most for unit, most in _LARGEST_REFERENCE.items() if column.endswith(f"_{unit}")), np.inf)
