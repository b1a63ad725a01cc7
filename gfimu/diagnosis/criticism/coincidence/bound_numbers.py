"""Whether the free numbers of causes lie on a pattern: the same normal equations under another prior.

Free numbers have z ~ N(0, k² I). On a pattern P (m, r) of unit rms they have

    z ~ N(0, k² (P Pᵀ + ε² I)) = N(0, k² U Uᵀ),  U = [P, ε I],

so that their evidence is that of UᵀGU and Uᵀb, averaged over scales k and scatters ε. The scatter matters: what is
large is on its pattern to first order only. Two causes with the same numbers, one λ times the other, have
U = [[I, 0], [λI, ε|λ|I]]. The numbers of each cause are taken in units of their own rms: one scale suits all then, and
a cause that is large does not make the numbers of another look bound.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.diagnosis.criticism.coincidence.patterns import (
    NOTHING,
    SPARE,
    Pattern,
    channel_patterns,
    chip_patterns,
    distinct,
    pair_patterns,
)
from gfimu.diagnosis.fit.evidence import SCALES, inverse, log_evidence
from gfimu.diagnosis.fit.gauss_newton import Fit
from gfimu.diagnosis.terms.cause import Cause
from gfimu.model.world_model import Size

__all__ = ["Coincidence", "coincidences"]

_SCATTERS = (0.003, 0.01, 0.03, 0.1)  # numerical: ε, nodes of an average over it


@dataclass(frozen=True)
class Coincidence:
    """Free numbers that lie on a pattern.

    Parameters
    ----------
    log_odds : float
        Of the pattern against free numbers, the number of patterns that were tried included, nats.
    causes : tuple of str
        The effects whose numbers they are.
    pattern : str
        What they are in proportion to.
    numbers, free : int
        How many numbers, and how many free ones the pattern has.
    common : bool
        Whether one thing before all chips makes it; else one thing in each chip does.
    """

    log_odds: float
    causes: tuple[str, ...]
    pattern: str
    numbers: int
    free: int
    common: bool = True

    @property
    def sentence(self) -> str:
        """What it says, for people."""
        names = " and ".join(self.causes)
        one = "one cause common to all chips, before them," if self.common else "one cause in each chip"
        return (
            f"the {self.numbers} numbers of {names} are no chance: they go as {self.pattern}; "
            f"{one} is more likely than so many"
        )


def coincidences(fit: Fit, array: AccelerometerArray, mounting: NDArray[np.float64]) -> list[Coincidence]:
    """Test the numbers of every cause, and of every two, against all patterns; the most likely first.

    Parameters
    ----------
    fit : Fit
        Causes and their normal equations, the drive integrated out.
    array : AccelerometerArray
        The array.
    mounting : ndarray, shape (3, 3)
        Rotation matrix from the body to the table.
    """
    ends = np.cumsum([0, *(len(cause.coordinates) for cause in fit.causes)])
    at = [slice(int(start), int(stop)) for start, stop in pairwise(ends)]
    if not fit.causes:
        return []
    unit = np.concatenate([np.full(len(one.coordinates), _rms(one)) for one in fit.causes])
    fit = replace(fit, gram=fit.gram * np.outer(unit, unit), score=fit.score * unit)
    free = log_evidence(fit.gram, fit.score)
    placed = list(zip(fit.causes, at, strict=True))
    single = [_on_a_pattern(fit, cause, mine, array, mounting, free) for cause, mine in placed]
    found = [one for one in single if one is not None]
    for one, other in combinations(placed, 2):
        if _are_of_a_kind(one[0], other[0]):
            found.append(_bound(fit, one, other, array, free))
    return sorted(found, key=lambda each: each.log_odds, reverse=True)


def _on_a_pattern(
    fit: Fit,
    cause: Cause,
    mine: slice,
    array: AccelerometerArray,
    mounting: NDArray[np.float64],
    free: float,
) -> Coincidence | None:
    """Return the most likely pattern of the numbers of one cause; None where there is none to try."""
    count = len(cause.coordinates)
    tried: list[tuple[float, Pattern]] = []
    for pattern in _patterns(cause, array, mounting):
        columns = _in_coordinates(cause, pattern)
        if columns is None:
            continue
        total, width = len(fit.score), columns.shape[1]
        values = []
        for scatter in _SCATTERS:
            turn = np.hstack([np.eye(total), np.zeros((total, width))])
            turn[mine, mine] = scatter * np.eye(count)
            turn[mine, total:] = columns
            values.append(_evidence(fit, turn))
        tried.append((_average(values) - free, Pattern(pattern.name, columns, pattern.common)))
    if not tried:
        return None
    odds, best = max(tried, key=lambda pair: pair[0])
    return Coincidence(
        odds - float(np.log(len(tried))), (cause.name,), best.name, count, best.columns.shape[1], best.common
    )


def _patterns(cause: Cause, array: AccelerometerArray, mounting: NDArray[np.float64]) -> list[Pattern]:
    """Return the patterns of a cause's sizes, in units of their prior: a number per channel, or some per chip."""
    sizes = cause.family.sizes(array)
    prior = np.array([size.prior_std for size in sizes])
    if len(cause.mixing) != len(sizes):
        return []
    usual = getattr(cause.family, "alike_by_lot", False)
    if len(sizes) == array.n_channels and all(
        size.key.startswith(channel) for size, channel in zip(sizes, array.channels, strict=True)
    ):
        return [one for one in distinct(channel_patterns(array, mounting), prior) if not (usual and one.is_of_equals)]
    pairs = _pairs(sizes, array)
    if pairs:
        return distinct(pair_patterns(array, pairs), prior)
    components, rest = divmod(len(sizes), len(array.chips))
    chips = np.repeat([chip.name for chip in array.chips], components)
    if rest or not all(size.key.startswith(chip) for size, chip in zip(sizes, chips, strict=False)):
        return []
    return distinct(chip_patterns(array, mounting, components), prior)


def _pairs(sizes: Sequence[Size], array: AccelerometerArray) -> list[tuple[int, int]]:
    """Return the pairs of channels that sizes belong to; none where they belong to something else."""
    names = list(array.channels)
    parts = [size.key.split("_from_") for size in sizes]
    if any(len(part) != 2 or part[0] not in names or part[1] not in names for part in parts):
        return []
    return [(names.index(to), names.index(source)) for to, source in parts]


def _in_coordinates(cause: Cause, pattern: Pattern) -> NDArray[np.float64] | None:
    """Return a pattern of the sizes as one of the coordinates; None where these can't be on it, or always are."""
    columns = np.linalg.lstsq(cause.mixing, pattern.columns, rcond=None)[0]
    missed = np.linalg.norm(cause.mixing @ columns - pattern.columns)
    if missed > NOTHING * np.linalg.norm(pattern.columns) or len(columns) < columns.shape[1] + SPARE:
        return None
    return np.asarray(columns)


def _are_of_a_kind(one: Cause, other: Cause) -> bool:
    """Whether two causes have the same numbers: one for each of the same channels or chips."""
    return (
        one.mixing.shape == other.mixing.shape
        and len(one.coordinates) > SPARE
        and bool(np.allclose(one.mixing, other.mixing))
    )


def _bound(
    fit: Fit, one: tuple[Cause, slice], other: tuple[Cause, slice], array: AccelerometerArray, free: float
) -> Coincidence:
    """Return the most likely way in which the numbers of two causes are the same but for a factor."""
    (first, mine), (second, its) = one, other
    count, total = len(first.coordinates), len(fit.score)
    sizes = [cause.family.sizes(array) for cause in (first, second)]
    ways: dict[str, tuple[float, float]] = {}
    if sizes[0][0].unit == sizes[1][0].unit:
        same = sizes[0][0].prior_std / sizes[1][0].prior_std * _rms(first) / _rms(second)
        ways |= {"equal": (same, 0.0), "opposite": (-same, 0.0)}
    weight = inverse(first.covariance + second.covariance)
    information = float(first.coordinates @ weight @ first.coordinates)  # of a ratio
    ratio = float(first.coordinates @ weight @ second.coordinates) / max(information, 1e-300)
    volume = 0.5 * float(np.log1p(information * ratio**2))  # what is fitted pays for its volume
    ways["proportional"] = (ratio * _rms(first) / _rms(second), volume)
    tried = []
    for name, (factor, cost) in ways.items():
        values = []
        for scatter in _SCATTERS:
            turn = np.eye(total)
            turn[its, mine] = factor * np.eye(count)
            turn[its, its] = scatter * max(abs(factor), 1e-3) * np.eye(count)
            values.append(_evidence(fit, turn))
        tried.append((_average(values) - free - cost - float(np.log(len(ways))), name))
    odds, name = max(tried)
    return Coincidence(odds, (first.name, second.name), f"each other ({name})", 2 * count, count)


def _rms(cause: Cause) -> float:
    """Return the rms of the numbers of a cause, in units of their prior."""
    return max(float(np.sqrt(np.mean(cause.coordinates**2))), SCALES[0])


def _evidence(fit: Fit, turn: NDArray[np.float64]) -> float:
    return log_evidence(turn.T @ fit.gram @ turn, turn.T @ fit.score)


def _average(values: Sequence[float]) -> float:
    return float(np.logaddexp.reduce(values) - np.log(len(values)))
