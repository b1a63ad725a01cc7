"""Signatures of faults from several onsets: begun, thinned out, carried to the next block, and compared; compiled.

Equation (3) is that of `gfimu.rate.health.recursion.steps`.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from gfimu.base.compiled import INNER, compiled
from gfimu.rate.health.recursion.isolation import deflate, strongest

__all__ = ["carry_signatures", "forget_onsets", "new_slot", "strongest_slot"]

_LARGEST = 1e12  # numerical: statistics of a filter that has run away


@compiled
def new_slot(state, oldest):  # type: ignore[no-untyped-def]
    """Begin an onset with this block; of too many the one goes whose neighbours are nearest, on a scale of log age.

    One that shows far more than all others is held beside them when its turn to go comes: of a large fault even the
    next block is no longer the onset.
    """
    ages = state.ages
    if state.held[0] >= 0 and state.held[0] != state.leading[0]:
        _drop_slot(state, state.held[0])
    held = state.held[0]
    used = _count_used(ages)
    if used - (1 if held >= 0 else 0) == len(ages) - 1:
        drop = 0
        least = np.inf
        for s in range(used):
            if s == held:
                continue
            older = s - 1 if s - 1 != held else s - 2
            younger = s + 1 if s + 1 != held else s + 2
            if older < 0:
                gap = 1e8 if ages[s] < oldest else -1.0
            else:
                gap = (ages[older] - (ages[younger] if younger < used else 0.0)) / (ages[s] + 1.0)
            if gap < least:
                least = gap
                drop = s
        if drop == state.leading[0]:
            state.held[0] = drop
        else:
            _drop_slot(state, drop)
            used -= 1
    rows, c = state.signature.shape[1], state.signature.shape[2]
    for i in range(c):  # number by number, as in `_move_slot`
        for r in range(rows):
            state.signature[used, r, i] = 0.0
        for j in range(c):
            state.information[used, i, j] = 0.0
        state.score[used, i] = 0.0
    ages[used] = 0.5  # half of the step before lies behind the onset; set to 1 after this block


@njit(**INNER)
def forget_onsets(state):  # type: ignore[no-untyped-def]
    """Follow no onset for now."""
    for s in range(len(state.ages)):
        state.ages[s] = 0.0
    state.leading[0] = -1
    state.held[0] = -1


@njit(**INNER)
def _count_used(ages):  # type: ignore[no-untyped-def]
    """Return how many slots are in use; they stand at the front."""
    used = 0
    for s in range(len(ages)):
        if ages[s] > 0.0:
            used += 1
    return used


@njit(**INNER)
def _drop_slot(state, drop):  # type: ignore[no-untyped-def]
    """Forget an onset; the younger ones move up."""
    used = _count_used(state.ages)
    for s in range(drop, used - 1):
        _move_slot(state, s + 1, s)
        state.ages[s] = state.ages[s + 1]
    state.ages[used - 1] = 0.0
    for mark in (state.leading, state.held):
        if mark[0] == drop:
            mark[0] = -1
        elif mark[0] > drop:
            mark[0] -= 1


@njit(**INNER)
def _move_slot(state, source, target):  # type: ignore[no-untyped-def]
    """Copy a slot, number by number: slices take longer to compile than all of this module."""
    rows, c = state.signature.shape[1], state.signature.shape[2]
    for i in range(c):
        for r in range(rows):
            state.signature[target, r, i] = state.signature[source, r, i]
        for j in range(c):
            state.information[target, i, j] = state.information[source, i, j]
        state.score[target, i] = state.score[source, i]


@njit(**INNER)
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
                moved[a, i] = step * alpha_rows[a, i]
            for j in range(3 + c):
                weight = transition[a, j]
                if weight != 0.0:
                    for i in range(c):
                        moved[a, i] += weight * g[j, i]
        for a in range(3):
            for i in range(c):
                g[a, i] = moved[a, i]
        state.ages[s] = age + 1.0


@njit(**INNER)
def strongest_slot(state, tuning, model_std, watched):  # type: ignore[no-untyped-def]
    """Return the slot in which a channel exceeds the threshold most, beyond what model errors explain; −1 if none."""
    found = -1
    best = tuning.threshold
    most = beside = 0.0
    state.leading[0] = -1
    for s in range(len(state.ages)):
        if state.ages[s] < 2.0:
            continue
        raw = strongest(state.information[s], state.score[s], watched)[1]
        if raw > most:
            most, beside = raw, most
            state.leading[0] = s
        elif raw > beside:
            beside = raw
        if not tuning.screen * tuning.threshold < raw < _LARGEST:
            continue
        information, score = deflate(state.information[s], state.score[s], model_std)
        value = strongest(information, score, watched)[1]
        state.largest[0] = max(state.largest[0], value)
        if value > best:
            best = value
            found = s
    if most < tuning.screen * tuning.threshold or most < tuning.sharp * beside:
        state.leading[0] = -1
    return found
