"""The page of a campaign: every result over every factor, shares of variance, reasons of failures, in one HTML file."""

from __future__ import annotations

import html
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pyarrow as pa
from matplotlib.figure import Figure

from gfimu.base.errors import printable
from gfimu.visual.page import STILL_POLICY, page_style
from gfimu.visual.page.svg import ON_PAGE, svg_text, themed
from sim.trials.sweep.design import Design
from sim.trials.sweep.panels import CAPTION, draw_counts, draw_over, draw_shares, label, most_influential
from sim.trials.sweep.sensitivity import Sensitivity, seed_shares, sensitivities
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
        sections = "".join(_section(table, design, result) for result in drawn)
    name = html.escape(folder.name)
    reasons = "".join(f"<li>{count}: {html.escape(reason)}</li>" for reason, count in failures(table).items())
    left_out = [one for one in result_names(table, design.plan) if one not in drawn]
    more = f" Not drawn: {html.escape(', '.join(map(label, left_out)))}." if left_out else ""
    return printable(
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f'<meta http-equiv="Content-Security-Policy" content="{STILL_POLICY}">'
        f"<title>Campaign {name}</title>"
        f'<link rel="icon" href="data:,"><style>{page_style()}</style></head>\n<body class="found"><main>'
        f"<header><h1>Campaign {name}</h1><p>{len(table)} of {len(design)} cases.{more}</p>"
        f'<p class="small quiet">{CAPTION}</p></header>\n'
        + sections
        + (f'<section class="card"><h3>Failures</h3><ul>{reasons}</ul></section>' if reasons else "")
        + "</main></body></html>\n"
    )


def _section(table: pa.Table, design: Design, result: str) -> str:
    """Return the part of a page about one result."""
    found = [one for one in sensitivities(table, design) if one.result == result]
    values = numbers(table, result)
    truth = pa.types.is_boolean(table.schema.field(result).type)
    what = html.escape(label(result))
    factors = most_influential(varying(design.plan), found)
    pictures = []
    for factor in factors:
        figure = Figure(figsize=_PANEL, layout="constrained")
        axes = figure.subplots()
        draw_over(axes, table, design, factor, values, truth=truth)
        axes.set_ylabel(f"share of cases: {label(result)}" if truth else label(result))
        pictures.append((figure, f"{what} over {html.escape(label(factor))}"))
    if not factors:
        figure = Figure(figsize=_PANEL, layout="constrained")
        draw_counts(figure.subplots(), result, values)
        pictures.append((figure, f"how often {what} has each value"))
    if found:
        figure = Figure(figsize=_PANEL, layout="constrained")
        axes = figure.subplots()
        draw_shares(axes, found, seed_shares(table, design).get(result))
        if any(np.isfinite(one.total) for one in found):
            figure.legend(loc="outside lower center", ncols=2, fontsize=8)
        pictures.append((figure, f"share of the variance of {what} by factor"))
    drawings = "".join(
        f"<figure>{themed(svg_text(figure), 0)}<figcaption>{words}</figcaption></figure>" for figure, words in pictures
    )
    return (
        f'<section class="card"><h3>{what}</h3><div class="pictures">{drawings}</div>{_shares(found, what)}</section>\n'
    )


def _shares(found: Sequence[Sensitivity], what: str) -> str:
    """Return the shares of the variance as a table, the largest first."""
    if not found:
        return ""

    def cell(value: float, low: float, high: float) -> str:
        shown = [round(one, 2) + 0.0 for one in (value, low, high)]  # no minus before zero
        return "{:.2f} ({:.2f} to {:.2f})".format(*shown).replace("-", "−") if np.isfinite(value) else "–"

    has_total = any(np.isfinite(one.total) for one in found)

    def total(one: Sensitivity) -> str:
        return f'<td class="number">{cell(one.total, one.total_low, one.total_high)}</td>' if has_total else ""

    rows = "".join(
        f'<tr><td class="name">{html.escape(label(one.factor))}</td>'
        f'<td class="number">{cell(one.first, one.first_low, one.first_high)}</td>{total(one)}</tr>'
        for one in sorted(found, key=lambda one: -np.nan_to_num(np.nanmax([one.first, one.total])))
    )
    return (
        f'<div class="scroll" tabindex="0" role="group" aria-label="shares of the variance of {what}">'
        '<table class="small"><caption>Share of the variance, with 95 % interval</caption>'
        f"<tr><th>factor</th><th>first order</th>{'<th>total</th>' if has_total else ''}</tr>{rows}</table></div>"
    )
