"""One Kalman kernel for every state model: prediction, scalar measurement, likelihood and smoothing, compiled.

A model fills the arrays and calls these functions. The state x (n,) has ``dynamic`` components in front, which change
from sample to sample; behind them stand constants, which do not: biases, gains, levers. Of these the last ones may be
*considered* (S. F. Schmidt, Application of state-space methods to navigation problems, Advances in Control Systems 3,
1966): their uncertainty enters every covariance and every gain, and they are not corrected themselves.

Loops over single numbers, as numba takes far longer over slices and calls of a linear algebra library.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gfimu.base.compiled import INNER

__all__ = ["Record", "cholesky", "measure", "predict", "solve_lower", "step_back", "take"]


class Record(NamedTuple):
    """What `step_back` needs of each sample of a block of length B, with up to u scalar measurements each.

    Parameters
    ----------
    transition : ndarray, shape (B, r, n)
        Rows of the transition to the sample.
    predicted : ndarray, shape (B, n)
        State before its measurements.
    rows : ndarray, shape (B, r, n)
        Rows of the covariance before its measurements.
    used : ndarray, shape (B,)
        Number of measurements.
    slope, gain : ndarray, shape (B, u, n)
        Slope h and gain of each.
    inverse, innovation : ndarray, shape (B, u)
        Inverse variance of each innovation, and the innovation.
    """

    transition: NDArray[np.float64]
    predicted: NDArray[np.float64]
    rows: NDArray[np.float64]
    used: NDArray[np.int64]
    slope: NDArray[np.float64]
    gain: NDArray[np.float64]
    inverse: NDArray[np.float64]
    innovation: NDArray[np.float64]

    @classmethod
    def empty(cls, length: int, dynamic: int, size: int, measurements: int) -> Record:
        """Return room for ``length`` samples; length 0 for a filter without a smoother."""
        return cls(
            np.empty((length, dynamic, size)), np.empty((length, size)), np.empty((length, dynamic, size)),
            np.zeros(length, dtype=np.int64), np.empty((length, measurements, size)),
            np.empty((length, measurements, size)), np.empty((length, measurements)), np.empty((length, measurements)),
        )  # fmt: skip


@njit(**INNER)
def predict(x, p, transition, added, noise, work):  # type: ignore[no-untyped-def]
    """Carry state x (n,) and covariance p (n, n) over a step: x[:r] = transition x + added, the others stay.

    ``transition`` (r, n), ``added`` (r,), ``noise`` (r, r) is the covariance that the step adds, ``work`` (r, n + 1).
    """
    r, n = transition.shape
    for a in range(r):
        total = added[a]
        for j in range(n):
            total += transition[a, j] * x[j]
            work[a, j] = 0.0
        work[a, n] = total
        for i in range(n):
            weight = transition[a, i]
            if weight != 0.0:
                for j in range(n):
                    work[a, j] += weight * p[i, j]
    for a in range(r):
        x[a] = work[a, n]
        for j in range(r, n):
            p[a, j] = work[a, j]
            p[j, a] = work[a, j]
        for b in range(a + 1):
            total = noise[a, b]
            for j in range(n):
                total += work[a, j] * transition[b, j]
            p[a, b] = total
            p[b, a] = total


@njit(**INNER)
def measure(x, p, slope, innovation, variance, solved, gain):  # type: ignore[no-untyped-def]
    """Take one scalar measurement: innovation = slope · (truth − x) + noise of ``variance``.

    Components from ``solved`` on are considered. ``gain`` (n,) is filled. Returns the inverse of the innovation's
    variance.
    """
    n = len(x)
    for j in range(n):
        gain[j] = 0.0
    for i in range(n):
        weight = slope[i]
        if weight != 0.0:
            for j in range(n):
                gain[j] += weight * p[i, j]
    total = variance
    for i in range(n):
        total += slope[i] * gain[i]
    inverse = 1.0 / total
    root = np.sqrt(inverse)
    for i in range(n):
        gain[i] *= root
    scaled = innovation * root
    for i in range(solved):
        x[i] += gain[i] * scaled
    for i in range(n):  # all of a row at once, also where it is known by symmetry: that is faster
        weight = gain[i]
        for j in range(n if i < solved else solved):
            p[i, j] -= weight * gain[j]
    for i in range(n):
        gain[i] = gain[i] * root if i < solved else 0.0
    return inverse


@njit(**INNER)
def take(x, p, slope, innovation, variance, solved, gain, record, row):  # type: ignore[no-untyped-def]
    """Take a scalar measurement and remember it, but in a row −1; returns the inverse of the innovation's variance."""
    inverse = measure(x, p, slope, innovation, variance, solved, gain)
    if len(record.used) > 0 and row >= 0:
        used = record.used[row]
        for j in range(len(x)):
            record.slope[row, used, j] = slope[j]
            record.gain[row, used, j] = gain[j]
        record.inverse[row, used] = inverse
        record.innovation[row, used] = innovation
        record.used[row] = used + 1
    return inverse


@njit(**INNER)
def step_back(record, k, adjoint, curvature, out, covariance):  # type: ignore[no-untyped-def]
    """Smooth sample k of a record, from the adjoint (n,) and its covariance (n, n) behind it.

    The modified Bryson–Frazier recursion (G. J. Bierman, Fixed interval smoothing with discrete measurements,
    Int. J. Control 18, 1973). Fills the smoothed dynamic components ``out`` (r,) and their ``covariance`` (r, r), and
    leaves adjoint and curvature as they are before the sample's prediction.
    """
    r, n = record.transition.shape[1:]
    product = np.empty(n)
    for i in range(record.used[k] - 1, -1, -1):
        h = record.slope[k, i]
        gain = record.gain[k, i]
        along = record.inverse[k, i] * record.innovation[k, i]
        for j in range(n):
            along += gain[j] * adjoint[j]
        square = record.inverse[k, i]
        for a in range(n):
            total = 0.0
            for j in range(n):
                total += curvature[a, j] * gain[j]
            product[a] = total
            square += gain[a] * total
        for a in range(n):
            adjoint[a] -= h[a] * along
            for b in range(a + 1):
                value = curvature[a, b] - h[a] * product[b] - product[a] * h[b] + h[a] * square * h[b]
                curvature[a, b] = value
                curvature[b, a] = value
    rows = record.rows[k]
    for a in range(r):
        total = record.predicted[k, a]
        for j in range(n):
            total -= rows[a, j] * adjoint[j]
        out[a] = total
        for i in range(n):
            total = 0.0
            for j in range(n):
                total += curvature[i, j] * rows[a, j]
            product[i] = total
        for b in range(a + 1):
            total = rows[a, b]
            for j in range(n):
                total -= rows[b, j] * product[j]
            covariance[a, b] = total
            covariance[b, a] = total
    _carry_back(record.transition[k], adjoint, curvature)


@njit(**INNER)
def _carry_back(transition, adjoint, curvature):  # type: ignore[no-untyped-def]
    """Replace adjoint λ and curvature Λ by Fᵀ λ and Fᵀ Λ F, with F's first r rows given and the others those of 1."""
    r, n = transition.shape
    moved = np.empty((r, n))  # first r rows of Λ F
    for a in range(r):
        for j in range(n):
            moved[a, j] = curvature[a, j] if j >= r else 0.0
        for b in range(r):
            weight = curvature[a, b]
            if weight != 0.0:
                for j in range(n):
                    moved[a, j] += weight * transition[b, j]
    right = np.empty((n, r))  # Λ F of the constants' rows, by the dynamic columns
    for i in range(r, n):
        for b in range(r):
            right[i, b] = curvature[i, b]
    for i in range(r, n):
        for j in range(r, i + 1):
            value = curvature[i, j]
            for a in range(r):
                value += right[i, a] * transition[a, j] + transition[a, i] * moved[a, j]
            curvature[i, j] = value
            curvature[j, i] = value
        for b in range(r):
            value = 0.0
            for a in range(r):
                value += right[i, a] * transition[a, b] + transition[a, i] * moved[a, b]
            curvature[i, b] = value
            curvature[b, i] = value
    for a in range(r):
        for b in range(r):
            value = 0.0
            for c in range(r):
                value += transition[c, a] * moved[c, b]
            curvature[a, b] = value
    for i in range(n):
        value = adjoint[i] if i >= r else 0.0
        for a in range(r):
            value += transition[a, i] * adjoint[a]
        product = value
        if i >= r:
            adjoint[i] = product
        else:
            moved[i, 0] = product
    for a in range(r):
        adjoint[a] = moved[a, 0]


@njit(**INNER)
def cholesky(matrix, size):  # type: ignore[no-untyped-def]
    """Replace the lower triangle of the first ``size`` rows of a positive matrix by its Cholesky factor.

    Returns the logarithm of the determinant.
    """
    log = 0.0
    for i in range(size):
        for j in range(i + 1):
            total = matrix[i, j]
            for k in range(j):
                total -= matrix[i, k] * matrix[j, k]
            if i == j:
                matrix[i, i] = np.sqrt(max(total, 1e-300))
                log += 2.0 * np.log(matrix[i, i])
            else:
                matrix[i, j] = total / matrix[j, j]
    return log


@njit(**INNER)
def solve_lower(factor, vector, size):  # type: ignore[no-untyped-def]
    """Replace a vector by L⁻¹ v, with the Cholesky factor L in the lower triangle."""
    for i in range(size):
        total = vector[i]
        for k in range(i):
            total -= factor[i, k] * vector[k]
        vector[i] = total / factor[i, i]
