"""The picture of a recording while it is made: the body as it turns, rate, health of channels, readings, the stream.

Entities: ``rate/omega_x`` …, ``rate/sign_probability``, ``health/a11`` …, ``readings/axis_1`` …, ``stream/…``,
``scene/…``, ``events``, ``notes``; all on the timeline ``time``, s on the board's clock.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from rerun.blueprint.encodings import TextLogColumnKind

from gfimu.array.array import AccelerometerArray
from gfimu.array.observability import require_all_motions
from gfimu.base.errors import GeometryError
from gfimu.base.files.rerun_stream import markdown
from gfimu.base.results.colours import AXES, ESTIMATE, HEALTH, TACHO, UNDECIDED, Colour, chip_colour
from gfimu.visual.live_drawing import BODY, EVENTS, LiveDrawing, axis_columns
from gfimu.visual.plots import entity_part
from gfimu.visual.rig import array_shapes, axes_shapes, channel_shapes, chip_names, drawing_size, gravity_shapes
from gfimu.visual.rig.words import array_words, scene_title
from gfimu.visual.run import reading_arrows
from gfimu.visual.scene import TIMELINE, Body, Scene

__all__ = ["SHOWN_S", "LivePicture"]

SHOWN_S = 30.0
"""Time that the plots show, s; they follow the newest sample."""

_NOTES = "notes"
_PALE = 120  # opacity of the edges of a band
_STREAM = {
    "sample_rate": ("sample rate, Hz", {"samples that came, Hz": TACHO}),
    "missing": ("lost, corrupt", {"samples lost": HEALTH["excluded"], "frames corrupt": HEALTH["in doubt"]}),
    "delay": ("delay, s", {"newest sample, s": TACHO, "rate, s": ESTIMATE}),
}
"""Plots of the stream: title, and name and colour of each line."""

_LOG_COLUMNS = rrb.TextLogColumns(
    timeline_columns=[TIMELINE], text_log_columns=[TextLogColumnKind.LogLevel, TextLogColumnKind.Body]
)


class LivePicture:
    """What a stream is drawn as.

    Parameters
    ----------
    array : AccelerometerArray
        The array.
    """

    def __init__(self, array: AccelerometerArray) -> None:
        self._array = array
        size = drawing_size(array)
        shapes = [*array_shapes(array), channel_shapes(array), chip_names(array), axes_shapes(array)]
        self._scene = Scene(
            [Body("array", shapes), Body("gravity", gravity_shapes(array, np.zeros(3)))],
            eye=(3.6 * size, -3.2 * size, 2.6 * size),
            look_at=(0.0, 0.0, 0.5 * size),
        )
        try:
            require_all_motions(array)
            self._has_rate = True
        except GeometryError:
            self._has_rate = False

    def open(self, stream: rr.RecordingStream) -> LiveDrawing:
        """Send the array, the colours and names of the lines, and the layout; return what draws the rest."""
        array = self._array
        self._scene.log(stream)
        chips = [chip_colour(index) for index in range(len(array.chips))]
        for axis, columns in enumerate(axis_columns(array)):
            names, colours = [array.channels[column] for column in columns], array.chip_of_channel[columns]
            _style(stream, f"readings/axis_{axis + 1}", names, [chips[int(chip)] for chip in colours], 1.2)
        if self._has_rate:
            for name, colour in zip("xyz", AXES, strict=True):
                _style(stream, f"rate/omega_{name}/band", ["+2σ", "−2σ"], [(*colour[:3], _PALE)] * 2, 1.0)
                _style(stream, f"rate/omega_{name}/estimate", [f"ω {name}"], [colour], 2.0)
            _style(stream, "rate/sign_probability", ["probability of the sign"], [UNDECIDED], 1.5)
            states = rr.StateConfiguration(values=list(HEALTH), labels=list(HEALTH), colors=list(HEALTH.values()))
            for channel in array.channels:
                stream.log(f"health/{entity_part(channel)}", states, static=True)
        for name, (_, lines) in _STREAM.items():
            _style(stream, f"stream/{name}", list(lines), list(lines.values()), 1.5)
        arrows = reading_arrows(array, np.zeros(1), np.zeros((1, array.n_channels)))
        sites = rr.Arrows3D.from_fields(
            origins=array.chip_positions,
            colors=chips,
            radii=[arrows.radius],
            labels=[f"{chip.name}: specific force" for chip in array.chips],
            show_labels=False,
        )
        stream.log(f"{BODY}/specific_force", sites, static=True)
        stream.log(_NOTES, markdown(self._notes()), static=True)
        stream.send_blueprint(self.blueprint(), make_active=True, make_default=True)
        return LiveDrawing(stream, array, arrows.length_per_m_s2)

    def blueprint(self) -> rrb.Blueprint:
        """Return the layout: the last half minute, following the newest sample."""
        array = self._array
        axes = range(1, len(axis_columns(array)) + 1)
        raw = [_plot(f"readings/axis_{axis}", f"readings, axis {axis} of each chip, m/s²") for axis in axes]
        stream = [_plot(f"stream/{name}", title) for name, (title, _) in _STREAM.items()]
        rows: list[rrb.Container | rrb.View] = [rrb.Vertical(*raw), rrb.Horizontal(*stream)]
        shares = [4, 1]
        if self._has_rate:
            rates = [_plot(f"rate/omega_{name}", f"ω {name} with ±2σ, rad/s") for name in "xyz"]
            sign = _plot("rate/sign_probability", "sign of ω, probability", span=(0.4, 1.05))
            rows = [
                rrb.Horizontal(rrb.Vertical(*rates), rrb.Vertical(*raw)),
                rrb.Horizontal(*self._lanes()),
                rrb.Horizontal(sign, *stream),
            ]
            shares = [9, 6, 4]
        left = rrb.Vertical(
            self._scene.view(scene_title(array)),
            rrb.Tabs(
                rrb.TextLogView(origin=f"/{EVENTS}", name="what happened", columns=_LOG_COLUMNS),
                rrb.TextDocumentView(origin=f"/{_NOTES}", name="what you see"),
                active_tab=0,
            ),
            row_shares=[5, 3],
        )
        return rrb.Blueprint(
            rrb.Horizontal(left, rrb.Vertical(*rows, row_shares=shares), column_shares=[2, 3]),
            rrb.TimePanel(state="collapsed", timeline=TIMELINE, play_state="following"),
            rrb.BlueprintPanel(state="collapsed"),
            rrb.SelectionPanel(state="collapsed"),
            auto_views=False,
            auto_layout=False,
        )

    def _lanes(self) -> list[rrb.View]:
        """Return the lanes of health, in two views beside each other, as a lane is high."""
        channels = self._array.channels
        half = -(-len(channels) // 2)
        return [
            rrb.StateTimelineView(
                origin="/health",
                contents=[f"/health/{entity_part(name)}" for name in part],
                name=f"health, {part[0]} to {part[-1]}",
                time_view=_window(),
            )
            for part in (channels[:half], channels[half:])
        ]

    def _notes(self) -> str:
        lanes = ", ".join(f"**{word}**" for word in HEALTH)
        rate = f"""
**Rate.** The filter's estimate in body axes, in its ±2σ band, and the probability that its sign is right (½ at rest,
where a sign means nothing). It comes from uncalibrated readings with the biases of the first rest; its first second, in
which they settle, is not drawn.

**Health.** A lane per channel: {lanes}. The watch needs a rest of some seconds at the start, or a rate that has
settled. Channels that are not used have a red axis in the scene. The recording holds every channel all the same.
"""
        turns = "The body turns with the estimated rate; its tilt follows the specific force within a second. "
        return f"""\
**3-D.** {turns * self._has_rate}\
The thick arrow of each chip is its specific force; at rest it points up. Thin arrows are the sensing axes. Chips are
drawn larger than they are; each has one hue in all pictures.
{rate * self._has_rate}
**Readings.** One line per chip in its hue, raw. A fast stream is shown as means, so that vibration can be larger than
drawn.

**Stream.** Samples that came per second; samples lost (red) and frames corrupt (yellow), in total. Delay of the newest
sample (blue): beyond the least of the last minute; of the rate (orange): what the filter has still to do.

Time is on the board's clock, in seconds; the plots follow the last {SHOWN_S:.0f} s. Pause below to look back.

{array_words(self._array)}
"""


def _style(
    stream: rr.RecordingStream, entity: str, names: Sequence[str], colours: Sequence[Colour], width: float
) -> None:
    """Send name, colour and width of the lines of an entity."""
    lines = rr.SeriesLines(names=list(names), colors=list(colours), widths=[width] * len(names))
    stream.log(entity, lines, static=True)


def _window() -> rrb.TimeAxis:
    """Return the time axis of every plot: the last half minute before the cursor, which follows the newest sample."""
    ends = (rr.TimeRangeBoundary.cursor_relative(seconds=seconds) for seconds in (-SHOWN_S, 0.0))
    return rrb.TimeAxis(view_range=rr.TimeRange(*ends))


def _plot(entity: str, title: str, *, span: tuple[float, float] | None = None) -> rrb.TimeSeriesView:
    """Return a plot without a legend, which would cover much of it: title and hue of the chip say what is what."""
    return rrb.TimeSeriesView(
        origin=f"/{entity}",
        name=title,
        axis_x=_window(),
        axis_y=None if span is None else rrb.ScalarAxis(range=span),
        plot_legend=rrb.PlotLegend(visible=False),
    )
