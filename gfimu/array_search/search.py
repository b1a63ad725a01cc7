"""Search of accelerometer arrays: exchange from random starts, each polished, with a proven lower bound.

A start is a random design. An exchange over candidate places and directions takes it to a design that no single
exchange makes better; the polish moves it on where places or directions are continuous. Then single chips are put
elsewhere at random and the same is done again, and what is better is kept. Starts are independent: how many
of them agree says how sure it is that nothing better exists, where the certificate does not.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray, Chip
from gfimu.array.array_file import ArrayFile
from gfimu.array.dilution import gdop_lower_bound
from gfimu.array.kinematics import require_all_motions
from gfimu.array_search.certificate import Certificate, certify
from gfimu.array_search.criteria import Goal
from gfimu.array_search.exchange import exchange, log_figure
from gfimu.array_search.objectives import Objective, Reached
from gfimu.array_search.polish import feasible, leaks, polish
from gfimu.array_search.problem import Design, Problem
from gfimu.array_search.scores import score_tables
from gfimu.array_search.scoring import Score, score, score_panels
from gfimu.base.declared import Declared, Table, cell, figure
from gfimu.base.errors import GeometryError, InputError
from gfimu.base.results import Panel, PlottedResult
from gfimu.base.short_repr import short_repr

__all__ = ["Found", "SearchResult", "best_design", "search"]

_Vector = NDArray[np.float64]

_KICKS = 4  # times that one chip of a start is put elsewhere; more find more and cost as much each
_MORE_KICKS = 5  # times as many where nothing is polished, so that they cost little
_MANY_CHIPS = 24  # from which on a polish costs so much that no chip is put elsewhere
_WORTH_A_POLISH = 0.01  # relative: an exchange that ends this much above the start's best is polished no more
_ENOUGH = 10  # starts that agree, after which no more are made
_NEAR = 1e-3  # relative: starts that end this near the best are counted besides
_UNSEEN = 1e-4  # singular value of J, lengths in units, below which a motion counts as not seen
_ROUNDING_COST = 1e-6  # relative: of the figure, that rounded positions may cost
_DIGITS = 6  # of positions in units, where rounding costs nothing


@dataclass(frozen=True)
class SearchResult(Declared, PlottedResult):
    """The best array of a search, with its score and its distance from a proven bound.

    ``array.to_toml()`` is an array file; ``value`` is the figure of the ``objective``. Trust the result less if few of
    the starts agree on it.

    Examples
    --------
    >>> import gfimu
    >>> found = gfimu.optimize(4, restarts=2, seed=1)
    >>> print(f"{found.score.gdop:.4f}, at least {found.gdop_lower_bound:.4f}")
    1.0607, at least 1.0607
    """

    array: Annotated[AccelerometerArray, figure("The array, as an array file holds it.", json=ArrayFile)]
    score: Annotated[Score, figure("Its figures of merit.")]
    gdop_lower_bound: Annotated[
        float, figure("GDOP that no geometry of as many tri-axial chips can beat; null of other searches.")
    ]
    starts: Annotated[int, figure("Starts that were made.")]
    agreeing: Annotated[int, figure("Starts that ended at the best figure.")]
    near: Annotated[int, figure("Starts that ended within 0.1 % of it.", key="within_0_1_percent")]
    objective: Objective
    value: float
    certificate: Annotated[Certificate | None, figure("A proven lower bound; null where none is known.")]

    __repr__ = short_repr

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return the array, one row per channel: position of its chip, m, and sensing axis, body frame."""
        return self.array.to_columns()

    def _heading(self) -> str:
        return f"Array found: {self.array.name}, {len(self.array.chips)} chips"

    def _facts(self) -> list[tuple[str, str]]:
        best = (self.objective.meaning, f"{self.value:.4g} {self.objective.unit}".strip())
        found = [
            *([] if self.objective.name == "gdop" else [best]),
            ("GDOP", f"{self.score.gdop:.4f} (lower bound {self.gdop_lower_bound:.4f})"),
            ("condition number κ", f"{self.score.condition_number:.4f}"),
            ("starts that end there", f"{self.agreeing} of {self.starts}"),
        ]
        return found if self.certificate is None else [*found, ("certificate", self.certificate.text)]

    def _panels(self) -> list[Panel]:
        return score_panels([self.score])

    @property
    def reached(
        self,
    ) -> Annotated[Reached, figure("What was made small.", key="objective", before="certificate")]:
        """The objective with its figure."""
        return Reached(self.objective.name, self.objective.meaning, self.objective.unit, self.value)

    def shown(self) -> Iterator[Table | str]:
        """Yield the places of the chips, the score, and how sure it is that nothing is better."""
        yield Table(
            f"{self.array.name}: positions in the body frame",
            ("chip", "x m", "y m", "z m", "sensing axes"),
            [(chip.name, *(f"{one:.5f}" for one in chip.position), _directions(chip)) for chip in self.array.chips],
        )
        yield from score_tables([self.score])
        yield f"{self.objective.meaning}: {cell(self.value, '.5g')} {self.objective.unit}".rstrip()
        near = f", {self.near} within 0.1 %" if self.near > self.agreeing else ""
        yield f"{self.agreeing} of {self.starts} starts agree on it{near}"
        none = "certificate: none; no lower bound is known for this objective and these chips"
        yield none if self.certificate is None else self.certificate.text


def search(
    problem: Problem,
    wanted: Objective,
    rng: np.random.Generator,
    *,
    starts: int = 40,
    part: str = "adxl345",
    name: str = "",
    report: Callable[[float], None] | None = None,
) -> SearchResult:
    """Search the array for which an objective is least.

    Parameters
    ----------
    problem : Problem
        What may be built.
    wanted : Objective
        What is to be small.
    rng : numpy.random.Generator
        Source of the random starts.
    starts : int
        Most starts that are made; fewer once ten agree.
    part : str
        Part of the chips in the result.
    name : str
        Name of the result.
    report : callable, optional
        Called with the share of the starts that is done.

    Raises
    ------
    GeometryError
        If no array of these chips sees all six motions, or none is free of ω² where that is asked.
    InputError
        If an argument is out of range or the chips don't fit.
    """
    judged = problem if wanted.is_worst or problem.tolerance is None else replace(problem, tolerance=None)
    found = best_design(judged, Goal(wanted.sought()), rng, starts=starts, report=report)
    n, k = problem.n_chips, problem.axes_per_chip
    condition = f"least {wanted.meaning} found" + (" with α free of ω²" if problem.non_recursive else "")
    description = f"{condition} for {n} chips of {k} axes in {problem.volume.name}"
    array = problem.array(found.design, name or f"optimized_{n}x{k}", part, description)
    value = math.exp(log_figure(judged, wanted.goal, found.design))
    figures = score(array)[0]
    if wanted.name.startswith("gdop_joint") and not math.isfinite(figures.gdop_joint):
        raise GeometryError(
            f"no geometry of {n} such chips in {problem.volume.name} was found that separates α and p from the "
            "products of ω; use more chips or more axes"
        )
    if wanted.name == "gdop_joint":
        value = figures.gdop_joint  # without the prior on products of ω that no channel sees
    in_box = wanted.name == "gdop" and k == 3 and _is_centred_box(problem)
    return SearchResult(
        array=array,
        score=figures,
        gdop_lower_bound=gdop_lower_bound(n) if in_box else math.nan,
        starts=found.starts,
        agreeing=found.agreeing,
        near=found.near,
        objective=wanted,
        value=value,
        certificate=certify(judged, wanted.criterion, value),
    )


@dataclass(frozen=True)
class Found:
    """Best design of a number of starts.

    Parameters
    ----------
    design : Design
        The design.
    starts, agreeing, near : int
        Starts made; how many ended at its figure; how many within 0.1 % of it.
    """

    design: Design
    starts: int
    agreeing: int
    near: int


def best_design(
    problem: Problem,
    goal: Goal,
    rng: np.random.Generator,
    *,
    starts: int,
    kicks: int = _KICKS,
    also: tuple[Design, ...] = (),
    report: Callable[[float], None] | None = None,
) -> Found:
    """Return the best design of a number of starts.

    ``also`` are designs to begin from besides the random ones; ``kicks`` is how often one chip of a start is put
    elsewhere. Raises as `search`.
    """
    if starts < 1:
        raise InputError(f"restarts = {starts}: must be at least 1")
    if problem.shape is None and not problem.turns:
        kicks *= _MORE_KICKS
    elif problem.n_chips > _MANY_CHIPS:
        kicks = 0
    ends: list[tuple[float, Design]] = []
    blind: list[tuple[float, Design]] = []
    made = 0
    for index in range(starts + len(also)):
        given = also[index] if index < len(also) else None
        value, design = _one_start(problem, goal, given, rng, kicks)
        made += 1
        if feasible(problem, design) and not (problem.non_recursive and leaks(design)):
            sees_too_little = np.linalg.svd(design.rows[:, :6], compute_uv=False)[-1] < _UNSEEN
            (blind if sees_too_little else ends).append((value, design))
        if report is not None:
            report(made / (starts + len(also)))
        best = min((one for one, _ in ends), default=math.inf)
        if sum(one < best + goal.agreement for one, _ in ends) >= _ENOUGH:
            break
    if not ends:
        raise _failure(problem, min(blind, key=lambda item: item[0])[1] if blind else None)
    best, design = min(ends, key=lambda item: item[0])
    agreeing, near = (sum(one < best + alike for one, _ in ends) for alike in (goal.agreement, _NEAR))
    return Found(_rounded(problem, goal, design, best), made, agreeing, near)


def _one_start(
    problem: Problem, goal: Goal, given: Design | None, rng: np.random.Generator, kicks: int
) -> tuple[float, Design]:
    pool = problem.candidates(rng)
    begin = problem.random_design(pool, rng) if given is None else given
    design, value = exchange(problem, goal, pool, begin, rng)
    design = polish(problem, goal, design)
    value = log_figure(problem, goal, design)
    for _ in range(0 if problem.non_recursive else kicks):
        pool = problem.candidates(rng)
        trial, reached = exchange(problem, goal, pool, _kicked(problem, pool, design, rng), rng)
        if reached < value + _WORTH_A_POLISH:
            trial = polish(problem, goal, trial)
            reached = log_figure(problem, goal, trial)
            if reached < value and feasible(problem, trial):
                design, value = trial, reached
    return value, design


def _kicked(problem: Problem, pool: Any, design: Design, rng: np.random.Generator) -> Design:
    """Return the design with one chip at a random candidate."""
    chip = int(rng.integers(problem.n_chips))
    others = np.arange(problem.n_chips) != chip
    free = np.flatnonzero(problem.apart(pool, design.positions[others], design.site[others]))
    if not len(free):
        return design
    one = int(rng.choice(free))
    return design.with_chip(chip, pool.positions[one], pool.axes[one], int(pool.site[one]))


def _rounded(problem: Problem, goal: Goal, design: Design, value: float) -> Design:
    """Positions without the optimiser's last digits, where that costs nothing."""
    if problem.shape is None:
        return design
    positions = np.round(design.positions, _DIGITS) + 0.0
    low, high = problem.shape.centre - problem.shape.half, problem.shape.centre + problem.shape.half
    tidy = Design(np.clip(positions, low, high), design.axes, design.site)
    costs_nothing = log_figure(problem, goal, tidy) <= value + _ROUNDING_COST
    clean = not (problem.non_recursive and leaks(tidy))
    return tidy if costs_nothing and clean and feasible(problem, tidy) else design


def _is_centred_box(problem: Problem) -> bool:
    return problem.shape is not None and problem.shape.kind == "box" and not problem.shape.centre.any()


def _failure(problem: Problem, design: Design | None) -> GeometryError:
    """Build the error that says why no start ended well."""
    where = problem.volume.name
    if design is None:
        rng = np.random.default_rng(0)
        design = problem.random_design(problem.candidates(rng), rng)
    try:
        require_all_motions(problem.array(design, "the best found", "adxl345", ""), or_axis=False)
    except GeometryError as error:
        return GeometryError(
            f"no geometry of {problem.n_chips} such chips in {where} was found that sees all motions: {error}"
        )
    if problem.non_recursive:
        return GeometryError(
            f"no geometry of {problem.n_chips} such chips in {where} was found whose angular acceleration is free "
            "of ω²; use more chips, or leave out the condition and give ω to the estimator"
        )
    return GeometryError(
        f"no geometry of {problem.n_chips} such chips in {where} was found that sees all motions well; use more chips"
    )


def _directions(chip: Chip) -> str:
    """Return the sensing axes in words: the turn of three changes no figure."""
    if len(chip.axes) == 3:
        return "any, e.g. body axes"
    return "  ".join("(" + ", ".join(f"{value:.4f}" for value in axis) + ")" for axis in chip.axes)
