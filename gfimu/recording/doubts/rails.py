"""Rails of a channel by its readings alone: levels at which they pile up and that they hardly exceed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.base.difference_noise import difference_noise
from gfimu.recording.policy import SamplePolicy

__all__ = ["DataRail", "is_within_range", "rails_of"]

_POLICY = SamplePolicy()


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
    if len(levels) < _POLICY.least_levels:
        return []
    count = float(np.min(np.diff(levels)))
    noise = difference_noise(values[np.isfinite(values)])
    known = np.isfinite(values)
    edges = np.flatnonzero(np.diff(values, prepend=np.nan, append=np.nan) != 0.0)
    for number in np.flatnonzero(np.diff(edges) > _POLICY.longest_equal):
        start, stop = int(edges[number]), int(edges[number + 1])
        if is_within_range(values, start, stop, count, noise):
            known[start:stop] = False
    if not known.any():
        return []
    found = []
    for side, extreme in (("most", values[known].max()), ("least", values[known].min())):
        away = np.where(known, np.abs(values - extreme), np.inf)
        counts = np.bincount(np.rint(away[away <= 2.0 * _POLICY.rail_width * count] / count).astype(int))
        place = int(np.argmax(counts[: _POLICY.rail_width + 1]))
        pile, beyond, below = int(counts[place]), int(counts[:place].sum()), counts[place + 1 : place + 4]
        steep = pile > _POLICY.steep * int(below.max(initial=0)) + 4
        if (
            pile >= max(_POLICY.pile * known.sum(), _POLICY.least_pile)
            and beyond <= _POLICY.beyond_pile * pile
            and steep
        ):
            on = away <= (place + 1.5) * count
            found.append(DataRail(side, float(np.median(values[np.abs(away - place * count) < 0.5 * count])), on))
    return found


def is_within_range(values: NDArray[np.float64], start: int, stop: int, step: float, noise: float) -> bool:
    """Return whether the value that a channel, (n,), holds from ``start`` to ``stop`` can be no end of its range.

    Readings lie beyond it on both sides, or the channel comes or goes by a jump: a signal that clips joins its rail.
    ``step`` is one count, ``noise`` the white noise, in the unit of the values; NaN is left aside.
    """
    away = values - values[start]
    width = _POLICY.rail_width * step
    if min(np.sum(away > width), np.sum(away < -width)) > _POLICY.garbage:
        return True
    inwards = np.sign(np.nansum(np.sign(away)))  # where most readings are
    for outside in (away[max(start - _POLICY.around, 0) : start][::-1], away[stop : stop + _POLICY.around]):
        near = outside[np.isfinite(outside)]
        if len(near) < 2:
            continue
        usual = float(np.median(np.abs(np.diff(near))))
        jump = inwards * near[0]
        if jump > _POLICY.jump * max(noise, usual, step) or -jump > max(width, _POLICY.jump * max(noise, usual)):
            return True
    return False
