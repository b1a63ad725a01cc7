"""Extended Kalman filter and smoother of the state [θ, Ω, α] for a rotation about one axis, compiled.

Beside the state run its derivatives by constants of the mounting that are not known exactly (levers, orientations,
biases): as the innovations of a filter are linear in such constants, their gradient and information follow in one pass,
without a place in the state (B. Friedland, Treatment of bias in recursive filtering, IEEE Trans. AC-14, 1969).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gfimu.rate.axis.channels import Coefficients

__all__ = ["FilterRun", "Slopes", "filter_axis", "smooth_axis"]


class Slopes(NamedTuple):
    """Derivatives of the channels' coefficients by m uncertain constants.

    Parameters
    ----------
    force : ndarray, shape (m, c, 3)
    by_acceleration, by_square, offset : ndarray, shape (m, c)
        Of the fields of `Coefficients` of the same names.
    gravity : ndarray, shape (m, 2)
        Of gravity along the axis and across it, m/s².
    """

    force: NDArray[np.float64]
    by_acceleration: NDArray[np.float64]
    by_square: NDArray[np.float64]
    offset: NDArray[np.float64]
    gravity: NDArray[np.float64]


class FilterRun(NamedTuple):
    """What one pass of the filter found.

    Parameters
    ----------
    states, covariances : ndarray, shapes (n, 3) and (n, 3, 3)
        [θ, Ω, α] after each sample.
    before, before_covariances : ndarray
        The same before each sample.
    by_constants, before_by_constants : ndarray, shape (n, 3, m)
        Derivatives of the states by the uncertain constants.
    likelihood : float
        Log likelihood of the innovations.
    likelihoods : ndarray, shape (n,)
        The same of those of each sample.
    squares : float
        Sum of their normalised squares.
    readings : int
        Their number.
    gradient, information : ndarray, shapes (m,) and (m, m)
        Of the log likelihood by the uncertain constants; the information without that in the size of the innovations.
    """

    states: NDArray[np.float64]
    covariances: NDArray[np.float64]
    before: NDArray[np.float64]
    before_covariances: NDArray[np.float64]
    by_constants: NDArray[np.float64]
    before_by_constants: NDArray[np.float64]
    likelihood: float
    likelihoods: NDArray[np.float64]
    squares: float
    readings: int
    gradient: NDArray[np.float64]
    information: NDArray[np.float64]


@njit(cache=True)  # type: ignore[misc]
def filter_axis(
    t: NDArray[np.float64],
    y: NDArray[np.float64],
    channels: Coefficients,
    gravity: NDArray[np.float64],
    variance: NDArray[np.float64],
    hub_variance: float,
    jerk: NDArray[np.float64],
    state: NDArray[np.float64],
    covariance: NDArray[np.float64],
    slopes: Slopes,
    mirrored: NDArray[np.int64],
    first_by_constants: NDArray[np.float64],
) -> FilterRun:
    """Run the filter over all samples.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Times, s.
    y : ndarray, shape (n, c)
        Readings, m/s²; NaN where one is missing.
    channels : Coefficients
        Coefficients of the channels.
    gravity : ndarray, shape (2,)
        Gravity along the axis and across it, m/s².
    variance : ndarray, shape (c,)
        White noise of the channels, m²/s⁴.
    hub_variance : float
        Variance of the axis's own specific force beyond gravity, each direction, m²/s⁴.
    jerk : ndarray, shape (n,)
        Spectral density of the change of α before each sample, rad²/s⁵.
    state, covariance
        [θ, Ω, α] before the first sample and its covariance.
    slopes : Slopes
        Derivatives by the uncertain constants, of which there may be none.
    mirrored : ndarray, shape (k,)
        Samples before which the sign of the rate is changed, ascending.
    first_by_constants : ndarray, shape (3, m)
        Derivatives of the state before the first sample by the uncertain constants.
    """
    force, by_acceleration, by_square, offset = channels
    along, across = gravity[0], gravity[1]
    m = len(slopes.offset)
    by_constants, before_by_constants = np.zeros((len(t), 3, m)), np.zeros((len(t), 3, m))
    gradient_of, information_of = np.zeros(m), np.zeros((m, m))
    v, d = first_by_constants.copy(), np.zeros((y.shape[1], m))
    n, c = y.shape
    states, covariances = np.empty((n, 3)), np.empty((n, 3, 3))
    before, before_covariance = np.empty((n, 3)), np.empty((n, 3, 3))
    x: NDArray[np.float64] = state.copy()
    p: NDArray[np.float64] = covariance.copy()
    likelihoods, squares, count = np.zeros(n), 0.0, 0
    f, q, h = np.eye(3), np.zeros((3, 3)), np.zeros((c, 3))
    noise = np.zeros((c, c))
    for i in range(c):
        for j in range(c):
            for axis in range(3):
                noise[i, j] += hub_variance * force[i, axis] * force[j, axis]
        noise[i, i] += variance[i]
    whole = np.ascontiguousarray(np.linalg.inv(noise))
    whole_log = np.linalg.slogdet(noise)[1]
    turned = 0
    for k in range(n):
        if k > 0:
            dt = t[k] - t[k - 1]
            f[0, 1], f[0, 2], f[1, 2] = dt, 0.5 * dt * dt, dt
            q[0, 0], q[0, 1], q[0, 2] = dt**5 / 20.0, dt**4 / 8.0, dt**3 / 6.0
            q[1, 1], q[1, 2], q[2, 2] = dt**3 / 3.0, dt * dt / 2.0, dt
            q[1, 0], q[2, 0], q[2, 1] = q[0, 1], q[0, 2], q[1, 2]
            x = f @ x
            p = f @ p @ f.T + jerk[k] * q
            v = f @ v
        if turned < len(mirrored) and mirrored[turned] == k:
            turned += 1
            x[1] = -x[1]
            for i in range(m):
                v[1, i] = -v[1, i]
            for i in range(3):
                p[1, i] = -p[1, i]
            for i in range(3):
                p[i, 1] = -p[i, 1]
        _keep(k, x, p, v, before, before_covariance, before_by_constants)
        seen = 0
        for i in range(c):
            if np.isfinite(y[k, i]):
                seen += 1
        if seen > 0:
            prior, prior_log = _inverse(p)
            start = x.copy()
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
                    pull = force[i, 0] * along + across * (force[i, 1] * cosine - force[i, 2] * sine)
                    h[i, 0] = -across * (force[i, 1] * sine + force[i, 2] * cosine)
                    h[i, 1] = 2.0 * by_square[i] * x[1]
                    h[i, 2] = by_acceleration[i]
                    predicted = pull + offset[i] + by_acceleration[i] * x[2] + by_square[i] * x[1] * x[1]
                    if np.isfinite(y[k, i]):
                        missed[i] = y[k, i] - predicted
                weighted = np.ascontiguousarray(h.T) @ inverse
                found, found_log = _inverse(prior + weighted @ h)  # covariance after the sample
                gradient = weighted @ missed - prior @ (x - start)
                if iteration == 0:
                    # Innovations: ν' S⁻¹ ν and log |S| by the matrix inversion lemma.
                    score = weighted @ missed
                    square = float(missed @ inverse @ missed - score @ (found @ score))
                    log_size = log_noise - found_log - prior_log
                    likelihoods[k] = -0.5 * (square + log_size + seen * np.log(2.0 * np.pi))
                    squares += square
                    count += seen
                if m > 0:
                    # Of ν = y − h(x, φ): ∂ν/∂φ = −d; the force of the hub itself is in the innovations' covariance.
                    hub = np.zeros(3)
                    if iteration == 1 and hub_variance > 0.0:
                        hub = hub_variance * (np.ascontiguousarray(force.T) @ (inverse @ missed))
                    _by_constants(d, slopes, force, x, along, across, hub)
                    d += h @ v
                    through = weighted @ d
                    if iteration == 0:
                        whitened = inverse @ (missed - h @ (found @ score))
                        gradient_of += d.T @ whitened
                        information_of += np.ascontiguousarray(d.T) @ inverse @ d - np.ascontiguousarray(through.T) @ (
                            found @ through
                        )
                        if hub_variance > 0.0:
                            precision = inverse - np.ascontiguousarray(weighted.T) @ (found @ weighted)
                            gradient_of += hub_variance * _by_size(slopes.force, force, precision, whitened)
                    else:
                        v = v - found @ through
                x = x + found @ gradient
            p = found
        _keep(k, x, p, v, states, covariances, by_constants)
    return FilterRun(
        states, covariances, before, before_covariance, by_constants, before_by_constants,
        likelihoods.sum(), likelihoods, squares, count, gradient_of, information_of,
    )  # fmt: skip


@njit(cache=True)  # type: ignore[misc]
def _keep(
    k: int,
    x: NDArray[np.float64],
    p: NDArray[np.float64],
    v: NDArray[np.float64],
    states: NDArray[np.float64],
    covariances: NDArray[np.float64],
    by_constants: NDArray[np.float64],
) -> None:
    """Keep state, covariance and derivatives of sample k: one by one, as slices take four times as long to compile."""
    for i in range(3):
        states[k, i] = x[i]
        for j in range(3):
            covariances[k, i, j] = p[i, j]
        for j in range(v.shape[1]):
            by_constants[k, i, j] = v[i, j]


@njit(cache=True)  # type: ignore[misc]
def _inverse(a: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Return the inverse of a symmetric positive matrix (3, 3), by minors, and the log of the inverse's determinant."""
    found = np.empty((3, 3))
    for i in range(3):
        for j in range(i, 3):
            one, two, three, four = (i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3
            found[i, j] = a[one, three] * a[two, four] - a[one, four] * a[two, three]
            found[j, i] = found[i, j]
    size = a[0, 0] * found[0, 0] + a[0, 1] * found[0, 1] + a[0, 2] * found[0, 2]
    return found / size, -np.log(size)


@njit(cache=True)  # type: ignore[misc]
def _by_constants(
    d: NDArray[np.float64],
    slopes: Slopes,
    force: NDArray[np.float64],
    x: NDArray[np.float64],
    along: float,
    across: float,
    hub: NDArray[np.float64],
) -> None:
    """Write the derivatives of what the channels read by the constants, at a state, into ``d``, shape (c, m)."""
    sine, cosine = np.sin(x[0]), np.cos(x[0])
    at = np.array([along + hub[0], across * cosine + hub[1], -across * sine + hub[2]])
    for j in range(d.shape[1]):
        first, second = slopes.gravity[j, 0], slopes.gravity[j, 1]
        for i in range(d.shape[0]):
            total = slopes.offset[j, i] + slopes.by_acceleration[j, i] * x[2] + slopes.by_square[j, i] * x[1] * x[1]
            for axis in range(3):
                total += slopes.force[j, i, axis] * at[axis]
            total += force[i, 0] * first + second * (force[i, 1] * cosine - force[i, 2] * sine)
            d[i, j] = total


@njit(cache=True)  # type: ignore[misc]
def _by_size(
    slopes: NDArray[np.float64],
    force: NDArray[np.float64],
    precision: NDArray[np.float64],
    whitened: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the gradient that the covariance F Fᵀ of the hub's force adds, per unit of its variance, shape (m,)."""
    found = np.zeros(len(slopes))
    along_hub, inside = np.ascontiguousarray(force.T) @ whitened, precision @ force
    for j in range(len(slopes)):
        for i in range(force.shape[0]):
            for axis in range(3):
                found[j] += slopes[j, i, axis] * (whitened[i] * along_hub[axis] - inside[i, axis])
    return found


@njit(cache=True)  # type: ignore[misc]
def smooth_axis(
    t: NDArray[np.float64], run: FilterRun, mirrored: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return smoothed states (n, 3), covariances (n, 3, 3) and derivatives by the constants (n, 3, m).

    Rauch, Tung and Striebel's recursion, of the states and of their derivatives alike; ``mirrored`` as in
    `filter_axis`.
    """
    n = len(t)
    x, p, v = run.states.copy(), run.covariances.copy(), run.by_constants.copy()
    f = np.eye(3)
    turned = len(mirrored) - 1
    for k in range(n - 2, -1, -1):
        dt = t[k + 1] - t[k]
        f[0, 1], f[0, 2], f[1, 1], f[1, 2] = dt, 0.5 * dt * dt, 1.0, dt
        if turned >= 0 and mirrored[turned] == k + 1:
            turned -= 1
            f[1] = -f[1]
        gain = np.ascontiguousarray(np.linalg.solve(run.before_covariances[k + 1], f @ run.covariances[k]).T)
        x[k] = run.states[k] + gain @ (x[k + 1] - run.before[k + 1])
        p[k] = run.covariances[k] + gain @ (p[k + 1] - run.before_covariances[k + 1]) @ gain.T
        p[k] = 0.5 * (p[k] + p[k].T)
        if v.shape[2] > 0:
            v[k] = run.by_constants[k] + gain @ (v[k + 1] - run.before_by_constants[k + 1])
    return x, p, v
