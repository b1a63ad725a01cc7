"""Integration of α over one sample interval within the rate filter."""

from __future__ import annotations

from numba import njit

from gfimu.rate.recursion_data import COMPILE

__all__ = ["interval_weights"]


@njit(**COMPILE)
def interval_weights(data, tuning, k, closing, weights):  # type: ignore[no-untyped-def]
    """Weights of the interval from sample k − 1 to k; returns the stencil's first sample and its length."""
    points = tuning.weights.shape[1]
    step = data.t[k] - data.t[k - 1]
    start = max(k - 1 - tuning.position, 0)
    if start + points > closing:
        start = closing - points
    if start >= 0 and data.whole_run[start + points - 1] >= points - 1:
        left = k - 1 - start
        if data.uniform_run[start + points - 1] >= points - 1:
            for j in range(points):
                weights[j] = tuning.weights[left, j] * step
        else:
            _uneven_weights(data.t, start, points, k - 1, weights)
        return start, points
    weights[0] = 0.5 * step
    weights[1] = 0.5 * step
    return k - 1, 2


@njit(**COMPILE)
def _uneven_weights(t, start, points, left, weights):  # type: ignore[no-untyped-def]
    """Integrate Lagrange's polynomials of uneven nodes from sample ``left`` to the next (Gauss–Legendre, exact)."""
    step = t[left + 1] - t[left]
    for j in range(points):
        weights[j] = 0.0
    for g in range(3):
        abscissa = 0.5 + (g - 1) * 0.3872983346207417
        share = 0.4444444444444444 if g == 1 else 0.2777777777777778
        at = t[left] + abscissa * step
        for j in range(points):
            basis = 1.0
            for i in range(points):
                if i != j:
                    basis *= (at - t[start + i]) / (t[start + j] - t[start + i])
            weights[j] += share * basis * step
