"""Signatures of faults from several onsets: begun, thinned out, carried to the next block, and compared; compiled.

Equation (3) is that of `gfimu.integrity.recursion.steps`.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from gfimu.integrity.recursion.isolation import deflate, strongest
from gfimu.rate.recursion_data import COMPILE

__all__ = ["carry_signatures", "new_slot", "strongest_slot"]

_LARGEST = 1e12  # numerical: statistics of a filter that has run away


@njit(**COMPILE)
def new_slot(state, oldest):  # type: ignore[no-untyped-def]
    """Begin an onset with this block; of too many the one goes whose neighbours are nearest, on a scale of log age."""
    ages = state.ages
    used = 0
    for s in range(len(ages)):
        if ages[s] > 0.0:
            used += 1
    if used == len(ages):
        drop = 0
        least = np.inf
        for s in range(used):
            if s == 0:
                gap = 1e8 if ages[0] < oldest else -1.0
            else:
                younger = ages[s + 1] if s < used - 1 else 0.0
                gap = (ages[s - 1] - younger) / (ages[s] + 1.0)
            if gap < least:
                least = gap
                drop = s
        for s in range(drop, used - 1):
            _move_slot(state, s + 1, s)
            ages[s] = ages[s + 1]
        used -= 1
    state.signature[used] = 0.0
    state.information[used] = 0.0
    state.score[used] = 0.0
    ages[used] = 0.5  # half of the step before lies behind the onset; set to 1 after this block


@njit(**COMPILE)
def _move_slot(state, source, target):  # type: ignore[no-untyped-def]
    """Copy a slot, number by number: slices take longer to compile than all of this module."""
    rows, c = state.signature.shape[1], state.signature.shape[2]
    for i in range(c):
        for r in range(rows):
            state.signature[target, r, i] = state.signature[source, r, i]
        for j in range(c):
            state.information[target, i, j] = state.information[source, i, j]
        state.score[target, i] = state.score[source, i]


@njit(**COMPILE)
def carry_signatures(tables, state, transition, step, place):  # type: ignore[no-untyped-def]
    """Carry the effect of every fault on the state over to this block, (3)."""
    alpha_rows = tables.alpha[place]
    c = alpha_rows.shape[1]
    moved = np.zeros((3, c))
    for s in range(len(state.ages)):
        age = state.ages[s]
        if age == 0.0:
            continue
        g = state.signature[s]
        if age == 0.5:
            for a in range(3):
                for i in range(c):
                    g[a, i] = 0.5 * step * alpha_rows[a, i]
            state.ages[s] = 1.0
            continue
        for a in range(3):
            for i in range(c):
                moved[a, i] = g[a, i] + step * alpha_rows[a, i]
            for j in range(c):
                weight = step * alpha_rows[a, j]
                if weight != 0.0:
                    for i in range(c):
                        moved[a, i] -= weight * g[3 + j, i]
            for b in range(3):
                weight = transition[a, b]
                if weight != 0.0:
                    for i in range(c):
                        moved[a, i] += weight * g[b, i]
        for a in range(3):
            for i in range(c):
                g[a, i] = moved[a, i]
        state.ages[s] = age + 1.0


@njit(**COMPILE)
def strongest_slot(state, tuning, model_std, watched):  # type: ignore[no-untyped-def]
    """Return the slot in which a channel exceeds the threshold most, beyond what model errors explain; −1 if none."""
    found = -1
    best = tuning.threshold
    for s in range(len(state.ages)):
        if state.ages[s] < 2.0:
            continue
        raw = strongest(state.information[s], state.score[s], watched)[1]
        if not tuning.screen * tuning.threshold < raw < _LARGEST:
            continue
        information, score = deflate(state.information[s], state.score[s], model_std)
        value = strongest(information, score, watched)[1]
        state.largest[0] = max(state.largest[0], value)
        if value > best:
            best = value
            found = s
    return found
