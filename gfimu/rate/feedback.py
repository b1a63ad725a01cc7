"""Integration of an angular acceleration that depends on the rate: α = α_linear − Λ s(ω)."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gfimu.array.quadrature import polynomial_weights
from gfimu.base.errors import InputError

__all__ = ["integrate_rate_recursively"]

_GAP_PERIODS = 1.5
_STEP_RATIO = 2.0
_FASTEST = 1e5
_ITERATIONS = 50


def integrate_rate_recursively(
    t: NDArray[np.float64],
    alpha_linear: NDArray[np.float64],
    leakage: NDArray[np.float64],
    pattern: NDArray[np.intp],
    omega0: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Integrate ω̇ = α_linear(t) − Λ s(ω) through the samples (GF-IMU paper, step 5 in its recursive form).

    The step is the implicit Adams–Moulton formula through the last two samples and the new one, for any spacing
    (third order); behind a gap, at the start, and where one step is more than twice the other it is the trapezoid.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Sample times, s, strictly increasing.
    alpha_linear : ndarray, shape (n, 3)
        Part of the angular acceleration that is linear in the readings, rad/s²; rows with NaN count as lost.
    leakage : ndarray, shape (k, 3, 6)
        Λ of each pattern.
    pattern : ndarray, shape (n,)
        Pattern of each sample.
    omega0 : ndarray, shape (3,)
        Rate at the first valid sample, rad/s.

    Returns
    -------
    ndarray, shape (n, 3)
        Angular rate in body axes, rad/s; NaN in lost rows.

    Raises
    ------
    InputError
        If the recursion diverges: α grows with ω², so an error of the rate feeds itself.
    """
    valid = np.isfinite(alpha_linear).all(axis=1)
    omega = np.full_like(alpha_linear, np.nan)
    times = np.ascontiguousarray(t[valid])
    if len(times) == 0:
        return omega
    longest = _GAP_PERIODS * float(np.median(np.diff(times))) if len(times) > 1 else np.inf
    found, reached = _integrate(
        times,
        np.ascontiguousarray(alpha_linear[valid]),
        np.ascontiguousarray(leakage),
        pattern[valid],
        np.asarray(omega0, dtype=float),
        longest,
    )
    if reached < len(times):
        raise InputError(
            f"the rate diverges {times[reached] - times[0]:.3g} s after the start, because this array's alpha depends "
            "on omega²; check order and signs of the columns and the unit of t_s; else use a shorter run, less biased "
            "readings, or an array that allows form 'joint'"
        )
    omega[valid] = found
    return omega


@njit(cache=True)
def _acceleration(linear, leakage, omega, out):  # type: ignore[no-untyped-def]
    x, y, z = omega[0], omega[1], omega[2]
    for row in range(3):
        out[row] = linear[row] - (
            leakage[row, 0] * x * x
            + leakage[row, 1] * y * y
            + leakage[row, 2] * z * z
            + leakage[row, 3] * x * y
            + leakage[row, 4] * x * z
            + leakage[row, 5] * y * z
        )


@njit(cache=True)
def _integrate(t, linear, leakage, pattern, omega0, longest):  # type: ignore[no-untyped-def]
    n = len(t)
    omega = np.empty((n, 3))
    omega[0] = omega0
    older, last, new = np.zeros(3), np.empty(3), np.empty(3)
    guess, fixed, weights = np.empty(3), np.empty(3), np.empty(3)
    _acceleration(linear[0], leakage[pattern[0]], omega[0], last)
    step_before = 0.0  # no usable sample before the last one
    for i in range(1, n):
        h = t[i] - t[i - 1]
        if h > longest:
            step_before = 0.0
        if h <= _STEP_RATIO * step_before and step_before <= _STEP_RATIO * h:
            polynomial_weights(t, i - 2, 3, i - 1, weights)  # older, last, new
        else:
            weights[0], weights[1], weights[2] = 0.0, 0.5 * h, 0.5 * h
        for axis in range(3):
            fixed[axis] = omega[i - 1, axis] + weights[1] * last[axis] + weights[0] * older[axis]
            guess[axis] = omega[i - 1, axis] + h * last[axis]
        for _ in range(_ITERATIONS):
            _acceleration(linear[i], leakage[pattern[i]], guess, new)
            change, size = 0.0, 0.0
            for axis in range(3):
                value = fixed[axis] + weights[2] * new[axis]
                change = max(change, abs(value - guess[axis]))
                size = max(size, abs(value))
                guess[axis] = value
            if not change > 1e-13 * (1.0 + size):
                break
        if not size < _FASTEST:
            return omega, i
        _acceleration(linear[i], leakage[pattern[i]], guess, new)
        omega[i] = guess
        for axis in range(3):
            older[axis] = last[axis]
            last[axis] = new[axis]
        step_before = h if h <= longest else 0.0
    return omega, n
