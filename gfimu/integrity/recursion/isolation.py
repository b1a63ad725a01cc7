"""Which channels may explain the innovations: one, two, or a whole chip, each at the onset that suits it best.

All functions work on the information C (slots, c, c) and the score d (slots, c) of faults on every channel, slot by
slot from one onset. A set S
explains T_S = d_Sᵀ C_SS⁻¹ d_S of the sum of squared innovations.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["Explanation", "deflate", "explanations", "strongest"]

_VISIBLE = 1e-9  # numerical: information below this is none
_SEPARATE = 1e-3  # of a channel's information that must remain beside others, for it to count as another channel


class Explanation(NamedTuple):
    """A set of channels that may be at fault, at the onset that suits it best."""

    channels: NDArray[np.int64]
    statistic: float
    slot: int


def deflate(
    information: NDArray[np.float64], score: NDArray[np.float64], std: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Take out of C and d what constant errors of all channels, with these standard deviations m (c,), may explain.

    (1 + C M²)⁻¹ [C, d], written as M⁻¹ (1 + M C M)⁻¹ M [C, d], whose matrix is positive definite.
    """
    c = len(std)
    both = std[:, None] * np.concatenate([information, score[..., None]], axis=-1)  # (slots, c, c + 1)
    solved = np.linalg.solve(np.eye(c) + both[..., :c] * std, both) / std[:, None]
    return solved[..., :c], solved[..., c]


def strongest(
    information: NDArray[np.float64], score: NDArray[np.float64], watched: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return how much the channel explains that explains most alone, shape (slots,)."""
    return np.asarray(_singles(information, score, watched).max(axis=-1))


def _singles(
    information: NDArray[np.float64], score: NDArray[np.float64], watched: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return what each channel explains alone, shape (slots, c)."""
    own = np.diagonal(information, axis1=-2, axis2=-1)
    return np.where(watched & (own > _VISIBLE), score**2 / np.maximum(own, _VISIBLE), 0.0)


def _pairs(
    information: NDArray[np.float64], score: NDArray[np.float64], watched: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return what each pair explains, shape (slots, c, c), upper triangle; 0 where two channels can't be separated."""
    own = np.diagonal(information, axis1=-2, axis2=-1)
    usable = watched & (own > _VISIBLE)
    product = own[:, :, None] * own[:, None, :]
    rest = product - information**2
    separate = np.triu(usable[:, :, None] & usable[:, None, :] & (rest > _SEPARATE * product), 1)
    alone = score[:, :, None] ** 2 * own[:, None, :]
    cross = score[:, :, None] * score[:, None, :] * information
    total = alone - 2.0 * cross + alone.transpose(0, 2, 1)
    return np.where(separate, total / np.where(separate, rest, 1.0), 0.0)


def _chips(
    information: NDArray[np.float64], score: NDArray[np.float64], watched: NDArray[np.bool_], chips: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Return what the watched channels of each chip explain, shape (slots, chips); 0 for fewer than two of them."""
    values = np.zeros((len(score), chips.max() + 1))
    for chip in range(values.shape[1]):
        members = np.flatnonzero((chips == chip) & watched)
        part = score[:, members]
        if len(members) == 2:
            values[:, chip] = _pairs(information, score, watched)[:, members[0], members[1]]
        elif len(members) > 2:
            block = information[:, members[:, None], members] + _VISIBLE * np.eye(len(members))
            values[:, chip] = np.sum(part * np.linalg.solve(block, part[..., None])[..., 0], axis=1)
    return values


def _at_best(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return the largest of each column of (slots, m), and its slot."""
    places = np.argmax(values, axis=0)
    return values[places, np.arange(values.shape[1])], places


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
    singles, slots = _at_best(_singles(information, score, watched))
    one = [Explanation(np.array([i]), float(singles[i]), int(slots[i])) for i in np.argsort(-singles)[:most]]
    pairs, slots = _at_best(_pairs(information, score, watched).reshape(len(score), -1))
    two = [
        Explanation(np.array(divmod(int(place), len(watched))), float(pairs[place]), int(slots[place]))
        for place in np.argsort(-pairs)[:most]
    ]
    values, slots = _at_best(_chips(information, score, watched, chips))
    whole = [
        Explanation(np.flatnonzero((chips == chip) & watched), float(values[chip]), int(slots[chip]))
        for chip in np.argsort(-values)[:most]
    ]
    return _positive(one), _positive(two), _positive(whole)


def _positive(entries: list[Explanation]) -> list[Explanation]:
    return [entry for entry in entries if entry.statistic > 0.0]
