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
_FIRST_BLOCK = 0.25  # of one block's evidence, which an onset in the middle of the block spoils at most
_SEPARATE = 1e-3  # of a channel's information that must remain beside others, for it to count as another channel


class Margins(NamedTuple):
    """By how much an explanation must exceed its rivals (`gfimu.integrity.policy.MonitorPolicy`)."""

    isolation: float
    unexplained: float
    second: float  # that a second channel must add to a first
    relative: float
    settled: float  # blocks, from which on imperfect signatures are allowed for


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
def _share(age, margins):  # type: ignore[no-untyped-def]
    """Return the share of a statistic by which a signature is wrong at most."""
    return margins.relative + _FIRST_BLOCK / age


@njit(**COMPILE)
def _allowed(statistic, age, margins):  # type: ignore[no-untyped-def]
    """Return what may remain for a further channel beside an explanation."""
    if age < margins.settled:
        return margins.unexplained
    return max(margins.unexplained, _share(age, margins) * statistic)


@njit(**COMPILE)
def _values_of_singles(information, score, watched):  # type: ignore[no-untyped-def]
    """Return what each channel explains alone at its best onset, shape (c,), and that slot, shape (c,)."""
    slots, c = score.shape
    values = np.zeros(c)
    places = np.zeros(c, dtype=np.int64)
    for s in range(slots):
        for i in range(c):
            if watched[i] and information[s, i, i] > _VISIBLE:
                value = score[s, i] * score[s, i] / information[s, i, i]
                if value > values[i]:
                    values[i] = value
                    places[i] = s
    return values, places


@njit(**COMPILE)
def _values_of_pairs(information, score, watched):  # type: ignore[no-untyped-def]
    """Return what each pair explains at its best onset, shape (c, c), upper triangle, and that slot."""
    slots, c = score.shape
    values = np.zeros((c, c))
    places = np.zeros((c, c), dtype=np.int64)
    pair = np.zeros(2, dtype=np.int64)
    for s in range(slots):
        for a in range(c):
            if not watched[a] or information[s, a, a] <= _VISIBLE:
                continue
            for b in range(a + 1, c):
                if not watched[b] or information[s, b, b] <= _VISIBLE:
                    continue
                pair[0] = a
                pair[1] = b
                value = _explained(information[s], score[s], pair)
                if value > values[a, b]:
                    values[a, b] = value
                    places[a, b] = s
    return values, places


@njit(**COMPILE)
def _values_of_chips(information, score, watched, chips):  # type: ignore[no-untyped-def]
    """Return what the watched channels of each chip explain at their best onset, and that slot."""
    count = chips.max() + 1
    values = np.zeros(count)
    places = np.zeros(count, dtype=np.int64)
    for chip in range(count):
        members = np.flatnonzero((chips == chip) & watched)
        if len(members) < 2:
            continue
        for s in range(score.shape[0]):
            value = _explained(information[s], score[s], members)
            if value > values[chip]:
                values[chip] = value
                places[chip] = s
    return values, places


@njit(**COMPILE)
def _two_largest(values):  # type: ignore[no-untyped-def]
    """Return the place of the largest value, it, and the second largest; of an array of any shape, flattened."""
    flat = values.ravel()
    best = int(np.argmax(flat))
    second = 0.0
    for m in range(len(flat)):
        if m != best and flat[m] > second:
            second = flat[m]
    return best, flat[best], second


@njit(**COMPILE)
def isolate(information, score, ages, watched, chips, margins):  # type: ignore[no-untyped-def]
    """Find the channels to blame, each set of them at the onset that suits it best.

    Parameters
    ----------
    information : ndarray, shape (slots, c, c)
        C of each onset, with the errors of the model taken out (`deflate`).
    score : ndarray, shape (slots, c)
        d, likewise.
    ages : ndarray, shape (slots,)
        Blocks since each onset.
    watched : ndarray of bool, shape (c,)
        Channels in use.
    chips : ndarray of int, shape (c,)
        Chip of each channel.
    margins : Margins
        What an explanation must bring.

    Returns
    -------
    tuple of (ndarray of int, bool, float, int)
        Channels to blame, whether that is beyond doubt, what they explain, and the slot of their onset. In doubt they
        are the channels of all sets of that size within the margin; none if no set of one, two, or a chip explains the
        innovations.
    """
    c = len(watched)
    singles, single_slots = _values_of_singles(information, score, watched)
    one, first, second = _two_largest(singles)
    single = np.array([one])
    place = single_slots[one]
    share = _share(ages[place], margins)
    if _beside(information[place], score[place], single, watched) < _allowed(first, ages[place], margins):
        needed = max(margins.isolation, share * first)
        if first - second > needed:
            return single, True, first, place
        return np.flatnonzero(singles >= first - needed), False, first, place
    pairs, pair_slots = _values_of_pairs(information, score, watched)
    best, two, next_two = _two_largest(pairs)
    values, chip_slots = _values_of_chips(information, score, watched, chips)
    chip, three, next_three = _two_largest(values)
    share = _share(ages[chip_slots[chip]], margins)
    if three - two > max(margins.unexplained, share * three):
        members = np.flatnonzero((chips == chip) & watched)
        place = chip_slots[chip]
        rest = _beside(information[place], score[place], members, watched)
        alone = three - next_three > max(margins.isolation, share * three)
        return members if rest < _allowed(three, ages[place], margins) else single[:0], alone, three, place
    pair = np.array([best // c, best % c])
    place = pair_slots[pair[0], pair[1]]
    share = _share(ages[place], margins)
    more = max(margins.second, share * two)
    rest = _beside(information[place], score[place], pair, watched)
    if two - first < more or rest > _allowed(two, ages[place], margins) or three - two > margins.isolation:
        return single[:0], False, two, place
    needed = max(margins.isolation, share * two)
    by_chip = chips == chip
    covered = by_chip[pair[0]] and by_chip[pair[1]]
    if two - next_two > needed and (covered or two - three > needed):
        return pair, True, two, place
    rivals = by_chip & watched & (not covered and two - three <= needed)
    for a in range(c):
        for b in range(a + 1, c):
            if pairs[a, b] >= two - needed and pairs[a, b] > 0.0:
                rivals[a] = True
                rivals[b] = True
    return np.flatnonzero(rivals), False, two, place
