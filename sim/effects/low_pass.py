"""Low passes of sampled series: first order, of a chain, a tachometer, a temperature; second order, of a proof mass."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.linalg import expm
from scipy.signal import lfilter

__all__ = ["low_pass", "mass_on_spring"]


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


def mass_on_spring(
    readings: NDArray[np.float64], t: NDArray[np.float64], natural: float, damping: float
) -> NDArray[np.float64]:
    """Second-order low pass of samples joined by a cubic spline, steady before the first sample.

    The displacement x of a mass M on a spring k with a damper D obeys M x″ + D x′ + k x = M f (GF-IMU paper, eq. 2,
    f the specific force); the reading y = k x / M obeys y″/ω² + (2ζ/ω) y′ + y = f. For ω → ∞ at constant
    τ = D/k = 2ζ/ω it is the first-order `low_pass`. Exact on each cubic piece of f.

    Parameters
    ----------
    readings : ndarray, shape (n, c)
        Specific forces f along the axes.
    t : ndarray, shape (n,)
        Times, s, equally spaced to within their jitter.
    natural : float
        ω = √(k/M), rad/s.
    damping : float
        ζ = D/(2 M ω).

    Returns
    -------
    ndarray, shape (n, c)
    """
    pieces = CubicSpline(t, readings).c  # (4, n - 1, c), the highest power first
    lag, square = 2.0 * damping / natural, 1.0 / natural**2
    # With D = d/dt the particular solution of (1 + lag D + square D²) y = f, up to the third derivative of a cubic.
    second, third = lag**2 - square, 2.0 * lag * square - lag**3
    step = float(np.median(np.diff(t)))

    def particular(at: float) -> NDArray[np.float64]:
        value = ((pieces[0] * at + pieces[1]) * at + pieces[2]) * at + pieces[3]
        slope = (3.0 * pieces[0] * at + 2.0 * pieces[1]) * at + pieces[2]
        bend, jerk = 6.0 * pieces[0] * at + 2.0 * pieces[1], 6.0 * pieces[0]
        return np.stack([value - lag * slope + second * bend + third * jerk, slope - lag * bend + second * jerk])

    first, last = particular(0.0), particular(step)  # y and y′ without the decaying part, (2, n - 1, c)
    carried = expm(np.array([[0.0, 1.0], [-(natural**2), -2.0 * damping * natural]]) * step)
    state = np.stack([readings[0], np.zeros(readings.shape[1])])  # at rest in equilibrium
    out = [readings[0]]
    for begin, end in zip(np.moveaxis(first, 1, 0), np.moveaxis(last, 1, 0), strict=True):
        state = end + carried @ (state - begin)
        out.append(state[0])
    return np.array(out)
