"""A smooth ramp: the quintic from one value to another whose first and second derivatives vanish at both ends."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["PEAK_OF_RAMP", "smooth_ramp"]

PEAK_OF_RAMP = 1.875
"""Largest slope of a smooth ramp over its mean: that of 10s³ − 15s⁴ + 6s⁵ at s = ½."""


def smooth_ramp(start: float, stop: float, duration: float) -> NDArray[np.float64]:
    """Return start + (stop − start)·(10s³ − 15s⁴ + 6s⁵), s = t/duration, as a polynomial of the time t.

    Parameters
    ----------
    start, stop : float
        Values at its ends, in any unit.
    duration : float
        Length, s, above zero.

    Returns
    -------
    ndarray, shape (6,)
        Coefficients, the highest power of t first, in that unit per power of a second.
    """
    step = stop - start
    return np.array([6 * step / duration**5, -15 * step / duration**4, 10 * step / duration**3, 0.0, 0.0, start])
