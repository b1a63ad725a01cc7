"""Whether a chip's readings hold gravity in the unit that they claim: a check that one tri-axial chip allows.

Over whole turns, or at rest, the mean square of the specific force is g² plus that of the motion: it can't be below g².
A file in g or without gravity is; one in mg is beyond the range of the part.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.parts.limits import PartLimits
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.recording.evidence.ways import unit_remedy
from gfimu.recording.recording import Recording

__all__ = ["gravity_text"]

_WINDOW_S = 3.0  # some turns of a wheel or a table, by choice
_LOWEST = 10.0  # per cent of the windows: the quietest are below; by choice
_ONE_G = (0.75, 2.2)  # what a quiet window reads in a file in g: turning adds to it; a quarter of g is 2.45; by choice
_TURNING_G = (0.75, 1.35)  # what gravity that turns reads in a file in g, with the errors of cheap parts; by choice
_NO_GRAVITY = 0.75  # m/s², as much as a bias: below it gravity is not in the readings; by choice


def gravity_text(recording: Recording, array: AccelerometerArray, limits: PartLimits) -> tuple[str, bool]:
    """Say what is odd about the size of gravity in the readings of each tri-axial chip.

    Parameters
    ----------
    recording : Recording
        Readings in m/s².
    array : AccelerometerArray
        The array.
    limits : PartLimits
        What its parts may be off by.

    Returns
    -------
    text : str
        Cause and remedy, one line; empty where nothing is odd, or no chip has three axes.
    refused : bool
        Whether one wrong unit explains it.
    """
    readings = recording.for_array(array)
    chips = array.chip_of_channel
    for index, chip in enumerate(array.chips):
        own = chips == index
        if np.linalg.matrix_rank(chip.axes) < 3:
            continue
        force = readings[:, own] @ np.linalg.pinv(chip.axes).T  # (n, 3)
        size, turning = _sizes(force[np.isfinite(force).all(axis=1)], recording.sample_rate)
        if not np.isfinite(size):
            continue
        least = STANDARD_GRAVITY * (1.0 - float(limits.gain[own].max())) - float(np.linalg.norm(limits.bias[own]))
        most = float(np.linalg.norm(limits.full_range[own]))
        seen = f"the specific force of chip {chip.name} is {size:.3g} m/s² (rms) where it is least"
        if size > most:
            in_mg = size * 1e-3 * STANDARD_GRAVITY > least
            remedy = unit_remedy(recording.unit_from, "mg", "…_mg")
            cause = f"it looks like mg: {remedy}" if in_mg else "check the unit"
            return f"{seen}, beyond the range of its part; {cause}", True
        if size >= least:
            continue
        if _ONE_G[0] < size < _ONE_G[1] or _TURNING_G[0] < turning < _TURNING_G[1]:
            how = f", and gravity turns in it by {turning:.3g} m/s²" if size >= _ONE_G[1] else ""
            cause = f"it looks like it is in g: {unit_remedy(recording.unit_from, 'g', '…_g')}"
            return f"{seen}{how}; gravity alone is 9.81: {cause}", True
        if size < _NO_GRAVITY:
            cause = "it has been taken out of the file; export the specific force, not the linear acceleration"
            return f"{seen}; gravity alone is 9.81: {cause}", True
        return f"{seen}; gravity alone is 9.81: check the unit, or calibrate the chip", False
    return "", False


def _sizes(force: NDArray[np.float64], rate: float) -> tuple[float, float]:
    """Return the rms of the force in the quietest windows and that of its changes within a window, m/s²."""
    length = max(int(_WINDOW_S * rate), 10)
    count = len(force) // length
    if count == 0:
        return float("nan"), float("nan")
    windows = force[: count * length].reshape(count, length, 3)
    ramp = np.linspace(-1.0, 1.0, length)
    ramp /= np.linalg.norm(ramp)
    changes = windows - windows.mean(axis=1, keepdims=True)
    changes = changes - ramp[:, None] * np.einsum("l,wlx->wx", ramp, changes)[:, None, :]
    rms = np.sqrt(np.mean(np.sum(windows**2, axis=2), axis=1))
    turning = np.sqrt(np.mean(np.sum(changes**2, axis=2), axis=1))
    return float(np.percentile(rms, _LOWEST)), float(np.median(turning))
