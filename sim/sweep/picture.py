"""Picture of a campaign: each result against each factor, and the share of its variance that each factor causes."""

from __future__ import annotations

import html
import io
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pyarrow as pa
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from gfimu.errors import InputError, unknown_name
from gfimu.files.atomic_file import atomic_path
from gfimu.units import KEY_ENDINGS
from gfimu.visual.colours import AFTER_ON_PAPER, BEFORE_ON_PAPER, INK, NOISE_ON_PAPER, css
from sim.sweep.design import Design
from sim.sweep.plan import RangeTable
from sim.sweep.sensitivity import Sensitivity, seed_shares, sensitivities
from sim.sweep.summary import failures, numbers, result_names, share_of, varying

__all__ = ["campaign_picture", "label"]

Floats = NDArray[np.float64]

_MOST_RESULTS, _MOST_FACTORS = 4, 6  # panels that a page shows legibly
_PANEL = (2.7, 2.4)  # inches
_BINS = 12  # of equal count, along a range
_DOTS = 1500  # cases: of more, dots hide each other
_DECADE = 15.0  # ratio of quantiles 95 and 5 % from which a logarithmic axis shows more
_LONGEST = 12  # characters of a value that stands upright
_CAPTION = (
    "Line: median. Dark band, box: half of the cases. Light band, whiskers: 90 %. Bars: share of the variance that a "
    "factor causes, with 95 % interval."
)
_STYLE = {"font.size": 9, "axes.titlesize": 9, "axes.spines.top": False, "axes.spines.right": False,
          "svg.hashsalt": "gfimu", "text.color": css(INK)}  # fmt: skip
_UNITS = {ending: unit for unit, ending in KEY_ENDINGS.items()} | {
    "mg": "mg", "g": "g", "degC": "°C", "rad2_s2": "rad²/s²", "ratio": "ratio", "ms": "ms", "mm": "mm", "deg": "°"
}  # fmt: skip


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
        if name not in there:
            raise unknown_name("result", name, there)
    if not there:
        raise InputError(f"{folder}: has no results to draw yet; gfimu campaign status {folder} says how far it is")
    drawn = list(results) or there[:_MOST_RESULTS]
    with mpl.rc_context(_STYLE):
        figure = _figure(f"{folder.name}: {len(table)} of {len(design)} cases", table, design, drawn, len(there))
        with atomic_path(path) as part:
            if Path(path).suffix.lower() == ".html":
                Path(part).write_text(_page(figure, folder, table, design), encoding="utf-8")
            else:
                figure.savefig(part, dpi=120, format=Path(path).suffix.lstrip("."), metadata=_metadata(path))
    return drawn


def label(name: str) -> str:
    """Return a column's name as people read it: ``alpha_rms_rad_s2`` is ``alpha rms (rad/s²)``."""
    for ending in sorted(_UNITS, key=len, reverse=True):
        if name.endswith(f"_{ending}"):
            return f"{_words(name.removesuffix(f'_{ending}'))} ({_UNITS[ending]})"
    return _words(name)


def _words(name: str) -> str:
    return name.replace("_", " ").replace(".", " ")


def _metadata(path: str | Path) -> dict[str, None]:
    return {"Date": None} if Path(path).suffix.lower() != ".png" else {}


def _figure(title: str, table: pa.Table, design: Design, results: list[str], all_results: int) -> Figure:
    found = [one for one in sensitivities(table, design) if one.result in results]
    shares = seed_shares(table, design)
    factors = _most_influential(varying(design.plan), found)
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
            _draw(axes, table, design, name, values, truth=truth)
            axes.set_xlabel(label(name))
        if not factors:
            row[0].hist(values[np.isfinite(values)], bins=40, color=css(AFTER_ON_PAPER))
            row[0].set_xlabel(label(result))
            row[0].set_ylabel("cases")
        else:
            row[0].set_ylabel(f"share of cases: {label(result)}" if truth else label(result))
        for axes in row[1 : len(factors)]:
            axes.sharey(row[0])
            axes.tick_params(which="both", labelleft=False)
        if found:
            _draw_bars(row[-1], [one for one in found if one.result == result], shares.get(result))
    if any(np.isfinite(one.total) for one in found):
        grid[0][-1].legend(fontsize=7, frameon=False, loc="center right")
    if factors:
        figure.supxlabel(_CAPTION, fontsize=8, x=0.01, ha="left")
    return figure


def _most_influential(factors: list[str], found: Sequence[Sensitivity]) -> list[str]:
    """Return the factors that have a panel, in the plan's order."""
    largest = {
        name: max((np.nanmax([one.first, one.total]) for one in found if one.factor == name), default=0.0)
        for name in factors
    }
    kept = sorted(factors, key=lambda name: -largest[name])[:_MOST_FACTORS]
    return [name for name in factors if name in kept]


def _draw(axes: Axes, table: pa.Table, design: Design, name: str, values: Floats, *, truth: bool) -> None:
    factor = design.plan.factors[name]
    finite = np.isfinite(values)
    values = values[finite]
    if not truth and len(values) and values.min() > 0.0:
        low, high = np.quantile(values, [0.05, 0.95])
        if high > _DECADE * low:
            axes.set_yscale("log")
    axes.grid(axis="y", lw=0.3)
    if isinstance(factor, RangeTable):
        if factor.scale == "log":
            axes.set_xscale("log")
        else:
            axes.xaxis.set_major_locator(MaxNLocator(4))
            axes.ticklabel_format(axis="x", scilimits=(-2, 4), useMathText=True)
        _draw_bands(axes, numbers(table, name)[finite], values, truth=truth)
        return
    column = np.array(table[name].to_pylist(), dtype=object)[finite]
    levels = sorted(set(factor)) if not any(isinstance(one, str) for one in factor) else list(factor)
    _draw_boxes(axes, [values[column == one] for one in levels], truth=truth)
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
        for place, group in enumerate(groups):
            if len(group):
                low, share, high = share_of(group)
                error = [[share - low], [high - share]]
                axes.errorbar(place, share, error, fmt="o", ms=4, color=css(AFTER_ON_PAPER), capsize=3)
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


def _draw_bars(axes: Axes, found: Sequence[Sensitivity], seeds: float | None) -> None:
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
    for number, (name, values, highs, colour) in enumerate(kinds):
        shift = height * (0.5 * (len(kinds) - 1) - number)
        error = np.nan_to_num(np.subtract(highs, values))
        axes.barh(
            places + shift, np.maximum(values, 0.0), height, color=css(colour), label=name, xerr=error,
            error_kw={"lw": 0.9},
        )  # fmt: skip
    names += [label(one.factor).partition(" (")[0] for one in found]
    axes.set_yticks(range(len(names)), names)
    axes.set_xlim(0.0, 1.05)
    axes.grid(axis="x", lw=0.3)
    axes.set_xlabel("share of the variance")


_PAGE_STYLE = (
    ":root{color-scheme:light dark} body{font-family:sans-serif;margin:min(2em,4vw);overflow-wrap:anywhere} "
    ".picture{overflow-x:auto;background:#fff;border-radius:6px} "
    "svg{display:block;max-width:100%;min-width:640px;height:auto} "
    "@media print{svg{min-width:0}}"
)
"""The picture is on white paper by night too, and scrolls within its box on a narrow screen."""


def _page(figure: Figure, folder: Path, table: pa.Table, design: Design) -> str:
    """Return a page that needs nothing else: the picture, the counts, the reasons of failures."""
    drawing = io.StringIO()
    figure.savefig(drawing, format="svg", metadata={"Date": None})
    svg = drawing.getvalue()
    reasons = "".join(f"<li>{count}: {html.escape(reason)}</li>" for reason, count in failures(table).items())
    name = html.escape(folder.name)
    return (
        f'<!DOCTYPE html><html lang="en"><meta charset="utf-8"><title>Campaign {name}</title>'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<style>{_PAGE_STYLE}</style>"
        f"<h1>Campaign {name}</h1><p>{len(table)} of {len(design)} cases.</p>"
        '<div class="picture" tabindex="0" role="img" aria-label="results over the factors of the campaign">'
        + svg[svg.index("<svg") :]
        + "</div>"
        + (f"<h2>Failures</h2><ul>{reasons}</ul>" if reasons else "")
        + "</html>"
    )
