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
from gfimu.rate.kernel import measure, predict
from gfimu.rate.probable_rate import slope_of

__all__ = ["advance", "model_errors"]


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
        transition = np.zeros((3, len(state.x)))
        _follow_range(state, means[k], tuning.forget)
        step = steps[k] + pending
        if tables.null_count[place] < 0:  # too few channels: a gap
            pending = step
            for a in range(3):
                omega[k, a] = state.x[a]
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
            omega[k, a] = state.x[a]
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
        square += state.x[a] * state.x[a]
    for i in range(len(std)):
        gain = tuning.range_share * tuning.scale_std * (state.high[i] - state.low[i])
        place = tuning.placement_std * square
        std[i] = np.sqrt(gain * gain + place * place + tuning.floor * tuning.floor)


@njit(**INNER)
def _keep(state, block):  # type: ignore[no-untyped-def]
    """Keep the state before a block: number by number, as slices take ten times as long to compile."""
    place = block % len(state.past_x)
    for i in range(len(state.last)):
        state.past_means[place, 0, i] = state.last[i]
        state.past_means[place, 1, i] = state.low[i]
        state.past_means[place, 2, i] = state.high[i]
    for r in range(len(state.x)):
        state.past_x[place, r] = state.x[r]
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
def _predict(tables, tuning, state, mean, turning, step, place, level, transition):  # type: ignore[no-untyped-def]
    """Carry state and covariance over to the next block, (1); ``transition`` (3, 3 + c) becomes that of ω."""
    leak = tables.leak[place]
    x, c = state.x, len(mean)
    alpha, added, noise, slope = np.zeros(3), np.zeros(3), np.zeros((3, 3)), np.zeros(3)
    middle = np.zeros(3)
    for a in range(3):
        alpha[a] = turning[a]
        middle[a] = x[a]
        transition[a, a] = 1.0
        for i in range(c):
            transition[a, 3 + i] = -step * tables.alpha[place, a, i]
            alpha[a] -= tables.alpha[place, a, i] * x[3 + i]
    leaky = False
    for a in range(3):
        for j in range(6):
            leaky = leaky or leak[a, j] != 0.0
    if leaky:  # products of ω remain in α: implicit midpoint
        left = np.zeros(3)
        for turn in range(4):
            s = _products(middle)
            for a in range(3):
                left[a] = alpha[a]
                for j in range(6):
                    left[a] -= leak[a, j] * s[j]
            if turn < 3:
                for a in range(3):
                    middle[a] = x[a] + 0.5 * step * left[a]
        for a in range(3):
            alpha[a] = left[a]
            slope_of(leak[a], middle, slope)
            for b in range(3):
                transition[a, b] -= step * slope[b]
    size = 0.0
    for a in range(3):
        size += alpha[a] * alpha[a]
    for a in range(3):
        added[a] = x[a] + step * alpha[a]
        for j in range(3 + c):
            added[a] -= transition[a, j] * x[j]
        for b in range(3):
            noise[a, b] = level * step * step * tables.noise[place, a, b] / tuning.samples
        if step > 1.5 * tuning.period:  # a gap, over which α is unknown but for its size
            noise[a, a] += (size + 1.0) * step * step
    predict(x, state.covariance, transition, added, noise, np.zeros((3, 4 + c)))
    for i in range(c):
        change = abs(mean[i] - state.last[i]) * (state.high[i] - state.low[i])
        state.covariance[3 + i, 3 + i] += tuning.walk * step + 0.5 * tuning.scale_std * tuning.scale_std * change


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
    x, p = state.x, state.covariance
    before = x.copy()
    average = np.empty(3)  # ω over the block
    for a in range(3):
        average[a] = before[a] + turning[3 + a]
    products = _products(average)
    _spread_within(products, turning, tables.leak[place], tuning)
    h, gain = np.zeros(n), np.zeros(n)
    slope = np.zeros(3)
    hg = np.zeros(c)
    total = 0.0
    for j in range(tables.null_count[place]):
        z_row = tables.null[place, j]
        m_row = tables.sensitivity[place, j]
        slope_of(m_row, average, slope)
        innovation = 0.0
        for a in range(6):
            innovation -= m_row[a] * products[a]
        for a in range(3):
            h[a] = slope[a]
            innovation -= slope[a] * (x[a] - before[a])
        for i in range(c):
            h[3 + i] = z_row[i]
            innovation += z_row[i] * (mean[i] - x[3 + i])
        inverse = measure(x, p, h, innovation, level / tuning.samples, n, gain)
        total += innovation * innovation * inverse
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
                weight = gain[m]
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
