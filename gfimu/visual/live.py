"""The picture of a recording while it is made: the body as it turns, rate, health of channels, readings, the stream.

Entities: ``rate/omega_x`` …, ``rate/sign_probability``, ``health/a11`` …, ``readings/axis_1`` …, ``stream/…``,
``scene/…``, ``events``, ``notes``; all on the timeline ``time``, s on the board's clock.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray
from rerun.blueprint.encodings import TextLogColumnKind
from scipy.spatial.transform import Rotation

from gfimu.errors import GeometryError
from gfimu.geometry.array import AccelerometerArray
from gfimu.geometry.observability import require_all_motions
from gfimu.integrity.fault import HealthCode
from gfimu.integrity.live.block import Health, LiveBlock, StreamState
from gfimu.motion.attitude import from_rotation, integrate_attitude, to_rotation
from gfimu.visual.colours import AXES, ESTIMATE, HEALTH, TACHO, UNDECIDED, Colour, chip_colour
from gfimu.visual.plots import broken_at_gaps
from gfimu.visual.rig import (
    array_shapes,
    axes_shapes,
    channel_shapes,
    chip_names,
    drawing_size,
    gravity_shapes,
)
from gfimu.visual.rig.words import array_words, scene_title
from gfimu.visual.run import reading_arrows
from gfimu.visual.scene import TIMELINE, Body, Scene

__all__ = ["SHOWN_S", "LiveDrawing", "LivePicture"]

SHOWN_S = 30.0
"""Time that the plots show, s; they follow the newest sample."""

_NOTES, _EVENTS, _BODY = "notes", "events", "scene/array"
_BAND = 2.0  # standard deviations on either side
_PALE = 120  # opacity of the edges of a band
_SETTLES_S = 1.0  # the biases do, in the first rest; the rate of that time would set the scale of its plot
_STREAM = {
    "sample_rate": ("sample rate, Hz", {"samples that came, Hz": TACHO}),
    "missing": ("lost, corrupt", {"samples lost": HEALTH["excluded"], "frames corrupt": HEALTH["in doubt"]}),
    "delay": ("delay, s", {"newest sample, s": TACHO, "rate, s": ESTIMATE}),
}
"""Plots of the stream: title, and name and colour of each line."""

_LOG_COLUMNS = rrb.TextLogColumns(
    timeline_columns=[TIMELINE], text_log_columns=[TextLogColumnKind.LogLevel, TextLogColumnKind.Body]
)

_WORDS = {
    None: "not watched",
    HealthCode.USED: "used",
    HealthCode.DOUBTED: "in doubt",
    HealthCode.EXCLUDED: "excluded",
    HealthCode.MISSING: "missing",
    HealthCode.SATURATED: "saturated",
    HealthCode.STUCK: "stuck",
}
_BAD = {HealthCode.EXCLUDED, HealthCode.MISSING, HealthCode.SATURATED, HealthCode.STUCK}


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
            eye=(3.2 * size, -2.9 * size, 2.1 * size),
            look_at=(0.0, 0.0, 0.1 * size),
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
        chips = [chip_colour(number) for number in range(len(array.chips))]
        for axis, columns in enumerate(_axis_columns(array)):
            names, colours = [array.channels[column] for column in columns], array.chip_of_channel[columns]
            _style(stream, f"readings/axis_{axis + 1}", names, [chips[int(chip)] for chip in colours], 1.2)
        if self._has_rate:
            for name, colour in zip("xyz", AXES, strict=True):
                _style(stream, f"rate/omega_{name}/band", ["+2σ", "−2σ"], [(*colour[:3], _PALE)] * 2, 1.0)
                _style(stream, f"rate/omega_{name}/estimate", [f"ω {name}"], [colour], 2.0)
            _style(stream, "rate/sign_probability", ["probability of the sign"], [UNDECIDED], 1.5)
            states = rr.StateConfiguration(values=list(HEALTH), labels=list(HEALTH), colors=list(HEALTH.values()))
            for channel in array.channels:
                stream.log(f"health/{channel}", states, static=True)
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
        stream.log(f"{_BODY}/specific_force", sites, static=True)
        stream.log(_NOTES, rr.TextDocument(self._notes(), media_type=rr.MediaType.MARKDOWN), static=True)
        stream.send_blueprint(self.blueprint(), make_active=True, make_default=True)
        return LiveDrawing(stream, array, arrows.length_per_m_s2)

    def blueprint(self) -> rrb.Blueprint:
        """Return the layout: the last half minute, following the newest sample."""
        array = self._array
        axes = range(1, len(_axis_columns(array)) + 1)
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
            shares = [9, 7, 3]
        left = rrb.Vertical(
            self._scene.view(scene_title(array)),
            rrb.Tabs(
                rrb.TextLogView(origin=f"/{_EVENTS}", name="what happened", columns=_LOG_COLUMNS),
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
                contents=[f"/health/{name}" for name in part],
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
        turns = "The body turns with the estimated rate; while it rests its tilt is read off the readings. "
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


class LiveDrawing:
    """Draws blocks of a stream, one after the other.

    Parameters
    ----------
    stream : rerun.RecordingStream
        Where to.
    array : AccelerometerArray
        The array, with c channels.
    length_per_m_s2 : float
        Length drawn for 1 m/s², m.
    """

    def __init__(self, stream: rr.RecordingStream, array: AccelerometerArray, length_per_m_s2: float) -> None:
        self._stream, self._array, self._length = stream, array, length_per_m_s2
        self._columns = _axis_columns(array)
        places = [np.flatnonzero(array.chip_of_channel == number) for number in range(len(array.chips))]
        self._sites = [(part, np.linalg.pinv(array.axes[part])) for part in places]  # (k,), (3, k) of each chip
        self._axes = channel_shapes(array)
        self._codes: tuple[HealthCode | None, ...] = ()
        self._ends: dict[str, float] = {}  # of each entity of lines the newest time
        self._forces: list[tuple[float, NDArray[np.float64]]] = []  # specific force (3,) that no rate has reached yet
        self._attitude = Rotation.identity()
        self._last: tuple[float, NDArray[np.float64]] | None = None  # time and rate of the attitude
        self._drawn_from_s = -np.inf

    def add(self, block: LiveBlock) -> None:
        """Draw what came."""
        for health in block.health:
            self._add_health(health)
        if len(block.t_s):
            self._add_readings(block.t_s, block.readings)
        if len(block.rate_t_s):
            self._add_rate(block)
        if block.states:
            self._add_states(block.states)
        if block.events:
            texts = rr.TextLog.columns(
                text=[event.text for event in block.events],
                level=["WARN" if event.is_fault else "INFO" for event in block.events],
            )
            self._send(_EVENTS, np.array([event.t_s for event in block.events]), texts)

    def _send(self, entity: str, t: NDArray[np.float64], columns: Any) -> None:
        self._stream.send_columns(entity, [rr.TimeColumn(TIMELINE, duration=t)], columns)

    def _send_lines(self, entity: str, t: NDArray[np.float64], values: NDArray[np.float64]) -> None:
        """Send lines (n, k), which break where samples are lost, also between blocks."""
        count = values.shape[1]
        before = self._ends.get(entity, float(t[0]))
        self._ends[entity] = float(t[-1])
        if t[0] > before:
            t, values = np.insert(t, 0, before), np.insert(values, 0, np.nan, axis=0)
            t, values = (part[1:] for part in broken_at_gaps(t, values))
        self._send(entity, t, rr.Scalars.columns(scalars=values.ravel()).partition(np.full(len(t), count)))

    def _add_readings(self, t: NDArray[np.float64], readings: NDArray[np.float64]) -> None:
        for axis, columns in enumerate(self._columns):
            self._send_lines(f"readings/axis_{axis + 1}", t, readings[:, columns])
        forces = np.stack([readings[:, part] @ inverse.T for part, inverse in self._sites], axis=1)  # (n, chips, 3)
        vectors = np.nan_to_num(forces).reshape(-1, 3) * self._length
        arrows = rr.Arrows3D.columns(vectors=vectors).partition(np.full(len(t), len(self._sites)))
        self._send(f"{_BODY}/specific_force", t, arrows)
        mean = readings.mean(axis=0)
        used = np.isfinite(mean) & [code not in _BAD for code in self._codes or [None] * len(mean)]
        if used.any():
            self._forces.append((float(t[-1]), np.linalg.lstsq(self._array.axes[used], mean[used])[0]))

    def _add_health(self, health: Health) -> None:
        """Send what changed: lanes, and red arrows in place of the sensing axes that are not used."""
        before = self._codes or ("",) * len(health.codes)
        now = np.array([health.t_s])
        for channel, code, last in zip(self._array.channels, health.codes, before, strict=True):
            if code != last:
                self._send(f"health/{channel}", now, rr.StateChange.columns(state=[_WORDS[code]]))
        if health.codes != self._codes:
            bad = [code in _BAD for code in health.codes]
            arrows = rr.Arrows3D.columns(
                origins=self._axes.origins[bad], vectors=1.3 * self._axes.vectors[bad],
                colors=[HEALTH["excluded"]] * sum(bad), radii=[2.5 * self._axes.radius] * sum(bad),
            )  # fmt: skip
            self._send(f"{_BODY}/not_used", now, arrows.partition([sum(bad)]))
        self._codes = health.codes

    def _add_rate(self, block: LiveBlock) -> None:
        t, omega = block.rate_t_s, block.omega.copy()
        if self._last is None:
            self._drawn_from_s = float(t[0]) + _SETTLES_S
        known = np.isfinite(omega).all(axis=1)
        if known.any():
            self._turn(t[known], omega[known], is_rest=bool(block.rest.any()))
        omega[t < self._drawn_from_s] = np.nan
        spread = _BAND * block.omega_std
        for axis, name in enumerate("xyz"):
            edges = omega[:, axis, None] + spread[:, axis, None] * [1.0, -1.0]
            self._send_lines(f"rate/omega_{name}/band", t, edges)
            self._send_lines(f"rate/omega_{name}/estimate", t, omega[:, [axis]])
        self._send_lines("rate/sign_probability", t, block.sign_probability[:, None])

    def _turn(self, t: NDArray[np.float64], omega: NDArray[np.float64], *, is_rest: bool) -> None:
        """Turn the body with the rate (n, 3), rad/s; at rest and at the start its tilt is read off the readings."""
        forces = [force for at, force in self._forces if at <= t[-1]] or [force for _, force in self._forces][:1]
        self._forces = [(at, force) for at, force in self._forces if at > t[-1]]
        if self._last is None:
            self._last = (float(t[0]), omega[0])
            self._attitude = _levelled(self._attitude, forces[0]) if forces else self._attitude
            t, omega = t[1:], omega[1:]
        times, rates = np.insert(t, 0, self._last[0]), np.insert(omega, 0, self._last[1], axis=0)
        turned = to_rotation(integrate_attitude(times, rates, q0=from_rotation(self._attitude)))
        self._last = (float(times[-1]), rates[-1])
        self._attitude = turned[-1]
        self._send(_BODY, times, rr.Transform3D.columns(quaternion=turned.as_quat()))
        if is_rest and forces:
            self._attitude = _levelled(self._attitude, np.mean(forces, axis=0))

    def _add_states(self, states: Sequence[StreamState]) -> None:
        t = np.array([state.t_s for state in states])
        for name, columns in {
            "sample_rate": [[state.rate_hz] for state in states],
            "missing": [[state.lost, state.corrupt] for state in states],
            "delay": [[state.delay_s, state.behind_s] for state in states],
        }.items():
            values = np.array(columns, dtype=float)
            self._send(f"stream/{name}", t, rr.Scalars.columns(scalars=values))


def _levelled(attitude: Rotation, force: NDArray[np.float64]) -> Rotation:
    """Return the nearest attitude in which a specific force (3,), body frame, of a body at rest points up."""
    up = attitude.apply(force)
    axis = np.cross(up, [0.0, 0.0, 1.0])
    size = float(np.linalg.norm(axis))
    if size == 0.0:  # upright, or on its head: any horizontal axis will do
        return attitude if up[2] >= 0.0 else Rotation.from_rotvec([np.pi, 0.0, 0.0]) * attitude
    return Rotation.from_rotvec(np.arctan2(size, up[2]) / size * axis) * attitude


def _axis_columns(array: AccelerometerArray) -> list[NDArray[np.intp]]:
    """Return the channels of the chips' first axes, of their second axes, and so on."""
    number = np.concatenate([np.arange(len(chip.axes)) for chip in array.chips])
    return [np.flatnonzero(number == axis) for axis in range(int(number.max()) + 1)]


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


def _plot(entity: str, title: str, *, legend: int = 1, span: tuple[float, float] | None = None) -> rrb.TimeSeriesView:
    return rrb.TimeSeriesView(
        origin=f"/{entity}",
        name=title,
        axis_x=_window(),
        axis_y=None if span is None else rrb.ScalarAxis(range=span),
        plot_legend=rrb.PlotLegend(visible=False),
    )
