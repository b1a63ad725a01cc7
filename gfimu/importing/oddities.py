"""What is odd about the accelerations of an unknown file: corrupt or missing values, rails, dead and noisy channels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["DataRail", "oddities", "rails_of", "sentinels_of"]

_NOISY = 3.0  # times the median noise of the channels of its kind
_PILE = 0.002  # of the samples, at an extreme, from which it is a rail
_LEAST_PILE = 8  # samples
_PILE_WIDTH = 12.0  # counts: an ADC that overshoots piles up beside the rail, too
_AT_ONE = 0.75  # of the samples near an extreme, that are at one count on a rail
_LEAST_VALUES = 50  # of a channel that moves
_CORRUPT = 1e6  # times the median size
_SENTINELS = (
    99.0,
    999.0,
    9999.0,
    99999.0,
    999999.0,
    32767.0,
    32768.0,
    8388607.0,
    8388608.0,
    2147483647.0,
    2147483648.0,
)
_APART = 3.0  # spans of the other values, by which a number that stands for a missing one lies beyond them


def oddities(columns: dict[str, NDArray[np.float64]]) -> list[str]:
    """Return what is odd about accelerations: corrupt or missing values, rails, constant and noisy channels."""
    found, noise = [], {}
    for name, values in columns.items():
        known = values[np.isfinite(values)]
        if len(known) < _LEAST_PILE:
            found.append(f"{name} has no readings")
            continue
        size = float(np.median(np.abs(known))) or 1.0
        corrupt = np.abs(known) > _CORRUPT * size
        if corrupt.any():
            found.append(f"{name}: {int(corrupt.sum())} values that can be no reading, up to {np.abs(known).max():.3g}")
            known = known[~corrupt]
        if len(known) < len(values) - int(corrupt.sum()):
            found.append(f"{name}: {len(values) - len(known) - int(corrupt.sum())} of {len(values)} cells are empty")
        if known.min() == known.max():
            found.append(f"{name} reads {known[0]:g} throughout")
            continue
        found += _rails(name, known)
        noise[name] = float(np.median(np.abs(np.diff(known, 2)))) / (0.6745 * 6.0**0.5)
    usual = float(np.median(list(noise.values()))) if noise else 0.0
    for name, level in noise.items():
        if usual > 0.0 and level > _NOISY * usual:
            found.append(
                f"{name} is noisy: {level:.3g} per sample, {level / usual:.2g} times the median of the channels"
            )
    return found


def _rails(name: str, known: NDArray[np.float64]) -> list[str]:
    return [
        f"{name}: {int(one.on.sum())} samples at its rail, {one.side} {one.level:g} (clipped)"
        for one in rails_of(known)
    ]


@dataclass(frozen=True)
class DataRail:
    """A level beyond which a channel does not read, by its readings alone.

    Parameters
    ----------
    side : str
        ``most`` or ``least``.
    level : float
        Where the readings pile up.
    on : ndarray of bool, shape (n,)
        Readings that are on it.
    """

    side: str
    level: float
    on: NDArray[np.bool_]


def rails_of(values: NDArray[np.float64]) -> list[DataRail]:
    """Return the rails of a channel, (n,): values that pile up within a few counts of an extreme; NaN is left aside."""
    known = np.isfinite(values)
    levels = np.unique(values[known])
    if len(levels) < _LEAST_VALUES:
        return []
    count = float(np.min(np.diff(levels)))
    found = []
    for side, extreme in (("most", levels[-1]), ("least", levels[0])):
        away = np.where(known, np.abs(values - extreme), np.inf)
        near = away <= _PILE_WIDTH * count
        edge, counts = np.unique(values[near], return_counts=True)
        pile = float(edge[int(np.argmax(counts))])
        others = int(np.sum(away <= 3.0 * _PILE_WIDTH * count) - near.sum())
        piled = int(np.sum(np.abs(values[near] - pile) <= count))
        # Noise spreads a level that is held over several counts; a rail holds all but a few at one.
        at_one = float(counts.max()) / int(near.sum())
        if piled >= max(_PILE * known.sum(), _LEAST_PILE) and piled > 3 * max(others, 1) and at_one > _AT_ONE:
            beyond = values >= pile - count if side == "most" else values <= pile + count
            found.append(DataRail(side, pile, near & beyond))
    return found


def sentinels_of(values: NDArray[np.float64]) -> tuple[float, ...]:
    """Return numbers of a channel, (n,), that stand for a missing value: -9999 and the like, far from all others."""
    found: list[float] = []
    levels = np.unique(values[np.isfinite(values)])
    for _ in range(2):
        if len(levels) < _LEAST_VALUES:
            break
        for extreme, rest in ((levels[0], levels[1:]), (levels[-1], levels[:-1])):
            away = float(min(abs(extreme - rest[0]), abs(extreme - rest[-1])))
            if abs(float(extreme)) in _SENTINELS and away > _APART * max(float(np.ptp(rest)), 1e-9):
                found.append(float(extreme))
                levels = rest
                break
    return tuple(found)
