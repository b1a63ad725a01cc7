"""Plots over time: a title with its unit, and lines or bands that share the recording's timeline."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from gfimu.base.results.colours import Colour
from gfimu.visual.scene import TIMELINE

__all__ = ["LONGEST_LEGEND", "Line", "Plot", "broken_at_gaps", "entity_part"]

LONGEST_LEGEND = 12
"""Lines that a legend names; a longer one would cover the plot."""


_LONGEST_TOGETHER_S = 60.0  # of a run whose plots zoom together


@dataclass(frozen=True)
class Line:
    """One line, or several of one name and colour: the edges of a band, the components of a truth.

    Parameters
    ----------
    name : str
        Name in the legend.
    t : ndarray, shape (n,)
        Time, s.
    values : ndarray, shape (n,) or (n, k)
        Values; each column is a line of its own.
    colour : Colour
        Colour of the line.
    width : float
        Width in points of the screen.
    """

    name: str
    t: NDArray[np.float64]
    values: NDArray[np.float64]
    colour: Colour
    width: float = 1.5


@dataclass(frozen=True)
class Plot:
    """Lines that share an axis.

    Parameters
    ----------
    title : str
        What is drawn and in which unit.
    lines : sequence of Line
        The lines, the first at the back.
    legend : bool
        Whether to name the lines.
    span : tuple of float, optional
        Lowest and highest value to show, so that several plots can be compared by eye; all data otherwise.
    """

    title: str
    lines: Sequence[Line]
    legend: bool = True
    span: tuple[float, float] | None = None

    @property
    def entity(self) -> str:
        """Path of the plot in the recording."""
        return f"plots/{entity_part(self.title)}"

    def log(self, stream: rr.RecordingStream) -> None:
        """Write the lines, by columns."""
        for index, line in enumerate(self.lines):
            entity = f"{self.entity}/{index:02d}_{entity_part(line.name)}"
            t, values = broken_at_gaps(line.t, line.values.reshape(len(line.t), -1))
            count = values.shape[1]
            style = rr.SeriesLines(names=[line.name] * count, colors=[line.colour] * count, widths=[line.width] * count)
            stream.log(entity, style, static=True)
            stream.send_columns(
                entity,
                [rr.TimeColumn(TIMELINE, duration=t)],
                rr.Scalars.columns(scalars=values.ravel()).partition(np.full(len(t), count)),
            )

    def view(self) -> rrb.TimeSeriesView:
        """Return the view of the plot for a blueprint.

        Plots of a run of up to a minute zoom together. Plots that do show the half minute around the cursor of a longer
        run, whatever range is asked for: each of those zooms alone, and shows the whole run at first.
        """
        first, last = _whole_run(self.lines)
        together = last - first <= _LONGEST_TOGETHER_S
        whole = rr.TimeRange(
            start=rr.TimeRangeBoundary.absolute(seconds=first), end=rr.TimeRangeBoundary.absolute(seconds=last)
        )
        return rrb.TimeSeriesView(
            origin=f"/{self.entity}",
            name=self.title,
            axis_x=rrb.TimeAxis(
                link=rrb.components.LinkAxis.LinkToGlobal if together else rrb.components.LinkAxis.Independent,
                view_range=whole,
            ),
            axis_y=rrb.ScalarAxis(range=self.span or _all_values(self.lines)),
            plot_legend=rrb.PlotLegend(
                corner=_emptiest_corner(self.lines), visible=self.legend and len(self.lines) <= LONGEST_LEGEND
            ),
        )


def _whole_run(lines: Sequence[Line]) -> tuple[float, float]:
    """First and last time of the lines, s."""
    times = [float(line.t[end]) for line in lines if len(line.t) for end in (0, -1)] or [0.0]
    return min(times), max(times)


def _all_values(lines: Sequence[Line]) -> tuple[float, float]:
    """Range of all values with a margin; the viewer's own is that of the samples that have arrived when it opens."""
    values = np.concatenate([line.values.ravel() for line in lines])
    values = values[np.isfinite(values)]
    if not len(values):
        return -1.0, 1.0
    low, high = float(values.min()), float(values.max())
    margin = 0.05 * (high - low) or 0.1 * abs(high) or 1.0
    return low - margin, high + margin


def _emptiest_corner(lines: Sequence[Line]) -> rrb.Corner2D:
    """Return the corner of the plot with the least data, for the legend."""
    points = np.concatenate([_some_points(line) for line in lines])
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        return rrb.Corner2D.RightTop
    low, high = points.min(axis=0), points.max(axis=0)
    across, up = ((points - low) / np.where(high > low, high - low, 1.0)).T
    left, right, bottom, top = across < 0.25, across > 0.75, up < 0.4, up > 0.6
    covered = {
        rrb.Corner2D.RightTop: right & top,
        rrb.Corner2D.LeftTop: left & top,
        rrb.Corner2D.RightBottom: right & bottom,
        rrb.Corner2D.LeftBottom: left & bottom,
    }
    return min(covered, key=lambda corner: int(covered[corner].sum()))


def _some_points(line: Line) -> NDArray[np.float64]:
    """About a thousand points (t, value) of a line, shape (m, 2)."""
    step = max(1, len(line.t) // 1000)
    values = line.values.reshape(len(line.t), -1)[::step]
    return np.column_stack([np.repeat(line.t[::step], values.shape[1]), values.ravel()])


def entity_part(text: str) -> str:
    """Return a name as a part of an entity path."""
    return re.sub(r"[^\w]+", "_", text).strip("_")


def broken_at_gaps(
    t: NDArray[np.float64], values: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Insert a NaN into every gap of more than 1.5 sample periods: lost samples show as a break, not as a line."""
    if len(t) < 3:
        return t, values
    steps = np.diff(t)
    gaps = np.flatnonzero(steps > 1.5 * np.median(steps))
    middles = t[gaps] + steps[gaps] / 2
    return np.insert(t, gaps + 1, middles), np.insert(values, gaps + 1, np.nan, axis=0)
