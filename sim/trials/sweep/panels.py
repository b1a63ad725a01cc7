"""Panels of a campaign: a result over one factor, how often it has each value, shares of its variance."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
import pyarrow as pa
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from gfimu.base.results.colours import AFTER_ON_PAPER, BEFORE_ON_PAPER, INK, NOISE_ON_PAPER, css
from gfimu.base.units import KEY_ENDINGS
from sim.trials.sweep.design import Design
from sim.trials.sweep.plan import RangeTable
from sim.trials.sweep.sensitivity import Sensitivity
from sim.trials.sweep.summary import numbers, share_of

__all__ = ["CAPTION", "draw_counts", "draw_over", "draw_shares", "label", "most_influential"]

Floats = NDArray[np.float64]

_PLAIN_POWERS = (-2, 4)  # of ten, within which numbers along an axis are written out
_MOST_FACTORS = 6  # panels that a row shows legibly
_LONGEST = 12  # characters of a value that stands upright
_DECADE = 15.0  # ratio of quantiles 95 and 5 % from which a logarithmic axis shows more
_DOTS = 1500  # cases: of more, dots hide each other
_BINS = 12  # of equal count, along a range
_UNITS = {ending: unit for unit, ending in KEY_ENDINGS.items()} | {
    "mg": "mg", "g": "g", "degC": "°C", "rad2_s2": "rad²/s²", "ratio": "ratio", "ms": "ms", "mm": "mm", "deg": "°"
}  # fmt: skip
CAPTION = (
    "Line: median. Dark band, box: half of the cases. Light band, whiskers: 90 %. Bars: share of the variance that a "
    "factor causes, with 95 % interval."
)
"""What the lines, bands and boxes of the panels are."""


def label(name: str) -> str:
    """Return a column's name as people read it: ``alpha_rms_rad_s2`` is ``alpha rms (rad/s²)``."""
    for ending in sorted(_UNITS, key=len, reverse=True):
        if name.endswith(f"_{ending}"):
            return f"{_words(name.removesuffix(f'_{ending}'))} ({_UNITS[ending]})"
    return _words(name)


def _words(name: str) -> str:
    return name.replace("_", " ").replace(".", " ")


def most_influential(factors: list[str], found: Sequence[Sensitivity]) -> list[str]:
    """Return the factors that have a panel, in the plan's order."""
    largest = {
        name: max((np.nanmax([one.first, one.total]) for one in found if one.factor == name), default=0.0)
        for name in factors
    }
    kept = sorted(factors, key=lambda name: -largest[name])[:_MOST_FACTORS]
    return [name for name in factors if name in kept]


def draw_counts(axes: Axes, result: str, values: Floats) -> None:
    """Draw how often a result has each value."""
    axes.hist(values[np.isfinite(values)], bins=40, color=css(AFTER_ON_PAPER))
    axes.set_xlabel(label(result))
    axes.set_ylabel("cases")


def draw_over(axes: Axes, table: pa.Table, design: Design, name: str, values: Floats, *, truth: bool) -> None:
    """Draw a result over one factor; ``truth``: it is true or false, and its share is drawn."""
    factor = design.plan.factors[name]
    finite = np.isfinite(values)
    values = values[finite]
    if not truth and len(values) and values.min() > 0.0:
        low, high = np.quantile(values, [0.05, 0.95])
        if high > _DECADE * low:
            axes.set_yscale("log")
    axes.grid(axis="y", lw=0.3)
    place: Literal["left", "center"] = "center"
    if isinstance(factor, RangeTable):
        if factor.scale == "log":
            axes.set_xscale("log")
        else:
            axes.xaxis.set_major_locator(MaxNLocator(4))
            axes.ticklabel_format(axis="x", scilimits=_PLAIN_POWERS, useMathText=True)
            low, high = _PLAIN_POWERS
            if not 10.0**low <= abs(factor.high) < 10.0**high:  # the power of ten stands at the right
                place = "left"
        axes.set_xlabel(label(name), loc=place)
        _draw_bands(axes, numbers(table, name)[finite], values, truth=truth)
        return
    axes.set_xlabel(label(name))
    column = np.array(table[name].to_pylist(), dtype=object)[finite]
    levels = sorted(set(factor)) if not any(isinstance(one, str) for one in factor) else list(factor)
    _draw_boxes(axes, [values[column == level] for level in levels], truth=truth)
    texts = [f"{one:.3g}" if isinstance(one, float) else str(one) for one in levels]
    upright = max(map(len, texts)) * len(texts) < 3 * _LONGEST
    axes.set_xticks(range(len(texts)), texts, rotation=0 if upright else 30, ha="center" if upright else "right")


def _draw_bands(axes: Axes, x: Floats, y: Floats, *, truth: bool) -> None:
    order = np.argsort(x, kind="stable")
    bins = [one for one in np.array_split(order, min(_BINS, max(len(x) // 5, 1))) if len(one)]
    centre = np.array([np.median(x[one]) for one in bins])
    if truth:
        axes.plot(centre, [y[one].mean() for one in bins], "o-", ms=3, color=css(AFTER_ON_PAPER))
        axes.set_ylim(-0.03, 1.03)
        return
    if len(x) <= _DOTS:
        axes.plot(x, y, ".", ms=2, color=css(NOISE_ON_PAPER), alpha=0.6, mec="none")
    q = np.array([np.quantile(y[one], [0.05, 0.25, 0.5, 0.75, 0.95]) for one in bins]).T
    axes.fill_between(centre, q[0], q[4], color=css(AFTER_ON_PAPER), alpha=0.18, lw=0)
    axes.fill_between(centre, q[1], q[3], color=css(AFTER_ON_PAPER), alpha=0.35, lw=0)
    axes.plot(centre, q[2], color=css(AFTER_ON_PAPER), lw=1.6)


def _draw_boxes(axes: Axes, groups: list[Floats], *, truth: bool) -> None:
    if truth:
        for index, group in enumerate(groups):
            if len(group):
                low, share, high = share_of(group)
                error = [[share - low], [high - share]]
                axes.errorbar(index, share, error, fmt="o", ms=4, color=css(AFTER_ON_PAPER), capsize=3)
        axes.set_xlim(-0.5, len(groups) - 0.5)
        axes.set_ylim(-0.03, 1.03)
        return
    axes.boxplot(
        groups,
        positions=range(len(groups)),
        widths=0.6,
        whis=(5, 95),
        showfliers=False,
        patch_artist=True,
        boxprops={"facecolor": (*(part / 255 for part in AFTER_ON_PAPER[:3]), 0.35), "edgecolor": css(AFTER_ON_PAPER)},
        medianprops={"color": css(AFTER_ON_PAPER), "linewidth": 1.8},
        whiskerprops={"color": css(AFTER_ON_PAPER)},
        capprops={"color": css(AFTER_ON_PAPER)},
        manage_ticks=False,
    )


def draw_shares(axes: Axes, found: Sequence[Sensitivity], seeds: float | None) -> None:
    """Draw the indices of the factors, the largest on top, and the share of the seeds below."""
    found = sorted(found, key=lambda one: np.nanmax([one.first, one.total]))[-8:]
    has_total = any(np.isfinite(one.total) for one in found)
    kinds = [("first order", [one.first for one in found], [one.first_high for one in found], AFTER_ON_PAPER)]
    if has_total:
        kinds.append(("total", [one.total for one in found], [one.total_high for one in found], BEFORE_ON_PAPER))
    height, names = 0.72 / len(kinds), []
    if seeds is not None:
        axes.barh(0, seeds, 0.6, color=css(NOISE_ON_PAPER))
        names.append("seeds")
    places = np.arange(len(names), len(names) + len(found))
    for index, (name, values, highs, colour) in enumerate(kinds):
        shift = height * (0.5 * (len(kinds) - 1) - index)
        error = np.nan_to_num(np.subtract(highs, values))
        axes.barh(
            places + shift, np.maximum(values, 0.0), height, color=css(colour), label=name, xerr=error,
            error_kw={"lw": 0.9, "ecolor": css(INK)},
        )  # fmt: skip
    names += [label(one.factor).partition(" (")[0] for one in found]
    axes.set_yticks(range(len(names)), names)
    axes.set_xlim(0.0, 1.05)
    axes.grid(axis="x", lw=0.3)
    axes.set_xlabel("share of the variance")
