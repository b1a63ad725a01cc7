"""The path of the body in the state of a filter, compiled: attitude, velocity, position, and the angle turned.

In the state of `gfimu.rate.body_rate` the path has ten components: the error θ of the attitude in world axes (3), the
velocity v and position s of the origin in the world (3 each) and the angle ψ about an axis n of the body. R is the
rotation from body to world; the world turns with the Earth at the rate Ω. From sample k − 1 to k, Δt later,

    R ← exp(−Ω Δt) R exp(½ Δt (ω_{k−1} + ω_k) + Δt²/12 (ω_{k−1} × ω_k + α_{k−1} − α_k))
    v ← v + ∫(R p) + Δt (g − 2 Ω × v),   s ← s + ∫v,   ψ ← ψ + ½ Δt n·(ω_{k−1} + ω_k − 2 Rᵀ Ω)

The specific force p is P y (`gfimu.rate.channel_sets`) less its bias b_p and the effect P D φ of the errors of the
channels. The integral of R p is that of the parabola through three samples. After each sample θ is added to R and set
to zero. At rest v is zero, R p points up and its size is g: both are measurements, which correct tilt and bias of p. An
attitude too uncertain for a linear step is levelled anew from R p, and earlier samples are not corrected by that rest.
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
    "ANGLE", "POSITION", "ROWS", "TILT", "VELOCITY", "Path", "PathTuning", "advance_path", "attitude_is_lost",
    "level_anew", "motion_of", "rest_on_path", "settle_path", "turned",
]  # fmt: skip

TILT, VELOCITY, POSITION, ANGLE = 6, 9, 12, 15  # places in the state
ROWS = 10  # of the path in the state
_TURNS = (TILT, TILT + 1, TILT + 2, ANGLE)
_EVEN = 0.01  # numerical: relative difference of two steps up to which a parabola goes through three samples


class PathTuning(NamedTuple):
    """Numbers of the path that stay the same over a run."""

    axis: NDArray[np.float64]  # (3,) n, body axes
    earth: NDArray[np.float64]  # (3,) Ω, world axes, rad/s
    gravity: float  # m/s²
    stop_variance: float  # of the velocity at rest, (m/s)²
    still_variance: float  # of the mean acceleration over a block of rest, (m/s²)²
    rest_window: int  # samples of a block of rest
    unknown_tilt: float  # variance of a tilt before gravity is measured that decides nothing, rad²
    lost_tilt: float  # variance of a tilt from which it is found anew at rest, rad²
    lost_heading: float  # variance of the heading from which the same is done, rad²


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
    """Return a component of [α; p] of sample k, corrected for the constants in the state x: biases, errors, products.

    ``slope`` (n,) is filled with its slope by the constants.
    """
    at, place, a = tuning.at, max(samples.channel_set[k], 0), row % 3
    along = np.empty(3)
    for i in range(at.alpha, len(x)):
        slope[i] = 0.0
    first = at.alpha if row < 3 else at.force
    value = samples.alpha[k, a] if row < 3 else samples.force[k, a]
    errors = samples.alpha_errors if row < 3 else samples.force_errors
    bias = tables.alpha_bias if row < 3 else tables.force_bias
    leak = tables.leak if row < 3 else tables.force_leak
    slope[first + a] = -1.0
    for i in range(samples.z.shape[1]):
        slope[at.products + i] = -bias[place, a, i]
    for j in range(at.errors, at.end):
        slope[j] = -errors[k, a, j - at.errors]
    slope_of(leak[place, a], x, along)
    for j in range(at.alpha, len(x)):
        value += slope[j] * x[j]
    return value - 0.5 * (along[0] * x[0] + along[1] * x[1] + along[2] * x[2])


@njit(**INNER)
def _force(samples, k, tables, tuning, x, out, slope):  # type: ignore[no-untyped-def]
    """Fill in p (3,) of sample k, corrected for the constants in the state x, and its slope (3, n) by them."""
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

    axes = np.empty((4, 3))  # of θ and ψ, in the body
    for b in range(3):
        axes[3, b] = path.axis[b]
        for a in range(3):
            axes[a, b] = middle[a, b]
    for a in range(4):
        row = _TURNS[a]
        for j in range(n):
            total = 0.0
            for b in range(3):
                total += axes[a, b] * (transition[b, j] + (1.0 if b == j else 0.0))
            transition[row, j] = half * total
        transition[row, row] = 1.0
        for b in range(TILT):
            total = 0.0
            for c in range(3):
                total += axes[a, c] * noise[c, b]
            noise[row, b] = noise[b, row] = half * total
        added[row] = 0.0
        for b in range(3):
            added[row] += half * axes[a, b] * added[b]
        for d in range(a + 1):
            total = 0.0
            for c in range(3):
                total += axes[d, c] * noise[row, c]
            noise[row, _TURNS[d]] = noise[_TURNS[d], row] = half * total
    for a in range(3):
        added[TILT + a] += vector[a]
        for b in range(3):
            added[TILT + a] -= half * middle[a, b] * (start[b] + rate[b])
            added[ANGLE] -= step * path.axis[a] * middle[b, a] * path.earth[b]

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
    for row in range(VELOCITY, ANGLE):
        for j in range(n):
            added[row] -= transition[row, j] * x[j]
    for a in range(3):
        carried.recent[a] = first[a]
    carried.recent[3] = step


@njit(**INNER)
def _mean_up(samples, first, last, tables, tuning, carried, up, slope):  # type: ignore[no-untyped-def]
    """Fill in the mean of R p over samples at rest (3,), and the slope (3, n) of that of p by the constants.

    Returns how many samples have it.
    """
    count = 0
    mean, force, one, matrix = np.zeros(3), np.empty(3), np.zeros(slope.shape), np.empty((3, 3))
    for k in range(first, last + 1):
        if samples.channel_set[k] < 0:
            continue
        count += 1
        _force(samples, k, tables, tuning, carried.x, force, one)
        for a in range(3):
            mean[a] += (force[a] - mean[a]) / count
            for j in range(tuning.at.alpha, slope.shape[1]):
                slope[a, j] += (one[a, j] - slope[a, j]) / count
    _matrix(carried.attitude, matrix)
    _times(matrix, mean, up)
    return count


@compiled
def rest_on_path(samples, first, last, tables, tuning, carried, solved, level, gain, record, row):  # type: ignore[no-untyped-def]
    """Take the mean of p over samples ``first`` to ``last`` at rest for gravity, and the velocity for zero.

    The record is filled where it has room. In a row −1 the body was levelled by the same samples before.
    """
    x, p, at, path = carried.x, carried.covariance, tuning.at, tuning.path
    n = len(x)
    up, slope = np.empty(3), np.zeros((3, n))
    matrix, row_of, old = np.empty((3, 3)), np.zeros(n), x.copy()
    old[TILT : TILT + 3] = 0.0
    _matrix(carried.attitude, matrix)
    count = _mean_up(samples, first, last, tables, tuning, carried, up, slope)
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
    """Add the estimated error θ of the attitude to the attitude, and set it to zero."""
    new = np.empty(4)
    turned(carried.attitude, carried.x[TILT : TILT + 3], True, new)
    for i in range(4):
        carried.attitude[i] = new[i]
    for a in range(3):
        carried.x[TILT + a] = 0.0


@njit(**INNER)
def attitude_is_lost(tuning, carried):  # type: ignore[no-untyped-def]
    """Whether gravity would move the attitude too far for one linear step, or its heading is unknown.

    An unknown heading turns the noise of p across the vertical about, which would seem to show it.
    """
    p, path = carried.covariance, tuning.path
    tilt = 0.5 * (p[TILT, TILT] + p[TILT + 1, TILT + 1])
    return tilt > path.lost_tilt or p[TILT + 2, TILT + 2] > path.lost_heading


@njit(**INNER)
def level_anew(samples, first, last, tables, tuning, carried, level, gain, record):  # type: ignore[no-untyped-def]
    """Find the tilt from the mean of p over samples ``first`` to ``last`` at rest, by the smallest turn, and stop."""
    x, p = carried.x, carried.covariance
    settle_path(carried)
    up, turn, new, slope = np.empty(3), np.zeros(3), np.empty(4), np.zeros((3, len(x)))
    if _mean_up(samples, first, last, tables, tuning, carried, up, slope) == 0:
        return
    across = np.sqrt(up[0] * up[0] + up[1] * up[1])
    if across > 0.0:
        angle = np.arctan2(across, up[2])
        turn[0], turn[1] = angle * up[1] / across, -angle * up[0] / across
    turned(carried.attitude, turn, True, new)
    for i in range(4):
        carried.attitude[i] = new[i]
    lost = p[TILT, TILT] + p[TILT + 1, TILT + 1]
    heading = p[TILT + 2, TILT + 2] + lost
    for row in range(TILT, POSITION):
        for j in range(len(x)):
            p[row, j] = p[j, row] = 0.0
        p[row, row] = tuning.path.unknown_tilt if row < VELOCITY else lost
        x[row] = 0.0
    p[TILT + 2, TILT + 2] = heading
    rest_on_path(samples, first, last, tables, tuning, carried, len(x), level, gain, record, -1)


@njit(**INNER)
def motion_of(samples, k, tables, tuning, x, p, level, out, variance):  # type: ignore[no-untyped-def]
    """Fill in α and p (6,) of sample k, corrected for the constants in the state x, and their variance (6,)."""
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
