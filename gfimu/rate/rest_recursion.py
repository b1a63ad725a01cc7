"""Test for rest within the rate filter, block by block (`gfimu.rate.rest_test` says what is tested)."""

from __future__ import annotations

import numpy as np
from numba import njit

from gfimu.base.compiled import INNER
from gfimu.rate.recursion_data import BLOCK, DOUBT, PAIR, PAST, REST_BLOCKS, RESTING, RETRY, RETURN, RUN, SAMPLES
from gfimu.rate.rest_test import HISTORY_BLOCKS, shown_variance

__all__ = ["keep_rest", "rest_block"]


@njit(**INNER)
def rest_block(data, k, tables, tuning, state):  # type: ignore[no-untyped-def]
    """Count sample k into the block; at the block's end test for rest (`gfimu.rate.rest_test`).

    Returns whether a block of rest ended here. Where a rest ended, the motion may have begun before it could be seen:
    ``state.counts[RETURN]`` is then the place, from 1, of the kept state that was certainly before it.
    """
    counts = state.counts
    window = tuning.rest_window
    if data.channel_set[k] != 0 or (counts[BLOCK] > 0 and data.whole_run[k] == 0):
        if counts[BLOCK] > 0 and data.whole_run[k] == 0:  # who knows what happened in the gap
            counts[RUN] = 0
            counts[RESTING] = 0
            counts[PAST] = 0
            counts[RETRY] = 0
            counts[DOUBT] = 0
        counts[BLOCK] = 0
        return False
    counts[BLOCK] += 1
    if counts[BLOCK] < window:
        return False
    counts[BLOCK] = 0
    doubts = counts[DOUBT]
    span = (
        0
        if data.vetoed[k]
        else _moving_blocks(data.y[k - window + 1 : k + 1], data.z[k - window + 1 : k + 1], tables, tuning, state)
    )
    if data.vetoed[k] or span > 0:
        if not data.vetoed[k]:
            # Besides the blocks that move, the one before them; none of those in doubt was taken for rest.
            back = max(span - doubts, 1)
            _return_before(back - 1 if doubts > 0 and tuning.live else back, window, state)
        if not data.vetoed[k] or counts[RESTING] > 0:  # all that is vetoed in a row counts as one block
            counts[RETRY] = counts[RESTING]
        counts[RUN] = 0
        counts[RESTING] = 0
        counts[PAST] = 0
        counts[DOUBT] = 0
        return False
    if counts[DOUBT] > 0 and doubts == 0 and tuning.live:  # until it is decided, the blocks before are in doubt as well
        back = min(1 + counts[PAIR], counts[PAST] - 1)
        _return_before(back, window, state)
        if counts[RETURN] > 0:
            counts[PAST] -= back
    return counts[RESTING] > 0 and counts[DOUBT] == 0


@njit(**INNER)
def _return_before(back, window, state):  # type: ignore[no-untyped-def]
    """Mark the kept state before the last ``back`` blocks of rest, or as many of them as are at hand."""
    counts = state.counts
    back = min(back, counts[PAST] - 1, len(state.past_x) - 1)  # the state behind the first block stays
    while back > 0 and counts[RETURN] == 0:
        place = (counts[PAST] - 1 - back) % len(state.past_x)
        if counts[SAMPLES] < state.past_samples[place] + (HISTORY_BLOCKS - 1) * window:
            counts[RETURN] = place + 1
        back -= 1


@njit(**INNER)
def keep_rest(state):  # type: ignore[no-untyped-def]
    """Keep the state after a block of rest, so that later blocks can be taken back."""
    place = state.counts[PAST] % len(state.past_x)
    for r in range(len(state.x)):
        state.past_x[place, r] = state.x[r]
        for q in range(len(state.x)):
            state.past_covariance[place, r, q] = state.covariance[r, q]
    for index in range(len(state.scalars)):
        state.past_scalars[place, index] = state.scalars[index]
    state.past_samples[place] = state.counts[SAMPLES]
    state.counts[PAST] += 1


@njit(**INNER)
def _moving_blocks(y, z, tables, tuning, state):  # type: ignore[no-untyped-def]
    """Test the block of readings y (window, c) and its null space z (window, d) for rest: 0, or how many blocks move.

    Amid a rest ``state.counts[DOUBT]`` is how many blocks up to this one are in doubt.
    """
    window, c = y.shape
    d = tables.null_rows.shape[1]
    counts = state.counts
    resting = counts[RESTING] > 0
    first = window // 2
    second = window - first
    limits = tuning.rest_limits[1 if counts[SAMPLES] < window else 0]
    ends = tuning.rest_limits[2] if resting and counts[SAMPLES] >= window else limits  # what ends a rest at once
    # ω when the block began: known, and not far from zero. Amid a rest that is the α of a block in doubt over again.
    known = state.block_covariance
    for a in range(3):
        if not known[a, a] <= limits[5]:  # nor if it is NaN
            return 1
        if state.block_x[a] ** 2 > ends[4] * (known[a, a] + tuning.rest_variance):  # never less than the full χ²
            return 1
    noise = shown_variance(z)
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
    scatter /= noise
    halves /= noise * (1.0 / first + 1.0 / second)
    if scatter > ends[0] or halves > ends[1]:
        return 1
    size = max(d, 3)
    spread = np.empty((size, size))
    value = np.empty(size)
    for a in range(3):
        value[a] = state.block_x[a]
        for b in range(3):
            spread[a, b] = known[a, b]
        spread[a, a] += tuning.rest_variance
    if _normalised_square(spread, value, 3) > ends[4]:
        return 1
    # Means against the biases known when the block began.
    alpha = np.empty(3)
    for a in range(3):
        total = -state.block_x[3 + a]
        for i in range(c):
            total += tables.alpha_rows[0, a, i] * mean[i]
        alpha[a] = total
        value[a] = total
        for b in range(3):
            spread[a, b] = known[3 + a, 3 + b] + noise * tables.alpha_noise[0, a, b] / window
    alpha_statistic = _normalised_square(spread, value, 3)
    null_statistic = 0.0
    if d > 0:
        for j in range(d):
            total = -state.block_x[6 + j]
            for i in range(c):
                total += tables.null_rows[0, j, i] * mean[i]
            value[j] = total
            for r in range(d):
                spread[j, r] = known[6 + j, 6 + r]
            spread[j, j] += noise / window
        null_statistic = _normalised_square(spread, value, d)
    if alpha_statistic > ends[2] or null_statistic > ends[3]:
        return 1
    doubtful = scatter > limits[0] or halves > limits[1] or alpha_statistic > limits[2] or null_statistic > limits[3]
    if doubtful and counts[DOUBT] > 0:  # the second in a row
        return 2
    span = _moving_run(alpha, noise, tables, tuning, state)
    if span > 0 or counts[RESTING] == 0:
        return span
    # Two blocks together raise a doubt as well; it is over when the mean since it began is again what rest explains.
    since = counts[DOUBT] + 1
    counts[PAIR] = 0
    if counts[RUN] > 1 and _run_statistic(max(since, 2), noise, tables, tuning, state) > limits[2]:
        doubtful = True
        counts[PAIR] = 1
    if doubtful:
        counts[DOUBT] = since
        return 0 if since < len(state.past_x) else since
    counts[DOUBT] = 0
    blocks = counts[REST_BLOCKS]
    for i in range(c):
        state.reference[i] += (mean[i] - state.reference[i]) / (blocks + 1)
    counts[REST_BLOCKS] = blocks + 1
    return 0


@njit(**INNER)
def _moving_run(alpha, noise, tables, tuning, state):  # type: ignore[no-untyped-def]
    """Test the blocks in a row that ended with this one, which alone moves not; rest begins when they are enough.

    Returns 0, or how many blocks up to this one move.
    """
    counts = state.counts
    length = len(state.run_alpha)
    place = counts[RUN] % length
    for a in range(3):
        state.run_alpha[place, a] = alpha[a] + state.block_x[3 + a]
        state.run_bias[place, a] = state.block_x[3 + a]
        for b in range(3):
            state.run_covariance[place, a, b] = state.block_covariance[3 + a, 3 + b]
    counts[RUN] += 1
    run = counts[RUN]
    limit = tuning.rest_limits[2 if counts[RESTING] > 0 else 0, 2]
    span = 2
    while span <= min(run, length):
        if _run_statistic(span, noise, tables, tuning, state) > limit:
            return span
        span *= 2
    if counts[RESTING] == 0:
        resumes = counts[RETRY] > 0
        if (
            run < (tuning.rest_retry if resumes else tuning.rest_entry)
            or _run_statistic(min(run, length), noise, tables, tuning, state)
            > tuning.rest_limits[0, 7 if resumes else 6]
        ):
            return 0
        spread = np.empty((3, 3))
        value = np.empty(3)
        for a in range(3):
            value[a] = state.x[a]
            for b in range(3):
                spread[a, b] = state.covariance[a, b]
            spread[a, a] += tuning.rest_variance
        if _normalised_square(spread, value, 3) > tuning.rest_limits[0, 7]:
            return 0
        counts[RESTING] = 1
    return 0


@njit(**INNER)
def _run_statistic(span, noise, tables, tuning, state):  # type: ignore[no-untyped-def]
    """Mean α of the last ``span`` blocks against its bias as known when they began, by the last block's noise."""
    length = len(state.run_alpha)
    run = state.counts[RUN]
    begin = (run - span) % length
    difference = np.empty(3)
    spread = np.empty((3, 3))
    for a in range(3):
        total = 0.0
        for number in range(run - span, run):
            total += state.run_alpha[number % length, a]
        difference[a] = total / span - state.run_bias[begin, a]
        for b in range(3):
            white = noise * tables.alpha_noise[0, a, b] / (span * tuning.rest_window)
            spread[a, b] = state.run_covariance[begin, a, b] + white
    return _normalised_square(spread, difference, 3)


@njit(**INNER)
def _normalised_square(spread, value, size):  # type: ignore[no-untyped-def]
    """Return vᵀ S⁻¹ v of the first ``size`` components by Cholesky's factors; both arguments are overwritten.

    Loops, as the compiler takes far longer over calls of a linear algebra library.
    """
    total = 0.0
    for i in range(size):
        for j in range(i):
            entry = spread[i, j]
            for k in range(j):
                entry -= spread[i, k] * spread[j, k]
            spread[i, j] = entry / spread[j, j]
            value[i] -= spread[i, j] * value[j]
        pivot = spread[i, i]
        for k in range(i):
            pivot -= spread[i, k] * spread[i, k]
        spread[i, i] = np.sqrt(pivot)
        value[i] /= spread[i, i]
        total += value[i] * value[i]
    return total
