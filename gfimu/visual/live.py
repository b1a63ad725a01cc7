"""The picture of a recording while it is made: the array with its readings as arrows, and the channels by chip."""

from __future__ import annotations

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from gfimu.geometry.array import AccelerometerArray
from gfimu.visual.colours import AXES, chip_colour
from gfimu.visual.rig import array_shapes, axes_shapes, channel_shapes, chip_names, drawing_size
from gfimu.visual.rig.words import array_words, scene_title
from gfimu.visual.run import reading_arrows
from gfimu.visual.scene import Body, Scene

__all__ = ["LivePicture"]

_NOTES = "notes"
_ARRAY = "scene/array"


class LivePicture:
    """What a stream is drawn as; it holds ``readings/a11`` …, ``omega/x`` … and ``health/a11`` ….

    Parameters
    ----------
    array : AccelerometerArray
        The array.
    """

    def __init__(self, array: AccelerometerArray) -> None:
        self._array = array
        still = reading_arrows(array, np.zeros(1), np.zeros((1, array.n_channels)))
        self._length, self._radius = still.length_per_m_s2, still.radius

    def open(self, stream: rr.RecordingStream) -> None:
        """Send the array, the colours and names of the lines, and the layout."""
        array, size = self._array, drawing_size(self._array)
        shapes = [*array_shapes(array), channel_shapes(array), chip_names(array), axes_shapes(array)]
        scene = Scene([Body("array", shapes)], eye=(2.9 * size, -2.6 * size, 2.1 * size), look_at=(0.0, 0.0, 0.0))
        scene.log(stream)
        colours = [chip_colour(int(chip)) for chip in array.chip_of_channel]
        arrows = rr.Arrows3D.from_fields(
            origins=array.positions,
            colors=colours,
            radii=[self._radius],
            labels=list(array.channels),
            show_labels=False,
        )
        stream.log(f"{_ARRAY}/readings", arrows, static=True)
        for channel, colour in zip(array.channels, colours, strict=True):
            stream.log(
                f"readings/{channel}", rr.SeriesLines(names=[channel], colors=[colour], widths=[1.2]), static=True
            )
            stream.log(f"health/{channel}", rr.SeriesLines(names=[channel], colors=[colour], widths=[2.0]), static=True)
        for axis, colour in zip("xyz", AXES, strict=True):
            stream.log(f"omega/{axis}", rr.SeriesLines(names=[f"ω {axis}"], colors=[colour], widths=[1.5]), static=True)
        stream.log(_NOTES, rr.TextDocument(self._notes(), media_type=rr.MediaType.MARKDOWN), static=True)
        stream.send_blueprint(self._layout(scene), make_active=True, make_default=True)

    def add(self, stream: rr.RecordingStream, times: rr.TimeColumn, readings: NDArray[np.float64]) -> None:
        """Send the arrows of readings (n, c), m/s², at times (n,)."""
        vectors = (readings * self._length)[:, :, None] * self._array.axes  # (n, c, 3)
        lengths = np.full(len(readings), self._array.n_channels)
        columns = rr.Arrows3D.columns(vectors=np.nan_to_num(vectors).reshape(-1, 3)).partition(lengths)
        stream.send_columns(f"{_ARRAY}/readings", [times], columns)

    def _layout(self, scene: Scene) -> rrb.Blueprint:
        array = self._array
        most = max(len(chip.axes) for chip in array.chips)
        lines = [
            rrb.TimeSeriesView(
                origin="/readings",
                contents=[f"/readings/{chip.channels[axis]}" for chip in array.chips if axis < len(chip.axes)],
                name=f"raw, axis {axis + 1}, m/s²",
            )
            for axis in range(most)
        ]
        rate = rrb.TimeSeriesView(origin="/omega", name="angular rate ω, rad/s")
        health = rrb.TimeSeriesView(
            origin="/health",
            name=f"health, a lane per channel, {array.channels[0]} at the top; raised: not used",
            plot_legend=rrb.PlotLegend(visible=False),
        )
        left = rrb.Vertical(
            scene.view(scene_title(array)),
            rrb.TextDocumentView(origin=f"/{_NOTES}", name="what you see"),
            row_shares=[3, 2],
        )
        return rrb.Blueprint(
            rrb.Horizontal(left, rrb.Vertical(*lines, rate, health), column_shares=[2, 3]),
            rrb.BlueprintPanel(state="collapsed"),
            rrb.SelectionPanel(state="collapsed"),
            auto_views=False,
            auto_layout=False,
        )

    def _notes(self) -> str:
        return f"""\
**3-D.** The array in its body frame. Each thick arrow is as long as its channel reads, in m/s². Chips are drawn larger
than they are; each has one hue in all pictures. At rest the arrows together point up.

**Plots.** One line per chip; time on the board's clock, in seconds. The rate is there once the filter has started, and
only where the array sees all six motions.

**Health.** A line stands at the bottom of its lane while its channel is used, in the middle while it is in doubt, at
the top when it contradicts the others and is not used for the rate. Needs a rest of some seconds at the start.

{array_words(self._array)}
"""
