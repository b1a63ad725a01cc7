"""Pareto front of two objectives: arrays that can be improved in one only at the cost of the other.

Two objectives are weighed against each other: the sum of w log f + (1 − w) log g is made small for several w, each
search beginning from the last one's array besides its random starts, and what another array beats in both is dropped.
Arrays in a concave stretch of the front (in logarithms) are not found that way. Where one objective is ``chips`` or
``size``, the other is made small for each number of chips, or for the volume shrunk in steps.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.array_search.certificate import certify
from gfimu.array_search.criteria import Goal
from gfimu.array_search.exchange import figure
from gfimu.array_search.objectives import OBJECTIVES, WORST, Conditions, Objective, objective
from gfimu.array_search.problem import Design, Problem, Sites
from gfimu.array_search.search import best_design
from gfimu.errors import InputError, unknown_name
from gfimu.geometry.array import AccelerometerArray
from gfimu.results import Panel, PlottedResult, Series, text_column
from gfimu.short_repr import short_repr

__all__ = ["CHIPS", "SIZE", "Front", "FrontPoint", "find_front"]

CHIPS, SIZE = "chips", "size"
"""Objectives of a front alone: the number of chips, and the longest edge around the volume."""

_WEIGHTS = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
_SIZES = (1.0, 0.85, 0.7, 0.6, 0.5, 0.4, 0.3)  # of the volume of the brief
_KICKS = 1  # of each start: neighbours on the front are starts besides
_TIE = 1e-6  # of the figure of the other objective at the ends of the front, where it would be left to chance
_ALIKE = 1e-4  # relative: points nearer than this in both figures are one


@dataclass(frozen=True)
class FrontPoint:
    """One array of the front.

    Parameters
    ----------
    array : AccelerometerArray
        The array.
    values : tuple of float
        Its two figures.
    bounds : tuple of (float or None)
        Proven lower bounds of the figures.
    starts, agreeing : int
        Starts made for it, and how many ended at the same compromise.
    """

    array: AccelerometerArray
    values: tuple[float, float]
    bounds: tuple[float | None, float | None]
    starts: int
    agreeing: int

    __repr__ = short_repr


@dataclass(frozen=True)
class Front(PlottedResult):
    """Pareto front: arrays of which none is worse than another in both objectives, ordered by the first.

    Parameters
    ----------
    names, meanings, units : tuple of str
        The two objectives.
    points : tuple of FrontPoint
        The arrays.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.optimize(4, most_chips=6, pareto=("chips", "gdop")).to_pandas()  # doctest: +SKIP
    """

    names: tuple[str, str]
    meanings: tuple[str, str]
    units: tuple[str, str]
    points: tuple[FrontPoint, ...]

    __repr__ = short_repr

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per array: chips, and both figures, their unit in the names where they have one."""
        values = np.array([point.values for point in self.points], dtype=float).reshape(-1, 2)
        names = [f"{name} [{unit}]" if unit else name for name, unit in zip(self.names, self.units, strict=True)]
        return {
            "array": text_column(point.array.name for point in self.points),
            "chips": np.array([len(point.array.chips) for point in self.points], dtype=int),
            **{name: values[:, place] for place, name in enumerate(names)},
        }

    def _heading(self) -> str:
        return f"Arrays of least {self.names[0]} and {self.names[1]}"

    def _facts(self) -> list[tuple[str, str]]:
        return list(zip(self.names, self.meanings, strict=True))

    def _panels(self) -> list[Panel]:
        values = np.array([point.values for point in self.points], dtype=float).reshape(-1, 2)
        x_label, y_label = (
            f"{name}, {unit or 'pure number'}" for name, unit in zip(self.names, self.units, strict=True)
        )
        return [Panel("front", y_label, (Series("", values[:, 1]),), values[:, 0], x_label)]

    def to_dict(self) -> dict[str, Any]:
        """Return the content of ``front.json``."""
        return {
            "objectives": [
                {"name": name, "meaning": meaning, "unit": unit}
                for name, meaning, unit in zip(self.names, self.meanings, self.units, strict=True)
            ],
            "points": [
                {
                    "array": point.array.name,
                    "chips": len(point.array.chips),
                    "values": list(point.values),
                    "bounds": list(point.bounds),
                    "starts": point.starts,
                    "agreeing": point.agreeing,
                }
                for point in self.points
            ],
        }


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
        meanings = [objective(name, problem, conditions) for name in names]
        texts, units = [one.meaning for one in meanings], [one.unit for one in meanings]
    else:
        other = names[0] if names[1] == stepped[0] else names[1]
        steps = _sizes(problem) if stepped[0] == SIZE else _numbers(problem, most_chips)
        points = _stepped(steps, conditions, other, rng, starts, report)
        goal = objective(other, problem, conditions)
        label = ("number of chips", "") if stepped[0] == CHIPS else ("longest edge of the volume", "m")
        texts, units = [label[0], goal.meaning], [label[1], goal.unit]
        if names[1] == stepped[0]:
            texts, units = texts[::-1], units[::-1]
            points = [replace(one, values=one.values[::-1], bounds=one.bounds[::-1]) for one in points]
    kept = [
        replace(point, array=replace(point.array, name=f"front_{number:02d}"))
        for number, point in enumerate(_undominated(points), start=1)
    ]
    return Front(names, (texts[0], texts[1]), (units[0], units[1]), tuple(kept))


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
    for number, weight in enumerate(_WEIGHTS):
        share = min(max(weight, _TIE), 1.0 - _TIE)
        compromise = Goal(first.sought(1.0 - share) + second.sought(share))
        end = best_design(
            problem,
            compromise,
            rng,
            starts=starts,
            kicks=_KICKS,
            also=last,
            report=_part(report, number, len(_WEIGHTS), starts + 1),
        )
        last = (end.design,)
        values = (math.exp(figure(problem, goals[0], end.design)), math.exp(figure(problem, goals[1], end.design)))
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
    for number, (step, problem) in enumerate(steps):
        wanted = objective(name, problem, conditions)
        end = best_design(
            problem, Goal(wanted.sought()), rng, starts=starts, report=_part(report, number, len(steps), starts)
        )
        value = math.exp(figure(problem, wanted.goal, end.design))
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


def _part(report: Callable[[float], None] | None, number: int, of: int, starts: int) -> Callable[[int], None] | None:
    return None if report is None else lambda made: report((number + min(1.0, made / starts)) / of)


def _undominated(points: Sequence[FrontPoint]) -> list[FrontPoint]:
    """Return the points that no other is as good as in both figures, by the first figure."""
    kept: list[FrontPoint] = []
    for point in sorted(points, key=lambda one: one.values):
        better = not kept or point.values[1] < kept[-1].values[1] * (1.0 - _ALIKE)
        if better and np.isfinite(point.values).all():
            kept.append(point)
    return kept
