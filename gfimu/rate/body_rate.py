"""The state model of a body's rate over the kernel, compiled: one sample after the other.

State x = [ω (3); ε (3); path (0 or 10); b_α (3); b_z (m); b_p (0 or 3); ρ (e); φ (q)]: the path is that of
`gfimu.rate.path`, behind it stand constants, of which the errors φ of the channels may be considered and not estimated.
ρ are the errors of references.
From sample k − 1 to k, Δt later,

    ω ← ω + ∫α + ½ Δt (ε_{k−1} + ε_k) − Δt b_α − ½ Δt (L s(ω))_{k−1, k} − Δt (K b_z) − ∫A D φ − γ Δt S r      (1)

with the integral of α = A y by its neighbours, and the products L and biases K that a smaller set of channels leaves in
it. ε is what the noise n of α does: half of it enters before the sample is measured and half after, the same noise
twice, and the quadrature overshoots, because its outer weights w are negative: ε_k = −g ε_{k−1} − (1 + g) n_k with
g = 2 Σ w²/Δt² − 1. So the noise of the integral has the right power at rate zero and at the Nyquist rate, which matters
where the body turns far between samples. S is the covariance of the noises of A y and z. r = z − M s(ω) − b_z, the mean
of both samples, shows the noise of z and with it part of that of α; γ falls from 1 to 0 where the change of ω within Δt
would make that correction unstable.

The null space is the measurement, one whitened row after the other,

    z_i = M_i s(ω) + (T b_z)_i + Z_i D φ + noise.                                                       (2)

It is linearised at the predicted rate, or where its products are not linear within the uncertainty of ω, at the most
probable rate, with the variance of the second-order terms added. No rate is larger than the products of its own sample
allow, which bounds the variance of ω (3).

Where the innovations of the last half second are larger than their variance, or the parity rows than theirs, noise is
taken for as much larger.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gfimu.base.compiled import INNER, compiled
from gfimu.rate.filter_state import (
    COMPLETE,
    CONSTANT,
    EXCESS,
    FIFTH,
    FOURTH,
    JUDGED,
    LAGGED,
    LAST_ALPHA,
    LAST_SET,
    LEVEL,
    LIKELIHOOD,
    MISFIT,
    PARITY,
    POWER,
    RATE,
    RESTING,
    ROUGH,
    SOLVED,
    STARTED,
    STILL,
    SUMMED,
    TIME,
    WALK,
    WANDER,
)
from gfimu.rate.kernel import cholesky, predict, solve_lower, step_back, take
from gfimu.rate.path import (
    POSITION,
    ROWS,
    TILT,
    advance_path,
    attitude_is_lost,
    level_anew,
    motion_of,
    rest_on_path,
    settle_path,
    turned,
)  # fmt: skip
from gfimu.rate.probable_rate import probable_rate, shown_rate, slope_of
from gfimu.rate.rest_test import MOVES, RESTS

__all__ = ["Workspace", "follow", "noise_level", "noise_of_step", "put_estimate", "smooth_back", "step_by_alpha"]

_BROAD = 0.02  # tr P over |ω|² from which the null space is linearised at the most probable rate
_UNKNOWN = 1.0  # the same, from which all of the rate's variance makes second-order terms
_CURVED = 0.01  # numerical: second-order terms below this share of the noise change nothing
_DEVIATIONS = 2.0  # of a product ω_a² that its bound allows for
_FOURTH_OF_NOISE = 70.0  # variance of the fourth and fifth difference of white noise of unit variance
_FIFTH_OF_NOISE = 252.0
_ROUGH_SHARE = 1.0 / (12.0 * 70.0 * 3.0)  # (Δt² × variance of the step)/12 per axis by the fifth difference of a walk
_GAP = 1.5  # periods from which on a step is a gap
_NEIGHBOURS = 4.0  # degrees of freedom that the samples before are worth beside a sample's own parity rows
_STATED = 1.01  # numerical: variance with stated errors over that of the noise from which there are some
_LEAST_LEVEL = 1e-3  # numerical
_MOST_COLOURED = 0.9  # correlation from sample to sample that innovations are taken to have at most
_BIAS_SQUARE = 4.0  # of the bias of α, in its variance per axis, that its power may hold
_STEADY_POWER = 2.0  # power of α over that of noise and bias up to which the rate is steady
_GROSS = 25.0  # mean square of the innovations over the noise from which a sample is looked at by itself
_UNUSABLE = 9.0  # χ² per degree of freedom of its best rate from which a sample has other noise
_LARGEST_MISFIT = 100.0  # χ² of a sample, beyond which it says no more against a sign
_SMOOTHED = 4  # samples on either side, whose mean α shows how fast the rate changes, clear of its noise
_STABLE = 0.1  # radians per step of the correction in (1) at which it is halved
_STABLE_ANEW = 1.0  # the same about given rates, where an error of the rate does not bend the correction


class Workspace(NamedTuple):
    """Room for intermediate results of m rows of the null space, taken once."""

    ahead: NDArray[np.float64]  # (3,) predicted rate
    along: NDArray[np.float64]  # (3,) slope of a product
    lin: NDArray[np.float64]  # (3,) rate about which the null space is linearised
    constant: NDArray[np.float64]  # (m,)
    factor: NDArray[np.float64]  # (m, m)


@compiled
def follow(samples, given, first, last, tables, tuning, carried, out, offset, record):  # type: ignore[no-untyped-def]
    """Run the filter over the samples ``first`` to ``last − 1``; sample k goes to row k + offset of ``out``.

    ``tables`` are `gfimu.rate.channel_sets.SetTables`. The record is filled where it has room.
    """
    again = len(given.level) > 0
    x, p = carried.x, carried.covariance
    n, m = len(x), samples.z.shape[1]
    r = tuning.at.alpha
    counts, scalars = carried.counts, carried.scalars
    keep, follows_path = len(record.used) > 0, tuning.at.alpha > TILT
    transition = np.zeros((r, n))
    added = np.zeros(r)
    noise = np.zeros((r, r))
    work = np.zeros((r, n + 1))
    slopes = np.zeros((max(m, 1), n))
    unit = np.zeros(n)
    gain = np.zeros(n)
    place_of = Workspace(np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(max(m, 1)), np.zeros((max(m, 1), max(m, 1))))
    for k in range(first, last):
        row, place = k + offset, samples.channel_set[k]
        stated = 1.0 + samples.model_error[k]
        level = noise_level(samples.parity[k], stated, tuning, scalars, counts[ROUGH] > 0)
        if again:
            level = given.level[k]
        if counts[STARTED] > 0:
            step_by_alpha(samples, given, k, tables, tuning, carried, level, transition, added, noise, place_of)
            if place == counts[LAST_SET] and place >= 0 and tables.mixed[place]:
                _correct_alpha(samples, given, k, tables, tuning, carried, level, transition, added, noise, place_of)
            noise_of_step(samples, k, tables, tuning, carried, noise)
            if follows_path:
                step = samples.t[k] - scalars[TIME]
                advance_path(samples, given, k, tables, tuning, carried, step, level, transition, added, noise)
            predict(x, p, transition, added, noise, work)
        else:
            for a in range(r):
                for j in range(n):
                    transition[a, j] = 1.0 if a == j else 0.0
        if follows_path:
            for i in range(4):
                out.path.ahead[row, i] = carried.attitude[i]
        if keep:
            record.used[row] = 0
            for j in range(n):
                record.predicted[row, j] = x[j]
                for a in range(r):
                    record.transition[row, a, j] = transition[a, j]
                    record.rows[row, a, j] = p[a, j]
        nis, dof, stated = 0.0, 0, 0.0
        if place >= 0 and tables.rows[place] > 0:
            dof = tables.rows[place]
            if not again and p[0, 0] + p[1, 1] + p[2, 2] > _BROAD * (x[0] * x[0] + x[1] * x[1] + x[2] * x[2]):
                _bound(samples.z[k], tables, tuning, carried, place, level, unit, gain, record, row)
            nis, stated, level = _take_products(
                samples, given, k, tables, tuning, carried, level, slopes, gain, record, row, place_of
            )
        square, count = _take_references(samples, given, k, tuning, carried, unit, gain, record, row)
        nis, stated, dof = nis + square, stated + square, dof + count
        if place >= 0:
            counts[SUMMED] += 1
            for a in range(3):
                carried.sums[a] += samples.alpha[k, a]
                for i in range(m):
                    carried.sums[a] -= tables.alpha_bias[place, a, i] * x[tuning.at.products + i]
        if place == 0:
            counts[COMPLETE] += 1
            for i in range(m):
                carried.sums[3 + i] += samples.z[k, i]
        lost = False
        begin = max(k - tuning.path.rest_window + 1, 0)
        rests = int(given.rest[k]) if again else _rests(samples, k, tables, tuning, carried)
        if rests == 1:
            counts[SOLVED] = n
            for a in range(3):
                unit[a] = 1.0
                take(x, p, unit, -x[a], tuning.rest_variance, counts[SOLVED], gain, record, row)
                unit[a] = 0.0
            if follows_path:
                lost = given.levelled[k] if again else attitude_is_lost(tuning, carried)
                if not lost:
                    rest_on_path(samples, begin, k, tables, tuning, carried, n, level, gain, record, row)
        counts[STARTED] = 1
        counts[LAST_SET] = place
        scalars[TIME] = samples.t[k]
        if place >= 0:
            scalars[LAST_ALPHA] = samples.t[k]
        for i in range(m):
            carried.last_z[i] = samples.z[k, i]
        out.rest[row] = rests > 0
        doubted = place == 0 and not again and _guard(samples, k, tables, tuning, carried, level)
        out.restart[row] = rests == 2 or doubted
        if follows_path and not again:
            settle_path(carried)
        if rests == 2:
            _start_again(carried, tuning, n, np.zeros(3), tuning.rest_variance)
        elif again and given.restart[k]:
            _start_again(carried, tuning, n, given.omega[k], _wide(given.omega[k], tables))
            out.restart[row] = True
        put_estimate(samples, k, row, tables, tuning, carried, level, out)
        out.nis[row] = nis
        out.dof[row] = dof
        out.stated[row] = stated
        if follows_path:
            out.path.levelled[row] = lost
            if lost:
                level_anew(samples, begin, k, tables, tuning, carried, level, gain, record)


@njit(**INNER)
def put_estimate(samples, k, row, tables, tuning, carried, level, out):  # type: ignore[no-untyped-def]
    """Put the rate, and where it is followed the path, into a row of the estimates."""
    x, p = carried.x, carried.covariance
    for a in range(3):
        out.omega[row, a] = x[a]
        out.covariance[row, a] = p[a, a]
    out.covariance[row, 3] = p[0, 1]
    out.covariance[row, 4] = p[0, 2]
    out.covariance[row, 5] = p[1, 2]
    out.inflation[row] = level
    if tuning.at.alpha > TILT:
        path = out.path
        for i in range(4):
            path.attitude[row, i] = carried.attitude[i]
        for i in range(ROWS - 3):
            path.line[row, i] = x[TILT + 3 + i]
        for i in range(ROWS):
            path.variance[row, i] = p[TILT + i, TILT + i]
        motion_of(samples, k, tables, tuning, x, p, level, path.motion[row], path.motion_variance[row])


@njit(**INNER)
def noise_level(parity, stated, tuning, scalars, rough):  # type: ignore[no-untyped-def]
    """Return the variance of the noise over the stated one, by the parity rows and the innovations so far.

    The parity rows show it in the sample itself, shrunk to what stated errors of gains and times make of it, or else to
    the samples before; it may be smaller than stated, where the stated one was measured in motion.
    """
    level = stated
    if not np.isnan(parity):
        scalars[PARITY] += tuning.forget_parity * (parity - scalars[PARITY])
        expected = scalars[PARITY] if stated < _STATED else stated
        if stated >= _STATED or abs(expected - 1.0) > tuning.parity_limit or parity > tuning.parity_alone:
            shrunk = tuning.parity_freedom * parity + _NEIGHBOURS * expected
            level = max(shrunk / (tuning.parity_freedom + _NEIGHBOURS), _LEAST_LEVEL)
    scalars[LEVEL] = level
    # Innovations of a motion between the samples are coloured by that, and not by the readings.
    coloured = scalars[LAGGED] > tuning.lag_limit and not rough
    if coloured or scalars[EXCESS] > tuning.excess_limit:
        excess = max(scalars[EXCESS], 1.0)
        share = min(scalars[LAGGED] / excess, _MOST_COLOURED) if coloured else 0.0
        level *= excess * (1.0 + share) / (1.0 - share)
    return level


@njit(**INNER)
def step_by_alpha(samples, given, k, tables, tuning, carried, level, transition, added, noise, place_of):  # type: ignore[no-untyped-def]
    """Fill in the transition to sample k by the integral of α, (1), and the covariance of the new ε."""
    x, scalars = carried.x, carried.scalars
    n, m = len(x), samples.z.shape[1]
    ahead, along = place_of.ahead, place_of.along
    step = samples.t[k] - scalars[TIME]
    place, before = samples.channel_set[k], carried.counts[LAST_SET]
    near = max(place, 0)
    half = 0.5 * step
    carried_on = half * (1.0 - tuning.overshoot)  # of the last ε, with its share in the new one
    renewed = level * (1.0 + tuning.overshoot) * (1.0 + tuning.overshoot)
    for a in range(3):
        for j in range(n):
            transition[a, j] = 0.0
        transition[a, a] = 1.0
        transition[a, 3 + a] = carried_on
        transition[3 + a, 3 + a] = -tuning.overshoot
        transition[a, tuning.at.alpha + a] = -step
        added[a] = samples.increment[k, a]
        ahead[a] = x[a] + added[a] + carried_on * x[3 + a] - step * x[tuning.at.alpha + a]
        for b in range(3):
            noise[3 + a, 3 + b] = renewed * tables.alpha_noise[near, a, b]
        for j in range(tuning.at.errors, n):
            transition[a, j] = -samples.error_increment[k, a, j - tuning.at.errors]
    for end in range(2):  # what a smaller set, or an array that sees products in α, leaves in it: predicted first
        here = before if end == 0 else place
        if here >= 0 and not tables.plain[here]:
            for a in range(3):
                slope_of(tables.leak[here, a], x, along)
                for b in range(3):
                    ahead[a] -= 0.5 * half * along[b] * x[b]
                for i in range(m):
                    ahead[a] -= half * tables.alpha_bias[here, a, i] * x[tuning.at.products + i]
    for end in range(2):
        here = before if end == 0 else place
        if here < 0 or tables.plain[here]:
            continue
        about = _about(given, k, end, x, ahead)
        for a in range(3):
            slope_of(tables.leak[here, a], about, along)
            for b in range(3):
                change = 0.0 if end == 0 else ahead[b] - x[b]
                added[a] += half * along[b] * (0.5 * about[b] - change)
                transition[a, b] -= half * along[b]
            for i in range(m):
                transition[a, tuning.at.products + i] -= half * tables.alpha_bias[here, a, i]


@njit(**INNER)
def _about(given, k, end, x, ahead):  # type: ignore[no-untyped-def]
    """Return the rate (3,) about which products are linearised before (``end`` 0) or after (1) the step to sample k."""
    if len(given.level) > 0:
        return given.omega[k - 1 + end]
    return x[:3] if end == 0 else ahead


@njit(**INNER)
def _correct_alpha(samples, given, k, tables, tuning, carried, level, transition, added, noise, place_of):  # type: ignore[no-untyped-def]
    """Take from ∫α the part of its noise that the null space of both samples shows."""
    x, ahead, along = carried.x, place_of.ahead, place_of.along
    m = samples.z.shape[1]
    place = samples.channel_set[k]
    half = 0.5 * (samples.t[k] - carried.scalars[TIME])
    square = ahead[0] * ahead[0] + ahead[1] * ahead[1] + ahead[2] * ahead[2]
    turn = 4.0 * half / (_STABLE_ANEW if len(given.level) > 0 else _STABLE)
    share = 1.0 / ((1.0 + turn * turn * tables.cross_size[place] * square) * level * level)
    weight = half * share
    renewed = level * (1.0 + tuning.overshoot) * (1.0 + tuning.overshoot)
    for a in range(3):
        for i in range(m):
            added[a] -= weight * tables.cross_noise[place, a, i] * (carried.last_z[i] + samples.z[k, i])
            transition[a, tuning.at.products + i] += 2.0 * weight * tables.cross_bias[place, a, i]
            for j in range(tuning.at.errors, len(x)):
                error = samples.product_errors[k - 1, i, j - tuning.at.errors]
                error += samples.product_errors[k, i, j - tuning.at.errors]
                transition[a, j] += weight * tables.cross_noise[place, a, i] * error
        for end in range(2):
            about = _about(given, k, end, x, ahead)
            slope_of(tables.cross_products[place, a], about, along)
            for b in range(3):
                change = 0.0 if end == 0 else ahead[b] - x[b]
                added[a] += weight * along[b] * (change - 0.5 * about[b])
                transition[a, b] += weight * along[b]
        for b in range(3):
            noise[3 + a, 3 + b] -= renewed * (2.0 * share - share * share) * tables.cross_square[place, a, b]


@njit(**INNER)
def noise_of_step(samples, k, tables, tuning, carried, noise):  # type: ignore[no-untyped-def]
    """Fill in the covariance of the integral of α to sample k, from that of the new ε.

    Added is what the samples of α leave uncertain: an undersampled motion, a gap, samples without α.

    Differences of a well-sampled signal shrink with their order. Where the fifth is larger than the fourth, the noise
    taken off, α changes by itself between samples, and its integral is as uncertain as a random walk's between two
    known ends.
    """
    scalars = carried.scalars
    step = samples.t[k] - scalars[TIME]
    half = 0.5 * step
    for a in range(3):
        for b in range(3):
            noise[a, b] = half * half * noise[3 + a, 3 + b]
            noise[3 + a, b] = noise[a, 3 + b] = half * noise[3 + a, 3 + b]
    power = tables.alpha_noise[0, 0, 0] + tables.alpha_noise[0, 1, 1] + tables.alpha_noise[0, 2, 2]
    extra = 0.0
    if not np.isnan(samples.differences[k, 0]):
        scalars[FOURTH] += tuning.forget_second * (samples.differences[k, 0] - scalars[FOURTH])
        scalars[FIFTH] += tuning.forget_second * (samples.differences[k, 1] - scalars[FIFTH])
    rough = scalars[FIFTH] - 2.0 * _FIFTH_OF_NOISE * power
    if rough > 0.0 and rough > scalars[FOURTH] - _FOURTH_OF_NOISE * power:
        extra = rough * _ROUGH_SHARE * step * step
    carried.counts[ROUGH] = 1 if extra > 0.0 else 0
    whole = step < _GAP * tuning.period
    if samples.channel_set[k] < 0:  # α is held, and its changes add up
        age = samples.t[k] - scalars[LAST_ALPHA]
        extra += scalars[WALK] * age * age * step
    elif not whole:
        extra += scalars[WALK] * step * step * step / 12.0
    elif carried.counts[LAST_SET] >= 0:
        jump = -2.0 * power
        for a in range(3):
            jump += (samples.alpha[k, a] - samples.alpha[k - 1, a]) ** 2
        walk = scalars[WALK] + tuning.forget_second * (jump / (3.0 * tuning.period) - scalars[WALK])
        scalars[WALK] = max(0.0, walk)
    for a in range(3):
        noise[a, a] += extra


@njit(**INNER)
def _bound(z, tables, tuning, carried, place, level, unit, gain, record, row):  # type: ignore[no-untyped-def]
    """Bring the variance of each axis down to the largest square that the products of a sample allow, (3)."""
    x, p = carried.x, carried.covariance
    m, first = len(z), tuning.at.products
    for a in range(3):
        if not tables.square_seen[place, a]:
            continue
        shown = 0.0
        variance = 0.0
        for j in range(m):
            weight = tables.inverse_bias[place, a, j]
            shown += tables.inverse[place, a, j] * z[j] - weight * x[first + j]
            variance += level * tables.inverse[place, a, j] ** 2
            if weight != 0.0:
                for i in range(m):
                    variance += weight * p[first + i, first + j] * tables.inverse_bias[place, a, i]
        largest = max(shown, 0.0) + _DEVIATIONS * np.sqrt(variance)
        if p[a, a] > largest:
            unit[a] = 1.0
            take(x, p, unit, -x[a], largest * p[a, a] / (p[a, a] - largest), carried.counts[SOLVED], gain, record, row)
            unit[a] = 0.0


@njit(**INNER)
def _take_products(samples, given, k, tables, tuning, carried, level, slopes, gain, record, row, place_of):  # type: ignore[no-untyped-def]
    """Measure the null space of sample k, (2).

    Returns innovations² over their variance and over the stated one, and the level of the noise.
    """
    x, p, scalars = carried.x, carried.covariance, carried.scalars
    n, m = len(x), samples.z.shape[1]
    place = samples.channel_set[k]
    count = tables.rows[place]
    slope, lin, constant, factor = place_of.along, place_of.lin, place_of.constant, place_of.factor
    first_level = level
    for i in range(count):
        for j in range(m):
            slopes[i, tuning.at.products + j] = tables.product_bias[place, i, j]
        for j in range(tuning.at.errors, n):
            slopes[i, j] = samples.product_errors[k, i, j - tuning.at.errors]
    again = len(given.level) > 0
    if again:
        lin[:] = given.omega[k]
    curved = not again and _linearise(samples.z[k], tables, place, tuning, carried, level, slopes, lin, factor)
    for i in range(count):
        slope_of(tables.sensitivity[place, i], lin, slope)
        constant[i] = samples.z[k, i]  # innovation at x = 0 of the linearised row
        for a in range(3):
            slopes[i, a] = slope[a]
            constant[i] += 0.5 * slope[a] * lin[a]
    if curved:  # whiten the rows
        solve_lower(factor, constant, count)
        column = np.empty(count)
        for j in range(n):
            for i in range(count):
                column[i] = slopes[i, j]
            solve_lower(factor, column, count)
            for i in range(count):
                slopes[i, j] = column[i]
    gross = 0.0
    for i in range(count):
        innovation = constant[i]
        for j in range(n):
            innovation -= slopes[i, j] * x[j]
        gross += innovation * innovation
    if not again and place == 0 and tuning.guard_window > 0 and gross > _GROSS * count * (1.0 if curved else level):
        own = np.empty(3)
        unexplained = _own_rate(samples.z[k], tables, carried, own) / (max(m - 3, 1) * level)
        if unexplained > _UNUSABLE:  # no rate explains the sample: its noise is as much larger
            level *= unexplained
            scalars[LEVEL] *= unexplained
    steady = _steady_share(samples, k, tables, tuning, carried, level) if tuning.compares else 1.0
    nis = 0.0
    by_stated = 0.0
    excess = 0.0
    lagged = 0.0
    follows = carried.counts[LAST_SET] == place
    variance = level / first_level if curved else level
    for i in range(count):
        innovation = constant[i]
        for j in range(n):
            innovation -= slopes[i, j] * x[j]
        inverse = take(x, p, slopes[i], innovation, variance, carried.counts[SOLVED], gain, record, row)
        nis += innovation * innovation * inverse
        if tuning.compares:
            share = variance * inverse
            scalars[LIKELIHOOD] -= 0.5 * (innovation * innovation * inverse - np.log(inverse))
            scalars[WANDER] += 4.0 * share * (1.0 - share) * steady
        by_stated += innovation * innovation / (1.0 / inverse - variance + variance / level)
        by_parity = variance * scalars[LEVEL] / level  # the noise without what innovations showed
        stated = innovation / np.sqrt(1.0 / inverse - variance + by_parity)
        excess += stated * stated
        if follows:
            lagged += stated * carried.last_white[i]
        carried.last_white[i] = stated
    scalars[EXCESS] += tuning.forget_half * (excess / count - scalars[EXCESS])
    if follows:
        scalars[LAGGED] += tuning.forget_second * (lagged / count - scalars[LAGGED])
    return nis, by_stated, level


@njit(**INNER)
def _take_references(samples, given, k, tuning, carried, unit, gain, record, row):  # type: ignore[no-untyped-def]
    """Measure what the references of sample k show; returns innovations² over their variance, and how many there are.

    ``unit`` (n,) is zero, and left so.
    """
    x, rows, path = carried.x, tuning.references, tuning.path
    about = given.omega[k] if len(given.level) > 0 else x[:3]
    nis, count, rate, change = 0.0, 0, 0.0, 0.0
    for a in range(3):
        rate += path.axis[a] * about[a]
        change += path.axis[a] * _change(samples, given, k, a)
    for i in range(len(rows.variance)):
        if np.isnan(samples.references[k, i]):
            continue
        for a in range(3):
            unit[rows.first[i] + a] = rows.weights[i, a]
        for j in range(len(rows.value_of)):
            if rows.value_of[j] == i:
                kind = rows.grows_with[j]
                unit[tuning.at.references + j] = 1.0 if kind == CONSTANT else (rate if kind == RATE else change)
        innovation = samples.references[k, i]
        for j in range(len(x)):
            innovation -= unit[j] * x[j]
        solved = carried.counts[SOLVED]
        inverse = take(x, carried.covariance, unit, innovation, rows.variance[i], solved, gain, record, row)
        nis += innovation * innovation * inverse
        if tuning.compares:
            carried.scalars[LIKELIHOOD] -= 0.5 * (innovation * innovation * inverse - np.log(inverse))
        count += 1
        unit[:] = 0.0
    return nis, count


@njit(**INNER)
def _change(samples, given, k, a):  # type: ignore[no-untyped-def]
    """Return how fast a component of the rate changes at sample k: by the rates given, or by the mean α about it."""
    if len(given.level) > 0:
        first, last = max(k - 1, 0), min(k + 1, len(given.level) - 1)
        return (given.omega[last, a] - given.omega[first, a]) / (samples.t[last] - samples.t[first])
    return np.mean(samples.alpha[max(k - _SMOOTHED, 0) : min(k + _SMOOTHED + 1, len(samples.t)), a])


@njit(**INNER)
def _steady_share(samples, k, tables, tuning, carried, level):  # type: ignore[no-untyped-def]
    """Return the share of the power of α over half a second that its noise and bias explain: 1 at a steady rate."""
    scalars = carried.scalars
    lasting, spread = np.empty(3), np.empty((3, 3))
    _lasting_alpha(samples, k, tuning, carried, lasting, spread)
    power = 0.0
    allowed = 0.0
    for a in range(3):
        value = samples.alpha[k, a] - lasting[a]
        power += value * value
        allowed += level * tables.alpha_noise[0, a, a] + _BIAS_SQUARE * spread[a, a]
    scalars[POWER] += tuning.forget_half * (power - scalars[POWER])
    allowed *= _STEADY_POWER
    excess = max(scalars[POWER] - allowed, 0.0)
    return allowed / (allowed + excess)


@njit(**INNER)
def _linearise(z, tables, place, tuning, carried, level, slopes, lin, factor):  # type: ignore[no-untyped-def]
    """Choose the rate about which the null space is linearised; ``slopes`` (m, n) hold those of the constants.

    Returns whether second-order terms matter; then ``factor`` is the Cholesky factor of the noise with them.
    """
    x, p = carried.x, carried.covariance
    n, count, first = len(x), tables.rows[place], tuning.at.products
    size = x[0] * x[0] + x[1] * x[1] + x[2] * x[2]
    spread = p[0, 0] + p[1, 1] + p[2, 2]
    for a in range(3):
        lin[a] = x[a]
    if spread < _BROAD * size or spread * spread * tables.size[place] < _CURVED * level:
        return False
    # Constants given the rate: mean c + C P⁻¹ d, covariance B − C P⁻¹ Cᵀ, both through their slopes.
    crossed = np.zeros((count, 3))
    target = np.zeros(count)
    inner = np.zeros((count, count))
    spread_of = np.zeros(n)
    for i in range(count):
        target[i] = z[i]
        spread_of[:] = 0.0
        for j in range(first, n):
            weight = slopes[i, j]
            if weight == 0.0:
                continue
            target[i] -= weight * x[j]
            for a in range(3):
                crossed[i, a] += weight * p[j, a]
            for r in range(first, n):
                spread_of[r] += weight * p[j, r]
        for q in range(i + 1):
            for r in range(first, n):
                inner[i, q] += spread_of[r] * slopes[q, r]
        inner[i, i] += level
    prior = np.empty((3, 3))
    column = np.empty(3)
    for a in range(3):
        for b in range(3):
            prior[a, b] = p[a, b]
    cholesky(prior, 3)
    linear = np.zeros((count, 3))
    for i in range(count):
        for a in range(3):
            column[a] = crossed[i, a]
        solve_lower(prior, column, 3)
        for a in range(3):
            crossed[i, a] = column[a]  # C L⁻ᵀ
        for a in range(2, -1, -1):
            for b in range(a + 1, 3):
                column[a] -= prior[b, a] * column[b]
            column[a] /= prior[a, a]
            linear[i, a] = column[a]
    for i in range(count):
        for q in range(i + 1):
            for a in range(3):
                inner[i, q] -= crossed[i, a] * crossed[q, a]
    seeds = np.empty((3, 3))
    shown = np.empty(3)
    shown_rate(tables.inverse[place], z, carried.x, first, tables.product_bias[place], shown)
    for a in range(3):
        seeds[0, a] = x[a]
        seeds[1, a] = shown[a]
        seeds[2, a] = -shown[a]
    cholesky(inner, count)
    solve_lower(inner, target, count)
    whitened = np.empty((count, 6))
    white = np.empty(count)
    for q in range(6):
        for i in range(count):
            white[i] = tables.sensitivity[place, i, q]
        solve_lower(inner, white, count)
        for i in range(count):
            whitened[i, q] = white[i]
    for a in range(3):
        for i in range(count):
            white[i] = linear[i, a]
        solve_lower(inner, white, count)
        for i in range(count):
            linear[i, a] = white[i]
    posterior = np.empty((3, 3))
    probable_rate(x, p, target, whitened, linear, seeds, lin, posterior)
    if spread > _UNKNOWN * size:  # about a rate that may be zero the slope of its products shows nothing
        for a in range(3):
            for b in range(3):
                posterior[a, b] = p[a, b]
    for i in range(count):
        for j in range(i + 1):
            factor[i, j] = 2.0 * _trace(tables.sensitivity[place, i], tables.sensitivity[place, j], posterior)
        factor[i, i] += level
    cholesky(factor, count)
    return True


@njit(**INNER)
def _trace(first, second, p):  # type: ignore[no-untyped-def]
    """Return tr(B P C P) of the symmetric forms B and C whose elements (6,) stand in the order of the products."""
    total = 0.0
    b = np.empty((3, 3))
    c = np.empty((3, 3))
    for matrix, row in ((b, first), (c, second)):
        for a in range(3):
            matrix[a, a] = row[a]
        matrix[0, 1] = matrix[1, 0] = 0.5 * row[3]
        matrix[0, 2] = matrix[2, 0] = 0.5 * row[4]
        matrix[1, 2] = matrix[2, 1] = 0.5 * row[5]
    for i in range(3):
        for j in range(3):
            left = 0.0
            right = 0.0
            for q in range(3):
                left += b[i, q] * p[q, j]
                right += c[j, q] * p[q, i]
            total += left * right
    return total


@njit(**INNER)
def _rests(samples, k, tables, tuning, carried):  # type: ignore[no-untyped-def]
    """Return whether a block of rest ends here: 0, 1, or 2 where the filter has to start anew from that rest.

    Rest takes still blocks in a row, and a rate that may be zero; or biases for which rest explains the mean null space
    of those blocks, as it was before the run, clearly better than the filter's rate does.
    """
    counts = carried.counts
    still = samples.still[k]
    if still == 0:
        return 0
    if still == MOVES:
        counts[STILL] = 0
        counts[SUMMED] = counts[COMPLETE] = 0
        counts[RESTING] = 0
        carried.sums[:] = 0.0
    if still != RESTS:
        return 0
    counts[STILL] += 1
    if counts[STILL] < tuning.rest_entry:
        return 0
    x, p = carried.x, carried.covariance
    factor = np.empty((3, 3))
    value = np.empty(3)
    for a in range(3):
        value[a] = x[a]
        for b in range(3):
            factor[a, b] = p[a, b]
        factor[a, a] += tuning.rest_variance
    rate = _square(factor, value)
    if counts[RESTING] > 0 and rate < tuning.rest_limit:
        return 1
    if counts[SUMMED] == 0:
        return 0
    _lasting_alpha(samples, k, tuning, carried, value, factor)
    for a in range(3):  # a rate that passes slowly through zero has a mean α
        value[a] = carried.sums[a] / counts[SUMMED] - value[a]
        for b in range(3):
            factor[a, b] += tables.alpha_noise[0, a, b] / counts[SUMMED]
    if rate < tuning.entry_rate and _square(factor, value) < tuning.entry_alpha:
        counts[RESTING] = 1
        return 1
    m = len(carried.sums) - 3
    if tuning.guard_window == 0 or counts[COMPLETE] == 0:
        return 0
    spread = np.empty((m, m))
    resting = np.empty(m)
    turning = np.empty(m)
    along = np.empty(3)
    for i in range(m):
        resting[i] = carried.sums[3 + i] / counts[COMPLETE]
        slope_of(tables.sensitivity[0, i], carried.x, along)
        turning[i] = resting[i]
        for a in range(3):
            turning[i] -= 0.5 * along[a] * carried.x[a]
        for j in range(m):
            spread[i, j] = carried.prior[tuning.at.products + i, tuning.at.products + j]
        spread[i, i] += 1.0 / counts[COMPLETE]
    cholesky(spread, m)
    solve_lower(spread, resting, m)
    solve_lower(spread, turning, m)
    gain = 0.0
    for i in range(m):
        gain += turning[i] * turning[i] - resting[i] * resting[i]
    return 2 if gain > tuning.rest_clear else 0


@njit(**INNER)
def _lasting_alpha(samples, k, tuning, carried, value, factor):  # type: ignore[no-untyped-def]
    """Fill in what biases and errors of the channels make of A y at sample k, (3,), and its covariance (3, 3)."""
    x, p = carried.x, carried.covariance
    n, first = len(x), tuning.at.errors
    row = np.zeros(n)
    for a in range(3):
        value[a] = x[tuning.at.alpha + a]
        for j in range(n):
            row[j] = p[tuning.at.alpha + a, j]
        for i in range(first, n):
            weight = samples.alpha_errors[k, a, i - first]
            value[a] += weight * x[i]
            for j in range(n):
                row[j] += weight * p[i, j]
        for b in range(3):
            factor[a, b] = row[tuning.at.alpha + b]
            for j in range(first, n):
                factor[a, b] += row[j] * samples.alpha_errors[k, b, j - first]


@njit(**INNER)
def _square(factor, value):  # type: ignore[no-untyped-def]
    """Return vᵀ S⁻¹ v of three components; both arguments are overwritten."""
    cholesky(factor, 3)
    solve_lower(factor, value, 3)
    return value[0] * value[0] + value[1] * value[1] + value[2] * value[2]


@njit(**INNER)
def _start_again(carried, tuning, solved, omega, variance):  # type: ignore[no-untyped-def]
    """Start anew from a rate (3,) with this variance per axis, and the biases as they were before the run.

    The path goes on, with an attitude as uncertain as the change of the rate makes it over a window of the guard.
    """
    x, end = carried.x, tuning.at.alpha  # of the path
    for i in range(len(x)):
        for j in range(len(x)):
            if not (TILT <= i < end and TILT <= j < end):
                carried.covariance[i, j] = carried.prior[i, j]
    for a in range(3):
        lost = tuning.guard_window * tuning.period * (omega[a] - x[a])
        if end > TILT:
            for b in range(3):
                carried.covariance[TILT + b, TILT + b] += lost * lost
        x[a], x[3 + a] = omega[a], 0.0
    for i in range(end, len(x)):
        x[i] = 0.0
    for a in range(3):
        carried.covariance[a, a] = variance
    carried.counts[SOLVED] = solved
    carried.scalars[EXCESS] = 1.0
    carried.scalars[LAGGED] = 0.0


@njit(**INNER)
def _guard(samples, k, tables, tuning, carried, level):  # type: ignore[no-untyped-def]
    """Judge a window of samples; where it contradicts the filter, start anew from the last one's own rate.

    The misfit is χ² of the null space at the filter's rate, with the biases as uncertain as before the run.
    """
    if tuning.guard_window == 0:
        return False
    counts, scalars = carried.counts, carried.scalars
    x, z = carried.x, samples.z[k]
    m = len(z)
    misfit = _misfit(z, carried, x)
    scalars[MISFIT] += misfit / scalars[LEVEL] - m
    counts[JUDGED] += 1
    if counts[JUDGED] < tuning.guard_window:
        return False
    mean = scalars[MISFIT] / counts[JUDGED] + m
    suspicious = scalars[MISFIT] > tuning.guard_limit
    scalars[MISFIT] = 0.0
    counts[JUDGED] = 0
    if not suspicious:
        return False
    own = np.zeros(3)
    first = max(k - tuning.guard_window + 1, 0)
    fits = np.zeros(k + 1 - first)
    for j in range(first, k + 1):
        fits[j - first] = _own_rate(samples.z[j], tables, carried, own) / scalars[LEVEL]
    typical = max(np.median(fits) / max(m - 3, 1), 1.0)
    # The last sample must fit a rate of its own, and the samples theirs clearly better than the filter's.
    if fits[-1] > _UNUSABLE * max(m - 3, 1) * typical or mean - np.median(fits) < tuning.guard_clear * typical:
        return False
    side = _side(samples, k, own, tuning, carried)
    for a in range(3):
        own[a] *= side
    _start_again(carried, tuning, tuning.solved_in_motion, own, _wide(own, tables))
    return True


@njit(**INNER)
def _wide(omega, tables):  # type: ignore[no-untyped-def]
    """Return the variance with which a rate (3,) of one sample is started from."""
    square = omega[0] * omega[0] + omega[1] * omega[1] + omega[2] * omega[2]
    return square / 9.0 + _DEVIATIONS / np.sqrt(tables.size[0])


@njit(**INNER)
def _own_rate(z, tables, carried, own):  # type: ignore[no-untyped-def]
    """Fill in the rate (3,) that a sample shows but for its sign, with the biases as before the run; returns its χ²."""
    m = len(z)
    target = np.zeros(m)
    for i in range(m):
        for j in range(i + 1):
            target[i] += carried.guard_white[i, j] * z[j]
    seeds = np.zeros((2, 3))
    shown_rate(tables.inverse[0], z, np.zeros(m), 0, tables.product_bias[0], own)
    for a in range(3):
        seeds[0, a] = carried.x[a]
        seeds[1, a] = own[a]
    spread = np.zeros((3, 3))
    wide = 1e6 * np.eye(3)
    return probable_rate(np.zeros(3), wide, target, carried.guard_sensitivity, np.zeros((m, 3)), seeds, own, spread)


@njit(**INNER)
def _side(samples, k, omega, tuning, carried):  # type: ignore[no-untyped-def]
    """Return the sign, ±1, with which a rate (3,) at sample k goes better with the samples of the window before.

    From either the rate is carried back by the integral of α, without the bias that the filter had; alike, the sign is
    that of the filter's rate.
    """
    back = np.empty(3)
    x = carried.x
    misfits = np.zeros(2)
    for which in range(2):
        side = 1.0 if which == 0 else -1.0
        for a in range(3):
            back[a] = side * omega[a]
        for j in range(k, max(k - tuning.guard_window, 0), -1):
            if samples.channel_set[j - 1] != 0 or samples.t[j] - samples.t[j - 1] > _GAP * tuning.period:
                break
            for a in range(3):
                back[a] -= samples.increment[j, a] - (samples.t[j] - samples.t[j - 1]) * x[tuning.at.alpha + a]
            misfits[which] += min(_misfit(samples.z[j - 1], carried, back), _LARGEST_MISFIT)
    along = omega[0] * x[0] + omega[1] * x[1] + omega[2] * x[2]
    if abs(misfits[0] - misfits[1]) < tuning.guard_clear:
        return 1.0 if along >= 0.0 else -1.0
    return 1.0 if misfits[0] < misfits[1] else -1.0


@njit(**INNER)
def _misfit(z, carried, omega):  # type: ignore[no-untyped-def]
    """Return χ² of the null space z (m,) at a rate (3,)."""
    total = 0.0
    xx, yy, zz = omega[0] * omega[0], omega[1] * omega[1], omega[2] * omega[2]
    xy, xz, yz = omega[0] * omega[1], omega[0] * omega[2], omega[1] * omega[2]
    for i in range(len(z)):
        row = carried.guard_sensitivity[i]
        value = -(row[0] * xx + row[1] * yy + row[2] * zz + row[3] * xy + row[4] * xz + row[5] * yz)
        for j in range(i + 1):
            value += carried.guard_white[i, j] * z[j]
        total += value * value
    return total


@compiled
def smooth_back(samples, record, restart, first, last, tables, tuning, end, adjoint, curvature, out, again):  # type: ignore[no-untyped-def]
    """Smooth the samples of a record, whose sample 0 is ``first``, back from sample ``last − 1``.

    ``restart`` (N,) marks samples behind which the filter started anew: nothing goes on across them. ``adjoint`` (n,)
    and ``curvature`` (n, n) are carried from block to block. ``end`` is the state behind the last sample, and ``again``
    the estimates of the filter over these samples. Fills rates, their covariance and the path in ``out``.
    """
    r, x, path = tuning.at.alpha, end.x.copy(), out.path
    value, spread = np.empty(r), np.empty((r, r))
    for k in range(last - 1, first - 1, -1):
        if restart[k]:
            adjoint[:] = 0.0
            curvature[:] = 0.0
        if r > TILT and path.levelled[k]:
            for row in range(TILT, POSITION):
                adjoint[row] = 0.0
                curvature[row, :] = 0.0
                curvature[:, row] = 0.0
        step_back(record, k - first, adjoint, curvature, value, spread)
        for a in range(3):
            out.omega[k, a] = x[a] = value[a]
            out.covariance[k, a] = spread[a, a]
        out.covariance[k, 3] = spread[0, 1]
        out.covariance[k, 4] = spread[0, 2]
        out.covariance[k, 5] = spread[1, 2]
        if r > TILT:
            turned(again.path.ahead[k - first], value[TILT : TILT + 3], True, path.attitude[k])
            for i in range(ROWS - 3):
                path.line[k, i] = value[TILT + 3 + i]
            for i in range(ROWS):
                path.variance[k, i] = spread[TILT + i, TILT + i]
            level = out.inflation[k]
            motion_of(samples, k, tables, tuning, x, end.covariance, level, path.motion[k], path.motion_variance[k])
