"""The null space where the rate is hardly larger than its uncertainty, so that its products are no longer linear in it.

There z = M s(ω) + T b + noise is linearised at the most probable rate and not at the predicted one, whose slope may
vanish, and the uncertainty of the rate is kept below what the products of the same sample allow.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from gfimu.base.compiled import INNER

__all__ = ["largest_squares", "probable_rate", "second_order"]

_DEVIATIONS = 2.0  # of the product ω_a² that its bound allows for
_ITERATIONS = 50  # numerical
_ROUNDING = 1e-13  # numerical: of the cost
_POLISHING = 3  # numerical: Newton steps, of which each squares the error
_CONVERGED = 1e-22  # numerical: squared step over squared rate, (rad/s)²


@njit(**INNER)
def second_order(m, xx, xy, xz, yy, yz, zz):  # type: ignore[no-untyped-def]
    """Mean tr(BP) and further variance 2 tr(BPBP) of ωᵀBω when ω has the covariance P.

    Parameters
    ----------
    m : ndarray, shape (6,)
        Row of M: the elements of B in the order of the products of ω, off-diagonal ones doubled.
    xx, xy, xz, yy, yz, zz : float
        Elements of P.
    """
    b = 0.5 * m[3]
    c = 0.5 * m[4]
    e = 0.5 * m[5]
    c00 = m[0] * xx + b * xy + c * xz
    c01 = m[0] * xy + b * yy + c * yz
    c02 = m[0] * xz + b * yz + c * zz
    c10 = b * xx + m[1] * xy + e * xz
    c11 = b * xy + m[1] * yy + e * yz
    c12 = b * xz + m[1] * yz + e * zz
    c20 = c * xx + e * xy + m[2] * xz
    c21 = c * xy + e * yy + m[2] * yz
    c22 = c * xz + e * yz + m[2] * zz
    variance = 2.0 * (c00 * c00 + c11 * c11 + c22 * c22 + 2.0 * (c01 * c10 + c02 * c20 + c12 * c21))
    return c00 + c11 + c22, variance


@njit(**INNER)
def largest_squares(z, tables, place, x, covariance, noise, out):  # type: ignore[no-untyped-def]
    """Largest ω_a² (3,) that a sample's products allow: what they show, plus twice its standard deviation.

    Infinite for an axis whose square the null space does not see.
    """
    rows = tables.products[place]  # (6, d)
    d = rows.shape[1]
    for a in range(3):
        if not tables.square_seen[place, a]:
            out[a] = np.inf
            continue
        shown = 0.0
        variance = 0.0
        for i in range(d):
            shown += rows[a, i] * z[i]
            variance += rows[a, i] * rows[a, i] * noise
        for j in range(d):
            weight = 0.0  # of bias j
            for i in range(d):
                weight += rows[a, i] * tables.null_bias[place, i, j]
            shown -= weight * x[6 + j]
            if weight != 0.0:
                for q in range(d):
                    other = 0.0
                    for i in range(d):
                        other += rows[a, i] * tables.null_bias[place, i, q]
                    variance += weight * other * covariance[6 + j, 6 + q]
        out[a] = max(shown, 0.0) + _DEVIATIONS * np.sqrt(variance)


@njit(**INNER)
def probable_rate(z, tables, place, count, x, covariance, noise, out, posterior):  # type: ignore[no-untyped-def]
    """Find the most probable rate (3,) and its covariance (3, 3) by a prediction and a sample whose biases are free.

    Minimises dᵀP⁻¹d + ρᵀS⁻¹ρ over ω = x + d by Levenberg & Marquardt's steps, with ρ = z − T b − M s(ω) − G d: G d is
    what the deviation of the rate says of the biases, S their covariance when it is known, and the noise.
    """
    d = z.shape[0]
    m = np.empty((count, 6))
    start = np.empty(count)
    crossed = np.empty((count, 3))
    weights = np.empty((count, count))
    combined = np.empty((count, d))
    used = 0
    for i in range(count):
        strength = 0.0
        for q in range(6):
            strength += abs(tables.null_sensitivity[place, i, q])
        if strength == 0.0:  # sees no product
            continue
        for q in range(6):
            m[used, q] = tables.null_sensitivity[place, i, q]
        start[used] = z[i]
        for j in range(d):
            combined[used, j] = tables.null_bias[place, i, j]
            start[used] -= combined[used, j] * x[6 + j]
        used += 1
    prior = np.empty((3, 3))
    for a in range(3):
        for b in range(3):
            prior[a, b] = covariance[a, b]
    _invert(prior, 3)
    for i in range(used):
        for a in range(3):
            total = 0.0
            for j in range(d):
                if combined[i, j] != 0.0:
                    total += combined[i, j] * covariance[6 + j, a]
            crossed[i, a] = total
    gain = np.empty((count, 3))
    for i in range(used):
        for a in range(3):
            gain[i, a] = crossed[i, 0] * prior[0, a] + crossed[i, 1] * prior[1, a] + crossed[i, 2] * prior[2, a]
    for i in range(used):
        for q in range(used):
            total = noise if i == q else 0.0
            for j in range(d):
                if combined[i, j] != 0.0:
                    for r in range(d):
                        total += combined[i, j] * combined[q, r] * covariance[6 + j, 6 + r]
            for a in range(3):
                total -= gain[i, a] * crossed[q, a]
            weights[i, q] = total
    _invert(weights, used)
    residual = np.empty(count)
    slope = np.empty((count, 3))
    best = np.inf
    trial = np.empty(3)
    omega = np.empty(3)
    step = np.empty(3)
    normal = np.empty((3, 3))
    damped = np.empty((3, 3))
    gradient = np.empty(3)
    other = np.empty(3)
    for side in range(3):
        # From the prediction, and from what the products of this sample show alone, with either sign.
        if side == 0:
            for a in range(3):
                omega[a] = x[a]
        else:
            _shown(z, tables, place, x, other)
            for a in range(3):
                omega[a] = other[a] if side == 1 else -other[a]
        cost = _cost(omega, x, prior, m, start, gain, weights, used, residual, slope)
        damping = 1e-3
        for _ in range(_ITERATIONS):
            _normal_equations(omega, x, prior, weights, used, residual, slope, gradient, normal)
            accepted = False
            better = cost
            for _ in range(6):
                for a in range(3):
                    for b in range(3):
                        damped[a, b] = normal[a, b]
                    damped[a, a] += damping * normal[a, a]
                _invert(damped, 3)
                for a in range(3):
                    step[a] = damped[a, 0] * gradient[0] + damped[a, 1] * gradient[1] + damped[a, 2] * gradient[2]
                    trial[a] = omega[a] + step[a]
                better = _cost(trial, x, prior, m, start, gain, weights, used, residual, slope)
                if better <= cost * (1.0 + _ROUNDING):
                    accepted = True
                    break
                damping *= 8.0
            if not accepted:
                break
            length = 0.0
            for a in range(3):
                length += step[a] * step[a]
                omega[a] = trial[a]
            cost = better
            damping = max(0.2 * damping, 1e-9)
            if length < _CONVERGED * (1.0 + omega[0] * omega[0] + omega[1] * omega[1] + omega[2] * omega[2]):
                break
        if cost < best:
            best = cost
            for a in range(3):
                out[a] = omega[a]
    # Newton's steps from there: with residuals as large as here those of Gauss converge slowly.
    for _ in range(_POLISHING):
        _cost(out, x, prior, m, start, gain, weights, used, residual, slope)
        _normal_equations(out, x, prior, weights, used, residual, slope, gradient, damped)
        for i in range(used):
            weighted = 0.0
            for q in range(used):
                weighted += weights[i, q] * residual[q]
            for a in range(3):
                damped[a, a] -= 2.0 * weighted * m[i, a]
            for a, b, q in ((0, 1, 3), (0, 2, 4), (1, 2, 5)):
                damped[a, b] -= weighted * m[i, q]
                damped[b, a] -= weighted * m[i, q]
        _invert(damped, 3)
        if damped[0, 0] <= 0.0 or damped[1, 1] <= 0.0 or damped[2, 2] <= 0.0:  # no minimum
            break
        for a in range(3):
            out[a] += damped[a, 0] * gradient[0] + damped[a, 1] * gradient[1] + damped[a, 2] * gradient[2]
    _cost(out, x, prior, m, start, gain, weights, used, residual, slope)
    _normal_equations(out, x, prior, weights, used, residual, slope, gradient, posterior)
    _invert(posterior, 3)


@njit(**INNER)
def _normal_equations(omega, x, prior, weights, used, residual, slope, gradient, normal):  # type: ignore[no-untyped-def]
    """Fill half the descent of the cost (3,) and Gauss's approximation to half its second derivative (3, 3)."""
    for a in range(3):
        gradient[a] = 0.0
        for b in range(3):
            gradient[a] -= prior[a, b] * (omega[b] - x[b])
            normal[a, b] = prior[a, b]
    for i in range(used):
        for q in range(used):
            for a in range(3):
                gradient[a] += slope[i, a] * weights[i, q] * residual[q]
                for b in range(3):
                    normal[a, b] += slope[i, a] * weights[i, q] * slope[q, b]


@njit(**INNER)
def _shown(z, tables, place, x, out):  # type: ignore[no-untyped-def]
    """Rate (3,) along the axis whose square the products show as largest, the other axes by their products with it."""
    d = z.shape[0]
    shown = np.zeros(6)
    for q in range(6):
        for i in range(d):
            value = z[i]
            for j in range(d):
                value -= tables.null_bias[place, i, j] * x[6 + j]
            shown[q] += tables.products[place, q, i] * value
    axis = 0
    for a in range(1, 3):
        if shown[a] > shown[axis]:
            axis = a
    out[:] = 0.0
    if shown[axis] > 0.0:
        out[axis] = np.sqrt(shown[axis])
        for a in range(3):
            if a != axis:
                out[a] = shown[2 + a + axis] / out[axis]  # xy, xz, yz are 3, 4, 5


@njit(**INNER)
def _cost(omega, x, prior, m, start, gain, weights, used, residual, slope):  # type: ignore[no-untyped-def]
    """Fill the residual and the slope of what it is subtracted from; returns the cost."""
    d0 = omega[0] - x[0]
    d1 = omega[1] - x[1]
    d2 = omega[2] - x[2]
    for i in range(used):
        h0 = 2.0 * omega[0] * m[i, 0] + omega[1] * m[i, 3] + omega[2] * m[i, 4]
        h1 = 2.0 * omega[1] * m[i, 1] + omega[0] * m[i, 3] + omega[2] * m[i, 5]
        h2 = 2.0 * omega[2] * m[i, 2] + omega[0] * m[i, 4] + omega[1] * m[i, 5]
        residual[i] = start[i] - 0.5 * (h0 * omega[0] + h1 * omega[1] + h2 * omega[2])
        residual[i] -= gain[i, 0] * d0 + gain[i, 1] * d1 + gain[i, 2] * d2
        slope[i, 0] = h0 + gain[i, 0]
        slope[i, 1] = h1 + gain[i, 1]
        slope[i, 2] = h2 + gain[i, 2]
    total = d0 * (prior[0, 0] * d0 + 2.0 * (prior[0, 1] * d1 + prior[0, 2] * d2))
    total += d1 * (prior[1, 1] * d1 + 2.0 * prior[1, 2] * d2) + d2 * prior[2, 2] * d2
    for i in range(used):
        for q in range(used):
            total += residual[i] * weights[i, q] * residual[q]
    return total


@njit(**INNER)
def _invert(matrix, size):  # type: ignore[no-untyped-def]
    """Invert the first ``size`` rows of a positive definite matrix in place (Gauss & Jordan, no exchange of rows)."""
    for p in range(size):
        pivot = 1.0 / matrix[p, p]
        matrix[p, p] = 1.0
        for q in range(size):
            matrix[p, q] *= pivot
        for r in range(size):
            if r != p:
                factor = matrix[r, p]
                matrix[r, p] = 0.0
                for q in range(size):
                    matrix[r, q] -= factor * matrix[p, q]
