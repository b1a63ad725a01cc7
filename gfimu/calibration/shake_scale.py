"""Scale of the positions from α = dω/dt in the band in which a hand shakes, where the sampling resolves it.

Positions s times larger go with rates ω/√s and accelerations α/s: the field of the chips is the same. α = dω/dt then
holds for one s only. With b the slope of α against dω/dt at the positions of a fit, s = b².
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

__all__ = ["scale_from_band"]

Floats = NDArray[np.float64]

_BAND_HZ = (2.0, 8.0)
_BLOCK_S = 1.0


def scale_from_band(parts: list[tuple[Floats, Floats, Floats]]) -> tuple[float, float]:
    """Compare α with dω/dt in the band from 2 to 8 Hz.

    Parameters
    ----------
    parts : list of (t, alpha, slope)
        Of each shake: times (n,), s, angular acceleration by the chips and derivative of the rate, (n, 3), rad/s².

    Returns
    -------
    scale, std : float
        Factor for the positions, and its standard deviation from the scatter of blocks of one second.
    """
    products: list[Floats] = []
    squares: list[Floats] = []
    for t, alpha, slope in parts:
        rate = (len(t) - 1) / float(t[-1] - t[0])
        band = (_BAND_HZ[0], min(_BAND_HZ[1], 0.4 * rate))
        sections = butter(4, band, btype="band", fs=rate, output="sos")
        even = np.linspace(t[0], t[-1], len(t))
        seen, tied = (
            sosfiltfilt(sections, np.column_stack([np.interp(even, t, column) for column in one.T]), axis=0)
            for one in (alpha, slope)
        )
        edges = np.arange(0, len(t), max(round(_BLOCK_S * rate), 4))
        products.append(np.add.reduceat(np.sum(seen * tied, axis=1), edges))
        squares.append(np.add.reduceat(np.sum(tied**2, axis=1), edges))
    product, square = np.concatenate(products), np.concatenate(squares)
    slope_of_all = float(product.sum() / square.sum())
    blocks = product - slope_of_all * square
    count = len(blocks)
    std = float(np.sqrt(np.sum(blocks**2) * count / max(count - 1, 1)) / square.sum())
    return slope_of_all**2, 2.0 * abs(slope_of_all) * std
