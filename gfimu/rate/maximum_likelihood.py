"""Maximum likelihood: the rate of each sample on its own, at the Cramér–Rao bound.

Minimises ‖z − M s(ω)‖² over ω by damped Gauss–Newton (Levenberg–Marquardt), with z white. The start is the best of the
previous sample's rate and a few fixed directions, so arrays that see only some of the products of ω are served too.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["rate_of_null_space", "rates_of_null_space"]

_ITERATIONS = 60
_CONVERGED = 1e-10
_LEAST_SEEN = 1e-12  # numerical: determinant of the information, its trace 1, below which a direction is not seen
# Seven directions, one of which is within 36° of any axis.
_STARTS = np.array(
    [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1], [1, 1, -1], [1, -1, 1], [-1, 1, 1]], dtype=float
) / np.sqrt([[1], [1], [1], [3], [3], [3], [3]])  # fmt: skip


def rates_of_null_space(
    z: NDArray[np.float64], sensitivity: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rates (n, 3) that fit samples z (n, d) = M s(ω) + white noise best, up to the sign, and covariances (n, 3, 3)."""
    rank = int(np.linalg.matrix_rank(sensitivity, tol=1e-9))
    # Rows beyond the rank see no product: only the first ones carry information.
    left, strengths, right = np.linalg.svd(sensitivity)
    compact = strengths[:rank, None] * right[:rank]  # (rank, 6)
    omega, information = _solve(z @ left[:, :rank], compact, _STARTS)
    covariance = np.full((len(z), 3, 3), np.nan)
    covariance[np.isfinite(omega[:, 0])] = np.diag(np.full(3, np.inf))  # but for those that are seen in all directions
    scale = np.trace(information, axis1=1, axis2=2)
    seen = np.flatnonzero((scale > 0.0) & np.isfinite(scale))
    seen = seen[np.linalg.det(information[seen] / scale[seen, None, None]) > _LEAST_SEEN]
    covariance[seen] = np.linalg.inv(information[seen])
    return omega, covariance


def rate_of_null_space(z: NDArray[np.float64], sensitivity: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rate (3,) that fits one sample z (d,) = M s(ω) + white noise best, up to the sign, with M of shape (d, 6)."""
    omega, _ = _solve(z[None], np.ascontiguousarray(sensitivity), _STARTS)
    return omega[0]


@njit(cache=True, error_model="numpy")
def _solve(z, m, starts):  # type: ignore[no-untyped-def]
    """Solve each row of z (n, r); returns rates (n, 3) and the information on them (n, 3, 3)."""
    n, rows = z.shape
    omega = np.full((n, 3), np.nan)
    information = np.full((n, 3, 3), np.nan)
    strength = np.sqrt((m * m).sum())
    last = np.zeros(3)
    residual = np.empty(rows)
    slope = np.empty((rows, 3))
    for k in range(n):
        if not np.isfinite(z[k]).all():
            continue
        size = np.sqrt(np.sqrt((z[k] * z[k]).sum()) / strength)
        best = last.copy()
        cost = _residual(z[k], m, best, residual, slope)
        for start in starts:
            candidate = size * start
            other = _residual(z[k], m, candidate, residual, slope)
            if other < cost:
                cost = other
                best = candidate
        best = _descend(z[k], m, best, residual, slope)
        _residual(z[k], m, best, residual, slope)
        information[k] = slope.T @ slope
        omega[k] = best
        last = best
    return omega, information


@njit(cache=True, error_model="numpy")
def _residual(z, m, omega, residual, slope):  # type: ignore[no-untyped-def]
    """Fill residual z − M s(ω) and slope M ∂s/∂ω; returns the sum of squares."""
    x, y, w = omega
    total = 0.0
    for i in range(len(z)):
        row = m[i]
        slope[i, 0] = 2.0 * x * row[0] + y * row[3] + w * row[4]
        slope[i, 1] = 2.0 * y * row[1] + x * row[3] + w * row[5]
        slope[i, 2] = 2.0 * w * row[2] + x * row[4] + y * row[5]
        residual[i] = z[i] - 0.5 * (slope[i, 0] * x + slope[i, 1] * y + slope[i, 2] * w)
        total += residual[i] * residual[i]
    return total


@njit(cache=True, error_model="numpy")
def _descend(z, m, start, residual, slope):  # type: ignore[no-untyped-def]
    """Levenberg–Marquardt from ``start``."""
    omega = start.copy()
    cost = _residual(z, m, omega, residual, slope)
    damping = 1e-3
    for _ in range(_ITERATIONS):
        normal = slope.T @ slope
        gradient = slope.T @ residual
        floor = 1e-12 * np.trace(normal) + 1e-30
        accepted = False
        for _ in range(12):
            damped = normal.copy()
            for a in range(3):
                damped[a, a] += damping * normal[a, a] + floor
            trial = omega + _solution(damped, gradient)
            other = _residual(z, m, trial, residual, slope)
            if other <= cost:
                accepted = True
                break
            damping *= 5.0
        if not accepted:
            _residual(z, m, omega, residual, slope)
            break
        done = cost - other <= _CONVERGED * cost
        omega = trial
        cost = other
        damping = max(damping * 0.2, 1e-12)
        if done:
            break
    return omega


@njit(cache=True, error_model="numpy")
def _solution(matrix, column):  # type: ignore[no-untyped-def]
    """Return P⁻¹ c of a positive definite P (3, 3), which is overwritten: loops, as a library's compile far longer."""
    found = np.empty(3)
    for i in range(3):
        found[i] = column[i]
        for j in range(i):
            matrix[i, j] /= matrix[j, j]
            found[i] -= matrix[i, j] * found[j]
            for q in range(j + 1, i + 1):
                matrix[i, q] -= matrix[i, j] * matrix[q, j] * matrix[j, j]
    for i in range(2, -1, -1):
        found[i] /= matrix[i, i]
        for q in range(i + 1, 3):
            found[i] -= matrix[q, i] * found[q]
    return found
