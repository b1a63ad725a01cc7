"""Preparation of the rate filter's samples: faulty channels found, readings turned into α and the null space."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gfimu.base.compiled import compiled
from gfimu.rate.recursion_data import RecursionInput, Tables

__all__ = ["prepare"]

_UNIFORM = 1e-6
_GAP = 1.5


@compiled
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

    Readings of missing channels become zero. ``held`` (c,) and ``run`` (c,) carry the last reading and how often it
    repeated; ``tally`` (3, c) counts samples in which a channel was missing, saturated and stuck.
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
