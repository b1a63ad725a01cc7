"""The recursion of the rate filter, compiled: one sample after the other.

State x = [ω (3); b_α (3); b_z (d); b_gyro (0 or 3); ε (3)], biases constant. From sample k − 1 to k

    ω ← ω + Σ_j w_j (α_j − K_j b_z − L_j s(ω_j)) − Δt b_α + Δt/2 (ε_{k−1} + ε_k)                       (1)

with w the weights of the interval's quadrature and (K, L) zero for sets of channels that see α cleanly. ε is what the
noise n of α does to it: half enters before the sample is measured and half after, the same noise twice, and the
quadrature overshoots, because its outer weights are negative,

    ε_k = −g ε_{k−1} − (1 + g) n_k,    g = 2 Σ w²/Δt² − 1.                                              (1b)

So the noise of the integral has the power of Σ w n at rate zero, at the Nyquist rate and on the average; with 6 points
g = 0.26 and it has the right power within 2 % up to 1.5 radians per sample. Where the body turns far between samples
(|ω| Δt near 1) both matter: taking the intervals' noises for independent would be wrong by more than a tenth, g = 0 by
4 %. The null space is the measurement, one whitened row after the other, linearised at the predicted
rate,

    z_i = M_i s(ω) + (T b_z)_i + noise,    s = products of ω,                                          (2)

to second order while ω is not much larger than its uncertainty: with P the covariance of ω and B_i the symmetric form
of row i, z_i has mean ωᵀB_iω + tr(B_i P) and the variance 2 tr(B_i P B_i P) more than the linear one.

Everything that a sample needs is in arrays, so a run can stop after any sample and go on with the same answer. Sizes
are those of the arrays: one compiled form serves every array of accelerometers, with and without a gyro.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from gfimu.base.compiled import INNER, compiled
from gfimu.rate.interval import interval_weights
from gfimu.rate.model_errors import follow_differences, inflation_of, undersampled
from gfimu.rate.recursion_data import BLOCK, HELD, LAST_GOOD, RESTING, RETURN, SAMPLES, STARTED, TIME, WALK
from gfimu.rate.rest_recursion import keep_rest, rest_block
from gfimu.rate.slow_rate import largest_squares, probable_rate, second_order

__all__ = ["forward"]

_WALK_MEMORY = 1.0  # s, over which the change of α is averaged
_HIDDEN = 0.1  # (⅓)²: share of the change of α by which its integral may be off, squared
_SLOW = 1e-3  # tr P above this share of |ω|² switches the second-order terms on
_BROAD = 0.02  # tr P above this share of |ω|²: the null space is linearised at the most probable rate
_LARGE = 1.0  # of the noise's variance: squared second-order terms from which on linearisation fails
_LASTING = 0.5  # s, for which a deviation from rest lasts, so that its second-order terms are no white noise
_CLEAR = 9.0  # variances by which a rate must be clear of zero for a sample whose second-order terms exceed its noise
_CLEAR = (
    9.0  # variances by which a rate must be clear of zero for a sample to be used whose second-order terms are large
)
_CURVED = 0.01  # numerical: second-order terms below this share of the noise change nothing


@compiled
def forward(  # type: ignore[no-untyped-def]
    data, first, last, closing, tables, tuning, state, out, offset, record
):
    """Run the filter over the samples ``first`` to ``last − 1``; returns where it stopped.

    It stops behind a sample at which a rest ended whose last blocks are in doubt (``state.counts[RETURN]``).

    ``closing`` is the number of samples that the stencils may use; ``offset`` is added to a sample's place to find
    its place in ``out``; the record is filled when its arrays are not empty.
    """
    x = state.x
    n = x.shape[0]
    d = data.z.shape[1]
    gyro_axes = n - 9 - d  # 0 or 3
    covariance = state.covariance
    keep = record.updates.shape[0] > 0
    points = tuning.weights.shape[1]
    weights = np.zeros(max(points, 2))
    ph = np.zeros(n)
    h = np.zeros(n)
    before = np.zeros(n)
    moved = np.zeros(3)
    rows = np.zeros((3, n))
    product = np.zeros((3, n))
    bound = np.zeros(3)
    lin = np.zeros(3)
    wide = np.zeros((3, 3))
    lasting = max(1.0, _LASTING / tuning.period)
    noise_row = n - 3
    overshoot = tuning.overshoot
    renewed = (1.0 + overshoot) * (1.0 + overshoot)
    slopes = np.zeros((max(d, 1), 3))
    innovations = np.zeros(d)
    variances = np.zeros(d)
    alpha = data.alpha
    even_weights = tuning.weights
    plain_set = tables.plain[0]
    noise_of_all = tables.alpha_noise[0]
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
        noise_set = place if sensed else 0
        if inflated and sensed:
            inflation = inflation_of(data, k, state, tuning, x[0] * x[0] + x[1] * x[1] + x[2] * x[2])
        inflation += (1.0 + inflation) * data.excess[k]
        if state.counts[STARTED] > 0:
            # Prediction, (1).
            step = data.t[k] - state.scalars[TIME]
            half = 0.5 * step
            carried = half * (1.0 - overshoot)  # of the last ε, with its share in the new one
            start = min(max(k - 1 - tuning.position, 0), closing - points)
            regular = start >= 0 and data.uniform_run[start + points - 1] >= points - 1
            even = plain_set and regular
            if points == 6:
                if start >= 0 and data.whole_run[start + points - 1] >= points - 1:
                    follow_differences(alpha, start, forget, state.scalars)
                rough = undersampled(noise_power, state.scalars) * step * step
                if rough > 0.0:
                    if sensed and data.excess[k] > 0.0:  # and no less than this change of α alone may hide
                        c0 = alpha[k, 0] - alpha[k - 1, 0]
                        c1 = alpha[k, 1] - alpha[k - 1, 1]
                        c2 = alpha[k, 2] - alpha[k - 1, 2]
                        rough = max(rough, _HIDDEN * step * step * (c0 * c0 + c1 * c1 + c2 * c2))
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
            else:
                start, used = interval_weights(data, tuning, k, closing, weights)
                for j in range(used):
                    node = start + j
                    node_set = data.channel_set[node]
                    if node_set >= 0 and not tables.plain[node_set]:
                        clean = False
                        break
                    s0 += weights[j] * alpha[node, 0]
                    s1 += weights[j] * alpha[node, 1]
                    s2 += weights[j] * alpha[node, 2]
            if clean:
                for r in range(n):
                    covariance[0, r] += carried * covariance[noise_row, r] - step * covariance[3, r]
                    covariance[1, r] += carried * covariance[noise_row + 1, r] - step * covariance[4, r]
                    covariance[2, r] += carried * covariance[noise_row + 2, r] - step * covariance[5, r]
                for r in range(n):
                    covariance[r, 0] += carried * covariance[r, noise_row] - step * covariance[r, 3]
                    covariance[r, 1] += carried * covariance[r, noise_row + 1] - step * covariance[r, 4]
                    covariance[r, 2] += carried * covariance[r, noise_row + 2] - step * covariance[r, 5]
            else:
                # What K and L leave in α, with ω of the past as estimated and of the future extrapolated.
                s0 = 0.0
                s1 = 0.0
                s2 = 0.0
                rows[:] = 0.0
                for a in range(3):
                    rows[a, a] = 1.0
                    rows[a, 3 + a] = -step
                    rows[a, noise_row + a] = carried
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
            x[0] += s0 - step * x[3] + carried * x[noise_row]
            x[1] += s1 - step * x[4] + carried * x[noise_row + 1]
            x[2] += s2 - step * x[5] + carried * x[noise_row + 2]
            _renew_noise(x, covariance, tables.alpha_noise[noise_set], (1.0 + inflation) * renewed, overshoot, half)
            extra = 0.0
            if not sensed:  # α is held: its changes add up
                age = data.t[k] - state.scalars[LAST_GOOD]
                extra = state.scalars[WALK] * age * age * step
            elif data.whole_run[k] == 0:
                extra = state.scalars[WALK] * step * step * step / 12.0
            if extra > 0.0:
                for a in range(3):
                    covariance[a, a] += extra
            if sensed and data.whole_run[k] > 0:
                c0 = alpha[k, 0] - alpha[k - 1, 0]
                c1 = alpha[k, 1] - alpha[k - 1, 1]
                c2 = alpha[k, 2] - alpha[k - 1, 2]
                jump = c0 * c0 + c1 * c1 + c2 * c2 - 2.0 * noise_power
                state.scalars[WALK] = max(0.0, (1.0 - forget) * state.scalars[WALK] + forget_rate * jump)
            if keep:
                if clean:
                    rows[:] = 0.0
                    for a in range(3):
                        rows[a, a] = 1.0
                        rows[a, 3 + a] = -step
                        rows[a, noise_row + a] = carried
                for a in range(3):
                    _copy(rows[a], record.transition[row, a])
        else:
            settled = (1.0 + inflation) * renewed / (1.0 - overshoot * overshoot)
            _renew_noise(x, covariance, tables.alpha_noise[noise_set], settled, 0.0, 0.0)
            if keep:
                record.transition[row] = 0.0
                for a in range(3):
                    record.transition[row, a, a] = 1.0
        state.counts[STARTED] = 1
        state.scalars[TIME] = data.t[k]
        if sensed:
            state.scalars[LAST_GOOD] = data.t[k]
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
        if sensed and d > 0:
            plain = place == 0
            measured_rows = d if plain else tables.null_count[place]
            sensitivity = tables.null_sensitivity[place]
            size = w0 * w0 + w1 * w1 + w2 * w2
            spread = covariance[0, 0] + covariance[1, 1] + covariance[2, 2]
            curved = spread > _SLOW * size and spread * spread * tables.null_size[place] > _CURVED * _CURVED
            broad = spread > _BROAD * size and spread * spread * tables.null_size[place] > _LARGE
            if broad:
                # No rate is larger than the products of ω allow: that keeps its variance where linearisation holds.
                largest_squares(data.z[k], tables, place, x, covariance, 1.0 + inflation, bound)
                for a in range(3):
                    if covariance[a, a] > bound[a]:
                        for r in range(n):
                            ph[r] = covariance[a, r]
                        inverse = (ph[a] - bound[a]) / (ph[a] * ph[a])
                        innovation = -x[a]
                        if keep:
                            h[:] = 0.0
                            h[a] = 1.0
                            _remember(record, row, used_rows, h, ph, inverse, innovation)
                            used_rows += 1
                        _apply(x, covariance, ph, inverse, innovation)
                w0 = x[0]
                w1 = x[1]
                w2 = x[2]
                probable_rate(data.z[k], tables, place, measured_rows, x, covariance, 1.0 + inflation, lin, wide)
            else:
                lin[0] = w0
                lin[1] = w1
                lin[2] = w2
                if curved:
                    for a in range(3):
                        for b in range(3):
                            wide[a, b] = covariance[a, b]
            rests = state.counts[RESTING] > 0
            widest = 0.0
            for i in range(measured_rows):
                m = sensitivity[i]
                h0 = 2.0 * lin[0] * m[0] + lin[1] * m[3] + lin[2] * m[4]
                h1 = 2.0 * lin[1] * m[1] + lin[0] * m[3] + lin[2] * m[5]
                h2 = 2.0 * lin[2] * m[2] + lin[0] * m[4] + lin[1] * m[5]
                slopes[i, 0] = h0
                slopes[i, 1] = h1
                slopes[i, 2] = h2
                predicted = h0 * (w0 - 0.5 * lin[0]) + h1 * (w1 - 0.5 * lin[1]) + h2 * (w2 - 0.5 * lin[2])
                innovations[i] = data.z[k, i] - predicted
                variances[i] = 1.0 + inflation
                if curved:
                    mean, wider = second_order(
                        m, wide[0, 0], wide[0, 1], wide[0, 2], wide[1, 1], wide[1, 2], wide[2, 2]
                    )
                    if broad:
                        if rests:
                            wider *= lasting
                        widest = max(widest, wider)
                    variances[i] += wider
                    if not broad:
                        innovations[i] -= mean
                if plain:
                    innovations[i] -= x[6 + i]
                else:
                    for j in range(d):
                        innovations[i] -= tables.null_bias[place, i, j] * x[6 + j]
            clear = _CLEAR * (wide[0, 0] + wide[1, 1] + wide[2, 2])
            bounded = tables.square_seen[place, 0] and tables.square_seen[place, 1] and tables.square_seen[place, 2]
            small = rests or clear > lin[0] * lin[0] + lin[1] * lin[1] + lin[2] * lin[2]
            if bounded and small and widest > 1.0 + inflation:
                # Little is known of the rate but its bound: what z shows would be taken for biases. If the block turns
                # out as rest, the mean of these z is used at its end.
                for i in range(d):
                    state.held[i] += data.z[k, i]
                state.counts[HELD] += 1
                measured_rows = 0
            _copy(x, before)
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
                _apply(x, covariance, ph, inverse, innovation)
                nis += innovation * innovation * inverse
                determinant *= variance
            dof = measured_rows
        if gyro_axes > 0:
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
                    _apply(x, covariance, ph, inverse, innovation)
                    nis += innovation * innovation * inverse
                    determinant *= variance
                    dof += 1

        # Rest: at the end of each block that passes the test, without a doubt, ω = 0 is one more measurement.
        rest = False
        if tuning.rest_window > 0 and rest_block(data, k, tables, tuning, state):
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
                _apply(x, covariance, ph, inverse, innovation)
            held = state.counts[HELD]
            if held > 0:
                for i in range(d):
                    for r in range(n):
                        ph[r] = covariance[6 + i, r]
                    inverse = 1.0 / ((1.0 + inflation) / held + ph[6 + i])
                    innovation = state.held[i] / held - x[6 + i]
                    if keep:
                        h[:] = 0.0
                        h[6 + i] = 1.0
                        _remember(record, row, used_rows, h, ph, inverse, innovation)
                        used_rows += 1
                    _apply(x, covariance, ph, inverse, innovation)
        state.counts[SAMPLES] += 1
        if keep:
            record.updates[row] = used_rows
        if tuning.rest_window > 0 and state.counts[BLOCK] == 0:
            state.held[:] = 0.0
            state.counts[HELD] = 0
            _copy(x, state.block_x)
            for r in range(n):
                _copy(covariance[r], state.block_covariance[r])
            if rest:
                keep_rest(state)

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
        if state.counts[RETURN] > 0:
            return k + 1
    return last


@njit(**INNER)
def _copy(source, target):  # type: ignore[no-untyped-def]
    """Copy number by number: a slice takes ten times as long to compile."""
    for r in range(len(source)):
        target[r] = source[r]


@njit(**INNER)
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


@njit(**INNER)
def _renew_noise(x, covariance, noise, factor, overshoot, half):  # type: ignore[no-untyped-def]
    """Take the ε of a new sample into the state, (1b), and half of what is new in it into ω."""
    noise_row = len(x) - 3
    for a in range(3):
        x[noise_row + a] *= -overshoot
        for r in range(len(x)):
            covariance[noise_row + a, r] *= -overshoot
        for r in range(len(x)):
            covariance[r, noise_row + a] *= -overshoot
    for a in range(3):
        for b in range(3):
            value = factor * noise[a, b]
            covariance[noise_row + a, noise_row + b] += value
            covariance[a, noise_row + b] += half * value
            covariance[noise_row + b, a] += half * value
            covariance[a, b] += half * half * value


@njit(**INNER)
def _apply(x, covariance, ph, inverse, innovation):  # type: ignore[no-untyped-def]
    """Update by one scalar measurement: x += P h e/S, P −= P h hᵀP/S."""
    n = len(x)
    root = np.sqrt(inverse)
    pull = innovation * inverse
    for r in range(n):
        x[r] += ph[r] * pull
        ph[r] *= root
    for r in range(n):
        factor = ph[r]
        for q in range(n):
            covariance[r, q] -= factor * ph[q]


@njit(**INNER)
def _remember(record, row, place, h, ph, inverse, innovation):  # type: ignore[no-untyped-def]
    """Store one scalar update for the backward pass."""
    for r in range(len(h)):
        record.h[row, place, r] = h[r]
        record.gain[row, place, r] = ph[r] * inverse
    record.inverse[row, place] = inverse
    record.innovation[row, place] = innovation


@njit(**INNER)
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
