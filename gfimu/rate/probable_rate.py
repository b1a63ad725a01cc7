"""The most probable rate of one sample where its products are not linear in it, compiled."""

from __future__ import annotations

import numpy as np
from numba import njit

from gfimu.base.compiled import INNER
from gfimu.rate.kernel import cholesky, solve_lower

__all__ = ["probable_rate", "products_of", "shown_rate", "slope_of"]

_STEPS = 30  # numerical
_CONVERGED = 1e-14  # numerical: squared step over squared rate


@njit(**INNER)
def products_of(w, out):  # type: ignore[no-untyped-def]
    """Fill in the six products s(ω)."""
    out[0] = w[0] * w[0]
    out[1] = w[1] * w[1]
    out[2] = w[2] * w[2]
    out[3] = w[0] * w[1]
    out[4] = w[0] * w[2]
    out[5] = w[1] * w[2]


@njit(**INNER)
def slope_of(row, w, out):  # type: ignore[no-untyped-def]
    """Fill in the derivative (3,) of ``row`` (6,) · s(ω) by ω; half of its product with ω is ``row`` · s(ω)."""
    out[0] = 2.0 * w[0] * row[0] + w[1] * row[3] + w[2] * row[4]
    out[1] = 2.0 * w[1] * row[1] + w[0] * row[3] + w[2] * row[5]
    out[2] = 2.0 * w[2] * row[2] + w[0] * row[4] + w[1] * row[5]


@njit(**INNER)
def shown_rate(inverse, z, x, first, bias, out):  # type: ignore[no-untyped-def]
    """Fill in a rate (3,) that products z (m,) may show without the biases in the state x: along the largest square.

    ``inverse`` (6, m) gives the products, and ``bias`` (m, m) the biases in z of those in x[first:].
    """
    shown = np.zeros(6)
    for i in range(len(z)):
        value = z[i]
        for j in range(len(z)):
            value -= bias[i, j] * x[first + j]
        for q in range(6):
            shown[q] += inverse[q, i] * value
    axis = 0
    for a in range(1, 3):
        if shown[a] > shown[axis]:
            axis = a
    for a in range(3):
        out[a] = 0.0
    if shown[axis] > 0.0:
        out[axis] = np.sqrt(shown[axis])
        for a in range(3):
            if a != axis:
                out[a] = shown[2 + a + axis] / out[axis]  # products xy, xz, yz stand at 3, 4, 5


@njit(**INNER)
def probable_rate(prior, spread, target, sensitivity, linear, seeds, out, posterior):  # type: ignore[no-untyped-def]
    """Find the rate ω that minimises dᵀ P⁻¹ d + ‖target − M s(ω) − G d‖² with d = ω − prior; returns the minimum.

    Levenberg & Marquardt's steps from each seed.

    Parameters
    ----------
    prior : ndarray, shape (3,)
        Predicted rate, rad/s.
    spread : ndarray, shape (3, 3)
        Its covariance P.
    target : ndarray, shape (m,)
        Null space without biases, whitened.
    sensitivity : ndarray, shape (m, 6)
        M, whitened.
    linear : ndarray, shape (m, 3)
        G, whitened: what the deviation of the rate says of the biases.
    seeds : ndarray, shape (s, 3)
        Rates to start from, rad/s.
    out : ndarray, shape (3,)
        Filled with the rate.
    posterior : ndarray, shape (3, 3)
        Filled with its covariance.
    """
    m = len(target)
    weight = np.empty((3, 3))  # P⁻¹
    factor = np.empty((3, 3))
    unit = np.empty(3)
    for a in range(3):
        for b in range(3):
            factor[a, b] = spread[a, b]
    _invert(factor, weight)
    best = np.inf
    omega = np.empty(3)
    trial = np.empty(3)
    gradient = np.empty(3)
    normal = np.empty((3, 3))
    damped = np.empty((3, 3))
    residual = np.empty(m)
    slope = np.empty((m, 3))
    for seed in range(len(seeds)):
        for a in range(3):
            omega[a] = seeds[seed, a]
        cost = _cost(omega, prior, weight, target, sensitivity, linear, residual, slope)
        damping = 1e-3
        for _ in range(_STEPS):
            _normal_equations(omega, prior, weight, residual, slope, gradient, normal)
            better = np.inf
            for _ in range(8):
                for a in range(3):
                    for b in range(3):
                        damped[a, b] = normal[a, b]
                    damped[a, a] *= 1.0 + damping
                    unit[a] = gradient[a]
                cholesky(damped, 3)
                solve_lower(damped, unit, 3)
                for a in range(2, -1, -1):
                    for b in range(a + 1, 3):
                        unit[a] -= damped[b, a] * unit[b]
                    unit[a] /= damped[a, a]
                for a in range(3):
                    trial[a] = omega[a] + unit[a]
                better = _cost(trial, prior, weight, target, sensitivity, linear, residual, slope)
                if better <= cost:
                    break
                damping *= 8.0
            if not better <= cost:
                break
            length = 0.0
            size = 1.0
            for a in range(3):
                length += unit[a] * unit[a]
                omega[a] = trial[a]
                size += omega[a] * omega[a]
            cost = better
            damping = max(0.2 * damping, 1e-9)
            if length < _CONVERGED * size:
                break
        if cost < best:
            best = cost
            for a in range(3):
                out[a] = omega[a]
    _cost(out, prior, weight, target, sensitivity, linear, residual, slope)
    _normal_equations(out, prior, weight, residual, slope, gradient, normal)
    _invert(normal, posterior)
    return best


@njit(**INNER)
def _normal_equations(omega, prior, weight, residual, slope, gradient, normal):  # type: ignore[no-untyped-def]
    """Fill half the descent of the cost (3,) and Gauss's approximation to half its second derivative (3, 3)."""
    for a in range(3):
        gradient[a] = 0.0
        for b in range(3):
            gradient[a] -= weight[a, b] * (omega[b] - prior[b])
            normal[a, b] = weight[a, b]
        for i in range(len(residual)):
            gradient[a] += slope[i, a] * residual[i]
            for b in range(3):
                normal[a, b] += slope[i, a] * slope[i, b]


@njit(**INNER)
def _invert(matrix, out):  # type: ignore[no-untyped-def]
    """Fill in the inverse of a positive matrix (3, 3), which is overwritten."""
    cholesky(matrix, 3)
    columns = np.zeros((3, 3))  # row a: L⁻¹ e_a
    for a in range(3):
        columns[a, a] = 1.0
        solve_lower(matrix, columns[a], 3)
    for a in range(3):
        for b in range(3):
            out[a, b] = columns[a, 0] * columns[b, 0] + columns[a, 1] * columns[b, 1] + columns[a, 2] * columns[b, 2]


@njit(**INNER)
def _cost(omega, prior, weight, target, sensitivity, linear, residual, slope):  # type: ignore[no-untyped-def]
    """Fill the residual and the slope of what it is subtracted from; returns the cost."""
    total = 0.0
    along = np.empty(3)
    for a in range(3):
        for b in range(3):
            total += (omega[a] - prior[a]) * weight[a, b] * (omega[b] - prior[b])
    for i in range(len(target)):
        slope_of(sensitivity[i], omega, along)
        value = target[i]
        for a in range(3):
            value -= 0.5 * along[a] * omega[a] + linear[i, a] * (omega[a] - prior[a])
            slope[i, a] = along[a] + linear[i, a]
        residual[i] = value
        total += value * value
    return total
