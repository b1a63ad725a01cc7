"""Panels as a matplotlib figure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gfimu.base.files.atomic_file import atomic_path
from gfimu.base.results.panels import OF_TIME, Panel, Series

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

__all__ = ["drawn", "drawn_chips", "save_figure", "write_panels"]

_WIDTH, _HEIGHT = 7.0, 2.7  # inches of one panel
_LONGEST_LEGEND = 12
_MOST_POINTS = 20_000  # of a line; more can't be seen and make a slow picture
_MANY_NAMES = 7  # under a panel, from which they are turned
_UNSTAMPED = {"svg": {"Date": None}, "png": {"Software": None}}  # the same figure gives the same file
_STYLES = {"line": "-", "dashes": "--", "dots": ":", "points": "."}


def drawn(panels: Sequence[Panel], figure: Figure | SubFigure | None = None) -> Figure | SubFigure:
    """Draw panels one below the other, in two columns where they are many."""
    across, down = _across_and_down(panels)
    drawing = _new_figure(across, down) if figure is None else figure
    grid = drawing.subplots(down, across, squeeze=False)
    for axes, panel in zip(grid.flat, panels, strict=False):
        _draw(axes, _as_written(panel))
    for axes in grid.flat[len(panels) :]:
        axes.remove()
    return drawing


def write_panels(path: str | Path, title: str, panels: Sequence[Panel]) -> None:
    """Write a picture of panels below a title, as `save_figure`."""
    from matplotlib.figure import Figure

    figure = drawn(panels, Figure(figsize=_size(*_across_and_down(panels)), layout="constrained"))
    figure.suptitle(_literal(title), fontsize=11)
    save_figure(path, figure)


def save_figure(path: str | Path, figure: Any, dpi: int = 120) -> None:
    """Write a figure, whole or not at all; the extension decides the format, PNG without one."""
    kind = Path(path).suffix.lstrip(".").lower() or "png"
    with atomic_path(path) as temporary:
        figure.savefig(temporary, dpi=dpi, format=kind, metadata=_UNSTAMPED.get(kind))


def _across_and_down(panels: Sequence[Panel]) -> tuple[int, int]:
    across = 2 if len(panels) > 3 else 1
    return across, -(-len(panels) // across)


def _size(across: int, down: int) -> tuple[float, float]:
    """Return width and height of a figure, inches."""
    return _WIDTH * across, _HEIGHT * down + 0.4


def drawn_chips(
    title: str,
    chips: Sequence[tuple[str, NDArray[np.float64], NDArray[np.float64]]],
    figure: Figure | None = None,
) -> Figure:
    """Draw chips in 3-D: the name of each, its position (3,), m, and its sensing axes (k, 3)."""
    from gfimu.base.results.colours import PALE, chip_colour, css

    drawing = _new_figure(1, 2) if figure is None else figure
    axes: Any = drawing.add_subplot(projection="3d")
    places = 1e3 * np.array([place for _, place, _ in chips])  # (k, 3), mm
    reach = max(float(np.abs(places).max()), 1.0)
    for number, ((name, _, directions), place) in enumerate(zip(chips, places, strict=True)):
        colour = css(chip_colour(number, on_paper=True))
        axes.plot(*np.column_stack([[*place[:2], -1.4 * reach], place]), color=css(PALE), linewidth=0.8)
        axes.scatter(*place, s=36, color=colour)
        for direction in directions:
            axes.quiver(*place, *(0.35 * reach * direction), color=colour, linewidth=1.4, arrow_length_ratio=0.25)
        axes.text(*(place + 0.08 * reach), _literal(name), fontsize=9)
    axes.set_title(f"{_literal(title)}, body frame", fontsize=10)
    for axis in "xyz":
        getattr(axes, f"set_{axis}lim")(-1.4 * reach, 1.4 * reach)
        getattr(axes, f"set_{axis}label")(f"{axis}, mm")
    axes.set_box_aspect((1.0, 1.0, 1.0))
    return drawing


def _as_written(panel: Panel) -> Panel:
    """Return the panel with texts that matplotlib shows as they are: names come from files of others."""
    return replace(
        panel,
        title=_literal(panel.title),
        y_label=_literal(panel.y_label),
        x_label=_literal(panel.x_label),
        series=tuple(replace(one, name=_literal(one.name)) for one in panel.series),
        x=tuple(map(_literal, panel.x)) if isinstance(panel.x, tuple) else panel.x,
    )


def _literal(text: str) -> str:
    """Return a text without mathematics in it: two dollar signs would enclose a formula."""
    return text.replace("$", r"\$")


def _new_figure(across: int, down: int) -> Figure:
    """Return a figure of pyplot, so that a script can show it; a backend without windows keeps no hold of it."""
    import matplotlib as mpl
    from matplotlib import pyplot as plt

    figure = plt.figure(figsize=_size(across, down), layout="constrained")
    backend = mpl.get_backend().lower()
    if backend == "agg" or "inline" in backend:  # a notebook shows the cell's value; it would show this one twice
        plt.close(figure)
    return figure


def _draw(axes: Any, panel: Panel) -> None:
    axes.set_title(panel.title, fontsize=10)
    axes.set_ylabel(panel.y_label)
    (_draw_names if panel.by_name else _draw_lines)(axes, panel)
    if panel.scale == "zero":
        axes.set_ylim(bottom=0.0, top=1.05 * axes.get_ylim()[1])
    elif panel.scale == "log":
        axes.set_yscale("log")
    axes.grid(which="major", linewidth=0.4, alpha=0.6)
    named = [one.name for one in panel.series if one.name]
    if 0 < len(named) <= _LONGEST_LEGEND and (len(panel.series) > 1 or not panel.by_name):
        axes.legend(fontsize=8, ncols=min(4, len(named)), framealpha=0.7)


def _draw_lines(axes: Any, panel: Panel) -> None:
    for place, series in enumerate(panel.series):
        x = np.asarray(panel.x if series.x is None else series.x, dtype=float)
        step = max(1, -(-len(x) // _MOST_POINTS))
        t, y, colour = x[::step], series.values[::step], _colour(series, place)
        if series.std is not None:
            half = 2.0 * series.std[::step]
            axes.fill_between(t, y - half, y + half, color=colour, alpha=0.22, linewidth=0.0)
        axes.plot(
            t, y, _STYLES.get(series.style, "-"), color=colour, linewidth=1.1, label=_label(series) or "_", zorder=3
        )
    if panel.shaded is not None:
        axes.axvspan(*panel.shaded, color="0.93", zorder=-1)
    axes.set_xlabel(panel.x_label)
    if panel.scale == "log":
        axes.set_xscale("log")


def _draw_names(axes: Any, panel: Panel) -> None:
    """Draw each value as a dot over its name; those of several series stand side by side."""
    names = list(panel.x)
    places = np.arange(len(names), dtype=float)
    count = len(panel.series)
    for number, series in enumerate(panel.series):
        offset = 0.0 if count == 1 else 0.5 * (number / (count - 1) - 0.5)
        bars = None if series.std is None else 2.0 * series.std
        axes.errorbar(
            places + offset, series.values, yerr=bars, fmt="o", markersize=4, capsize=3, elinewidth=1.1,
            color=_colour(series, number), label=_label(series) or "_",
        )  # fmt: skip
    turned = len(names) > _MANY_NAMES or max(map(len, names), default=0) > 14
    axes.set_xticks(
        places,
        list(names),
        rotation=60 if turned else 0,
        ha="right" if turned else "center",
        fontsize=8,
    )
    axes.set_xlim(-0.6, len(names) - 0.4)
    if panel.x_label and panel.x_label != OF_TIME:
        axes.set_xlabel(panel.x_label)


def _label(series: Series) -> str:
    name = series.name
    return f"{name} ± 2σ" if name and series.std is not None else name


def _colour(series: Series, place: int) -> str:
    from gfimu.base.results.colours import (
        AFTER_ON_PAPER,
        AXES_ON_PAPER,
        BEFORE_ON_PAPER,
        NOISE_ON_PAPER,
        chip_colour,
        css,
    )

    roles = dict(zip("xyz", AXES_ON_PAPER, strict=True))
    roles |= {"before": BEFORE_ON_PAPER, "after": AFTER_ON_PAPER, "noise": NOISE_ON_PAPER}
    if series.role in roles:
        return css(roles[series.role])
    return css(chip_colour(place if series.chip is None else series.chip, on_paper=True))
