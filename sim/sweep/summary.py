"""Summary of a campaign's rows: quantiles of each result by the values of factors, and reasons of failures."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from gfimu.errors import unknown_name
from sim.sweep.plan import PlanFile, RangeTable, Value

__all__ = ["Group", "failures", "grouped"]

Row = Mapping[str, Any]

_QUANTILES = (0.05, 0.5, 0.95)
_NO_RESULT = {"case", "seed", "failure"}


@dataclass(frozen=True)
class Group:
    """One result over the cases with equal values of some factors.

    Parameters
    ----------
    values : dict of str to value
        The values, by factor.
    result : str
        Name of the result, with its unit.
    cases : int
        Cases that have it.
    failed : int
        Cases of the group that failed.
    low, median, high : float
        Quantiles 5, 50 and 95 %; of results that are true or false, the share of true ones in ``median`` and its 95 %
        interval (Wilson).
    """

    values: dict[str, Value]
    result: str
    cases: int
    failed: int
    low: float
    median: float
    high: float

    def to_dict(self) -> dict[str, Any]:
        """Return the content for JSON."""
        return asdict(self)


def failures(rows: Sequence[Row]) -> dict[str, int]:
    """Return how many cases failed, by the reason, most frequent first."""
    return dict(Counter(row["failure"] for row in rows if row["failure"]).most_common())


def grouped(rows: Sequence[Row], plan: PlanFile, by: Sequence[str] = ()) -> list[Group]:
    """Group rows by factors and return the quantiles of every numeric result.

    Parameters
    ----------
    rows : sequence of mapping
        Rows of the dataset.
    plan : PlanFile
        The plan.
    by : sequence of str
        Factors to group by; all that are lists of several values by default.

    Raises
    ------
    InputError
        If the plan has no such factor.
    """
    for name in by:
        if name not in plan.factors:
            raise unknown_name("factor", name, plan.factors)
    names = list(by) or [name for name, one in plan.factors.items() if not isinstance(one, RangeTable) and len(one) > 1]
    groups: dict[tuple[Value, ...], list[Row]] = {}
    for row in rows:
        groups.setdefault(tuple(row[name] for name in names), []).append(row)
    results = list(dict.fromkeys(key for row in rows for key in row if key not in _NO_RESULT | set(plan.factors)))
    found = []
    for values, members in groups.items():
        failed = sum(bool(row["failure"]) for row in members)
        for result in results:
            numbers = [
                row[result] for row in members if isinstance(row.get(result), float | int) and np.isfinite(row[result])
            ]
            if numbers:
                low, median, high = _share(numbers) if isinstance(numbers[0], bool) else _quantiles(numbers)
                named = dict(zip(names, values, strict=True))
                found.append(Group(named, result, len(numbers), failed, low, median, high))
    return found


def _quantiles(numbers: Sequence[float]) -> tuple[float, float, float]:
    low, median, high = np.quantile(numbers, _QUANTILES)
    return float(low), float(median), float(high)


def _share(truths: Sequence[float]) -> tuple[float, float, float]:
    """Return Wilson's 95 % interval of a share, and the share between its limits."""
    n, share, z = len(truths), float(np.mean(truths)), 1.959964
    centre, half = share + z**2 / (2 * n), z * np.sqrt(share * (1 - share) / n + z**2 / (4 * n**2))
    return float((centre - half) / (1 + z**2 / n)), share, float((centre + half) / (1 + z**2 / n))
