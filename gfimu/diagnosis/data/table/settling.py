"""When the chips of a run converted, where their marks leave it open: by what their readings say of the motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.data.conversions import Conversions
from gfimu.diagnosis.data.run import Run

__all__ = ["settled"]


def settled(run: Run, prediction: NDArray[np.float64], chip: NDArray[np.intp], rate: NDArray[np.float64]) -> Run:
    """Return a run whose chips converted when their readings agree best with a prediction.

    Only what the marks leave open is estimated, with its prior, and against the chips whose times are known: a lag that
    all share is not taken away. Of each channel's residual a constant and what depends on rate, its square and its
    derivative are left out: these are what wrong biases, gains and positions leave.

    Parameters
    ----------
    run : Run
        The run.
    prediction : ndarray, shape (n, c)
        What the simulation predicts for it, m/s².
    chip : ndarray of int, shape (c,)
        Chip of each channel.
    rate : ndarray, shape (n,)
        Rate of the table, rad/s.
    """
    times = run.conversions
    if times is None or not times.unknown.any():
        return run
    columns = [(mode, k) for mode in range(2) for k in range(times.after.shape[1]) if times.unknown[mode, :, k].any()]
    slopes = np.gradient(prediction, run.sample_period, axis=0)
    other = np.column_stack([np.ones(len(rate)), rate, rate**2, np.gradient(rate, run.sample_period)])
    normal, right = np.diag([0.0, *[1.0] * len(columns)]), np.zeros(len(columns) + 1)
    for channel, k in enumerate(chip):
        jump = np.abs(np.diff(times.after[:, k], prepend=times.after[0, k])) > Conversions.JUMP * run.sample_period
        used = run.valid[:, channel] & ~(jump | np.roll(jump, -1))
        slope = slopes[used, channel]
        mine = np.column_stack([slope, *(slope * times.unknown[mode, used, k] * (k == of) for mode, of in columns)])
        both = np.column_stack([mine, (run.readings - prediction)[used, channel]])
        both -= other[used] @ np.linalg.lstsq(other[used], both, rcond=None)[0]
        weighted = both / max(float(np.std(both[:, -1])), np.finfo(float).tiny)
        normal += weighted[:, :-1].T @ weighted[:, :-1]
        right += weighted[:, :-1].T @ weighted[:, -1]
    sizes = np.linalg.lstsq(normal, right, rcond=None)[0][1:]
    after = times.after.copy()
    for (mode, k), size in zip(columns, sizes, strict=True):
        after[:, k] += size * times.unknown[mode, :, k]
    return replace(run, conversions=replace(times, after=after, unknown=np.zeros_like(times.unknown)))
