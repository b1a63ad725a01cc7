"""Which channels explain the innovations: one, two, or a whole chip, each against its rivals.

All functions work on the information C (c, c) and the score d (c,) of faults on every channel from one onset. A set S
explains T_S = d_Sᵀ C_SS⁻¹ d_S. A fault is isolated if its set exceeds the next one of its kind by a margin and no
further channel is needed beside it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gfimu.rate.recursion_data import COMPILE

__all__ = ["Margins", "Verdict", "deflate", "isolate", "strongest"]

_VISIBLE = 1e-9  # numerical: information below this is none
_SEPARATE = 1e-3  # of a channel's information that must remain beside others, for it to count as another channel


class Margins(NamedTuple):
    """By how much an explanation must exceed its rivals (`gfimu.integrity.policy.MonitorPolicy`)."""

    isolation: float
    unexplained: float
    relative: float
    second: float  # that a second channel must add to a first


class Verdict(NamedTuple):
    """Channels that explain a fault.

    ``channels`` are those to blame; with ``isolated`` false they are all of the sets that can't be separated.
    """

    channels: NDArray[np.int64]
    isolated: bool
    statistic: float


@njit(**COMPILE)
def deflate(information, score, std):  # type: ignore[no-untyped-def]
    """Take out of C and d what constant errors of all channels, with these standard deviations, may explain."""
    c = len(score)
    left = np.eye(c)
    right = np.empty((c, c + 1))
    for i in range(c):
        for j in range(c):
            left[i, j] += information[i, j] * std[j] * std[j]
            right[i, j] = information[i, j]
        right[i, c] = score[i]
    solved = np.linalg.solve(left, right)
    return solved[:, :c].copy(), solved[:, c].copy()


@njit(**COMPILE)
def strongest(information, score, watched):  # type: ignore[no-untyped-def]
    """Return the channel that explains most alone, how much, and how much the next one does."""
    best = -1
    first = 0.0
    second = 0.0
    for i in range(len(score)):
        if not watched[i] or information[i, i] <= _VISIBLE:
            continue
        value = score[i] * score[i] / information[i, i]
        if value > first:
            second = first
            first = value
            best = i
        elif value > second:
            second = value
    return best, first, second


@njit(**COMPILE)
def _explained(information, score, members):  # type: ignore[no-untyped-def]
    """Return T_S of a set; 0 where its channels can't be separated."""
    size = len(members)
    if size == 2:
        a = members[0]
        b = members[1]
        product = information[a, a] * information[b, b]
        rest = product - information[a, b] * information[a, b]
        if not rest > _SEPARATE * product:
            return 0.0
        return (
            score[a] * score[a] * information[b, b]
            - 2.0 * score[a] * score[b] * information[a, b]
            + score[b] * score[b] * information[a, a]
        ) / rest
    block = np.empty((size, size))
    part = np.empty(size)
    for m in range(size):
        part[m] = score[members[m]]
        for q in range(size):
            block[m, q] = information[members[m], members[q]]
        block[m, m] += _VISIBLE
    return float(part @ np.linalg.solve(block, part))


@njit(**COMPILE)
def _beside(information, score, members, watched):  # type: ignore[no-untyped-def]
    """Return the most that one further channel explains beside a set."""
    size = len(members)
    c = len(score)
    block = np.empty((size, size))
    right = np.empty((size, c + 1))
    for m in range(size):
        for q in range(size):
            block[m, q] = information[members[m], members[q]]
        block[m, m] += _VISIBLE
        for i in range(c):
            right[m, i] = information[members[m], i]
        right[m, c] = score[members[m]]
    solved = np.linalg.solve(block, right)
    most = 0.0
    for i in range(c):
        if not watched[i] or information[i, i] <= _VISIBLE:
            continue
        own = information[i, i]
        rest = score[i]
        for m in range(size):
            own -= information[i, members[m]] * solved[m, i]
            rest -= information[i, members[m]] * solved[m, c]
        if own > _SEPARATE * information[i, i]:
            most = max(most, rest * rest / own)
    return most


@njit(**COMPILE)
def _best_pairs(information, score, watched):  # type: ignore[no-untyped-def]
    """Return the two pairs that explain most, shape (2, 2), and how much, shape (2,)."""
    c = len(score)
    pairs = np.full((2, 2), -1)
    values = np.zeros(2)
    pair = np.zeros(2, dtype=np.int64)
    for a in range(c):
        if not watched[a] or information[a, a] <= _VISIBLE:
            continue
        for b in range(a + 1, c):
            if not watched[b] or information[b, b] <= _VISIBLE:
                continue
            pair[0] = a
            pair[1] = b
            value = _explained(information, score, pair)
            if value > values[0]:
                values[1] = values[0]
                pairs[1] = pairs[0]
                values[0] = value
                pairs[0] = pair
            elif value > values[1]:
                values[1] = value
                pairs[1] = pair
    return pairs, values


@njit(**COMPILE)
def _best_chips(information, score, watched, chips):  # type: ignore[no-untyped-def]
    """Return the chip whose watched channels explain most, how much, and how much the next chip's do."""
    best = -1
    first = 0.0
    second = 0.0
    for chip in range(chips.max() + 1):
        members = np.flatnonzero((chips == chip) & watched)
        if len(members) < 2:
            continue
        value = _explained(information, score, members)
        if value > first:
            second = first
            first = value
            best = chip
        elif value > second:
            second = value
    return best, first, second


@njit(**COMPILE)
def isolate(information, score, watched, chips, margins):  # type: ignore[no-untyped-def]
    """Find the channels to blame.

    Parameters
    ----------
    information : ndarray, shape (c, c)
        C, with the errors of the model taken out (`deflate`).
    score : ndarray, shape (c,)
        d, likewise.
    watched : ndarray of bool, shape (c,)
        Channels in use.
    chips : ndarray of int, shape (c,)
        Chip of each channel.
    margins : Margins
        What an explanation must bring.

    Returns
    -------
    tuple of (ndarray of int, bool, float)
        Channels to blame, whether that is beyond doubt, and what they explain. In doubt they are the channels of all
        sets of that size within the margin; none if no set of one, two, or a chip explains the innovations.
    """
    share = margins.relative
    one, first, second = strongest(information, score, watched)
    single = np.array([one])
    if _beside(information, score, single, watched) < max(margins.unexplained, share * first):
        needed = max(margins.isolation, share * first)
        if first - second > needed:
            return single, True, first
        rivals = np.zeros(len(score), dtype=np.bool_)
        for i in range(len(score)):
            if watched[i] and information[i, i] > _VISIBLE:
                rivals[i] = first - score[i] * score[i] / information[i, i] <= needed
        return np.flatnonzero(rivals), False, first
    pairs, values = _best_pairs(information, score, watched)
    chip, chip_first, chip_second = _best_chips(information, score, watched, chips)
    if chip >= 0 and chip_first - values[0] > max(margins.unexplained, share * chip_first):
        members = np.flatnonzero((chips == chip) & watched)
        alone = chip_first - chip_second > max(margins.isolation, share * chip_first)
        rest = _beside(information, score, members, watched)
        if alone and rest < max(margins.unexplained, share * chip_first):
            return members, True, chip_first
    pair = pairs[0].copy()
    if pair[0] < 0 or values[0] - first < max(margins.second, share * values[0]):
        return single[:0], False, first
    if _beside(information, score, pair, watched) > max(margins.unexplained, share * values[0]):
        return single[:0], False, values[0]
    if values[0] - values[1] > max(margins.isolation, share * values[0]):
        return pair, True, values[0]
    both = np.zeros(len(score), dtype=np.bool_)
    for m in range(2):
        both[pairs[0, m]] = True
        both[pairs[1, m]] = True
    return np.flatnonzero(both), False, values[0]
