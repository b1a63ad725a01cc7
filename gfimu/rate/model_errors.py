"""Errors beyond white noise that widen the rate filter's uncertainty."""

from __future__ import annotations

from numba import njit

from gfimu.base.compiled import INNER
from gfimu.rate.recursion_data import FIFTH, FOURTH

__all__ = ["follow_differences", "inflation_of", "undersampled"]

_ERROR_MEMORY = 1.0  # s, for which a scale or placement error keeps its effect
_FOURTH_OF_NOISE = 70.0  # variance of the fourth and fifth difference of white noise of unit variance
_FIFTH_OF_NOISE = 252.0
_ROUGH_SHARE = 1.0 / (12.0 * 70.0)  # (Δt² × variance of the step)/12 by the fifth difference of a random walk


@njit(**INNER)
def inflation_of(data, k, state, tuning, omega_squared):  # type: ignore[no-untyped-def]
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


@njit(**INNER)
def follow_differences(alpha, start, forget, scalars):  # type: ignore[no-untyped-def]
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
    scalars[FOURTH] += forget * (fourth - scalars[FOURTH])
    scalars[FIFTH] += forget * (fifth - scalars[FIFTH])


@njit(**INNER)
def undersampled(noise_power, scalars):  # type: ignore[no-untyped-def]
    """Variance of α per axis that the polynomial through its samples does not follow.

    Differences of a well-sampled signal shrink with their order; where the fifth is larger than the fourth, the noise
    taken off, α changes by itself between samples. Then its integral over an interval is as uncertain as a random
    walk's between two known ends.
    """
    excess = scalars[FIFTH] - 2.0 * _FIFTH_OF_NOISE * noise_power
    if excess <= 0.0 or excess < scalars[FOURTH] - _FOURTH_OF_NOISE * noise_power:
        return 0.0
    return excess * _ROUGH_SHARE / 3.0
