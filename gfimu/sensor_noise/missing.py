"""Missing and wrong values of a series at rest: left out, and filled without fast noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.base.errors import InputError

__all__ = ["filled", "without_isolated"]

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class _Policy:
    """What a wrong value is, and how many may be missing."""

    neighbours: int = 3  # samples on either side that a value is compared with
    ratio: float = 15.0  # of the distance from their median over their median deviation; 10 σ of normal noise
    most_missing: float = 0.05  # share of the series: the noise is known to a few percent all the same


_POLICY = _Policy()


def without_isolated(values: Floats) -> Floats:
    """Return a series with NaN for values far from all their neighbours, which agree with one another, shape (n,).

    Such values are wrong reads: zeros, doubles, flipped bits. A motion spreads the neighbours too.
    """
    reach = _POLICY.neighbours
    padded = np.pad(values, reach, constant_values=np.nan)
    before, after = padded[reach - 1 : -reach - 1], padded[reach + 1 : len(padded) - reach + 1]
    between = 0.5 * (np.where(np.isnan(before), after, before) + np.where(np.isnan(after), before, after))
    jump, steps = np.abs(values - between), np.abs(np.diff(values))
    if not np.any(steps > 0.0):
        return values
    floor = max(float(np.nanmedian(jump)), float(np.min(steps[steps > 0.0])))  # noise, or the resolution
    places = np.flatnonzero(jump > 0.5 * _POLICY.ratio * floor)
    offsets = [offset for offset in range(2 * reach + 1) if offset != reach]
    around = padded[places[:, None] + offsets]  # (p, 6)
    centre = np.nanmedian(around, axis=1)
    spread = np.maximum(np.nanmedian(np.abs(around - centre[:, None]), axis=1), floor)
    result = values.copy()
    result[places[np.abs(values[places] - centre) > _POLICY.ratio * spread]] = np.nan
    return result


def filled(values: Floats) -> tuple[Floats, float]:
    """Fill missing and isolated wrong values with the mean of their surroundings.

    Returns
    -------
    filled : ndarray, shape (n,)
    present : float
        Share of the values that were kept: the fast noise of the filled series has that share of its variance.

    Raises
    ------
    InputError
        If too many are missing.
    """
    series = without_isolated(values)
    present = np.isfinite(series)
    share = float(present.mean())
    if share < 1.0 - _POLICY.most_missing:
        raise InputError(f"{1.0 - share:.0%} of its samples are missing in the stretch used; choose another run")
    if share < 1.0:
        window = np.ones(4 * _POLICY.neighbours + 1)
        count = np.convolve(present, window, mode="same")
        mean = np.convolve(np.where(present, series, 0.0), window, mode="same") / np.maximum(count, 1.0)
        covered = count > 0.0
        series = np.where(present, series, np.interp(np.arange(len(series)), np.flatnonzero(covered), mean[covered]))
    return series, share
