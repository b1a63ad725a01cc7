"""Spikes: isolated values far off their neighbours, in the channels and in the reference."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from gfimu.diagnosis.data.run import Run, difference_noise

__all__ = ["channel_spikes", "reference_spikes"]

_SPIKE = 8.0  # noise
_ROUGH = 6.0  # how much neighbours usually differ there
_NEIGHBOURS, _AROUND = 5, 9


def channel_spikes(run: Run, white: NDArray[np.float64], quantum: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Mark isolated readings, shape (n, c), far off the median of their five neighbours.

    Parameters
    ----------
    run : Run
        The run.
    white, quantum : ndarray, shape (c,)
        White noise and step of each channel, m/s².
    """
    readings = run.readings.copy()
    for column, valid in zip(readings.T, run.valid.T, strict=True):
        if valid.any():  # a gap is no neighbour
            column[~valid] = np.interp(run.t[~valid], run.t[valid], column[valid])
    smooth = median_filter(readings, size=(_NEIGHBOURS, 1), mode="nearest")
    jump = np.abs(readings - smooth)
    differences = np.abs(np.diff(readings, axis=0, prepend=readings[:1]))
    rough = median_filter(differences, size=(_AROUND, 1), mode="nearest")
    return run.valid & (jump > _SPIKE * np.maximum(white, 0.5 * quantum) + _ROUGH * rough)


def reference_spikes(run: Run) -> NDArray[np.bool_]:
    """Mark isolated values, shape (n,), of the reference: a pulse too many or too few, or interference."""
    known = np.flatnonzero(run.reference_valid)
    found = np.zeros(len(run.t), dtype=bool)
    while len(known) > _AROUND:  # several close to each other hide among themselves
        values = run.reference[known]
        differences = np.abs(np.diff(values, prepend=values[:1]))
        if not differences.any():
            break
        # A coarse reference differs by a step or not at all; the least difference of a fine one is below its noise.
        noise = max(difference_noise(values), float(differences[differences > 0.0].min()))
        rough = median_filter(differences, size=_AROUND, mode="mirror")
        jump = np.abs(values - median_filter(values, size=_NEIGHBOURS, mode="mirror"))
        wrong = jump > _SPIKE * noise + _ROUGH * rough
        if not wrong.any():
            break
        found[known[wrong]] = True
        known = known[~wrong]
    return found
