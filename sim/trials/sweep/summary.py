"""Summary of a campaign's rows: quantiles of each result by the values of factors, and reasons of failures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray
from scipy.stats import binomtest

from gfimu.base.declared import Declared, figure
from gfimu.base.errors import check_name
from sim.trials.sweep.plan import PlanFile, RangeTable, Value

__all__ = ["Group", "failures", "grouped", "numbers", "result_names", "share_of", "varying"]

_QUANTILES = (0.05, 0.5, 0.95)
_NO_RESULT = {"case", "seed", "failure"}
_BINS = 5  # of equal count, of a range that is grouped by


@dataclass(frozen=True)
class Group(Declared):
    """One result over the cases with equal values of some factors."""

    values: Annotated[dict[str, Value], figure("Values of the factors; of a range, the fifth of it, as text.")]
    result: Annotated[str, figure("Name of the result, with its unit.")]
    cases: Annotated[int, figure("Cases that have it.")]
    failed: Annotated[int, figure("Cases of the group that failed.")]
    low: Annotated[float, figure("5 % quantile; of a share, lower 95 % limit (Wilson).")]
    median: Annotated[float, figure("Median; of a share, the share.")]
    high: Annotated[float, figure("95 % quantile; of a share, upper 95 % limit (Wilson).")]
    share: Annotated[
        bool, figure("Whether the result is true or false, and the figures are the share of true ones.")
    ] = False


def failures(table: pa.Table) -> dict[str, int]:
    """Return how many cases failed, by the reason, most frequent first."""
    if "failure" not in table.column_names:
        return {}
    counts = {one["values"]: one["counts"] for one in table["failure"].value_counts().to_pylist() if one["values"]}
    return dict(sorted(counts.items(), key=lambda item: -item[1]))


def varying(plan: PlanFile) -> list[str]:
    """Return the factors that have more than one value."""
    return [name for name, one in plan.factors.items() if isinstance(one, RangeTable) or len(set(one)) > 1]


def result_names(table: pa.Table, plan: PlanFile) -> list[str]:
    """Return the results that are numbers, or true or false."""
    return [
        field.name
        for field in table.schema
        if field.name not in _NO_RESULT | set(plan.factors)
        and (pa.types.is_integer(field.type) or pa.types.is_floating(field.type) or pa.types.is_boolean(field.type))
    ]


def numbers(table: pa.Table, name: str) -> NDArray[np.float64]:
    """Return a column as numbers, (n,), true as 1; NaN where a case has none."""
    return np.asarray(table[name].cast(pa.float64()).to_numpy())


def grouped(table: pa.Table, plan: PlanFile, by: Sequence[str] = ()) -> list[Group]:
    """Group rows by factors and return the quantiles of every numeric result.

    Parameters
    ----------
    table : pyarrow.Table
        Rows of the dataset.
    plan : PlanFile
        The plan.
    by : sequence of str
        Factors to group by; all that are lists of several values by default. A range is cut into fifths of the cases.

    Raises
    ------
    InputError
        If the plan has no such factor.
    """
    for name in by:
        check_name("factor", name, plan.factors)
    names = list(by) or [name for name in varying(plan) if not isinstance(plan.factors[name], RangeTable)]
    if not len(table):
        return []
    members, values = _groups(table, plan, names)
    failed = pc.not_equal(table["failure"], "").to_numpy()
    found = []
    for rows, named in zip(members, values, strict=True):
        for result in result_names(table, plan):
            column = numbers(table, result)[rows]
            column = column[np.isfinite(column)]
            if len(column):
                share = pa.types.is_boolean(table.schema.field(result).type)
                summary = share_of(column) if share else _quantiles(column)
                found.append(Group(named, result, len(column), int(failed[rows].sum()), *summary, share))
    return found


def _groups(
    table: pa.Table, plan: PlanFile, names: Sequence[str]
) -> tuple[list[NDArray[np.intp]], list[dict[str, Value]]]:
    """Return the rows of each group, and its values by factor."""
    codes, labels = np.zeros((len(table), 0), dtype=int), []
    for name in names:
        factor = plan.factors[name]
        one, label = (
            _binned(numbers(table, name)) if isinstance(factor, RangeTable) else _coded(table[name], list(factor))
        )
        codes = np.column_stack([codes, one])
        labels.append(label)
    found, which = np.unique(codes, axis=0, return_inverse=True)
    members = np.split(np.argsort(which.ravel(), kind="stable"), np.cumsum(np.bincount(which.ravel()))[:-1])
    values = [{name: label[code] for name, label, code in zip(names, labels, one, strict=True)} for one in found]
    return members, values


def _coded(column: pa.ChunkedArray, factor: list[Value]) -> tuple[NDArray[np.intp], list[Value]]:
    """Return the place of each row's value in the plan, (n,), and the values."""
    encoded = column.combine_chunks().dictionary_encode()
    places = np.array([factor.index(value) for value in encoded.dictionary.to_pylist()])
    return places[np.asarray(encoded.indices)], factor


def _binned(column: NDArray[np.float64]) -> tuple[NDArray[np.intp], list[Value]]:
    """Return the number of each row's bin of equal count, (n,), and the limits of the bins as text."""
    edges = np.unique(np.quantile(column, np.linspace(0.0, 1.0, _BINS + 1)))
    which = np.clip(np.searchsorted(edges, column, side="right") - 1, 0, max(len(edges) - 2, 0))
    limits = [f"{low:.3g} … {high:.3g}" for low, high in pairwise(edges)]
    return which, [*limits] or [f"{edges[0]:.3g}"]


def _quantiles(column: NDArray[np.float64]) -> tuple[float, float, float]:
    low, median, high = np.quantile(column, _QUANTILES)
    return float(low), float(median), float(high)


def share_of(truths: NDArray[np.float64]) -> tuple[float, float, float]:
    """Return Wilson's 95 % interval of a share, and the share between its limits."""
    counted = binomtest(int(np.sum(truths)), len(truths))
    interval = counted.proportion_ci(0.95, method="wilson")
    return float(interval.low), float(counted.statistic), float(interval.high)
