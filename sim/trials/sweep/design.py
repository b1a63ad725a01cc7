"""The cases of a plan: combinations of factor values, each with a seed, the same on every machine."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from gfimu.base.errors import InputError
from sim.trials.sweep.plan import PlanFile, RangeTable, Value

__all__ = ["Case", "Design"]

_UNUSED_BITS = 11  # numerical: of 64; a seed of 53 bits is exact in every file, and millions of them differ
_MOST_POINTS = 2_000_000  # numerical: of a design that is no grid, which are kept in memory


@dataclass(frozen=True)
class Case:
    """One run of a campaign.

    Parameters
    ----------
    number : int
        Its place in the campaign.
    values : dict of str to value
        Value of each factor.
    seed : int
        Seed of everything left to chance in it.
    """

    number: int
    values: dict[str, Value]
    seed: int


@dataclass(frozen=True)
class Design:
    """Cases of a plan, in order; ``design[number]`` is one of them.

    The design ``saltelli`` takes two points A and B of a Sobol sequence of twice the dimensions, and for each factor
    the point A with that factor's value of B (Saltelli et al., Computer Physics Communications 181(2), 2010): from
    these k + 2 combinations per base point follow first-order and total indices.

    Parameters
    ----------
    plan : PlanFile
        The plan.
    """

    plan: PlanFile

    def __len__(self) -> int:
        return self.points * self.plan.repeats

    def __getitem__(self, number: int) -> Case:
        point, repeat = divmod(number, self.plan.repeats)
        # Repeats of all points share their seeds, so that factors are compared on the same chips and noise.
        (seed,) = np.random.SeedSequence([self.plan.seed, repeat]).generate_state(1, np.uint64)
        return Case(number, self._values(self._point(point)), int(seed) >> _UNUSED_BITS)

    def batches(self) -> Iterator[range]:
        """Yield the numbers of the cases that run together."""
        for first in range(0, len(self), self.plan.batch):
            yield range(first, min(first + self.plan.batch, len(self)))

    @property
    def points(self) -> int:
        """Combinations, each with ``plan.repeats`` cases."""
        if self.plan.design == "grid":
            return math.prod(self._sizes)
        base = self.plan.points or 0
        return base * (len(self.plan.factors) + 2) if self.plan.design == "saltelli" else base

    @cached_property
    def _sizes(self) -> tuple[int, ...]:
        """Values of each factor; of a range its levels, 0 without."""
        return tuple(one.levels or 0 if isinstance(one, RangeTable) else len(one) for one in self.plan.factors.values())

    @cached_property
    def _cube(self) -> NDArray[np.float64]:
        plan, dimensions = self.plan, len(self.plan.factors)
        count = plan.points or 0
        if count > _MOST_POINTS:
            raise InputError(
                f"the plan has {count} points, at most {_MOST_POINTS}; use fewer points and more repeats, or several "
                "plans with seeds of their own"
            )
        return _unit_cube(plan.design, 2 * dimensions if plan.design == "saltelli" else dimensions, count, plan.seed)

    def _point(self, number: int) -> NDArray[np.float64]:
        """Return the coordinates of a combination, (k,): the number of a choice, or a place in [0, 1] of a range."""
        ranges = np.array([isinstance(factor, RangeTable) for factor in self.plan.factors.values()])
        if self.plan.design == "grid":
            places = np.array(np.unravel_index(number, self._sizes), dtype=float)
            return np.where(ranges, places / np.maximum(np.array(self._sizes) - 1.0, 1.0), places)
        if self.plan.design == "saltelli":
            base, which = divmod(number, len(ranges) + 2)
            first, second = np.split(self._cube[base], 2)
            unit = second if which == 1 else first.copy()
            if which > 1:
                unit[which - 2] = second[which - 2]
        else:
            unit = self._cube[number]
        sizes = np.where(ranges, 1, self._sizes)
        return np.where(ranges, unit, np.minimum(np.floor(unit * sizes), sizes - 1.0))

    def _values(self, point: NDArray[np.float64]) -> dict[str, Value]:
        values: dict[str, Value] = {}
        for (name, factor), place in zip(self.plan.factors.items(), point, strict=True):
            if isinstance(factor, RangeTable):
                low, high = np.log([factor.low, factor.high]) if factor.scale == "log" else (factor.low, factor.high)
                value = float(low + place * (high - low))
                values[name] = float(np.exp(value)) if factor.scale == "log" else value
            else:
                values[name] = factor[int(place)]
        return values


@lru_cache(maxsize=4)  # each batch of a campaign asks again
def _unit_cube(design: str, dimensions: int, count: int, seed: int) -> NDArray[np.float64]:
    """Return points of the unit cube, (count, dimensions)."""
    rng = np.random.default_rng(np.random.SeedSequence([seed, count, dimensions]))
    if design in {"sobol", "saltelli"}:
        return np.asarray(qmc.Sobol(dimensions, rng=rng).random(count))
    if design == "latin_hypercube":
        return np.asarray(qmc.LatinHypercube(dimensions, rng=rng).random(count))
    return rng.random((count, dimensions))
