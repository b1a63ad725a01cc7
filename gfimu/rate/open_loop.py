"""α integrated, or rates of single samples strung together, and the path with it: nothing is measured on the way.

The transitions and their noise are those of the filter (`gfimu.rate.body_rate`).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from gfimu.base.compiled import INNER, compiled
from gfimu.rate.body_rate import Workspace, noise_level, noise_of_step, put_estimate, step_by_alpha
from gfimu.rate.filter_state import LAST_ALPHA, LAST_SET, ROUGH, STARTED, TIME
from gfimu.rate.kernel import predict
from gfimu.rate.path import TILT, advance_path

__all__ = ["integrate_open"]


@compiled
def integrate_open(samples, given, single, first, last, tables, tuning, carried, out):  # type: ignore[no-untyped-def]
    """Carry rate and path over the samples ``first`` to ``last − 1`` and fill these rows of ``out``.

    ``tables`` are `gfimu.rate.channel_sets.SetTables`, ``single`` the rates of single samples, which take the place of
    the integral of α where there are any; ``given`` is nothing.
    """
    x, p = carried.x, carried.covariance
    n, m, r = len(x), samples.z.shape[1], tuning.at.alpha
    counts, scalars = carried.counts, carried.scalars
    transition, added, noise, work = np.zeros((r, n)), np.zeros(r), np.zeros((r, r)), np.zeros((r, n + 1))
    place_of = Workspace(np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(max(m, 1)), np.zeros((max(m, 1), max(m, 1))))
    for k in range(first, last):
        level = noise_level(samples.parity[k], 1.0 + samples.model_error[k], tuning, scalars, counts[ROUGH] > 0)
        if counts[STARTED] > 0:
            step_by_alpha(samples, given, k, tables, tuning, carried, level, transition, added, noise, place_of)
            noise_of_step(samples, k, tables, tuning, carried, noise)
            if len(single.omega) > 0 and not np.isnan(single.omega[k, 0]):
                _take_over(samples, single, k, tables, tuning, x, transition, added, noise)
            if r > TILT:
                step = samples.t[k] - scalars[TIME]
                advance_path(samples, given, k, tables, tuning, carried, step, level, transition, added, noise)
            predict(x, p, transition, added, noise, work)
        counts[STARTED] = 1
        counts[LAST_SET] = samples.channel_set[k]
        scalars[TIME] = samples.t[k]
        if samples.channel_set[k] >= 0:
            scalars[LAST_ALPHA] = samples.t[k]
        put_estimate(samples, k, k, tables, tuning, carried, level, out)


@njit(**INNER)
def _take_over(samples, single, k, tables, tuning, x, transition, added, noise):  # type: ignore[no-untyped-def]
    """Fill in the transition to the rate of a single sample, whose error is that of the null space, times its gain."""
    m, at, place = samples.z.shape[1], tuning.at, samples.channel_set[k]
    for a in range(3):
        added[a] = single.omega[k, a]
        for j in range(len(x)):
            transition[a, j] = 0.0
        for i in range(m):
            for j in range(m):
                transition[a, at.products + j] -= single.gain[k, a, i] * tables.product_bias[place, i, j]
            for j in range(at.errors, at.end):
                transition[a, j] -= single.gain[k, a, i] * samples.product_errors[k, i, j - at.errors]
        for j in range(at.products, at.end):
            added[a] -= transition[a, j] * x[j]
        for b in range(3):
            noise[a, b] = single.covariance[k, a, b]
            noise[a, 3 + b] = noise[3 + b, a] = 0.0
