"""The recursions of the rate filter and smoother, compiled: one sample after the other.

State x = [ω (3); b_α (3); b_z (d); b_gyro (0 or 3); ε (3)], biases constant. From sample k − 1 to k

    ω ← ω + Σ_j w_j (α_j − K_j b_z − L_j s(ω_j)) − Δt b_α + Δt/2 (ε_{k−1} + ε_k)                       (1)

with w the weights of the interval's quadrature and (K, L) zero for sets of channels that see α cleanly. ε is minus the
noise of α at a sample. Half of it enters before the sample is measured and half after, the same noise twice: where
the body turns far between samples (|ω| Δt near 1), taking the intervals' noises for independent would be wrong by
more than a tenth. The null space is the measurement, one whitened row after the other, linearised at the predicted rate,

    z_i = M_i s(ω) + (T b_z)_i + noise,    s = products of ω,                                          (2)

to second order while ω is not much larger than its uncertainty: with P the covariance of ω and B_i the symmetric form
of row i, z_i has mean ωᵀB_iω + tr(B_i P) and the variance 2 tr(B_i P B_i P) more than the linear one.

Everything that a sample needs is in arrays, so a run can stop after any sample and go on with the same answer. Sizes
are lengths of tuples: constants for the compiler, which unrolls the loops over the state.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gfimu.rate.second_order import second_order
from gfimu.rate.unrolled import step as _step_twelve

__all__ = [
    "Record",
    "RecursionInput",
    "RecursionOutput",
    "RecursionState",
    "Tables",
    "Tuning",
    "backward",
    "forward",
    "prepare",
]

_COMPILE: dict[str, Any] = {"cache": True, "error_model": "numpy", "fastmath": {"contract", "reassoc", "nsz"}}
_UNIFORM = 1e-6
_GAP = 1.5
_WALK_MEMORY = 1.0  # s, over which the wandering of α is averaged
_ERROR_MEMORY = 1.0  # s, for which a scale or placement error keeps its effect
_FOURTH_OF_NOISE = 70.0  # variance of the fourth and fifth difference of white noise of unit variance
_FIFTH_OF_NOISE = 252.0
_ROUGH_SHARE = 1.0 / (12.0 * 70.0)  # (Δt² × variance of the step)/12 by the fifth difference of a random walk
_SLOW = 1e-3  # tr P above this share of |ω|² switches the second-order terms on

# Places in RecursionState.scalars
_TIME, _WALK, _LAST_GOOD, _FOURTH, _FIFTH = range(5)
# Places in RecursionState.counts
_STARTED, _BLOCK, _REST_BLOCKS, _SAMPLES, _RUN, _RESTING = range(6)


class Tables(NamedTuple):
    """Matrices per set of channels (`gfimu.rate.sensing.ChannelTables`), stacked."""

    alpha_bias: NDArray[np.float64]  # (sets, 3, d)
    alpha_leak: NDArray[np.float64]  # (sets, 3, 6)
    alpha_noise: NDArray[np.float64]  # (sets, 3, 3)
    null_sensitivity: NDArray[np.float64]  # (sets, d, 6)
    null_bias: NDArray[np.float64]  # (sets, d, d)
    null_count: NDArray[np.int64]  # (sets,)
    plain: NDArray[np.bool_]  # (sets,)
    alpha_rows: NDArray[np.float64]  # (sets, 3, c)
    null_rows: NDArray[np.float64]  # (sets, d, c)


class Tuning(NamedTuple):
    """Numbers that stay the same over a run."""

    period: float  # nominal sample period, s
    weights: NDArray[np.float64]  # (m − 1, m): quadrature of each interval of the stencil, in periods
    position: int  # interval of the stencil that is integrated
    inverse_noise: NDArray[np.float64]  # (c,) 1/σ, s²/m
    scale_variance: float  # of the scale factors
    placement_variance: float  # over σ² of a channel, 1/(m/s²)² m²
    timing_variance: float  # of a channel's sampling time, s²
    gyro_variance: float  # (rad/s)²
    rest_window: int  # samples per block of the rest test; 0: no test
    rest_variance: float  # of the rate at rest, (rad/s)²
    rest_entry: int  # blocks in a row before rest begins anew
    rest_limits: NDArray[np.float64]  # (8,) `gfimu.rate.rest_test.RestTest.limits`
    likelihood: bool


class RecursionState(NamedTuple):
    """What is carried from one sample to the next."""

    x: NDArray[np.float64]  # (n,)
    covariance: NDArray[np.float64]  # (n, n)
    scalars: NDArray[np.float64]  # (5,)
    mean_alpha: NDArray[np.float64]  # (3,) over the filter's memory
    counts: NDArray[np.int64]  # (6,)
    settles: NDArray[np.bool_]  # (1,) the run starts at rest
    block_x: NDArray[np.float64]  # (n,) state when the block began
    block_covariance: NDArray[np.float64]  # (n, n)
    reference: NDArray[np.float64]  # (c,) mean reading while the biases were learned, m/s²
    run_alpha: NDArray[np.float64]  # (r, 3) mean α of the last blocks that passed, ring
    run_bias: NDArray[np.float64]  # (r, 3) its bias as known when each began
    run_covariance: NDArray[np.float64]  # (r, 3, 3)

    def copy(self) -> RecursionState:
        """Return a state that shares nothing with this one."""
        return RecursionState(*(field.copy() for field in self))


class RecursionInput(NamedTuple):
    """Samples, with enough of the ones before and after for the quadrature."""

    t: NDArray[np.float64]  # (N,)
    y: NDArray[np.float64]  # (N, c)
    alpha: NDArray[np.float64]  # (N, 3) A y
    z: NDArray[np.float64]  # (N, d) Z y
    channel_set: NDArray[np.int64]  # (N,)
    gyro: NDArray[np.float64]  # (N, 3), NaN where there is none
    uniform_run: NDArray[np.int64]  # (N,) equal steps between complete samples in a row up to here
    whole_run: NDArray[np.int64]  # (N,) steps without a gap up to here
    corrected: NDArray[np.float64]  # (N, 3) α of the past without what the products of ω left in it


class RecursionOutput(NamedTuple):
    """Estimates per sample."""

    omega: NDArray[np.float64]  # (N, 3)
    covariance: NDArray[np.float64]  # (N, 6) xx, yy, zz, xy, xz, yz
    nis: NDArray[np.float64]  # (N,)
    dof: NDArray[np.int64]  # (N,)
    likelihood: NDArray[np.float64]  # (N,)
    rest: NDArray[np.bool_]  # (N,) a block of rest ended here
    manoeuvre: NDArray[np.float64]  # (N,) recent α against its uncertainty, squared


class Record(NamedTuple):
    """What the backward pass needs of each sample of a block of length B, with up to u scalar updates."""

    x: NDArray[np.float64]  # (B, 3) predicted rate
    rows: NDArray[np.float64]  # (B, 3, n) rows of the predicted covariance
    transition: NDArray[np.float64]  # (B, 3, n) rows of the transition to this sample
    count: NDArray[np.int64]  # (B,)
    h: NDArray[np.float64]  # (B, u, n)
    gain: NDArray[np.float64]  # (B, u, n)
    inverse: NDArray[np.float64]  # (B, u) 1/S
    innovation: NDArray[np.float64]  # (B, u)


@njit(**_COMPILE)
def prepare(
    first: int,
    last: int,
    period: float,
    masks: NDArray[np.int64],
    tables: Tables,
    limits: NDArray[np.float64],
    stuck_after: int,
    held: NDArray[np.float64],
    run: NDArray[np.int64],
    tally: NDArray[np.int64],
    data: RecursionInput,
) -> int:
    """Turn readings into α and z; returns the first sample that needs a set of channels not in the tables yet.

    Readings of missing channels become zero. ``held`` (c,) and ``run`` (c,) carry the last reading and how often it repeated; ``tally`` (3, c) counts samples in
    which a channel was missing, saturated and stuck.
    """
    t = data.t
    y = data.y
    alpha = data.alpha
    z = data.z
    alpha_rows = tables.alpha_rows
    null_rows = tables.null_rows
    null_count = tables.null_count
    c = y.shape[1]
    d = z.shape[1]
    repeats = np.empty(c, dtype=np.int64)
    for k in range(first, last):
        faults = 0
        for i in range(c):
            value = y[k, i]
            repeats[i] = run[i] + 1 if value == held[i] else 1
            faults += int(not abs(value) < limits[i]) + int(repeats[i] >= stuck_after)  # NaN is not less either
        place = 0
        missing = 0
        if faults > 0:
            for i in range(c):
                if not abs(y[k, i]) < limits[i] or repeats[i] >= stuck_after:
                    missing |= 1 << i
            place = -1
            for known in range(len(masks)):
                if masks[known] == missing:
                    place = known
            if place < 0:
                return k
            for i in range(c):
                if np.isnan(y[k, i]):
                    tally[0, i] += 1
                elif not abs(y[k, i]) < limits[i]:
                    tally[1, i] += 1
                elif repeats[i] >= stuck_after:
                    tally[2, i] += 1
        for i in range(c):
            run[i] = repeats[i]
            held[i] = y[k, i]
        usable = null_count[place] >= 0
        data.channel_set[k] = place if usable else -1
        step = t[k] - t[k - 1] if k > 0 else 0.0
        whole = k > 0 and step < _GAP * period and usable and data.channel_set[k - 1] >= 0
        data.whole_run[k] = data.whole_run[k - 1] + 1 if whole else 0
        uniform = whole and place == 0 and data.channel_set[k - 1] == 0 and abs(step - period) < _UNIFORM * period
        data.uniform_run[k] = data.uniform_run[k - 1] + 1 if uniform else 0
        if not usable:  # α is held
            for a in range(3):
                data.alpha[k, a] = data.alpha[k - 1, a] if k > 0 else 0.0
            continue
        if missing != 0:
            for i in range(c):
                if (missing >> i) & 1:
                    y[k, i] = 0.0
        for a in range(3):
            total = 0.0
            for i in range(c):
                total += alpha_rows[place, a, i] * y[k, i]
            alpha[k, a] = total
        for j in range(d):
            total = 0.0
            for i in range(c):
                total += null_rows[place, j, i] * y[k, i]
            z[k, j] = total
    return last


@njit(**_COMPILE)
def _quadrature(data, tuning, k, closing, weights):  # type: ignore[no-untyped-def]
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
            _uneven_weights(data.t, start, points, k - 1, weights)
        return start, points
    weights[0] = 0.5 * step
    weights[1] = 0.5 * step
    return k - 1, 2


@njit(**_COMPILE)
def _uneven_weights(t, start, points, left, weights):  # type: ignore[no-untyped-def]
    """Integrate Lagrange's polynomials of uneven nodes from sample ``left`` to the next (Gauss–Legendre, exact)."""
    step = t[left + 1] - t[left]
    for j in range(points):
        weights[j] = 0.0
    for g in range(3):
        abscissa = 0.5 + (g - 1) * 0.3872983346207417
        share = 0.4444444444444444 if g == 1 else 0.2777777777777778
        at = t[left] + abscissa * step
        for j in range(points):
            basis = 1.0
            for i in range(points):
                if i != j:
                    basis *= (at - t[start + i]) / (t[start + j] - t[start + i])
            weights[j] += share * basis * step


@njit(**_COMPILE)
def _correct(alpha, tables, place, x, omega0, omega1, omega2, out):  # type: ignore[no-untyped-def]
    """Take K b_z and L s(ω) out of one sample of α."""
    d = tables.alpha_bias.shape[2]
    for a in range(3):
        leak = tables.alpha_leak[place, a]
        value = alpha[a] - (
            leak[0] * omega0 * omega0
            + leak[1] * omega1 * omega1
            + leak[2] * omega2 * omega2
            + leak[3] * omega0 * omega1
            + leak[4] * omega0 * omega2
            + leak[5] * omega1 * omega2
        )
        for j in range(d):
            value -= tables.alpha_bias[place, a, j] * x[6 + j]
        out[a] = value


@njit(**_COMPILE)
def _inflation(data, k, state, tuning, omega_squared):  # type: ignore[no-untyped-def]
    """Variance of scale, placement and timing errors against the noise; lasting ones count as white over a second."""
    c = data.y.shape[1]
    changed = 0.0
    moved = 0.0
    for i in range(c):
        if data.y[k, i] == 0.0:  # a missing channel
            continue
        change = (data.y[k, i] - state.reference[i]) * tuning.inverse_noise[i]
        changed += change * change
        if k > 0 and data.y[k - 1, i] != 0.0:
            slope = (data.y[k, i] - data.y[k - 1, i]) * tuning.inverse_noise[i]
            moved += slope * slope
    lasting = tuning.scale_variance * changed / c + tuning.placement_variance * omega_squared * omega_squared
    if k > 0:
        step = data.t[k] - data.t[k - 1]
        moved *= tuning.timing_variance / (c * step * step)
    return lasting * max(_ERROR_MEMORY / tuning.period, 1.0) + moved


@njit(**_COMPILE)
def _follow_differences(alpha, start, forget, scalars):  # type: ignore[no-untyped-def]
    """Average the squares of the fourth and fifth differences of α over the last second."""
    fourth = 0.0
    fifth = 0.0
    for a in range(3):
        d0 = alpha[start, a] - 4.0 * alpha[start + 1, a] + 6.0 * alpha[start + 2, a]
        d0 += alpha[start + 4, a] - 4.0 * alpha[start + 3, a]
        d1 = alpha[start + 1, a] - 4.0 * alpha[start + 2, a] + 6.0 * alpha[start + 3, a]
        d1 += alpha[start + 5, a] - 4.0 * alpha[start + 4, a]
        fourth += 0.5 * (d0 * d0 + d1 * d1)
        fifth += (d1 - d0) * (d1 - d0)
    scalars[_FOURTH] += forget * (fourth - scalars[_FOURTH])
    scalars[_FIFTH] += forget * (fifth - scalars[_FIFTH])


@njit(**_COMPILE)
def _undersampled(noise_power, scalars):  # type: ignore[no-untyped-def]
    """Variance of α per axis that the polynomial through its samples does not follow.

    Differences of a well-sampled signal shrink with their order; where the fifth is larger than the fourth, the noise
    taken off, α changes by itself between samples. Then its integral over an interval is as uncertain as a random
    walk's between two known ends.
    """
    excess = scalars[_FIFTH] - 2.0 * _FIFTH_OF_NOISE * noise_power
    if excess <= 0.0 or excess < scalars[_FOURTH] - _FOURTH_OF_NOISE * noise_power:
        return 0.0
    return excess * _ROUGH_SHARE / 3.0


@njit(**_COMPILE)
def forward(  # type: ignore[no-untyped-def]
    data, first, last, closing, tables, tuning, state, out, offset, record, states, null_axes, gyro_axes
):
    """Run the filter over the samples ``first`` to ``last − 1``.

    ``closing`` is the number of samples that the stencils may use; ``offset`` is added to a sample's place to find
    its place in ``out``; the record is filled when its arrays are not empty. ``states``, ``null_axes`` and
    ``gyro_axes`` are tuples as long as the state, the null space and the gyro.
    """
    n = len(states)
    d = len(null_axes)
    x = state.x
    covariance = state.covariance
    keep = record.count.shape[0] > 0
    points = tuning.weights.shape[1]
    weights = np.zeros(max(points, 2))
    ph = np.zeros(n)
    h = np.zeros(n)
    before = np.zeros(n)
    moved = np.zeros(3)
    rows = np.zeros((3, n))
    product = np.zeros((3, n))
    turned = np.zeros(3)
    settles = state.settles[0]
    noise_row = n - 3
    slopes = np.zeros((max(d, 1), 3))
    innovations = np.zeros(d)
    variances = np.zeros(d)
    unrolled = n == 15 and d == 6
    alpha = data.alpha
    z = data.z
    even_weights = tuning.weights
    plain_set = tables.plain[0]
    noise_of_all = tables.alpha_noise[0]
    sensitivity_of_all = tables.null_sensitivity[0]
    noise_power = noise_of_all[0, 0] + noise_of_all[1, 1] + noise_of_all[2, 2]
    inflated = tuning.scale_variance + tuning.placement_variance + tuning.timing_variance > 0.0
    forget = min(1.0, tuning.period / _WALK_MEMORY)
    forget_rate = forget / (3.0 * tuning.period)
    for k in range(first, last):
        row = k - first
        place = data.channel_set[k]
        sensed = place >= 0
        step = 0.0
        inflation = 0.0
        nis = 0.0
        dof = 0
        determinant = 1.0
        stepped = False
        noise_set = place if sensed else 0
        if inflated and sensed:
            inflation = _inflation(data, k, state, tuning, x[0] * x[0] + x[1] * x[1] + x[2] * x[2])
        if state.counts[_STARTED] > 0:
            # Prediction, (1).
            step = data.t[k] - state.scalars[_TIME]
            half = 0.5 * step
            start = min(max(k - 1 - tuning.position, 0), closing - points)
            regular = start >= 0 and data.uniform_run[start + points - 1] >= points - 1
            even = plain_set and regular
            if points == 6:
                if start >= 0 and data.whole_run[start + points - 1] >= points - 1:
                    _follow_differences(alpha, start, forget, state.scalars)
                rough = _undersampled(noise_power, state.scalars) * step * step
                if rough > 0.0:
                    for a in range(3):
                        covariance[a, a] += rough
            clean = True
            s0 = 0.0
            s1 = 0.0
            s2 = 0.0
            if even:
                left = k - 1 - start
                for j in range(points):
                    weight = step * even_weights[left, j]
                    s0 += weight * alpha[start + j, 0]
                    s1 += weight * alpha[start + j, 1]
                    s2 += weight * alpha[start + j, 2]
                stepped = unrolled and not keep and not (settles and state.counts[_SAMPLES] < tuning.rest_window)
            else:
                start, used = _quadrature(data, tuning, k, closing, weights)
                for j in range(used):
                    node = start + j
                    node_set = data.channel_set[node]
                    if node_set >= 0 and not tables.plain[node_set]:
                        clean = False
                        break
                    s0 += weights[j] * alpha[node, 0]
                    s1 += weights[j] * alpha[node, 1]
                    s2 += weights[j] * alpha[node, 2]
            if stepped:
                turned[0] = s0
                turned[1] = s1
                turned[2] = s2
                nis, determinant = _step_twelve(
                    x, covariance, turned, step, noise_of_all, inflation, sensitivity_of_all, z, k, _SLOW
                )
                dof = d
            elif clean:
                for r in range(n):
                    covariance[0, r] += half * covariance[noise_row, r] - step * covariance[3, r]
                    covariance[1, r] += half * covariance[noise_row + 1, r] - step * covariance[4, r]
                    covariance[2, r] += half * covariance[noise_row + 2, r] - step * covariance[5, r]
                for r in range(n):
                    covariance[r, 0] += half * covariance[r, noise_row] - step * covariance[r, 3]
                    covariance[r, 1] += half * covariance[r, noise_row + 1] - step * covariance[r, 4]
                    covariance[r, 2] += half * covariance[r, noise_row + 2] - step * covariance[r, 5]
            else:
                # What K and L leave in α, with ω of the past as estimated and of the future extrapolated.
                s0 = 0.0
                s1 = 0.0
                s2 = 0.0
                rows[:] = 0.0
                for a in range(3):
                    rows[a, a] = 1.0
                    rows[a, 3 + a] = -step
                    rows[a, noise_row + a] = half
                previous = data.corrected[k - 1]
                for j in range(used):
                    node = start + j
                    node_set = data.channel_set[node]
                    if node < k:
                        s0 += weights[j] * data.corrected[node, 0]
                        s1 += weights[j] * data.corrected[node, 1]
                        s2 += weights[j] * data.corrected[node, 2]
                    elif node_set < 0 or tables.plain[node_set]:
                        s0 += weights[j] * data.alpha[node, 0]
                        s1 += weights[j] * data.alpha[node, 1]
                        s2 += weights[j] * data.alpha[node, 2]
                    else:
                        ahead = data.t[node] - data.t[k - 1]
                        _correct(
                            data.alpha[node], tables, node_set, x,
                            x[0] + ahead * (previous[0] - x[3]),
                            x[1] + ahead * (previous[1] - x[4]),
                            x[2] + ahead * (previous[2] - x[5]),
                            moved,
                        )  # fmt: skip
                        s0 += weights[j] * moved[0]
                        s1 += weights[j] * moved[1]
                        s2 += weights[j] * moved[2]
                    if node_set >= 0 and not tables.plain[node_set]:
                        for a in range(3):
                            leak = tables.alpha_leak[node_set, a]
                            rows[a, 0] -= weights[j] * (2 * leak[0] * x[0] + leak[3] * x[1] + leak[4] * x[2])
                            rows[a, 1] -= weights[j] * (2 * leak[1] * x[1] + leak[3] * x[0] + leak[5] * x[2])
                            rows[a, 2] -= weights[j] * (2 * leak[2] * x[2] + leak[4] * x[0] + leak[5] * x[1])
                            for i in range(d):
                                rows[a, 6 + i] -= weights[j] * tables.alpha_bias[node_set, a, i]
                for a in range(3):
                    for r in range(n):
                        total = 0.0
                        for q in range(n):
                            total += rows[a, q] * covariance[q, r]
                        product[a, r] = total
                for a in range(3):
                    for r in range(3, n):
                        covariance[a, r] = product[a, r]
                        covariance[r, a] = product[a, r]
                    for b in range(3):
                        total = 0.0
                        for q in range(n):
                            total += product[a, q] * rows[b, q]
                        covariance[a, b] = total
                for a in range(3):
                    for b in range(a):
                        mean = 0.5 * (covariance[a, b] + covariance[b, a])
                        covariance[a, b] = mean
                        covariance[b, a] = mean
            if not stepped:
                x[0] += s0 - step * x[3] + half * x[noise_row]
                x[1] += s1 - step * x[4] + half * x[noise_row + 1]
                x[2] += s2 - step * x[5] + half * x[noise_row + 2]
                _renew_noise(x, covariance, tables.alpha_noise[noise_set], 1.0 + inflation, half, noise_row)
            extra = 0.0
            if not sensed:  # α is held: its wandering adds up
                age = data.t[k] - state.scalars[_LAST_GOOD]
                extra = state.scalars[_WALK] * age * age * step
            elif data.whole_run[k] == 0:
                extra = state.scalars[_WALK] * step * step * step / 12.0
            if extra > 0.0:
                for a in range(3):
                    covariance[a, a] += extra
            if sensed and data.whole_run[k] > 0:
                c0 = alpha[k, 0] - alpha[k - 1, 0]
                c1 = alpha[k, 1] - alpha[k - 1, 1]
                c2 = alpha[k, 2] - alpha[k - 1, 2]
                jump = c0 * c0 + c1 * c1 + c2 * c2 - 2.0 * noise_power
                state.scalars[_WALK] = max(0.0, (1.0 - forget) * state.scalars[_WALK] + forget_rate * jump)
            if keep:
                if clean:
                    rows[:] = 0.0
                    for a in range(3):
                        rows[a, a] = 1.0
                        rows[a, 3 + a] = -step
                        rows[a, noise_row + a] = half
                record.transition[row] = rows
        else:
            _renew_noise(x, covariance, tables.alpha_noise[noise_set], 1.0 + inflation, 0.0, noise_row)
            if keep:
                record.transition[row] = 0.0
                for a in range(3):
                    record.transition[row, a, a] = 1.0
        state.counts[_STARTED] = 1
        state.scalars[_TIME] = data.t[k]
        if sensed:
            state.scalars[_LAST_GOOD] = data.t[k]
        used_rows = 0
        if keep:
            for a in range(3):
                record.x[row, a] = x[a]
                for r in range(n):
                    record.rows[row, a, r] = covariance[a, r]

        # Null space, (2), one row after the other.
        w0 = x[0]
        w1 = x[1]
        w2 = x[2]
        # In the first block after a start at rest ω is known from the start alone and drifts with the unknown bias of
        # α: far too uncertain for a linearised z. If the block turns out as rest, the mean of z is used at its end.
        settling = tuning.rest_window > state.counts[_SAMPLES] and settles
        if sensed and d > 0 and not settling and not stepped:
            plain = place == 0
            measured_rows = d if plain else tables.null_count[place]
            sensitivity = tables.null_sensitivity[place]
            # The very first sample of a start in the dark is linearised where it is fitted.
            slow = (state.counts[_SAMPLES] > 0 or settles) and covariance[0, 0] + covariance[1, 1] + covariance[
                2, 2
            ] > _SLOW * (w0 * w0 + w1 * w1 + w2 * w2)
            for i in range(measured_rows):
                m = sensitivity[i]
                h0 = 2.0 * w0 * m[0] + w1 * m[3] + w2 * m[4]
                h1 = 2.0 * w1 * m[1] + w0 * m[3] + w2 * m[5]
                h2 = 2.0 * w2 * m[2] + w0 * m[4] + w1 * m[5]
                slopes[i, 0] = h0
                slopes[i, 1] = h1
                slopes[i, 2] = h2
                innovations[i] = data.z[k, i] - 0.5 * (h0 * w0 + h1 * w1 + h2 * w2)
                variances[i] = 1.0 + inflation
                if slow:
                    mean, wider = second_order(
                        m, covariance[0, 0], covariance[0, 1], covariance[0, 2], covariance[1, 1], covariance[1, 2],
                        covariance[2, 2],
                    )  # fmt: skip
                    innovations[i] -= mean
                    variances[i] += wider
                if plain:
                    innovations[i] -= x[6 + i]
                else:
                    for j in range(d):
                        innovations[i] -= tables.null_bias[place, i, j] * x[6 + j]
            before[:] = x
            for i in range(measured_rows):
                h[:] = 0.0
                for a in range(3):
                    h[a] = slopes[i, a]
                for j in range(d):
                    h[6 + j] = tables.null_bias[place, i, j]
                variance = variances[i]
                innovation = innovations[i]
                for r in range(n):
                    total = h[0] * covariance[0, r] + h[1] * covariance[1, r] + h[2] * covariance[2, r]
                    if plain:
                        total += covariance[6 + i, r]
                    else:
                        for j in range(d):
                            total += h[6 + j] * covariance[6 + j, r]
                    ph[r] = total
                for r in range(6 + d):
                    variance += h[r] * ph[r]
                    innovation -= h[r] * (x[r] - before[r])
                inverse = 1.0 / variance
                if keep:
                    _remember(record, row, used_rows, h, ph, inverse, innovation)
                    used_rows += 1
                _apply(x, covariance, ph, inverse, innovation, states)
                nis += innovation * innovation * inverse
                determinant *= variance
            dof = measured_rows
        if len(gyro_axes) > 0:
            for a in range(3):
                if np.isfinite(data.gyro[k, a]):
                    for r in range(n):
                        ph[r] = covariance[a, r] + covariance[6 + d + a, r]
                    variance = tuning.gyro_variance + ph[a] + ph[6 + d + a]
                    innovation = data.gyro[k, a] - x[a] - x[6 + d + a]
                    inverse = 1.0 / variance
                    if keep:
                        h[:] = 0.0
                        h[a] = 1.0
                        h[6 + d + a] = 1.0
                        _remember(record, row, used_rows, h, ph, inverse, innovation)
                        used_rows += 1
                    _apply(x, covariance, ph, inverse, innovation, states)
                    nis += innovation * innovation * inverse
                    determinant *= variance
                    dof += 1

        # Rest: at the end of each block that passes the test ω = 0 is one more measurement.
        rest = False
        if tuning.rest_window > 0 and _rest_block(data, k, tables, tuning, state):
            rest = True
            for a in range(3):
                for r in range(n):
                    ph[r] = covariance[a, r]
                inverse = 1.0 / (tuning.rest_variance + ph[a])
                innovation = -x[a]
                if keep:
                    h[:] = 0.0
                    h[a] = 1.0
                    _remember(record, row, used_rows, h, ph, inverse, innovation)
                    used_rows += 1
                _apply(x, covariance, ph, inverse, innovation, states)
            if settling:
                for i in range(d):
                    for r in range(n):
                        ph[r] = covariance[6 + i, r]
                    inverse = 1.0 / (1.0 / tuning.rest_window + ph[6 + i])
                    innovation = -x[6 + i]
                    for j in range(data.y.shape[1]):
                        innovation += tables.null_rows[0, i, j] * state.reference[j]
                    if keep:
                        h[:] = 0.0
                        h[6 + i] = 1.0
                        _remember(record, row, used_rows, h, ph, inverse, innovation)
                        used_rows += 1
                    _apply(x, covariance, ph, inverse, innovation, states)
        state.counts[_SAMPLES] += 1
        if keep:
            record.count[row] = used_rows
        if tuning.rest_window > 0 and state.counts[_BLOCK] == 0:
            state.block_x[:] = x
            state.block_covariance[:] = covariance

        if sensed:
            if tables.plain[place]:
                for a in range(3):
                    data.corrected[k, a] = data.alpha[k, a]
            else:
                _correct(data.alpha[k], tables, place, x, x[0], x[1], x[2], data.corrected[k])
        elif k > 0:
            for a in range(3):
                data.corrected[k, a] = data.corrected[k - 1, a]
        target = k + offset
        for a in range(3):
            out.omega[target, a] = x[a]
            out.covariance[target, a] = covariance[a, a]
        out.covariance[target, 3] = covariance[0, 1]
        out.covariance[target, 4] = covariance[0, 2]
        out.covariance[target, 5] = covariance[1, 2]
        out.nis[target] = nis
        out.dof[target] = dof
        out.rest[target] = rest
        if tuning.likelihood:
            out.likelihood[target] = -0.5 * (nis + np.log(determinant))
            out.manoeuvre[target] = _manoeuvre(data.corrected[k], tables.alpha_noise[noise_set], tuning, state)


@njit(**_COMPILE)
def _renew_noise(x, covariance, noise, factor, half, noise_row):  # type: ignore[no-untyped-def]
    """Take the ε of a new sample into the state: half of it is in ω already."""
    for a in range(3):
        x[noise_row + a] = 0.0
        for r in range(len(x)):
            covariance[noise_row + a, r] = 0.0
            covariance[r, noise_row + a] = 0.0
    for a in range(3):
        for b in range(3):
            value = factor * noise[a, b]
            covariance[noise_row + a, noise_row + b] = value
            covariance[a, noise_row + b] = half * value
            covariance[noise_row + b, a] = half * value
            covariance[a, b] += half * half * value


@njit(**_COMPILE)
def _apply(x, covariance, ph, inverse, innovation, states):  # type: ignore[no-untyped-def]
    """Update by one scalar measurement: x += P h e/S, P −= P h hᵀP/S."""
    n = len(states)
    root = np.sqrt(inverse)
    pull = innovation * inverse
    for r in range(n):
        x[r] += ph[r] * pull
        ph[r] *= root
    for r in range(n):
        factor = ph[r]
        for q in range(n):
            covariance[r, q] -= factor * ph[q]


@njit(**_COMPILE)
def _remember(record, row, place, h, ph, inverse, innovation):  # type: ignore[no-untyped-def]
    """Store one scalar update for the backward pass."""
    for r in range(len(h)):
        record.h[row, place, r] = h[r]
        record.gain[row, place, r] = ph[r] * inverse
    record.inverse[row, place] = inverse
    record.innovation[row, place] = innovation


@njit(**_COMPILE)
def _manoeuvre(alpha, noise, tuning, state):  # type: ignore[no-untyped-def]
    """Average α over the filter's memory 1/|ω|; returns its largest component in standard deviations, squared."""
    x = state.x
    speed = np.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])
    weight = min(max(speed * tuning.period, tuning.period), 0.25)
    largest = 0.0
    for a in range(3):
        state.mean_alpha[a] += weight * (alpha[a] - x[3 + a] - state.mean_alpha[a])
        spread = noise[a, a] * weight / (2.0 - weight) + state.covariance[3 + a, 3 + a]
        largest = max(largest, state.mean_alpha[a] * state.mean_alpha[a] / spread)
    return largest


@njit(**_COMPILE)
def _rest_block(data, k, tables, tuning, state):  # type: ignore[no-untyped-def]
    """Count sample k into the block; at the block's end test for rest (`gfimu.rate.rest_test`)."""
    counts = state.counts
    window = tuning.rest_window
    if data.channel_set[k] != 0 or (counts[_BLOCK] > 0 and data.whole_run[k] == 0):
        if counts[_BLOCK] > 0 and data.whole_run[k] == 0:  # who knows what happened in the gap
            counts[_RUN] = 0
            counts[_RESTING] = 0
        counts[_BLOCK] = 0
        return False
    counts[_BLOCK] += 1
    if counts[_BLOCK] < window:
        return False
    counts[_BLOCK] = 0
    if not _is_rest(data.y[k - window + 1 : k + 1], tables, tuning, state):
        counts[_RUN] = 0
        counts[_RESTING] = 0
        return False
    return counts[_RESTING] > 0


@njit(**_COMPILE)
def _is_rest(y, tables, tuning, state):  # type: ignore[no-untyped-def]
    """Test the block of readings y (window, c) against the hypothesis of rest."""
    window, c = y.shape
    d = tables.null_rows.shape[1]
    first = window // 2
    second = window - first
    limits = tuning.rest_limits
    # ω when the block began: known, and not far from zero.
    known = state.block_covariance
    for a in range(3):
        if known[a, a] > limits[5]:
            return False
        if state.block_x[a] ** 2 > limits[4] * (known[a, a] + tuning.rest_variance):  # never less than the full χ²
            return False
    # Scatter within the block, and its second half against its first.
    mean = np.empty(c)
    scatter = 0.0
    halves = 0.0
    for i in range(c):
        origin = y[0, i]
        early = 0.0
        squares = 0.0
        for j in range(first):
            change = y[j, i] - origin
            early += change
            squares += change * change
        late = 0.0
        for j in range(first, window):
            change = y[j, i] - origin
            late += change
            squares += change * change
        total = early + late
        weight = tuning.inverse_noise[i] * tuning.inverse_noise[i]
        mean[i] = origin + total / window
        scatter += weight * (squares - total * total / window)
        difference = late / second - early / first
        halves += weight * difference * difference
    if scatter > limits[0] or halves / (1.0 / first + 1.0 / second) > limits[1]:
        return False
    consistent = np.linalg.solve(known[:3, :3] + tuning.rest_variance * np.eye(3), state.block_x[:3])
    if (consistent * state.block_x[:3]).sum() > limits[4]:
        return False
    # Means against the biases known when the block began.
    alpha = tables.alpha_rows[0] @ mean - state.block_x[3:6]
    spread = known[3:6, 3:6] + tables.alpha_noise[0] / window
    if (np.linalg.solve(spread, alpha) * alpha).sum() > limits[2]:
        return False
    if d > 0:
        null = tables.null_rows[0] @ mean - state.block_x[6 : 6 + d]
        spread_null = known[6 : 6 + d, 6 : 6 + d] + np.eye(d) / window
        if (np.linalg.solve(spread_null, null) * null).sum() > limits[3]:
            return False
    return _is_rest_run(mean, alpha, tables, tuning, state)


@njit(**_COMPILE)
def _is_rest_run(mean, alpha, tables, tuning, state):  # type: ignore[no-untyped-def]
    """Test the blocks in a row that ended with this one, which passed; rest begins when they are enough."""
    counts = state.counts
    length = len(state.run_alpha)
    place = counts[_RUN] % length
    state.run_alpha[place] = alpha
    state.run_alpha[place] += state.block_x[3:6]
    state.run_bias[place] = state.block_x[3:6]
    state.run_covariance[place] = state.block_covariance[3:6, 3:6]
    counts[_RUN] += 1
    run = counts[_RUN]
    span = 2
    while span <= min(run, length):
        if _run_statistic(span, tables, tuning, state) > tuning.rest_limits[2]:
            return False
        span *= 2
    if counts[_RESTING] == 0:
        if run < tuning.rest_entry or _run_statistic(min(run, length), tables, tuning, state) > tuning.rest_limits[6]:
            return True
        known = state.covariance[:3, :3] + tuning.rest_variance * np.eye(3)
        if (np.linalg.solve(known, state.x[:3]) * state.x[:3]).sum() > tuning.rest_limits[7]:
            return True
        counts[_RESTING] = 1
    blocks = counts[_REST_BLOCKS]
    for i in range(len(mean)):
        state.reference[i] += (mean[i] - state.reference[i]) / (blocks + 1)
    counts[_REST_BLOCKS] = blocks + 1
    return True


@njit(**_COMPILE)
def _run_statistic(span, tables, tuning, state):  # type: ignore[no-untyped-def]
    """Mean α of the last ``span`` blocks against its bias as known when they began."""
    length = len(state.run_alpha)
    run = state.counts[_RUN]
    begin = (run - span) % length
    difference = -state.run_bias[begin]
    for number in range(run - span, run):
        difference += state.run_alpha[number % length] / span
    spread = state.run_covariance[begin] + tables.alpha_noise[0] / (span * tuning.rest_window)
    return (np.linalg.solve(spread, difference) * difference).sum()


@njit(**_COMPILE)
def backward(record, count, adjoint, curvature, omega, covariance, first, states):  # type: ignore[no-untyped-def]
    """Run the smoother back over a recorded block of ``count`` samples (Bryson–Frazier form of Rauch–Tung–Striebel).

    For each scalar measurement, from the last to the first, with gain k = P h/S:

        λ ← λ − h (e/S + kᵀλ),   Λ ← (I − k hᵀ)ᵀ Λ (I − k hᵀ) + h hᵀ/S

    then x_s = x − P λ and P_s = P − P Λ P with the predicted x and P, and λ ← Fᵀλ, Λ ← FᵀΛF. No inverse is needed.
    """
    n = len(states)
    work = np.zeros(n)
    three = np.zeros((3, n))
    for row in range(count - 1, -1, -1):
        for place in range(record.count[row] - 1, -1, -1):
            h = record.h[row, place]
            gain = record.gain[row, place]
            inverse = record.inverse[row, place]
            along = record.innovation[row, place] * inverse
            for r in range(n):
                along += gain[r] * adjoint[r]
            both = inverse
            for r in range(n):
                total = 0.0
                for q in range(n):
                    total += curvature[r, q] * gain[q]
                work[r] = total
                both += total * gain[r]
            for r in range(n):
                adjoint[r] -= h[r] * along
                for q in range(n):
                    curvature[r, q] += both * h[r] * h[q] - h[r] * work[q] - work[r] * h[q]
        for a in range(3):
            total = record.x[row, a]
            for r in range(n):
                total -= record.rows[row, a, r] * adjoint[r]
                value = 0.0
                for q in range(n):
                    value += record.rows[row, a, q] * curvature[q, r]
                three[a, r] = value
            omega[first + row, a] = total
        for place in range(6):
            a = place if place < 3 else (0 if place < 5 else 1)
            b = place if place < 3 else (1 if place == 3 else 2)
            total = record.rows[row, a, b]
            for r in range(n):
                total -= three[a, r] * record.rows[row, b, r]
            covariance[first + row, place] = total
        # λ ← Fᵀλ, Λ ← FᵀΛF with F the identity but for the rows of ω; the rows of ε are zero: it starts anew.
        transition = record.transition[row]
        adjoint[n - 3 :] = 0.0
        curvature[n - 3 :] = 0.0
        curvature[:, n - 3 :] = 0.0
        for r in range(n):
            total = adjoint[r] if r >= 3 else 0.0
            for a in range(3):
                total += transition[a, r] * adjoint[a]
            work[r] = total
        adjoint[:] = work
        # Λ F, column by column, then Fᵀ (Λ F), row by row.
        for r in range(n):
            l0 = curvature[r, 0]
            l1 = curvature[r, 1]
            l2 = curvature[r, 2]
            for q in range(n):
                base = curvature[r, q] if q >= 3 else 0.0
                curvature[r, q] = base + l0 * transition[0, q] + l1 * transition[1, q] + l2 * transition[2, q]
        for q in range(n):
            l0 = curvature[0, q]
            l1 = curvature[1, q]
            l2 = curvature[2, q]
            for r in range(n):
                base = curvature[r, q] if r >= 3 else 0.0
                curvature[r, q] = base + transition[0, r] * l0 + transition[1, r] * l1 + transition[2, r] * l2
