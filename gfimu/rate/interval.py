"""Integration of α over one sample interval within the rate filter."""

from __future__ import annotations

from numba import njit

from gfimu.array.quadrature import polynomial_weights
from gfimu.base.compiled import INNER

__all__ = ["interval_weights"]


@njit(**INNER)
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
            polynomial_weights(data.t, start, points, k - 1, weights)
        return start, points
    weights[0] = 0.5 * step
    weights[1] = 0.5 * step
    return k - 1, 2
