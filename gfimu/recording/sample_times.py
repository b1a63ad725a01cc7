"""Sample times in short: their period, and the gaps in them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["gaps_of", "timing"]

_GAP = 1.5  # sample periods


def gaps_of(t_s: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return the samples behind which more than 1.5 median sample periods pass, of two times (n,), s, or more."""
    steps = np.diff(t_s)
    return np.flatnonzero(steps > _GAP * np.median(steps))


def timing(t_s: NDArray[np.float64]) -> str:
    """Return samples, length, rate and gaps of sample times (n,), s, in words."""
    count = f"{len(t_s)} samples" if len(t_s) != 1 else "1 sample"
    if len(t_s) < 2:
        return count
    period = float(np.median(np.diff(t_s)))
    gaps = len(gaps_of(t_s))
    rate = f" at {1.0 / period:.4g} Hz" if period > 0 else ""
    gap_text = f", {gaps} gap{'s' if gaps > 1 else ''}" if gaps else ""
    return f"{count}, {float(t_s[-1] - t_s[0]):.4g} s{rate}{gap_text}"
