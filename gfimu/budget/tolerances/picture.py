"""Picture of a tolerance budget: distributions of the errors before and after calibration, and shares per cause."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter
from numpy.typing import NDArray

from gfimu.base.files.atomic_file import atomic_path
from gfimu.base.results.colours import (
    AFTER_ON_PAPER,
    BEFORE_ON_PAPER,
    NOISE_ON_PAPER,
    PALE,
    SPIN_AXIS_ON_PAPER,
    Colour,
    chip_colour,
    css,
)
from gfimu.budget.tolerances.budget import QUANTITIES, QuantityBudget, ToleranceBudget
from gfimu.budget.tolerances.comparison import DRAWS
from gfimu.budget.tolerances.tolerances import CAUSES

__all__ = ["tolerance_picture"]

Floats = NDArray[np.float64]

_LABELLED = 0.06  # share of a bar from which the cause is written into it
_TICKS = 12  # numerical: most labels of an axis, which fit beside each other
_NARROW = 5.0  # numerical: ratio of the ends of an axis, below which round numbers lie beside each other
_IN_KEY = 0.005  # share from which a cause is in the key: less is no wider than a line

_LINES: tuple[Colour, ...] = (BEFORE_ON_PAPER, NOISE_ON_PAPER, SPIN_AXIS_ON_PAPER, AFTER_ON_PAPER)
"""Of the calibrations: what comes before is orange, the last is blue."""


def tolerance_picture(
    path: str | Path,
    budgets: Mapping[str, ToleranceBudget],
    errors: Mapping[str, Mapping[str, Floats]],
    shape: str,
    *,
    title: str,
) -> None:
    """Draw the errors of every quantity.

    Left: cumulative distribution of the error over units, one colour per calibration; full the simulated units, dashed
    the first-order map. Right: shares of the causes in the variance, one bar per calibration.

    Parameters
    ----------
    path : str or Path
        File to write, ``.png``, ``.svg`` or ``.pdf``.
    budgets : mapping of str to ToleranceBudget
        First order, by calibration.
    errors : mapping
        By calibration and quantity, the norms of the errors of the simulated units, shape (n,).
    shape : {"uniform", "normal"}
        Distribution of the machining errors.
    title : str
        What is shown.
    """
    names = [name for name in QUANTITIES if all(name in budget.quantities for budget in budgets.values())]
    figure = Figure(figsize=(12, 2.3 * len(names) + 1.2), layout="constrained")
    grid = np.atleast_2d(figure.subplots(len(names), 2, width_ratios=(1.0, 1.25)))
    for (left, right), name in zip(grid, names, strict=True):
        quantities = {calibration: budget.quantities[name] for calibration, budget in budgets.items()}
        simulated = {calibration: found[name] for calibration, found in errors.items() if name in found}
        _distributions(left, quantities, simulated, shape)
        _shares(right, quantities)
    lines = "dashed: first order, full: simulated units" if errors else "first order"
    grid[0, 0].set_title(f"share of units whose error is below ({lines})", fontsize=10)
    grid[0, 1].set_title("share of each cause in the variance, and total, rms over units (first order)", fontsize=10)
    every = [budget.quantities[name].shares for budget in budgets.values() for name in names]
    present = [cause for cause in CAUSES if any(shares.get(cause, 0.0) >= _IN_KEY for shares in every)]
    handles = [Patch(color=_colour(cause), label=cause) for cause in present]
    if handles:
        figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), fontsize=9, frameon=False)
    figure.suptitle(title, fontsize=11)
    with atomic_path(path) as temporary:
        figure.savefig(temporary, dpi=100, format=Path(path).suffix.lstrip("."))


def _distributions(
    axes: Axes, quantities: Mapping[str, QuantityBudget], simulated: Mapping[str, Floats], shape: str
) -> None:
    """Draw the cumulative distribution of the error over units after each calibration."""
    ends: list[float] = []
    for index, (calibration, one) in enumerate(quantities.items()):
        colour = _LINES[index % len(_LINES)]
        curves = [(np.sort(one.draw(DRAWS, shape, np.random.default_rng(0))), "--")]
        if calibration in simulated:
            found = simulated[calibration]
            curves.append((np.sort(found[np.isfinite(found)]), "-"))
        for values, style in curves:
            if not len(values) or values[-1] <= 0.0:
                continue
            below = (np.arange(len(values)) + 0.5) / len(values)
            axes.plot(values, below, style, color=css(colour), lw=1.9 if style == "-" else 1.1)
            ends += np.quantile(values, [0.01, 0.99]).tolist()
    if not ends:
        axes.text(0.5, 0.5, "no error", ha="center", transform=axes.transAxes)
        axes.set_axis_off()
        return
    axes.set_xscale("log")
    axes.set_xlim(min(ends) / 1.3, max(ends) * 1.3)
    # Plain numbers: powers of ten alone leave an axis of less than a decade without any, or with some that overlap.
    narrow = max(ends) < _NARROW * min(ends)
    axes.xaxis.set_major_locator(MaxNLocator(5) if narrow else LogLocator(subs=(1.0, 2.0, 5.0), numticks=_TICKS))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.3g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_ylim(0.0, 1.0)
    axes.set_yticks([0.0, 0.5, 0.95], ["0", "50 %", "95 %"])
    axes.axhline(0.95, color=css(PALE), lw=0.7, zorder=0)
    axes.axhline(0.5, color=css(PALE), lw=0.7, zorder=0)
    axes.set_ylabel("units below", fontsize=9)
    one = next(iter(quantities.values()))
    axes.set_xlabel(f"{one.meaning}, {one.unit}", fontsize=9.5)
    axes.tick_params(labelsize=8)
    axes.spines[["top", "right"]].set_visible(False)


def _shares(axes: Axes, quantities: Mapping[str, QuantityBudget]) -> None:
    for index, one in enumerate(quantities.values()):
        start = 0.0
        for cause, share in one.shares.items():
            axes.barh(index, share, left=start, height=0.72, color=_colour(cause), edgecolor="white", lw=0.6)
            if share >= _LABELLED:
                text = f"{cause} {share:.0%}" if share >= 2.5 * _LABELLED else f"{share:.0%}"
                axes.text(start + share / 2, index, text, ha="center", va="center", fontsize=7.5, color="white")
            start += share
    axes.set_yticks(range(len(quantities)), [f"{name}\n{one.rms:.3g} {one.unit}" for name, one in quantities.items()])
    axes.tick_params(labelsize=8.5, length=0)
    for number, label in enumerate(axes.get_yticklabels()):  # the key to the curves on the left
        label.set_color(css(_LINES[number % len(_LINES)]))
        label.set_fontweight("bold")
    axes.invert_yaxis()
    axes.set_xlim(0.0, 1.0)
    axes.set_xticks([])
    axes.spines[:].set_visible(False)


def _colour(cause: str) -> str:
    return css(chip_colour(CAUSES.index(cause), on_paper=True))
