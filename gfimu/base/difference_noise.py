"""White noise of a smooth series."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["difference_noise"]


def difference_noise(series: NDArray[np.float64]) -> float:
    """Return the white noise of a smooth series (n,) from its third differences (robust), in its unit."""
    third = np.diff(series, n=3)
    if not len(third):
        return 0.0
    return 1.4826 * float(np.median(np.abs(third - np.median(third)))) / np.sqrt(20.0)
