"""What is odd about the accelerations of an unknown file: corrupt or missing values, rails, dead and noisy channels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "BEYOND_PILE",
    "GARBAGE",
    "LONGEST_EQUAL",
    "RAIL_WIDTH",
    "is_within_range",
    "oddities",
    "rails_of",
    "sentinels_of",
]

RAIL_WIDTH = 12
"""Counts beyond a rail in which single readings may lie: ten were seen on a real one."""
BEYOND_PILE = 0.1
"""Readings beyond a rail, of those on it: one in forty on a real one."""
GARBAGE = 5
"""Samples that may read anything."""
LONGEST_EQUAL = 40
"""Equal readings in a row that say nothing yet."""

_NOISY = 3.0  # times the median noise of the channels of its kind
_PILE = 0.002  # of the samples, at an extreme, from which it is a rail
_LEAST_PILE = 8  # samples
_STEEP = 3.0  # times the counts just below it
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
_AROUND = 6  # readings before and after a value that is held
_JUMP = 6.0  # times the noise, or what neighbours usually differ: no signal joins its rail so
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
    """Return the rails of a channel, (n,): values that pile up within a few counts of an extreme; NaN is left aside.

    A value that the channel held though it is within its range is none (`is_within_range`).
    """
    levels = np.unique(values[np.isfinite(values)])
    if len(levels) < _LEAST_VALUES:
        return []
    count = float(np.min(np.diff(levels)))
    noise = float(np.nanmedian(np.abs(np.diff(values, 2)))) / (0.6745 * 6.0**0.5)
    known = np.isfinite(values)
    edges = np.flatnonzero(np.diff(values, prepend=np.nan, append=np.nan) != 0.0)
    for number in np.flatnonzero(np.diff(edges) > LONGEST_EQUAL):
        start, stop = int(edges[number]), int(edges[number + 1])
        if is_within_range(values, start, stop, count, noise):
            known[start:stop] = False
    if not known.any():
        return []
    found = []
    for side, extreme in (("most", values[known].max()), ("least", values[known].min())):
        away = np.where(known, np.abs(values - extreme), np.inf)
        counts = np.bincount(np.rint(away[away <= 2.0 * RAIL_WIDTH * count] / count).astype(int))
        place = int(np.argmax(counts[: RAIL_WIDTH + 1]))
        pile, beyond, below = int(counts[place]), int(counts[:place].sum()), counts[place + 1 : place + 4]
        steep = pile > _STEEP * int(below.max(initial=0)) + 4
        if pile >= max(_PILE * known.sum(), _LEAST_PILE) and beyond <= BEYOND_PILE * pile and steep:
            on = away <= (place + 1.5) * count
            found.append(DataRail(side, float(np.median(values[np.abs(away - place * count) < 0.5 * count])), on))
    return found


def is_within_range(values: NDArray[np.float64], start: int, stop: int, step: float, noise: float) -> bool:
    """Return whether the value that a channel, (n,), holds from ``start`` to ``stop`` can be no end of its range.

    Readings lie beyond it on both sides, or the channel comes or goes by a jump: a signal that clips joins its rail.
    ``step`` is one count, ``noise`` the white noise, in the unit of the values; NaN is left aside.
    """
    away = values - values[start]
    width = RAIL_WIDTH * step
    if min(np.sum(away > width), np.sum(away < -width)) > GARBAGE:
        return True
    inwards = np.sign(np.nansum(np.sign(away)))  # where most readings are
    for outside in (away[max(start - _AROUND, 0) : start][::-1], away[stop : stop + _AROUND]):
        near = outside[np.isfinite(outside)]
        if len(near) < 2:
            continue
        usual = float(np.median(np.abs(np.diff(near))))
        jump = inwards * near[0]
        if jump > _JUMP * max(noise, usual, step) or -jump > max(width, _JUMP * max(noise, usual)):
            return True
    return False


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
