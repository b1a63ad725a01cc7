"""Which channels may explain the innovations: one, two, or a whole chip, each at the onset that suits it best.

All functions work on the information C (c, c) and the score d (c,) of faults on every channel from one onset. A set S
explains T_S = d_Sᵀ C_SS⁻¹ d_S of the sum of squared innovations.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gfimu.base.compiled import INNER, compiled

__all__ = ["Explanation", "deflate", "explanations", "strongest"]

_VISIBLE = 1e-9  # numerical: information below this is none
_SEPARATE = 1e-3  # of a channel's information that must remain beside others, for it to count as another channel


class Explanation(NamedTuple):
    """A set of channels that may be at fault, at the onset that suits it best."""

    channels: NDArray[np.int64]
    statistic: float
    slot: int


@compiled
def deflate(information, score, std):  # type: ignore[no-untyped-def]
    """Take out of C and d what constant errors of all channels, with these standard deviations m, may explain.

    (1 + C M²)⁻¹ [C, d], written as M⁻¹ (1 + M C M)⁻¹ M [C, d], whose matrix is positive definite.
    """
    c = len(score)
    left = np.eye(c)
    right = np.empty((c, c + 1))
    for i in range(c):
        for j in range(c):
            left[i, j] += std[i] * information[i, j] * std[j]
            right[i, j] = std[i] * information[i, j]
        right[i, c] = std[i] * score[i]
    _solve(left, right)
    cleaned = np.empty((c, c))
    explained = np.empty(c)
    for i in range(c):
        for j in range(c):
            cleaned[i, j] = right[i, j] / std[i]
        explained[i] = right[i, c] / std[i]
    return cleaned, explained


@njit(**INNER)
def _solve(matrix, columns):  # type: ignore[no-untyped-def]
    """Put P⁻¹ B in the place of ``columns`` B, P = L Lᵀ positive definite, whose lower triangle becomes L.

    As with NumPy's, a matrix that has no such L is a `LinAlgError`.

    Loops, as the compiler takes far longer over calls of a linear algebra library.
    """
    n, width = columns.shape
    for i in range(n):
        for j in range(i + 1):
            entry = matrix[i, j]
            for q in range(j):
                entry -= matrix[i, q] * matrix[j, q]
            if i > j:
                matrix[i, j] = entry / matrix[j, j]
            elif 0.0 < entry < np.inf:
                matrix[i, i] = np.sqrt(entry)
            else:  # not a number
                raise np.linalg.LinAlgError("not positive definite")
        for q in range(i):
            for m in range(width):
                columns[i, m] -= matrix[i, q] * columns[q, m]
        for m in range(width):
            columns[i, m] /= matrix[i, i]
    for i in range(n - 1, -1, -1):
        for q in range(i + 1, n):
            for m in range(width):
                columns[i, m] -= matrix[q, i] * columns[q, m]
        for m in range(width):
            columns[i, m] /= matrix[i, i]


@compiled
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


@njit(**INNER)
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


@compiled
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


@compiled
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


@compiled
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


def explanations(
    information: NDArray[np.float64],
    score: NDArray[np.float64],
    watched: NDArray[np.bool_],
    chips: NDArray[np.int64],
    most: int,
) -> tuple[list[Explanation], list[Explanation], list[Explanation]]:
    """Return the channels, the pairs and the chips that explain most, each list from the largest on.

    Parameters
    ----------
    information : ndarray, shape (slots, c, c)
        C of each onset, with the errors of the model taken out (`deflate`).
    score : ndarray, shape (slots, c)
        d, likewise.
    watched : ndarray of bool, shape (c,)
        Channels in use.
    chips : ndarray of int, shape (c,)
        Chip of each channel.
    most : int
        Length of each list, at most.
    """
    singles, slots = _values_of_singles(information, score, watched)
    one = [Explanation(np.array([i]), float(singles[i]), int(slots[i])) for i in np.argsort(-singles)[:most]]
    pairs, slots = _values_of_pairs(information, score, watched)
    two = []
    for place in np.argsort(-pairs, axis=None)[:most]:
        a, b = divmod(int(place), len(watched))
        two.append(Explanation(np.array([a, b]), float(pairs[a, b]), int(slots[a, b])))
    values, slots = _values_of_chips(information, score, watched, chips)
    whole = [
        Explanation(np.flatnonzero((chips == chip) & watched), float(values[chip]), int(slots[chip]))
        for chip in np.argsort(-values)[:most]
    ]
    return _positive(one), _positive(two), _positive(whole)


def _positive(entries: list[Explanation]) -> list[Explanation]:
    return [entry for entry in entries if entry.statistic > 0.0]
