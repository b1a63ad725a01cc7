"""Panels in rerun: series over time as lines, values over names as bars, facts as a table."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gfimu.base.files.outputs import RERUN, check_outputs
from gfimu.base.files.rerun_stream import markdown, rrd_stream
from gfimu.base.results.panels import OF_TIME, Panel

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

__all__ = ["log_result", "write_result"]


def write_result(
    path: str | Path, entity: str, heading: str, facts: Sequence[tuple[str, str]], panels: Sequence[Panel]
) -> Path:
    """Write facts and panels as a rerun recording with a layout.

    Raises
    ------
    InputError
        If the name does not end in ``.rrd``, or its folder can't be written to.
    """
    import rerun.blueprint as rrb

    file = Path(path)
    check_outputs([("path", file, RERUN)])
    views = [_view(panel, f"{entity}/{_part(panel.title)}") for panel in panels]
    notes = rrb.TextDocumentView(origin=f"/{entity}/facts", name=heading)
    layout = rrb.Horizontal(notes, rrb.Grid(*views), column_shares=[1, 3])
    with rrd_stream(file, "gfimu", blueprint=rrb.Blueprint(layout, collapse_panels=True)) as stream:
        stream.send_recording_name(heading)
        log_result(stream, entity, heading, facts, panels)
    return file


def log_result(
    stream: rr.RecordingStream,
    entity: str,
    heading: str,
    facts: Sequence[tuple[str, str]],
    panels: Sequence[Panel],
) -> None:
    """Log facts and panels below an entity."""
    lines = [f"# {heading}", "", "| | |", "|---|---|", *(f"| {word} | {_cell(value)} |" for word, value in facts)]
    stream.log(f"{entity}/facts", markdown("\n".join(lines)), static=True)
    for panel in panels:
        _log(stream, panel, f"{entity}/{_part(panel.title)}")


def _log(stream: rr.RecordingStream, panel: Panel, entity: str) -> None:
    import rerun as rr

    for number, series in enumerate(panel.series):
        place = f"{entity}/{number:02d}_{_part(series.name)}"
        if _as_bars(panel):
            x = np.arange(len(series.values)) if panel.by_name or series.x is None else series.x
            stream.log(place, rr.BarChart(np.nan_to_num(series.values), abscissa=x), static=True)
            continue
        t = np.asarray(panel.x if series.x is None else series.x, dtype=float)
        half = None if series.std is None else 2.0 * series.std
        edges = {} if half is None else {"minus 2 sigma": series.values - half, "plus 2 sigma": series.values + half}
        for name, values in {"": series.values, **edges}.items():
            label = f"{series.name} {name}".strip()
            below = f"{place}/{_part(name)}" if name else place
            stream.log(below, rr.SeriesLines(names=[label], widths=[0.8 if name else 1.5]), static=True)
            stream.send_columns(below, [rr.TimeColumn("t", duration=t)], rr.Scalars.columns(scalars=values))


def _view(panel: Panel, entity: str) -> rrb.BarChartView | rrb.TimeSeriesView:
    import rerun.blueprint as rrb

    view = rrb.BarChartView if _as_bars(panel) else rrb.TimeSeriesView
    return view(origin=f"/{entity}", name=f"{panel.title}, {panel.y_label}")


def _as_bars(panel: Panel) -> bool:
    return panel.by_name or panel.x_label != OF_TIME


def _part(text: str) -> str:
    return re.sub(r"\W+", "_", text).strip("_").lower() or "values"


def _cell(text: str) -> str:
    return text.replace("|", "\\|")
