"""Picture of a campaign: each result against each factor, and the share of its variance that each factor causes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pyarrow as pa
from matplotlib.figure import Figure
from numpy.typing import NDArray

from gfimu.base.errors import InputError, check_name
from gfimu.base.files.atomic_file import write_text
from gfimu.base.results import save_figure
from gfimu.base.results.colours import INK, css
from sim.trials.sweep.design import Design
from sim.trials.sweep.page import campaign_page
from sim.trials.sweep.panels import CAPTION, draw_counts, draw_over, draw_shares, label, most_influential
from sim.trials.sweep.sensitivity import seed_shares, sensitivities
from sim.trials.sweep.summary import numbers, result_names, varying

__all__ = ["campaign_picture"]

Floats = NDArray[np.float64]

_MOST_RESULTS = 4  # rows that a picture shows legibly
_PANEL = (2.7, 2.4)  # inches
_STYLE = {"font.size": 9, "axes.titlesize": 9, "axes.spines.top": False, "axes.spines.right": False,
          "svg.hashsalt": "gfimu", "text.color": css(INK)}  # fmt: skip


def campaign_picture(
    path: str | Path, folder: Path, table: pa.Table, design: Design, results: Sequence[str] = ()
) -> list[str]:
    """Draw a campaign; return the results that are drawn.

    Of a range the median and the bands of 50 and 90 % of the cases; of a list boxes (quartiles, whiskers to 5 and
    95 %); of a result that is true or false its share with 95 % interval.

    Parameters
    ----------
    path : str or Path
        ``.png``, ``.svg``, or ``.html`` for a page with the picture, counts and failures.
    folder : Path
        The campaign, for the title.
    table : pyarrow.Table
        Its rows.
    design : Design
        The cases of its plan.
    results : sequence of str
        Results to draw; the first four by default.

    Raises
    ------
    InputError
        If there is no such result, or none at all.
    """
    there = result_names(table, design.plan)
    for name in results:
        check_name("result", name, there)
    if not there:
        raise InputError(f"{folder}: has no results to draw yet; gfimu campaign status {folder} says how far it is")
    drawn = list(results) or there[:_MOST_RESULTS]
    if Path(path).suffix.lower() == ".html":
        write_text(path, campaign_page(folder, table, design, drawn))
        return drawn
    with mpl.rc_context(_STYLE):
        figure = _figure(f"{folder.name}: {len(table)} of {len(design)} cases", table, design, drawn, len(there))
        save_figure(path, figure)
    return drawn


def _figure(title: str, table: pa.Table, design: Design, results: list[str], all_results: int) -> Figure:
    found = [one for one in sensitivities(table, design) if one.result in results]
    shares = seed_shares(table, design)
    factors = most_influential(varying(design.plan), found)
    columns = max(len(factors), 1) + bool(found)
    figure = Figure(figsize=(_PANEL[0] * columns + 0.4, _PANEL[1] * len(results) + 0.6), layout="constrained")
    left_out = [f"{all_results - len(results)} more results"] if all_results > len(results) else []
    if len(varying(design.plan)) > len(factors):
        left_out.append(f"{len(varying(design.plan)) - len(factors)} factors of less influence")
    between = "\n" if columns == 1 else " "  # one panel is narrower than a title
    figure.suptitle(title + (f"{between}(not drawn: {', '.join(left_out)})" if left_out else ""), fontsize=11)
    grid = figure.subplots(len(results), columns, squeeze=False)
    for row, result in zip(grid, results, strict=True):
        values = numbers(table, result)
        truth = pa.types.is_boolean(table.schema.field(result).type)
        for axes, name in zip(row, factors, strict=False):
            draw_over(axes, table, design, name, values, truth=truth)
        if not factors:
            draw_counts(row[0], result, values)
        else:
            row[0].set_ylabel(f"share of cases: {label(result)}" if truth else label(result))
        for axes in row[1 : len(factors)]:
            axes.sharey(row[0])
            axes.tick_params(which="both", labelleft=False)
        if found:
            draw_shares(row[-1], [one for one in found if one.result == result], shares.get(result))
    if any(np.isfinite(one.total) for one in found):
        grid[0][-1].legend(fontsize=7, frameon=False, loc="center right")
    if factors:
        figure.supxlabel(CAPTION, fontsize=8, x=0.01, ha="left")
    return figure
