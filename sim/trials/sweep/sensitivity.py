"""Sensitivity indices of a campaign: which share of a result's variance each factor causes.

The first-order index of a factor is the variance of the result's mean given that factor, over the variance of the
result; the total index is what would remain of the variance if all other factors were known (Saltelli et al., Global
Sensitivity Analysis, 2008, ch. 4). Both are of the mean over the seeds of a combination; what the seeds cause is given
beside them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from gfimu.base.declared import Declared, figure
from sim.trials.sweep.design import Design
from sim.trials.sweep.plan import RangeTable
from sim.trials.sweep.summary import numbers, result_names, varying

__all__ = ["METHODS", "Sensitivity", "seed_shares", "sensitivities"]

Floats = NDArray[np.float64]

METHODS = {
    "saltelli": "Saltelli's design: first-order (Saltelli 2010) and total indices (Jansen 1999)",
    "grid": "full grid: exact first-order indices of these values; the interval is that of the seeds",
    "given data": "first-order indices from given data: variance between equal-count bins or values, bias removed",
}
"""How an index was found, and what is to be known of it."""

_LEAST = 8  # points: below, an index says nothing
_BIN_POINTS, _MOST_BINS = 8, 64  # points in a bin of a range; bins, so that a bin is narrow and its mean is no noise
_BLOCKS, _RESAMPLES = 200, 400  # numerical: of the bootstrap; its standard deviation within 5 %
_Z95 = 1.959964  # numerical: 97.5 % quantile of the normal distribution


@dataclass(frozen=True)
class Sensitivity(Declared):
    """Share of one factor in the variance of one result; combinations with a failed case are left out."""

    result: Annotated[str, figure("Name of the result.")]
    factor: Annotated[str, figure("Name of the factor.")]
    method: Annotated[str, figure("How it was found, a key of `METHODS`.")]
    points: Annotated[int, figure("Combinations that it was found from; of Saltelli's design, base points.")]
    first: Annotated[float, figure("First-order index; null where there is none.")]
    first_low: Annotated[float, figure("Lower 95 % limit, by the bootstrap.")]
    first_high: Annotated[float, figure("Upper 95 % limit.")]
    total: Annotated[float, figure("Total index; null where the method gives none.")] = np.nan
    total_low: Annotated[float, figure("Lower 95 % limit.")] = np.nan
    total_high: Annotated[float, figure("Upper 95 % limit.")] = np.nan

    def row_text(self) -> tuple[str, str, str, str, str]:
        """Return result, factor, indices with half their intervals, and points, as a table shows them."""
        first = _index_text(self.first, self.first_low, self.first_high)
        total = _index_text(self.total, self.total_low, self.total_high)
        return self.result, self.factor, first, total, str(self.points)


def _index_text(value: float, low: float, high: float) -> str:
    if math.isnan(value):
        return ""
    return f"{value:.3f}" if math.isnan(low) else f"{value:.3f} ± {(high - low) / 2.0:.3f}"


def sensitivities(table: pa.Table, design: Design) -> list[Sensitivity]:
    """Return the indices of every factor that varies, for every numeric result that varies.

    Parameters
    ----------
    table : pyarrow.Table
        Rows of the dataset; some may be missing.
    design : Design
        The cases of its plan.
    """
    found: list[Sensitivity] = []
    for result in result_names(table, design.plan):
        values = _by_point(table, result, design)
        if design.plan.design == "saltelli":
            found += _of_saltelli(result, values.mean(axis=1), list(design.plan.factors))
        else:
            found += _of_given_data(result, values, table, design)
    return found


def seed_shares(table: pa.Table, design: Design) -> dict[str, float]:
    """Return which share of each result's variance the seeds cause, alone or with factors; none without repeats."""
    shares = {}
    if design.plan.repeats > 1:
        for result in result_names(table, design.plan):
            values = _by_point(table, result, design)
            values = values[np.isfinite(values).all(axis=1)]
            if len(values) and values.var() > 0.0:
                shares[result] = min(float(values.var(axis=1, ddof=1).mean() / values.var(ddof=1)), 1.0)
    return shares


def _by_point(table: pa.Table, result: str, design: Design) -> Floats:
    """Return a result by combination and repeat, (points, repeats); NaN where it is missing."""
    values = np.full(len(design), np.nan)
    values[table["case"].to_numpy()] = numbers(table, result)
    return values.reshape(-1, design.plan.repeats)


def _of_saltelli(result: str, means: Floats, factors: list[str]) -> list[Sensitivity]:
    """Return first-order and total indices from A, B and AB: eq. (b) and (f) of table 2 of Saltelli et al. (2010)."""
    k = len(factors)
    runs = means.reshape(-1, k + 2)  # A, B, A with one factor of B
    runs = runs[np.isfinite(runs).all(axis=1)]
    if len(runs) < _LEAST or not runs[:, :2].var() > 0.0:
        return []
    runs -= runs[:, :2].mean()
    a, b, mixed = runs[:, :1], runs[:, 1:2], runs[:, 2:]
    first, total = b * (mixed - a), 0.5 * (a - mixed) ** 2
    moments = np.column_stack([np.ones(len(runs)), a + b, a**2 + b**2, first, total])

    def indices(sums: Floats) -> Floats:
        count, mean = sums[..., :1], sums[..., 1:2] / (2.0 * sums[..., :1])
        variance = sums[..., 2:3] / (2.0 * count) - mean**2
        return sums[..., 3:] / count / variance

    value, half = _bootstrapped(moments, indices)
    return [
        Sensitivity(
            result, name, "saltelli", len(runs),
            value[i], value[i] - half[i], value[i] + half[i],
            value[k + i], value[k + i] - half[k + i], value[k + i] + half[k + i],
        )
        for i, name in enumerate(factors)
    ]  # fmt: skip


def _of_given_data(result: str, values: Floats, table: pa.Table, design: Design) -> list[Sensitivity]:
    whole = np.isfinite(values).all(axis=1)
    values = values[whole]
    if len(values) < min(_LEAST, design.points) or not values.mean(axis=1).var() > 0.0:
        return []
    cases = table["case"].to_numpy()
    rows = np.full(len(design), -1)
    rows[cases] = np.arange(len(cases))
    rows = rows[:: design.plan.repeats][whole]
    # Every mean of a full grid is over all values of the other factors: there is no bias to remove.
    full = design.plan.design == "grid" and bool(whole.all())
    found = []
    for name in varying(design.plan):
        which = _classes(table[name].take(rows))
        if full:
            value, half = _of_grid(values, which)
            found.append(Sensitivity(result, name, "grid", len(values), value, value - half, value + half))
        else:
            even = design.plan.design == "sobol" and isinstance(design.plan.factors[name], RangeTable)
            value, half = _of_classes(values.mean(axis=1), which, even=even)
            found.append(Sensitivity(result, name, "given data", len(values), value, value - half, value + half))
    return found


def _classes(column: pa.ChunkedArray) -> NDArray[np.intp]:
    """Return the class of each point, (n,): its value, or a bin of equal count where there are many."""
    encoded = column.combine_chunks().dictionary_encode()
    if len(encoded.dictionary) <= _MOST_BINS and len(encoded) >= 2 * len(encoded.dictionary):
        return np.asarray(encoded.indices)
    bins = min(max(len(encoded) // _BIN_POINTS, 2), _MOST_BINS)
    ranks = np.argsort(np.argsort(np.asarray(column), kind="stable"), kind="stable")
    return ranks * bins // len(ranks)


def _of_classes(y: Floats, which: NDArray[np.intp], *, even: bool) -> tuple[float, float]:
    """Return the correlation ratio of y (n,) over classes (n,), its bias removed, and half its interval.

    The mean of a class has a variance of its own, by which the ratio is too large. Of independent points it is the
    variance within classes over their count (Kelley's ε²). The points of a Sobol sequence (``even``) are spread evenly
    inside a bin too: there it is less, and the second differences of the means of neighbouring bins show how much.
    """
    y = y - y.mean()
    count = int(which.max()) + 1
    inside = np.eye(count)[which]  # (n, k)
    moments = np.column_stack([np.ones(len(y)), y, y**2, inside, inside * y[:, None]])

    def index(sums: Floats) -> Floats:
        n, whole = sums[..., 0], sums[..., 1] ** 2 / sums[..., 0]
        total = sums[..., 2] - whole
        members, parts = np.maximum(sums[..., 3 : 3 + count], 1e-12), sums[..., 3 + count :]
        between = np.sum(parts**2 / members, axis=-1) - whole
        bias = (count - 1.0) * (total - between) / np.maximum(n - count, 1.0)
        if even and count > 2:
            rough = np.mean(np.diff(parts / members, 2, axis=-1) ** 2, axis=-1) / 6.0  # variance of a mean
            bias = np.minimum(bias, rough * n)
        return np.asarray(((between - bias) / total)[..., None])

    value, half = _bootstrapped(moments, index)
    return float(value[0]), float(half[0])


def _of_grid(values: Floats, which: NDArray[np.intp]) -> tuple[float, float]:
    """Return the correlation ratio over the classes of a full grid, and half its interval over the seeds (p, r)."""

    def index(y: Floats) -> float:
        members = np.bincount(which)
        means = np.bincount(which, y) / members
        return float(members @ (means - y.mean()) ** 2 / (len(y) * y.var()))

    repeats = values.shape[1]
    value = index(values.mean(axis=1))
    if repeats == 1:
        return value, np.nan
    weights = np.random.default_rng(0).multinomial(repeats, np.full(repeats, 1.0 / repeats), _RESAMPLES) / repeats
    return value, _Z95 * float(np.std([index(values @ weight) for weight in weights]))


def _bootstrapped(moments: Floats, index: Callable[[Floats], Floats]) -> tuple[Floats, Floats]:
    """Return an index of summed moments, and half its 95 % interval by a bootstrap over points.

    The centre is that of the sample: a resample repeats points, and the indices of repeated points are biased. Many
    points are resampled in blocks.

    Parameters
    ----------
    moments : ndarray, shape (n, m)
        What each point adds.
    index : callable
        Takes sums (..., m) to indices (..., j).
    """
    rng = np.random.default_rng(0)
    blocks = min(len(moments), _BLOCKS)
    shuffled = np.array_split(rng.permutation(len(moments)), blocks)
    sums = np.array([moments[block].sum(axis=0) for block in shuffled])
    weights = rng.multinomial(blocks, np.full(blocks, 1.0 / blocks), _RESAMPLES)
    with np.errstate(divide="ignore", invalid="ignore"):
        resampled = index(weights @ sums)
    return index(sums.sum(axis=0)), _Z95 * np.nanstd(resampled, axis=0)
