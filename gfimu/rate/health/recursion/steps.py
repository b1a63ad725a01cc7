"""The recursion of the monitor of channels, compiled: an extended Kalman filter and the signatures of faults in it.

State x = [ω (3); b (c)], ω in the middle of a block and b the biases of the channels. From the middle of one block to
that of the next, T later,

    ω ← ω + T (A (ȳ_m − b) − L s(ω)),      ȳ_m the mean of the samples between                           (1)

and the null space of the block's mean readings ȳ is the measurement, one whitened row after the other,

    z_j = Z_j (ȳ − b) = M_j ⟨s(ω)⟩ + noise of variance 1/B,                                              (2)

with B the samples of a block and ⟨s⟩ the mean of the products of ω over it. By what ω does within the block, δ, which
the samples of α show (`gfimu.rate.health.recursion.turning`), ⟨s(ω)⟩ = s(ω + ⟨δ⟩) + ⟨δδ⟩ − s(⟨δ⟩).

A constant fault of one unit on channel i from block k₀ on makes the state wrong by column i of G and the innovations
by h (Willsky and Jones, IEEE Trans. Automatic Control 21, 1976):

    G_ω ← Φ_ω G_ω + T A (e − G_b)      (half of the first block lies behind the onset)
    h_j = Z_j − H_j G,   G ← G + K_j h_j,   C ← C + h_jᵀ h_j/S_j,   d ← d + h_jᵀ ν_j/S_j                   (3)

C is the information on faults of all channels at once, shape (c, c), and d the score: a set S of channels with that
onset has the most likely sizes f = C_SS⁻¹ d_S and explains T_S = d_Sᵀ f of the sum of squared innovations.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from gfimu.base.compiled import INNER, compiled
from gfimu.rate.health.recursion.signatures import carry_signatures, forget_onsets, new_slot, strongest_slot

__all__ = ["advance", "model_errors"]

_TINY = 1e-14  # numerical: least variance kept on the diagonal of the covariance


@compiled
def advance(tables, tuning, state, means, turning, steps, sets, levels, watched, omega, std, nis, base):  # type: ignore[no-untyped-def]
    """Take n blocks; stop behind one in which a fault is seen.

    ``means`` (n, c), ``turning`` (n, 15) (`turning.turning_of`), ``steps`` (n,) s since the block before, ``sets`` (n,)
    of channels, ``levels`` (n,) measured variance of the null space over the stated one. ``omega``, ``std`` (n, 3) and
    ``nis`` (n,) are filled. ``base`` is the number of the first of the n blocks since the start of the run.

    Returns
    -------
    tuple of (int, int)
        The next block, and the slot of the fault; −1 if none was seen.
    """
    c = means.shape[1]
    model_std = np.empty(c)
    pending = 0.0
    k = 0
    while k < len(means):
        _keep(state, base + k)
        place = sets[k]
        level = levels[k]
        transition = np.zeros((3, 3))
        _follow_range(state, means[k], tuning.forget)
        step = steps[k] + pending
        if tables.null_count[place] < 0:  # too few channels: a gap
            pending = step
            for a in range(3):
                omega[k, a] = state.omega[a]
                std[k, a] = np.inf
            forget_onsets(state)
            k += 1
            continue
        pending = 0.0
        if not state.started[0]:  # from the first sample to the middle of the first block
            for i in range(len(state.last)):
                state.last[i] = means[k, i]
            step = 0.5 * tuning.period * (1.0 - 1.0 / tuning.samples)
        _predict(tables, tuning, state, means[k], turning[k], step, place, level, transition)
        if step > 1.5 * tuning.period:
            forget_onsets(state)
        if tuning.follow:
            new_slot(state, tuning.oldest)
            carry_signatures(tables, state, transition, step, place)
        nis[k] = _update(tables, tuning, state, means[k], turning[k], place, level)
        for a in range(3):
            omega[k, a] = state.omega[a]
            std[k, a] = np.sqrt(max(state.covariance[a, a], 0.0))
        for i in range(len(state.last)):
            state.last[i] = means[k, i]
        state.started[0] = True
        k += 1
        model_errors(state, tuning, model_std)
        slot = strongest_slot(state, tuning, model_std, watched)
        if slot >= 0:
            return k, slot
    return k, -1


@compiled
def model_errors(state, tuning, std):  # type: ignore[no-untyped-def]
    """Fill in how large a constant fault the errors of gain, axes and position resemble on each channel, m/s²."""
    square = 0.0
    for a in range(3):
        square += state.omega[a] * state.omega[a]
    for i in range(len(std)):
        gain = tuning.range_share * tuning.scale_std * (state.high[i] - state.low[i])
        place = tuning.placement_std * square
        std[i] = np.sqrt(gain * gain + place * place + tuning.floor * tuning.floor)


@njit(**INNER)
def _keep(state, block):  # type: ignore[no-untyped-def]
    """Keep the state before a block: number by number, as slices take ten times as long to compile."""
    place = block % len(state.past_rate)
    for a in range(3):
        state.past_rate[place, a] = state.omega[a]
    for i in range(len(state.bias)):
        state.past_bias[place, i] = state.bias[i]
        state.past_means[place, 0, i] = state.last[i]
        state.past_means[place, 1, i] = state.low[i]
        state.past_means[place, 2, i] = state.high[i]
    for r in range(len(state.covariance)):
        for q in range(len(state.covariance)):
            state.past_covariance[place, r, q] = state.covariance[r, q]


@njit(**INNER)
def _follow_range(state, mean, forget):  # type: ignore[no-untyped-def]
    """Follow the range of each channel's readings, with a memory."""
    for i in range(len(mean)):
        if not state.started[0]:
            state.low[i] = mean[i]
            state.high[i] = mean[i]
        state.low[i] = min(mean[i], state.low[i] + forget * (mean[i] - state.low[i]))
        state.high[i] = max(mean[i], state.high[i] + forget * (mean[i] - state.high[i]))


@njit(**INNER)
def _products(w):  # type: ignore[no-untyped-def]
    return np.array([w[0] * w[0], w[1] * w[1], w[2] * w[2], w[0] * w[1], w[0] * w[2], w[1] * w[2]])


@njit(**INNER)
def _slope(row, w, out):  # type: ignore[no-untyped-def]
    """Fill in the derivative of ``row`` s(ω) by ω."""
    out[0] = 2.0 * w[0] * row[0] + w[1] * row[3] + w[2] * row[4]
    out[1] = 2.0 * w[1] * row[1] + w[0] * row[3] + w[2] * row[5]
    out[2] = 2.0 * w[2] * row[2] + w[0] * row[4] + w[1] * row[5]


@njit(**INNER)
def _predict(tables, tuning, state, mean, turning, step, place, level, transition):  # type: ignore[no-untyped-def]
    """Carry state and covariance over to the next block, (1); ``transition`` becomes Φ_ω − 1."""
    alpha_rows = tables.alpha[place]
    leak = tables.leak[place]
    c = len(mean)
    n = 3 + c
    p = state.covariance
    alpha = np.zeros(3)
    for a in range(3):
        alpha[a] = turning[a]
        for i in range(c):
            alpha[a] -= alpha_rows[a, i] * state.bias[i]
    leaky = False
    for a in range(3):
        for j in range(6):
            leaky = leaky or leak[a, j] != 0.0
    if leaky:  # products of ω remain in α: implicit midpoint
        middle = state.omega.copy()
        for _ in range(3):
            s = _products(middle)
            for a in range(3):
                total = alpha[a]
                for j in range(6):
                    total -= leak[a, j] * s[j]
                middle[a] = state.omega[a] + 0.5 * step * total
        s = _products(middle)
        slope = np.zeros(3)
        for a in range(3):
            for j in range(6):
                alpha[a] -= leak[a, j] * s[j]
            _slope(leak[a], middle, slope)
            for b in range(3):
                transition[a, b] = -step * slope[b]
    rows = np.zeros((3, n))  # of F P, F = [1 + transition, −T A; 0, 1]
    for a in range(3):
        state.omega[a] += step * alpha[a]
        for m in range(n):
            total = p[a, m]
            for b in range(3):
                total += transition[a, b] * p[b, m]
            for i in range(c):
                total -= step * alpha_rows[a, i] * p[3 + i, m]
            rows[a, m] = total
    for a in range(3):
        for b in range(3):
            total = rows[a, b]
            for m in range(3):
                total += rows[a, m] * transition[b, m]
            for i in range(c):
                total -= rows[a, 3 + i] * step * alpha_rows[b, i]
            p[a, b] = total + level * step * step * tables.noise[place, a, b] / tuning.samples
        for i in range(c):
            p[a, 3 + i] = rows[a, 3 + i]
            p[3 + i, a] = rows[a, 3 + i]
    if step > 1.5 * tuning.period:  # a gap, over which α is unknown but for its size
        size = 0.0
        for a in range(3):
            size += alpha[a] * alpha[a]
        for a in range(3):
            p[a, a] += (size + 1.0) * step * step
    for i in range(c):
        change = abs(mean[i] - state.last[i]) * (state.high[i] - state.low[i])
        p[3 + i, 3 + i] += tuning.walk * step + 0.5 * tuning.scale_std * tuning.scale_std * change


@njit(**INNER)
def _spread_within(products, turning, leak, tuning):  # type: ignore[no-untyped-def]
    """Add ⟨δδ⟩ − s(⟨δ⟩) to s(ω), without what products of ω that remain in α add to δ: L τ with L = leak s(ω)."""
    length = tuning.period / tuning.samples
    square = length * length * (tuning.samples * tuning.samples - 1.0) / 12.0  # ⟨τ²⟩
    left = np.zeros(3)
    for a in range(3):
        for j in range(6):
            left[a] += leak[a, j] * products[j]
    first = (0, 1, 2, 0, 0, 1)
    second = (0, 1, 2, 1, 2, 2)
    for j in range(6):
        a = first[j]
        b = second[j]
        products[j] += (
            turning[6 + j] - turning[12 + a] * left[b] - left[a] * turning[12 + b] + left[a] * left[b] * square
        )


@njit(**INNER)
def _update(tables, tuning, state, mean, turning, place, level):  # type: ignore[no-untyped-def]
    """Measure the null space row by row, (2), with all signatures, (3); returns the normalised innovation squared."""
    c = len(mean)
    n = 3 + c
    p = state.covariance
    before = state.omega.copy()
    average = np.empty(3)  # ω over the block
    for a in range(3):
        average[a] = before[a] + turning[3 + a]
    products = _products(average)
    _spread_within(products, turning, tables.leak[place], tuning)
    noise = level / tuning.samples
    h = np.zeros(n)
    ph = np.zeros(n)
    slope = np.zeros(3)
    hg = np.zeros(c)
    total = 0.0
    for j in range(tables.null_count[place]):
        z_row = tables.null[place, j]
        m_row = tables.sensitivity[place, j]
        _slope(m_row, average, slope)
        innovation = 0.0
        for a in range(6):
            innovation -= m_row[a] * products[a]
        for a in range(3):
            h[a] = slope[a]
            innovation -= slope[a] * (state.omega[a] - before[a])
        for i in range(c):
            h[3 + i] = z_row[i]
            innovation += z_row[i] * (mean[i] - state.bias[i])
        variance = noise
        for m in range(n):
            value = 0.0
            for q in range(n):
                value += p[m, q] * h[q]
            ph[m] = value
        for m in range(n):
            variance += h[m] * ph[m]
        inverse = 1.0 / variance
        total += innovation * innovation * inverse
        for m in range(n):
            gain = ph[m] * inverse
            if m < 3:
                state.omega[m] += gain * innovation
            else:
                state.bias[m - 3] += gain * innovation
            for q in range(m + 1):
                value = p[m, q] - gain * ph[q]
                p[m, q] = value
                p[q, m] = value
            p[m, m] = max(p[m, m], _TINY)
        for s in range(len(state.ages)):
            if state.ages[s] == 0.0:
                continue
            g = state.signature[s]
            for i in range(c):
                hg[i] = z_row[i]
            for m in range(n):
                weight = h[m]
                if weight != 0.0:
                    for i in range(c):
                        hg[i] -= weight * g[m, i]
            for m in range(n):
                weight = ph[m] * inverse
                if weight != 0.0:
                    for i in range(c):
                        g[m, i] += weight * hg[i]
            information = state.information[s]
            score = state.score[s]
            for m in range(c):
                weight = hg[m] * inverse
                score[m] += weight * innovation
                for i in range(c):
                    information[m, i] += weight * hg[i]
    return total
