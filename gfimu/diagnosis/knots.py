"""Where the knots of a drive go: a twentieth of a second apart, and closer where the drive bends sharply."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["KNOT_SPACING", "intervals_to_cut"]

KNOT_SPACING = 0.05
"""Of a drive before any interval is cut, s."""

_BLUR = 0.3  # of the white noise of the reference: what an interval may miss of it
_BLUR_TOGETHER = 0.5  # the same of the acceleration, of the noise of all channels together
_LEAST_WIDTH = 0.4  # sample periods of an interval that is cut in two
_MOST_INTERVALS = 3.0  # times as many as without finer ones, for each costs


def intervals_to_cut(
    widths: NDArray[np.float64],
    bend: NDArray[np.float64],
    *,
    sample_period: float,
    acuity: float,
    reference_noise: float,
    is_angle: bool,
) -> NDArray[np.bool_]:
    """Return which knot intervals miss something of a drive, the sharpest bends first where these are too many.

    Parameters
    ----------
    widths : ndarray, shape (k,)
        Of the intervals, s.
    bend : ndarray, shape (k,)
        Rms of what the third derivative of the rate changes by at the ends of each, rad/s⁴.
    sample_period : float
        Of the channels, s.
    acuity : float
        How far an angular acceleration moves all channels together, standard deviations per rad/s².
    reference_noise : float
        White noise of the reference, rad/s or rad.
    is_angle : bool
        Whether the reference is an angle.
    """
    # What a piecewise parabola misses of an acceleration that bends by `bend` over its interval, and, as that goes
    # to and fro once per interval, what it misses of the rate or the angle that the reference reads.
    missed = bend * widths**2 / 16.0
    misread = missed * (widths / (2 * np.pi)) ** (2 if is_angle else 1)
    cut = (missed * acuity > _BLUR_TOGETHER) | (misread > _BLUR * reference_noise)
    cut &= widths > _LEAST_WIDTH * sample_period
    most = int(_MOST_INTERVALS * widths.sum() / KNOT_SPACING) - len(widths)
    if cut.sum() > most > 0:
        cut &= bend >= np.sort(bend[cut])[-most]
    return np.asarray(cut & (most > 0))
