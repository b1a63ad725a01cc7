"""Integrals of α over each sample interval, with what the samples leave uncertain of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gfimu.array.quadrature import STENCILS, even_weights, polynomial_weights
from gfimu.base.compiled import compiled

__all__ = ["integrals"]

_UNIFORM = 1e-6  # numerical: relative deviation of a step from the period that counts as none
_GAP = 1.5  # periods from which on a step is a gap


def integrals(
    t: NDArray[np.float64],
    alpha: NDArray[np.float64],
    channel_set: NDArray[np.int64],
    period: float,
    quadrature: str,
) -> NDArray[np.float64]:
    """Integrate α, or what errors make of it, over the interval before each sample; zero for the first one.

    The polynomial through the neighbouring samples of the same set of channels is integrated. Beside a gap or another
    set the trapezoid is taken, and over a sample without α the last value is kept.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Times, s.
    alpha : ndarray, shape (n, k)
        Columns of angular acceleration, rad/s²; in a sample without it the last one.
    channel_set : ndarray, shape (n,)
        Set of channels of each sample; negative where it has no α.
    period : float
        Nominal sample period, s.
    quadrature : str
        A key of `gfimu.array.quadrature.STENCILS` whose stencil does not alternate.

    Returns
    -------
    ndarray, shape (n, k)
        Integrals, rad/s.
    """
    stencil = STENCILS[quadrature]
    out = np.zeros(alpha.shape)
    _integrate(t, alpha, channel_set, period, -stencil.before[0], even_weights(stencil.points), out)
    return out


@compiled
def _integrate(t, alpha, channel_set, period, position, even, out):  # type: ignore[no-untyped-def]
    points = even.shape[1]
    weights = np.empty(points)
    n = len(t)
    whole = 0  # steps without a gap up to the end of the stencil
    uniform = 0
    reached = 0
    for k in range(1, n):
        start = min(max(k - 1 - position, 0), n - points)
        if start >= 0:
            last = start + points - 1
            while reached < last:
                reached += 1
                step = t[reached] - t[reached - 1]
                same = channel_set[reached] >= 0 and channel_set[reached] == channel_set[reached - 1]
                joined = step < _GAP * period and same
                whole = whole + 1 if joined else 0
                uniform = uniform + 1 if joined and abs(step - period) < _UNIFORM * period else 0
        step = t[k] - t[k - 1]
        if start >= 0 and reached == start + points - 1 and whole >= points - 1:
            if uniform >= points - 1:
                for j in range(points):
                    weights[j] = even[k - 1 - start, j] * step
            else:
                polynomial_weights(t, start, points, k - 1, weights)
            for a in range(alpha.shape[1]):
                total = 0.0
                for j in range(points):
                    total += weights[j] * alpha[start + j, a]
                out[k, a] = total
        else:
            for a in range(alpha.shape[1]):
                out[k, a] = 0.5 * step * (alpha[k - 1, a] + alpha[k, a])
