"""A first-order low pass of sampled series: of a sensing chain, a chip, a tachometer or a temperature."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

__all__ = ["low_pass"]


def low_pass(readings: NDArray[np.float64], t: NDArray[np.float64], tau: float) -> NDArray[np.float64]:
    """First-order low pass of samples joined by a cubic spline, steady before the first sample.

    With D = d/dt, τDy + y = f has on each cubic piece of f the particular solution P = f − τDf + τ²D²f − τ³D³f.
    Straight lines between samples are too coarse: at 100 Hz they miss 4 % of what 3 ms of lag do at 3 Hz.
    """
    spline = CubicSpline(t, readings)
    steps = np.diff(t)[:, None]
    pieces = spline.c  # (4, n - 1, c), the highest power first
    last = t[-1] - t[-2]
    slope = np.vstack([pieces[2], (3.0 * last * pieces[0, -1:] + 2.0 * pieces[1, -1:]) * last + pieces[2, -1:]])
    bend = np.vstack([2.0 * pieces[1], 6.0 * last * pieces[0, -1:] + 2.0 * pieces[1, -1:]])
    smooth = readings - tau * slope + tau**2 * bend
    jerk = tau**3 * np.diff(bend, axis=0) / steps  # constant over a piece
    decay = np.exp(-float(np.median(steps)) / tau)
    driven = (smooth[1:] - jerk) - decay * (smooth[:-1] - jerk)
    later, _ = lfilter([1.0], [1.0, -decay], driven, axis=0, zi=decay * readings[:1])
    return np.vstack([readings[:1], later])
