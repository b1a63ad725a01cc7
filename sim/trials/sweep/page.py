"""The page of a campaign: every result over every factor, shares of variance, reasons of failures, in one HTML file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pyarrow as pa
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gfimu.visual.page import page_style, page_text
from gfimu.visual.page.svg import ON_PAGE, svg_text, themed
from sim.trials.sweep.design import Design
from sim.trials.sweep.panels import CAPTION, draw_counts, draw_over, draw_shares, label, most_influential
from sim.trials.sweep.sensitivity import seed_shares, sensitivities
from sim.trials.sweep.summary import failures, numbers, result_names, varying

__all__ = ["campaign_page"]

_PANEL = (3.6, 2.7)  # inches: as wide as a telephone shows at the size of its letters


def campaign_page(folder: Path, table: pa.Table, design: Design, drawn: Sequence[str]) -> str:
    """Return a page that needs nothing else: every result over every factor, shares of variance, failures.

    Parameters
    ----------
    folder : Path
        The campaign, for the title.
    table : pyarrow.Table
        Its rows.
    design : Design
        The cases of its plan.
    drawn : sequence of str
        Results to draw.
    """
    with mpl.rc_context({**ON_PAGE, "font.size": 9}):
        results = [_result(table, design, result) for result in drawn]
    content = {
        "name": folder.name,
        "done": len(table),
        "cases": len(design),
        "left_out": [label(one) for one in result_names(table, design.plan) if one not in drawn],
        "caption": CAPTION,
        "results": results,
        "failures": failures(table),
        "style": page_style(),
    }
    return page_text(Path(__file__).parent / "templates" / "campaign.html.j2", content)


def _result(table: pa.Table, design: Design, result: str) -> Mapping[str, Any]:
    """Return what the page says and draws of one result."""
    found = [one for one in sensitivities(table, design) if one.result == result]
    values = numbers(table, result)
    truth = pa.types.is_boolean(table.schema.field(result).type)
    what = label(result)
    pictures = []

    def panel(words: str) -> Axes:
        figure = Figure(figsize=_PANEL, layout="constrained")
        pictures.append((figure, words))
        return figure.subplots()

    factors = most_influential(varying(design.plan), found)
    for factor in factors:
        axes = panel(f"{what} over {label(factor)}")
        draw_over(axes, table, design, factor, values, truth=truth)
        axes.set_ylabel(f"share of cases: {what}" if truth else what)
    if not factors:
        draw_counts(panel(f"how often {what} has each value"), result, values)
    has_total = any(np.isfinite(one.total) for one in found)
    if found:
        axes = panel(f"share of the variance of {what} by factor")
        draw_shares(axes, found, seed_shares(table, design).get(result))
        if has_total:
            axes.figure.legend(loc="outside lower center", ncols=2, fontsize=8)
    largest = sorted(found, key=lambda one: -np.nan_to_num(np.nanmax([one.first, one.total])))
    return {
        "what": what,
        "pictures": [(themed(svg_text(figure), 0), words) for figure, words in pictures],
        "has_total": has_total,
        "shares": [
            (
                label(one.factor),
                _interval(one.first, one.first_low, one.first_high),
                _interval(one.total, one.total_low, one.total_high),
            )
            for one in largest
        ],
    }


def _interval(value: float, low: float, high: float) -> str:
    shown = [round(one, 2) + 0.0 for one in (value, low, high)]  # no minus before zero
    return "{:.2f} ({:.2f} to {:.2f})".format(*shown).replace("-", "−") if np.isfinite(value) else "–"
