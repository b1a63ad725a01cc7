"""The plan of a campaign: factors, how their values are combined, seeds."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec

from gfimu.base.errors import InputError
from gfimu.base.files.model_files import read_toml
from gfimu.base.files.schema import Table, about, read

__all__ = ["PlanFile", "RangeTable", "Value", "load_plan"]

Value = str | float | int | bool
"""A value of a factor."""


class RangeTable(Table, frozen=True):
    """A factor whose values are drawn between two limits."""

    low: Annotated[float, about("Lower limit.")]
    high: Annotated[float, about("Upper limit.")]
    scale: Annotated[Literal["linear", "log"], about("Whether values or their logarithms are spread evenly.")] = (
        "linear"
    )
    levels: Annotated[Annotated[int, msgspec.Meta(ge=2)] | None, about("Values of a grid, both limits included.")] = (
        None
    )


class PlanFile(Table, frozen=True):
    """A plan: what each case does, its factors, and which combinations of their values are run."""

    factors: Annotated[
        dict[str, Annotated[list[Value], msgspec.Meta(min_length=1)] | RangeTable],
        about("Factors by name: a list of values, or a table with low and high.", example={"scenario": ["paper_run"]}),
    ]
    kind: Annotated[str, about("Task of a case: estimate, diagnose, measure or drive.")] = "estimate"
    design: Annotated[
        Literal["grid", "random", "latin_hypercube", "sobol", "saltelli"],
        about(
            "All combinations, or points of the unit cube drawn or spread evenly (scipy.stats.qmc); saltelli: for each "
            "of the points as many combinations as factors and two more, for Sobol indices."
        ),
    ] = "grid"
    points: Annotated[
        Annotated[int, msgspec.Meta(ge=1)] | None,
        about("Combinations of a design that is no grid; a power of two for sobol and saltelli."),
    ] = None
    repeats: Annotated[int, about("Seeds per combination.", ge=1)] = 1
    seed: Annotated[int, about("Seed of all random numbers.", ge=0)] = 0
    batch: Annotated[int, about("Cases that are run and written together.", ge=1)] = 20


def load_plan(path: str | Path) -> PlanFile:
    """Read a plan from a TOML file and check it.

    Raises
    ------
    InputError
        If a key is wrong, a range is empty, or the design lacks or contradicts its number of points.
    """
    table = read_toml(Path(path))
    if isinstance(table.get("factors"), dict):
        for name, factor in table["factors"].items():
            _check_form(f"{path}: [factors] {name}", factor)
    plan = read(table, PlanFile, str(path))
    if not plan.factors:
        raise InputError(f"{path}: [factors] is empty; give at least one, such as scenario = ['paper_run']")
    for name, factor in plan.factors.items():
        if isinstance(factor, RangeTable):
            _check_range(f"{path}: [factors] {name}", factor, grid=plan.design == "grid")
        else:
            _check_list(f"{path}: [factors] {name}", factor)
    if plan.design == "grid" and plan.points is not None:
        raise InputError(f"{path}: a grid has as many points as combinations; leave points out")
    if plan.design != "grid" and plan.points is None:
        raise InputError(f"{path}: design {plan.design!r} needs points = N")
    if plan.design in {"sobol", "saltelli"} and plan.points is not None and plan.points & (plan.points - 1):
        below = 1 << (plan.points.bit_length() - 1)
        raise InputError(
            f"{path}: points = {plan.points}: a Sobol sequence is even for powers of two; use {below} or {2 * below}"
        )
    return plan


def _check_form(where: str, factor: Any) -> None:
    """Check what a factor is made of, so that a message names it."""
    if isinstance(factor, dict):
        read(factor, RangeTable, where)
    elif not isinstance(factor, list) or not factor or not all(isinstance(one, str | float | int) for one in factor):
        raise InputError(f"{where} = {factor}: must be a list of values, such as [1, 2], or a table with low and high")
    elif any(isinstance(one, float) and not math.isfinite(one) for one in factor):
        raise InputError(f"{where} = {factor}: must be finite; leave out inf and nan")


def _check_list(where: str, factor: list[Value]) -> None:
    # A column of the dataset holds values of one type.
    if len({float if type(one) is int else type(one) for one in factor}) > 1:
        raise InputError(f"{where}: {factor} mixes numbers, texts or booleans; give values of one type")
    twice = [one for one in factor if factor.count(one) > 1]
    if twice:
        raise InputError(f"{where}: {twice[0]!r} is given twice; give each value once")


def _check_range(where: str, factor: RangeTable, *, grid: bool) -> None:
    if not factor.low < factor.high:
        raise InputError(f"{where}: low {factor.low:g} is not below high {factor.high:g}")
    if factor.scale == "log" and factor.low <= 0.0:
        raise InputError(f"{where}: low {factor.low:g} has no logarithm; use scale = 'linear'")
    if grid and factor.levels is None:
        raise InputError(f"{where}: a grid needs levels = N, or another design")
