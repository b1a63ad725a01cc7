"""The path of the body in the state of a filter, compiled: attitude, velocity, position, and the angle turned.

Behind ω and ε the state has the error θ of the attitude in world axes (3), the velocity v and position s of the origin
in the world (3 each) and the angle ψ about an axis n of the body. With R from the body to the world, which turns with
the Earth by Ω, from sample k − 1 to k, Δt later,

    R ← exp(−Ω Δt) R exp(½ Δt (ω_{k−1} + ω_k) + Δt²/12 (ω_{k−1} × ω_k + α_{k−1} − α_k))
    v ← v + ∫(R p) + Δt (g − 2 Ω × v),   s ← s + ∫v,   ψ ← ψ + ½ Δt n·(ω_{k−1} + ω_k − 2 Rᵀ Ω)

p = P y − b_p − P D φ, and the integral of R p is that of the parabola through three samples. θ is taken into R after
each sample. Where the body rests, v is zero and R p points up and measures g: that shows tilt and biases of p. A tilt
so uncertain that θ × R p is far from linear is found anew from R p alone, and nothing before it is corrected by it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gfimu.base.compiled import INNER, compiled
from gfimu.rate.kernel import take
from gfimu.rate.probable_rate import slope_of

__all__ = [
    "ANGLE", "POSITION", "ROWS", "TILT", "VELOCITY", "Path", "PathTuning", "advance_path", "level_anew", "motion_of",
    "rest_on_path", "settle_path", "tilt_is_vague", "turned",
]  # fmt: skip

TILT, VELOCITY, POSITION, ANGLE = 6, 9, 12, 15  # places in the state
ROWS = 10  # of the path in the state
_VAGUE = 0.05  # rad², of the two tilts together, from which the tilt is found anew at rest: 9° each
_LOST = 0.1  # rad², of the heading, from which the same is done: 18°
_TILTED = 0.3  # rad, uncertainty of a tilt before gravity is measured from which it decides nothing
_EVEN = 0.01  # numerical: relative difference of two steps up to which a parabola goes through three samples


class PathTuning(NamedTuple):
    """Numbers of the path that stay the same over a run."""

    axis: NDArray[np.float64]  # (3,) n, body axes
    earth: NDArray[np.float64]  # (3,) Ω, world axes, rad/s
    gravity: float  # m/s²
    stop_variance: float  # of the velocity at rest, (m/s)²
    still_variance: float  # of the mean acceleration over a block of rest, (m/s²)²
    rest_window: int  # samples of a block of rest


class Path(NamedTuple):
    """The path per sample, or nothing (N = 0) where it is not followed."""

    attitude: NDArray[np.float64]  # (N, 4) w, x, y, z
    ahead: NDArray[np.float64]  # (N, 4) as predicted
    line: NDArray[np.float64]  # (N, 7) velocity, position, angle
    variance: NDArray[np.float64]  # (N, 10) of θ, v, s, ψ
    motion: NDArray[np.float64]  # (N, 6) α, p
    motion_variance: NDArray[np.float64]  # (N, 6)
    levelled: NDArray[np.bool_]  # (N,) tilt and velocity were found anew behind this sample

    @classmethod
    def empty(cls, n: int) -> Path:
        """Return room for n samples."""
        attitude, ahead, line, variance, motion, spread = (np.empty((n, width)) for width in (4, 4, 7, ROWS, 6, 6))
        return cls(attitude, ahead, line, variance, motion, spread, np.zeros(n, dtype=np.bool_))


@njit(**INNER)
def turned(attitude, vector, before, out):  # type: ignore[no-untyped-def]
    """Turn an attitude (4,) by a rotation vector (3,) in body axes, or in world axes ``before`` it; fills ``out``."""
    angle = np.sqrt(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2])
    share = np.sin(0.5 * angle) / angle if angle > 1e-6 else 0.5 - angle * angle / 48.0
    w, x, y, z = attitude[0], attitude[1], attitude[2], attitude[3]
    e, f, g, h = np.cos(0.5 * angle), share * vector[0], share * vector[1], share * vector[2]
    side = -1.0 if before else 1.0
    out[0] = w * e - x * f - y * g - z * h
    out[1] = w * f + x * e + side * (y * h - z * g)
    out[2] = w * g + y * e + side * (z * f - x * h)
    out[3] = w * h + z * e + side * (x * g - y * f)
    size = np.sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2] + out[3] * out[3])
    for i in range(4):
        out[i] /= size


@njit(**INNER)
def _matrix(q, out):  # type: ignore[no-untyped-def]
    """Fill in the rotation matrix (3, 3) of an attitude (4,)."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    out[0, 0], out[0, 1], out[0, 2] = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)
    out[1, 0], out[1, 1], out[1, 2] = 2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)
    out[2, 0], out[2, 1], out[2, 2] = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)


@njit(**INNER)
def _difference(attitude, other, out):  # type: ignore[no-untyped-def]
    """Fill in the small rotation vector (3,), world axes, that turns the other attitude (4,) into this one."""
    w, x, y, z = attitude[0], attitude[1], attitude[2], attitude[3]
    e, f, g, h = other[0], -other[1], -other[2], -other[3]
    side = 2.0 if w * e - x * f - y * g - z * h >= 0.0 else -2.0
    out[0] = side * (w * f + x * e + y * h - z * g)
    out[1] = side * (w * g + y * e + z * f - x * h)
    out[2] = side * (w * h + z * e + x * g - y * f)


@njit(**INNER)
def _times(matrix, vector, out):  # type: ignore[no-untyped-def]
    """Fill in a matrix (3, 3) times a vector (3,)."""
    for a in range(3):
        out[a] = matrix[a, 0] * vector[0] + matrix[a, 1] * vector[1] + matrix[a, 2] * vector[2]


@njit(**INNER)
def _correct(samples, k, tables, tuning, row, x, slope):  # type: ignore[no-untyped-def]
    """Return a row of [α; p] of sample k without what the constants in the state x make of it.

    ``slope`` (n,) is filled with its slope by the constants.
    """
    at, place, a = tuning.at, max(samples.channel_set[k], 0), row % 3
    along = np.empty(3)
    for i in range(at.alpha, len(x)):
        slope[i] = 0.0
    if row < 3:
        value = samples.alpha[k, a]
        slope[at.alpha + a] = -1.0
        for i in range(samples.z.shape[1]):
            slope[at.products + i] = -tables.alpha_bias[place, a, i]
        for j in range(at.errors, at.end):
            slope[j] = -samples.alpha_errors[k, a, j - at.errors]
        slope_of(tables.leak[place, a], x, along)
    else:
        value = samples.force[k, a]
        slope[at.force + a] = -1.0
        for i in range(samples.z.shape[1]):
            slope[at.products + i] = -tables.force_bias[place, a, i]
        for j in range(at.errors, at.end):
            slope[j] = -samples.force_errors[k, a, j - at.errors]
        slope_of(tables.force_leak[place, a], x, along)
    for j in range(at.alpha, len(x)):
        value += slope[j] * x[j]
    return value - 0.5 * (along[0] * x[0] + along[1] * x[1] + along[2] * x[2])


@njit(**INNER)
def _force(samples, k, tables, tuning, x, out, slope):  # type: ignore[no-untyped-def]
    """Fill in p (3,) of sample k without what the constants make of it, and its slope (3, n) by them."""
    for a in range(3):
        out[a] = _correct(samples, k, tables, tuning, 3 + a, x, slope[a])


@njit(**INNER)
def advance_path(samples, given, k, tables, tuning, carried, step, level, transition, added, noise):  # type: ignore[no-untyped-def]
    """Carry the attitude to sample k, and fill in the rows of the path of transition, added and noise.

    Those of ω and ε are filled in already. Of an estimate that is made anew, everything is linear about the given one.
    """
    x, path = carried.x, tuning.path
    n, half = len(x), 0.5 * step
    before, behind, middle = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    again = len(given.level) > 0
    start, rate = x.copy(), x.copy()  # before and after the step, as far as attitude and p depend on it
    for a in range(3):
        rate[a] = added[a]
        for j in range(n):
            rate[a] += transition[a, j] * x[j]
        if again:
            start[a], rate[a] = given.omega[k - 1, a], given.omega[k, a]
    vector, new, ahead = np.empty(3), np.empty(4), np.empty(4)
    for a in range(3):
        b, c = (a + 1) % 3, (a + 2) % 3
        across = start[b] * rate[c] - start[c] * rate[b] + samples.alpha[k - 1, a] - samples.alpha[k, a]
        vector[a] = half * (start[a] + rate[a]) + step * step * across / 12.0
    _matrix(carried.attitude, before)
    turned(carried.attitude, vector, False, new)
    for a in range(3):
        vector[a] = -step * path.earth[a]
    turned(new, vector, True, ahead)
    for i in range(4):
        carried.attitude[i] = given.attitude[k, i] if again else ahead[i]
    _difference(ahead, carried.attitude, vector)
    _matrix(carried.attitude, behind)
    force, first, last = np.empty(3), np.empty(3), np.empty(3)
    slope, slope_behind = np.zeros((3, n)), np.zeros((3, n))
    _force(samples, k - 1, tables, tuning, start, force, slope)
    _times(before, force, first)
    _force(samples, k, tables, tuning, rate, force, slope_behind)
    _times(behind, force, last)
    for a in range(3):
        for b in range(3):
            middle[a, b] = 0.5 * (before[a, b] + behind[a, b])

    for a in range(3):  # θ and ψ
        for j in range(n):
            total = 0.0
            for b in range(3):
                total += middle[a, b] * (transition[b, j] + (1.0 if b == j else 0.0))
            transition[TILT + a, j] = half * total
        transition[TILT + a, TILT + a] = 1.0
        for b in range(TILT):
            total = 0.0
            for c in range(3):
                total += middle[a, c] * noise[c, b]
            noise[TILT + a, b] = noise[b, TILT + a] = half * total
        added[TILT + a] = vector[a]
        for b in range(3):
            added[TILT + a] += half * middle[a, b] * (added[b] - start[b] - rate[b])
    for j in range(n):
        total = 0.0
        for b in range(3):
            total += path.axis[b] * (transition[b, j] + (1.0 if b == j else 0.0))
        transition[ANGLE, j] = half * total
    transition[ANGLE, ANGLE] = 1.0
    for b in range(TILT + 3):
        total = 0.0
        for c in range(3):
            total += path.axis[c] * noise[c, b]
        noise[ANGLE, b] = noise[b, ANGLE] = half * total
    for a in range(3):
        for b in range(3):
            total = 0.0
            for c in range(3):
                total += middle[b, c] * noise[TILT + a, c]
            noise[TILT + a, TILT + b] = half * total
    total = 0.0
    for c in range(3):
        total += path.axis[c] * noise[ANGLE, c]
    noise[ANGLE, ANGLE] = half * total

    place = max(samples.channel_set[k], 0)
    for a in range(3):  # v and s
        b, c = (a + 1) % 3, (a + 2) % 3
        for j in range(n):
            total = transition[TILT + b, j] * last[c] - transition[TILT + c, j] * last[b]  # θ × R p
            for d in range(3):
                total += before[a, d] * slope[d, j] + behind[a, d] * slope_behind[d, j]
            transition[VELOCITY + a, j] = half * total
        transition[VELOCITY + a, TILT + b] += half * first[c]
        transition[VELOCITY + a, TILT + c] -= half * first[b]
        transition[VELOCITY + a, VELOCITY + a] = 1.0
        for j in range(n):
            transition[POSITION + a, j] = half * transition[VELOCITY + a, j]
        transition[POSITION + a, VELOCITY + a] = step
        transition[POSITION + a, POSITION + a] = 1.0
        total = 0.0
        for d in range(3):
            for e in range(3):
                total += middle[a, d] * tables.force_noise[place, d, e] * middle[a, e]
        noise[VELOCITY + a, VELOCITY + a] = step * step * level * total

    for a in range(3):  # θ at either end, as it is: nought where the attitude is the filter's own
        vector[a] = added[TILT + a]
        for j in range(n):
            vector[a] += transition[TILT + a, j] * x[j]
    even = abs(step - carried.recent[3]) < _EVEN * step
    for a in range(3):
        b, c = (a + 1) % 3, (a + 2) % 3
        gained = half * (first[a] + last[a])
        if even:
            gained = step * (5.0 * last[a] + 8.0 * first[a] - carried.recent[a]) / 12.0
        gained += half * (x[TILT + b] * first[c] - x[TILT + c] * first[b])
        gained += half * (vector[b] * last[c] - vector[c] * last[b])
        gained -= step * 2.0 * (path.earth[b] * x[VELOCITY + c] - path.earth[c] * x[VELOCITY + b])
        if a == 2:
            gained -= step * path.gravity
        moved = step * x[VELOCITY + a] + half * gained - step * step * (last[a] - first[a]) / 12.0
        added[VELOCITY + a], added[POSITION + a] = x[VELOCITY + a] + gained, x[POSITION + a] + moved
    added[ANGLE] = 0.0
    for a in range(3):
        earth = middle[0, a] * path.earth[0] + middle[1, a] * path.earth[1] + middle[2, a] * path.earth[2]
        added[ANGLE] += path.axis[a] * (half * added[a] - step * earth)
    for row in range(VELOCITY, ANGLE):
        for j in range(n):
            added[row] -= transition[row, j] * x[j]
    for a in range(3):
        carried.recent[a] = first[a]
    carried.recent[3] = step


@compiled
def rest_on_path(samples, first, last, tables, tuning, carried, solved, level, gain, record, row):  # type: ignore[no-untyped-def]
    """Take the mean of p over samples ``first`` to ``last`` at rest for gravity, and the velocity for zero.

    The record is filled where it has room. In a row −1 the body was levelled by the same samples before.
    """
    x, p, at, path = carried.x, carried.covariance, tuning.at, tuning.path
    n, count = len(x), 0
    mean, force, slope, one = np.zeros(3), np.empty(3), np.zeros((3, n)), np.zeros((3, n))
    for k in range(first, last + 1):
        if samples.channel_set[k] < 0:
            continue
        count += 1
        _force(samples, k, tables, tuning, x, force, one)
        for a in range(3):
            mean[a] += (force[a] - mean[a]) / count
            for j in range(at.alpha, n):
                slope[a, j] += (one[a, j] - slope[a, j]) / count
    matrix, up, row_of, old = np.empty((3, 3)), np.empty(3), np.zeros(n), x.copy()
    old[TILT : TILT + 3] = 0.0
    _matrix(carried.attitude, matrix)
    _times(matrix, mean, up)
    tilt, heading = p[TILT, TILT] + p[TILT + 1, TILT + 1], p[TILT + 2, TILT + 2]
    bent = 0.0 if row < 0 else 0.25 * path.gravity**2 * tilt * (tilt + heading)  # of the second-order terms of θ × R p
    for a in range(3):
        row_of[:] = 0.0
        if count > 0:
            if a < 2:  # of the true g, as noise across it would seem to show the heading
                row_of[TILT + 1 - a] = path.gravity if a == 0 else -path.gravity
            variance = path.still_variance + bent
            for d in range(3):
                for j in range(at.alpha, n):
                    row_of[j] += matrix[a, d] * slope[d, j]
                for e in range(3):
                    variance += level / count * matrix[a, d] * tables.force_noise[0, d, e] * matrix[a, e]
            innovation = (path.gravity if a == 2 else 0.0) - up[a]
            for j in range(n):
                innovation -= row_of[j] * (x[j] - old[j])
            take(x, p, row_of, innovation, variance, solved, gain, record, row)
            row_of[:] = 0.0
        row_of[VELOCITY + a] = 1.0
        take(x, p, row_of, -x[VELOCITY + a], path.stop_variance, solved, gain, record, row)


@njit(**INNER)
def settle_path(carried):  # type: ignore[no-untyped-def]
    """Take θ into the attitude."""
    new = np.empty(4)
    turned(carried.attitude, carried.x[TILT : TILT + 3], True, new)
    for i in range(4):
        carried.attitude[i] = new[i]
    for a in range(3):
        carried.x[TILT + a] = 0.0


@njit(**INNER)
def tilt_is_vague(carried):  # type: ignore[no-untyped-def]
    """Whether gravity would move the attitude too far for one linear step, or its heading is unknown.

    An unknown heading turns the noise of p across the vertical about, which would seem to show it.
    """
    p = carried.covariance
    return p[TILT, TILT] + p[TILT + 1, TILT + 1] > _VAGUE or p[TILT + 2, TILT + 2] > _LOST


@njit(**INNER)
def level_anew(samples, first, last, tables, tuning, carried, level, gain, record):  # type: ignore[no-untyped-def]
    """Find the tilt from the mean of p over samples ``first`` to ``last`` at rest, by the smallest turn, and stop."""
    x, p = carried.x, carried.covariance
    settle_path(carried)
    mean, force, up, turn = np.zeros(3), np.empty(3), np.empty(3), np.zeros(3)
    slope, matrix, new = np.zeros((3, len(x))), np.empty((3, 3)), np.empty(4)
    for k in range(first, last + 1):
        _force(samples, k, tables, tuning, x, force, slope)
        for a in range(3):
            mean[a] += force[a] / (last + 1 - first)
    _matrix(carried.attitude, matrix)
    _times(matrix, mean, up)
    across = np.sqrt(up[0] * up[0] + up[1] * up[1])
    if across > 0.0:
        angle = np.arctan2(across, up[2])
        turn[0], turn[1] = angle * up[1] / across, -angle * up[0] / across
    turned(carried.attitude, turn, True, new)
    for i in range(4):
        carried.attitude[i] = new[i]
    vague = p[TILT, TILT] + p[TILT + 1, TILT + 1]
    heading = p[TILT + 2, TILT + 2] + vague
    for row in range(TILT, POSITION):
        for j in range(len(x)):
            p[row, j] = p[j, row] = 0.0
        p[row, row] = _TILTED * _TILTED if row < VELOCITY else vague
        x[row] = 0.0
    p[TILT + 2, TILT + 2] = heading
    rest_on_path(samples, first, last, tables, tuning, carried, len(x), level, gain, record, -1)


@njit(**INNER)
def motion_of(samples, k, tables, tuning, x, p, level, out, variance):  # type: ignore[no-untyped-def]
    """Fill in α and p (6,) of sample k without what the constants of the state x make of it, and the variance (6,)."""
    at, place = tuning.at, max(samples.channel_set[k], 0)
    slope = np.zeros(len(x))
    for row in range(6):
        out[row] = _correct(samples, k, tables, tuning, row, x, slope)
        a = row % 3
        total = level * (tables.alpha_noise[place, a, a] if row < 3 else tables.force_noise[place, a, a])
        for i in range(at.alpha, len(x)):
            if slope[i] != 0.0:
                for j in range(at.alpha, len(x)):
                    total += slope[i] * p[i, j] * slope[j]
        variance[row] = total
