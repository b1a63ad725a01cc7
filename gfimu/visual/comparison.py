"""The picture of a diagnosis: every channel as measured and as predicted, before and after the model was extended."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path as FilePath

import numpy as np
import rerun.blueprint as rrb
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError
from gfimu.base.results.colours import Colour
from gfimu.recording import Recording
from gfimu.visual.colours import AFTER, BEFORE, MEASURED
from gfimu.visual.motion import KnownMotion
from gfimu.visual.plots import Line, Plot
from gfimu.visual.rig import drawing_size
from gfimu.visual.rig.words import comparison_legend
from gfimu.visual.rrd_file import notes_view, write_rrd
from gfimu.visual.run import run_scene
from gfimu.visual.scene import Scene, SensingArrows, Shape

__all__ = ["write_comparison"]

_LONGEST_ARROW = 2.0  # length of the largest residual, in sizes of the drawing


def write_comparison(
    path: str | FilePath,
    recording: Recording,
    array: AccelerometerArray,
    before: NDArray[np.float64],
    after: NDArray[np.float64] | None = None,
    *,
    known: KnownMotion | None = None,
    plots: Sequence[Plot] = (),
    shapes: Mapping[str, Sequence[Shape]] | None = None,
    notes: str = "",
    title: str = "measured and predicted",
) -> None:
    """Write the rerun recording of measured readings beside two predictions of them.

    Parameters
    ----------
    path : str or Path
        File to write, ``.rrd``.
    recording : Recording
        What was measured, in m/s².
    array : AccelerometerArray
        Geometry of the channels.
    before : ndarray, shape (n, c)
        Prediction of the nominal model, m/s²; NaN where there is none.
    after : ndarray, shape (n, c), optional
        Prediction of the extended model.
    known : KnownMotion, optional
        Motion of the rig; the recording's own reference otherwise.
    plots : sequence of Plot
        Further plots (rates, residual against angle), on a tab of their own.
    shapes : mapping of str to sequence of Shape, optional
        Shapes of ``base``, ``table`` and ``cube``; a plain rig otherwise.
    notes : str
        Markdown: the verdict in words.
    title : str
        Name that the viewer shows.

    Raises
    ------
    InputError
        If a prediction does not have the shape of the readings, or the file can't be written.
    """
    measured = recording.for_array(array)
    predictions = {"before": before} if after is None else {"before": before, "after": after}
    for name, prediction in predictions.items():
        if prediction.shape != measured.shape:
            raise InputError(f"prediction {name!r} has shape {prediction.shape}; the readings have {measured.shape}")
    known = known or KnownMotion.from_reference(recording, array)
    readings = _channel_plots(recording.t_s, array, "", {"measured": measured, **predictions})
    left_over = {name: measured - prediction for name, prediction in predictions.items()}
    residuals = _channel_plots(recording.t_s, array, "residual ", left_over, span=_common_span(left_over["before"]))
    scene = _residual_scene(recording, array, left_over, known, shapes)
    tabs = [_grid("residuals, m/s²", residuals, array), _grid("readings, m/s²", readings, array)]
    if plots:
        tabs.append(rrb.Grid(*[plot.view() for plot in plots], name="further"))
    layout = rrb.Horizontal(
        rrb.Vertical(
            scene.view(f"residuals along the sensing axes of array {array.name}"), notes_view(), row_shares=[3, 2]
        ),
        rrb.Tabs(*tabs, active_tab=0),
        column_shares=[2, 3],
    )
    write_rrd(
        path,
        title=title,
        layout=layout,
        scene=scene,
        plots=[*residuals, *readings, *plots],
        notes=f"{notes}\n\n{comparison_legend(array, extended=after is not None)}".strip(),
    )


_STYLES: Mapping[str, tuple[str, Colour, float]] = {
    "measured": ("measured", MEASURED, 2.0),
    "before": ("predicted before", BEFORE, 1.2),
    "after": ("predicted after", AFTER, 1.2),
}


def _channel_plots(
    t: NDArray[np.float64],
    array: AccelerometerArray,
    prefix: str,
    series: Mapping[str, NDArray[np.float64]],
    *,
    span: tuple[float, float] | None = None,
) -> list[Plot]:
    """One plot per channel; the first of them carries the legend."""
    plots = []
    for column, channel in enumerate(array.channels):
        lines = []
        for name, values in series.items():
            legend, colour, width = _STYLES[name]
            lines.append(Line(name if prefix else legend, t, values[:, column], colour, width))
        plots.append(Plot(f"{prefix}{channel}", lines, legend=column == 0, span=span))
    return plots


def _common_span(residual: NDArray[np.float64]) -> tuple[float, float] | None:
    """One symmetric range for all channels, wide enough for all but the wildest samples."""
    finite = np.abs(residual[np.isfinite(residual)])
    if not finite.size or not finite.any():
        return None
    widest = 1.1 * float(np.percentile(finite, 99.9))
    return (-widest, widest) if widest > 0 else None


def _grid(name: str, plots: Sequence[Plot], array: AccelerometerArray) -> rrb.Grid:
    """Arrange the channels with one row per chip."""
    columns = max(len(chip.axes) for chip in array.chips)
    return rrb.Grid(*[plot.view() for plot in plots], grid_columns=columns, name=name)


def _residual_scene(
    recording: Recording,
    array: AccelerometerArray,
    left_over: Mapping[str, NDArray[np.float64]],
    known: KnownMotion | None,
    shapes: Mapping[str, Sequence[Shape]] | None,
) -> Scene:
    """Build the scene with one arrow per channel and prediction, as long as its residual."""
    span = _common_span(left_over["before"])
    size = drawing_size(array)
    scale = _LONGEST_ARROW * size / span[1] if span is not None else size
    arrows = [
        SensingArrows(array, recording.t_s, residual, scale, 0.044 * size, _STYLES[name][1])
        for name, residual in left_over.items()
    ]
    return run_scene(arrows, array, known=known, shapes=shapes, on_table=known is None or known.angle is not None)
