"""Extended Kalman filter and smoother of the state [θ, Ω, α] for a rotation about one axis, compiled."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["filter_axis", "smooth_axis"]


@njit(cache=True)  # type: ignore[misc]
def filter_axis(
    t: NDArray[np.float64],
    y: NDArray[np.float64],
    force: NDArray[np.float64],
    by_acceleration: NDArray[np.float64],
    by_square: NDArray[np.float64],
    along: float,
    across: float,
    variance: NDArray[np.float64],
    hub_variance: float,
    jerk: float,
    state: NDArray[np.float64],
    covariance: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], float, float, int]:
    """Run the filter over all samples.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Times, s.
    y : ndarray, shape (n, c)
        Readings, m/s²; NaN where one is missing.
    force, by_acceleration, by_square
        Coefficients of `AxisChannels`.
    along, across : float
        Gravity along the axis and across it, m/s².
    variance : ndarray, shape (c,)
        White noise of the channels, m²/s⁴.
    hub_variance : float
        Variance of the axis's own specific force beyond gravity, each direction, m²/s⁴.
    jerk : float
        Spectral density of the change of α, rad²/s⁵.
    state, covariance
        [θ, Ω, α] before the first sample and its covariance.

    Returns
    -------
    states (n, 3), covariances (n, 3, 3), predicted states and covariances, log likelihood, squared innovations, count
    """
    n, c = y.shape
    states, covariances = np.empty((n, 3)), np.empty((n, 3, 3))
    before, before_covariance = np.empty((n, 3)), np.empty((n, 3, 3))
    x: NDArray[np.float64] = state.copy()
    p: NDArray[np.float64] = covariance.copy()
    likelihood, squares, count = 0.0, 0.0, 0
    f, q, h = np.eye(3), np.zeros((3, 3)), np.zeros((c, 3))
    noise = np.zeros((c, c))
    for i in range(c):
        for j in range(c):
            for axis in range(3):
                noise[i, j] += hub_variance * force[i, axis] * force[j, axis]
        noise[i, i] += variance[i]
    whole = np.ascontiguousarray(np.linalg.inv(noise))
    whole_log = np.linalg.slogdet(noise)[1]
    for k in range(n):
        if k > 0:
            dt = t[k] - t[k - 1]
            f[0, 1], f[0, 2], f[1, 2] = dt, 0.5 * dt * dt, dt
            q[0, 0], q[0, 1], q[0, 2] = dt**5 / 20.0, dt**4 / 8.0, dt**3 / 6.0
            q[1, 1], q[1, 2], q[2, 2] = dt**3 / 3.0, dt * dt / 2.0, dt
            q[1, 0], q[2, 0], q[2, 1] = q[0, 1], q[0, 2], q[1, 2]
            x = f @ x
            p = f @ p @ f.T + jerk * q
        before[k], before_covariance[k] = x, p
        seen = 0
        for i in range(c):
            if np.isfinite(y[k, i]):
                seen += 1
        if seen > 0:
            prior, start = np.linalg.inv(p), x.copy()
            inverse, log_noise = whole, whole_log
            if seen < c:
                rows = np.empty(seen, dtype=np.int64)
                place = 0
                for i in range(c):
                    if np.isfinite(y[k, i]):
                        rows[place] = i
                        place += 1
                part = np.empty((seen, seen))
                for i in range(seen):
                    for j in range(seen):
                        part[i, j] = noise[rows[i], rows[j]]
                small = np.linalg.inv(part)
                log_noise = np.linalg.slogdet(part)[1]
                inverse = np.zeros_like(whole)
                for i in range(seen):
                    for j in range(seen):
                        inverse[rows[i], rows[j]] = small[i, j]
            for iteration in range(2):  # once more about the corrected state, where Ω² bends
                missed = np.zeros(c)
                sine, cosine = np.sin(x[0]), np.cos(x[0])
                for i in range(c):
                    gravity = force[i, 0] * along + across * (force[i, 1] * cosine - force[i, 2] * sine)
                    h[i, 0] = -across * (force[i, 1] * sine + force[i, 2] * cosine)
                    h[i, 1] = 2.0 * by_square[i] * x[1]
                    h[i, 2] = by_acceleration[i]
                    predicted = gravity + by_acceleration[i] * x[2] + by_square[i] * x[1] * x[1]
                    if np.isfinite(y[k, i]):
                        missed[i] = y[k, i] - predicted
                weighted = np.ascontiguousarray(h.T) @ inverse
                information = prior + weighted @ h
                gradient = weighted @ missed - prior @ (x - start)
                if iteration == 0:
                    # Innovations: ν' S⁻¹ ν and log |S| by the matrix inversion lemma.
                    score = weighted @ missed
                    square = float(missed @ inverse @ missed - score @ np.linalg.solve(information, score))
                    log_size = log_noise + np.linalg.slogdet(information)[1] - np.linalg.slogdet(prior)[1]
                    likelihood -= 0.5 * (square + log_size + seen * np.log(2.0 * np.pi))
                    squares += square
                    count += seen
                x = x + np.linalg.solve(information, gradient)
            p = np.linalg.inv(information)  # type: ignore[assignment]
            p = 0.5 * (p + p.T)
        states[k], covariances[k] = x, p
    return states, covariances, before, before_covariance, likelihood, squares, count


@njit(cache=True)  # type: ignore[misc]
def smooth_axis(
    t: NDArray[np.float64],
    states: NDArray[np.float64],
    covariances: NDArray[np.float64],
    before: NDArray[np.float64],
    before_covariance: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return smoothed states (n, 3) and covariances (n, 3, 3): Rauch, Tung and Striebel's recursion."""
    n = len(t)
    x, p = states.copy(), covariances.copy()
    f = np.eye(3)
    for k in range(n - 2, -1, -1):
        dt = t[k + 1] - t[k]
        f[0, 1], f[0, 2], f[1, 2] = dt, 0.5 * dt * dt, dt
        gain = np.linalg.solve(before_covariance[k + 1], f @ covariances[k]).T
        x[k] = states[k] + gain @ (x[k + 1] - before[k + 1])
        p[k] = covariances[k] + gain @ (p[k + 1] - before_covariance[k + 1]) @ gain.T
        p[k] = 0.5 * (p[k] + p[k].T)
    return x, p
