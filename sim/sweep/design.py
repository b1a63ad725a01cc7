"""The cases of a plan: combinations of factor values, each with a seed, the same on every machine."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from gfimu.errors import InputError
from sim.sweep.plan import PlanFile, RangeTable, Value

__all__ = ["Case", "Design"]

_MOST_POINTS = 2_000_000  # combinations that are kept in memory


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

    Parameters
    ----------
    plan : PlanFile
        The plan.
    """

    plan: PlanFile

    def __len__(self) -> int:
        return len(self._points) * self.plan.repeats

    def __getitem__(self, number: int) -> Case:
        point, repeat = divmod(number, self.plan.repeats)
        # Repeats of all points share their seeds, so that factors are compared on the same chips and noise.
        (seed,) = np.random.SeedSequence([self.plan.seed, repeat]).generate_state(1)
        return Case(number, self._values(self._points[point]), int(seed))

    def batches(self) -> Iterator[range]:
        """Yield the numbers of the cases that run together."""
        for first in range(0, len(self), self.plan.batch):
            yield range(first, min(first + self.plan.batch, len(self)))

    @cached_property
    def _points(self) -> NDArray[np.float64]:
        """Coordinates of every combination, (n, k): the number of a choice, or a place in [0, 1] of a range."""
        plan, factors = self.plan, self.plan.factors.values()
        if plan.design == "grid":
            axes = [
                np.linspace(0.0, 1.0, one.levels or 2)
                if isinstance(one, RangeTable)
                else np.arange(len(one), dtype=float)
                for one in factors
            ]
            count = int(np.prod([len(axis) for axis in axes], dtype=float))
            _check_count(count)
            return np.array(list(itertools.product(*axes)))
        count = plan.points or 0
        _check_count(count)
        unit = _unit_cube(plan.design, len(plan.factors), count, plan.seed)
        sizes = [1 if isinstance(one, RangeTable) else len(one) for one in factors]
        chosen = np.minimum(np.floor(unit * sizes), np.array(sizes) - 1.0)
        return np.where([isinstance(one, RangeTable) for one in factors], unit, chosen)

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


def _unit_cube(design: str, dimensions: int, count: int, seed: int) -> NDArray[np.float64]:
    """Return points of the unit cube, (count, dimensions)."""
    rng = np.random.default_rng(np.random.SeedSequence([seed, count, dimensions]))
    if design == "sobol":
        return np.asarray(qmc.Sobol(dimensions, rng=rng).random(count))
    if design == "latin_hypercube":
        return np.asarray(qmc.LatinHypercube(dimensions, rng=rng).random(count))
    return rng.random((count, dimensions))


def _check_count(count: int) -> None:
    if count > _MOST_POINTS:
        raise InputError(
            f"the plan has {count} combinations, at most {_MOST_POINTS}; use fewer points and more repeats"
        )
