"""Pareto front of two objectives: arrays that can be improved in one only at the cost of the other.

Two objectives are weighed against each other: the sum of w log f + (1 − w) log g is made small for several w, each
search beginning from the last one's array besides its random starts, and what another array beats in both is dropped.
Arrays in a concave stretch of the front (in logarithms) are not found that way. Where one objective is ``chips`` or
``size``, the other is made small for each number of chips, or for the volume shrunk in steps.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array_search.certificate import certify
from gfimu.array_search.criteria import Goal
from gfimu.array_search.exchange import log_figure
from gfimu.array_search.objectives import OBJECTIVES, WORST, Aim, Conditions, Objective, objective
from gfimu.array_search.problem import Design, Problem, Sites
from gfimu.array_search.search import best_design
from gfimu.base.declared import Declared, Numbers, Table, cell, figure
from gfimu.base.errors import InputError, unknown_name
from gfimu.base.results import Panel, PlottedResult, Series, text_column
from gfimu.base.short_repr import short_repr

__all__ = ["CHIPS", "SIZE", "Front", "FrontPoint", "find_front"]

CHIPS, SIZE = "chips", "size"
"""Objectives of a front alone: the number of chips, and the longest edge around the volume."""

_STEPPED = {CHIPS: ("number of chips", ""), SIZE: ("longest edge of the volume", "m")}
_WEIGHTS = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
_SIZES = (1.0, 0.85, 0.7, 0.6, 0.5, 0.4, 0.3)  # of the volume of the brief
_KICKS = 1  # of each start: neighbours on the front are starts besides
_TIE = 1e-6  # of the figure of the other objective at the ends of the front, where it would be left to chance
_ALIKE = 1e-4  # relative: points nearer than this in both figures are one


@dataclass(frozen=True)
class FrontPoint(Declared):
    """An array of the front."""

    array: AccelerometerArray
    values: Annotated[tuple[float, float], figure("Its two figures.")]
    bounds: Annotated[
        tuple[float | None, float | None], figure("Proven least of each figure alone; null: none.", json=Numbers)
    ]
    starts: Annotated[int, figure("Starts that were made for it.")]
    agreeing: Annotated[int, figure("Starts that ended at it.")]

    __repr__ = short_repr

    @property
    def name(self) -> Annotated[str, figure("Name of its array file.", key="array", before="values")]:
        """Name of the array."""
        return self.array.name

    @property
    def chips(self) -> Annotated[int, figure("Chips.", before="values")]:
        """Number of chips."""
        return len(self.array.chips)


@dataclass(frozen=True)
class Front(Declared, PlottedResult):
    """Pareto front: arrays of which none is worse than another in both objectives, ordered by the first.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.optimize(4, most_chips=6, pareto=("chips", "gdop")).to_pandas()  # doctest: +SKIP
    """

    objectives: Annotated[tuple[Aim, Aim], figure("The two objectives.")]
    points: Annotated[tuple[FrontPoint, ...], figure("The arrays.")]

    __repr__ = short_repr

    @property
    def values(self) -> NDArray[np.float64]:
        """Both figures of every array, shape (p, 2)."""
        return np.array([point.values for point in self.points], dtype=float).reshape(-1, 2)

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per array: chips, and both figures, their unit in the names where they have one."""
        names = [f"{one.name} [{one.unit}]" if one.unit else one.name for one in self.objectives]
        return {
            "array": text_column(point.name for point in self.points),
            "chips": np.array([point.chips for point in self.points], dtype=int),
            **dict(zip(names, self.values.T, strict=True)),
        }

    def _heading(self) -> str:
        return f"Arrays of least {self.objectives[0].name} and {self.objectives[1].name}"

    def _facts(self) -> list[tuple[str, str]]:
        return [(one.name, one.meaning) for one in self.objectives]

    def _panels(self) -> list[Panel]:
        x_label, y_label = (f"{one.name}, {one.unit or 'pure number'}" for one in self.objectives)
        return [Panel("front", y_label, (Series("", self.values[:, 1]),), self.values[:, 0], x_label)]

    def shown(self) -> Iterator[Table]:
        """Yield the table of the arrays."""
        first, second = self.objectives
        yield Table(
            f"Front of {first.meaning} and {second.meaning}",
            ("array", first.label, second.label, "starts that agree", "bounds"),
            [
                (
                    point.name,
                    *(cell(value, ".5g") for value in point.values),
                    f"{point.agreeing} of {point.starts}",
                    "  ".join(cell(math.nan if bound is None else bound, ".5g") for bound in point.bounds),
                )
                for point in self.points
            ],
            note="No array of the table is worse than another in both. Bounds: proven least of each figure alone; "
            "—: none.",
        )


def find_front(
    problem: Problem,
    conditions: Conditions,
    names: tuple[str, str],
    rng: np.random.Generator,
    *,
    most_chips: int,
    starts: int = 40,
    report: Callable[[float], None] | None = None,
) -> Front:
    """Search the front of two objectives.

    Parameters
    ----------
    problem : Problem
        What may be built; its number of chips is the least where `CHIPS` is an objective.
    conditions : Conditions
        Noise, speed and times of the objectives.
    names : tuple of str
        Two keys of `OBJECTIVES`, or one and `CHIPS` or `SIZE`.
    rng : numpy.random.Generator
        Source of the random starts.
    most_chips : int
        Where `CHIPS` is an objective, the largest number of them.
    starts : int
        Most random starts of each array.
    report : callable, optional
        Called with the share of the work that is done, 0 to 1.

    Raises
    ------
    InputError
        If the two are the same, neither is a key of `OBJECTIVES`, or one is unknown.
    GeometryError
        If no array sees all six motions.
    """
    known = [*OBJECTIVES, CHIPS, SIZE]
    for name in names:
        if name.removesuffix(WORST) not in known:
            raise unknown_name("objective", name, known)
    stepped = [name for name in names if name in {CHIPS, SIZE}]
    if names[0] == names[1] or len(stepped) == 2:
        raise InputError(
            f"a front of {names[0]} and {names[1]}: give two different objectives, or one and chips or size"
        )
    if not stepped:
        points = _weighed(problem, conditions, names, rng, starts, report)
        aims: list[Aim] = [objective(name, problem, conditions) for name in names]
    else:
        other = names[0] if names[1] == stepped[0] else names[1]
        steps = _sizes(problem) if stepped[0] == SIZE else _numbers(problem, most_chips)
        points = _stepped(steps, conditions, other, rng, starts, report)
        goal = objective(other, problem, conditions)
        meaning, unit = _STEPPED[stepped[0]]
        aims = [Aim(stepped[0], meaning, unit), goal]
        if names[1] == stepped[0]:
            aims.reverse()
            points = [replace(one, values=one.values[::-1], bounds=one.bounds[::-1]) for one in points]
    kept = [
        replace(point, array=replace(point.array, name=f"front_{number:02d}"))
        for number, point in enumerate(_undominated(points), start=1)
    ]
    return Front((aims[0], aims[1]), tuple(kept))


def _weighed(
    problem: Problem,
    conditions: Conditions,
    names: tuple[str, str],
    rng: np.random.Generator,
    starts: int,
    report: Callable[[float], None] | None,
) -> list[FrontPoint]:
    first, second = (objective(name, problem, conditions) for name in names)
    goals = (first.goal, second.goal)
    found: list[FrontPoint] = []
    last: tuple[Design, ...] = ()
    for index, weight in enumerate(_WEIGHTS):
        share = min(max(weight, _TIE), 1.0 - _TIE)
        compromise = Goal(first.sought(1.0 - share) + second.sought(share))
        end = best_design(
            problem,
            compromise,
            rng,
            starts=starts,
            kicks=_KICKS,
            also=last,
            report=_part(report, index, len(_WEIGHTS)),
        )
        last = (end.design,)
        values = (
            math.exp(log_figure(problem, goals[0], end.design)),
            math.exp(log_figure(problem, goals[1], end.design)),
        )
        text = f"compromise of {first.meaning} and {second.meaning}"
        array = problem.array(end.design, "front", conditions.part, text)
        bounds = (_bound(problem, first, values[0]), _bound(problem, second, values[1]))
        found.append(FrontPoint(array, values, bounds, end.starts, end.agreeing))
    return found


def _stepped(
    steps: Sequence[tuple[float, Problem]],
    conditions: Conditions,
    name: str,
    rng: np.random.Generator,
    starts: int,
    report: Callable[[float], None] | None,
) -> list[FrontPoint]:
    found = []
    for index, (step, problem) in enumerate(steps):
        wanted = objective(name, problem, conditions)
        end = best_design(problem, Goal(wanted.sought()), rng, starts=starts, report=_part(report, index, len(steps)))
        value = math.exp(log_figure(problem, wanted.goal, end.design))
        text = f"least {wanted.meaning} found for {problem.n_chips} chips in {problem.volume.name}"
        array = problem.array(end.design, "front", conditions.part, text)
        bounds = (None, _bound(problem, wanted, value))
        found.append(FrontPoint(array, (step, value), bounds, end.starts, end.agreeing))
    return found


def _numbers(problem: Problem, most: int) -> list[tuple[float, Problem]]:
    if most <= problem.n_chips:
        raise InputError(f"a front over chips needs a range: the most chips, {most}, must exceed {problem.n_chips}")
    return [(float(n), replace(problem, n_chips=n)) for n in range(problem.n_chips, most + 1)]


def _sizes(problem: Problem) -> list[tuple[float, Problem]]:
    if isinstance(problem.volume, Sites):
        raise InputError(
            "a front over size shrinks the volume; candidate sites have none, give a box, sphere or cylinder"
        )
    unit = problem.length_unit_m or problem.unit  # one unit for all sizes, or the figures could not be compared
    steps = []
    for share in _SIZES:
        shrunk = problem.volume.scaled(share)
        if share < 1.0:
            shrunk = replace(shrunk, name=f"{shrunk.name} with all lengths times {share:g}")
        steps.append((2.0 * problem.unit * share, replace(problem, volume=shrunk, length_unit_m=unit)))
    return steps


def _bound(problem: Problem, wanted: Objective, value: float) -> float | None:
    found = certify(problem, wanted.criterion, value)
    return None if found is None else found.bound


def _part(report: Callable[[float], None] | None, number: int, of: int) -> Callable[[float], None] | None:
    return None if report is None else lambda share: report((number + share) / of)


def _undominated(points: Sequence[FrontPoint]) -> list[FrontPoint]:
    """Return the points that no other is as good as in both figures, by the first figure."""
    kept: list[FrontPoint] = []
    for point in sorted(points, key=lambda one: one.values):
        better = not kept or point.values[1] < kept[-1].values[1] * (1.0 - _ALIKE)
        if better and np.isfinite(point.values).all():
            kept.append(point)
    return kept
