"""A drawing of an array on paper: seen from the side and from above, with names, axes, gravity and axis of rotation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from gfimu.array.array import AccelerometerArray
from gfimu.array.turning_axis import TurningAxis
from gfimu.base.results.colours import (
    BEFORE_ON_PAPER,
    INK,
    NOISE_ON_PAPER,
    SPIN_AXIS_ON_PAPER,
    STYLES,
    chip_colour,
    css,
)
from gfimu.visual.colours import AXES, METAL
from gfimu.visual.rig.package import Package, drawing_size, package_of
from gfimu.visual.rig.words import short_name

__all__ = ["Marked", "array_figure", "channel_style"]

_MM = 1000.0
_WIDTH = 5.5  # inches of one view
_TITLES = {"side": "seen from the side", "above": "seen from above; ring: axis towards you, cross: away"}
_MOST_CHANNEL_NAMES, _LONGEST_CHANNEL_NAME = 12, 10
_ACROSS = 0.15  # an axis whose drawn length is below this share points at or away from the reader
_NAME_AWAY = 0.19  # distance of a chip's name from it, in sizes of the drawing: 14 points on this paper
_NAME_WEIGHT = 0.45
_MARK, _MARK_WIDTH = css(BEFORE_ON_PAPER), 2.4
_OBLIQUE = np.array([[0.77, 0.64, 0.0], [-0.27, 0.33, 0.9]])  # rows: right and up on paper, body frame
_TOP = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


@dataclass(frozen=True)
class Marked:
    """What a drawing marks: chips by number, the package, the axis of rotation."""

    chips: frozenset[int] = frozenset()
    package: bool = False
    axis: bool = False


def channel_style(array: AccelerometerArray, column: int) -> tuple[str, str | tuple[float, tuple[float, ...]]]:
    """Return colour and line style of a channel on paper: the hue of its chip, the style of its axis on the chip."""
    chip = int(array.chip_of_channel[column])
    axis = int(np.count_nonzero(array.chip_of_channel[:column] == chip))
    return css(chip_colour(chip, on_paper=True)), STYLES[axis]


def array_figure(
    array: AccelerometerArray,
    *,
    axis: TurningAxis | None = None,
    gravity: NDArray[np.float64] | None = None,
    gravity_name: str = "gravity",
    views: Sequence[str] = ("side", "above"),
    marked: Marked = Marked(),
) -> Figure:
    """Draw an array in its body frame, seen obliquely and from above.

    Parameters
    ----------
    array : AccelerometerArray
        The array.
    axis : TurningAxis, optional
        The axis about which it turns; the array's own by default.
    gravity : ndarray, shape (3,), optional
        Direction of gravity in the body frame.
    gravity_name : str
        What its arrow is called.
    views : sequence of {"side", "above"}
        What is drawn, from left to right.
    marked : Marked
        What stands out, in the colour of errors.
    """
    figure = Figure(figsize=(_WIDTH * len(views), 4.6), layout="constrained")
    spin = array.turning_axis if axis is None else axis
    for panel, view in zip(figure.subplots(1, len(views), squeeze=False)[0], views, strict=True):
        _draw(panel, array, _OBLIQUE if view == "side" else _TOP, spin, marked)
        panel.set_title(_TITLES[view], loc="left", fontsize=10)
        panel.set_aspect("equal", adjustable="datalim")
        panel.margins(0.17)
        if view == "side":
            panel.set_axis_off()
            _triad(panel, array, gravity, gravity_name)
        else:
            panel.set_xlabel("body x, mm")
            panel.set_ylabel("body y, mm")
            panel.grid(color="0.93", linewidth=0.6)
            panel.set_axisbelow(True)
    most = max(len(chip.axes) for chip in array.chips)
    handles = [
        Line2D([], [], color=css(INK), linestyle=STYLES[index], label=f"sensing axis {index + 1} of a chip")
        for index in range(most)
    ]
    if spin is not None:
        handles.append(Line2D([], [], color=css(SPIN_AXIS_ON_PAPER), linestyle="-.", label="axis of rotation"))
    figure.legend(handles=handles, loc="outside lower center", ncols=2 * len(views), fontsize=9, frameon=False)
    return figure


def _draw(
    panel: Axes, array: AccelerometerArray, view: NDArray[np.float64], spin: TurningAxis | None, marked: Marked
) -> None:
    """Draw package, axis of rotation, sensing axes and chips in one projection, view (2, 3), body frame to paper."""
    package, size = package_of(array), drawing_size(array)
    outline = _outline(package) @ view.T * _MM
    panel.fill(*_hull(outline).T, facecolor=css(METAL), alpha=0.35, edgecolor=css(NOISE_ON_PAPER), linewidth=0.8)
    if marked.package:
        panel.fill(*_hull(outline).T, fill=False, edgecolor=_MARK, linewidth=_MARK_WIDTH)
    for start, end in _edges(package):
        panel.plot(*(np.array([start, end]) @ view.T * _MM).T, color=css(NOISE_ON_PAPER), linewidth=0.6)
    if spin is not None:
        _axis_line(panel, spin, package, view, size, is_marked=marked.axis)
    names_channels = array.n_channels <= _MOST_CHANNEL_NAMES and max(map(len, array.channels)) <= _LONGEST_CHANNEL_NAME
    for column, channel in enumerate(array.channels):
        _sensing_axis(panel, array, column, view, 0.42 * _axis_length(array, size), channel if names_channels else "")
    places = array.chip_positions @ view.T * _MM
    for index, place in enumerate(places):
        colour = css(chip_colour(index, on_paper=True))
        panel.plot(*place, "s", color=colour, markersize=7 if len(places) <= 16 else 5, markeredgecolor="white")
        if index in marked.chips:
            panel.plot(*place, "o", color=_MARK, markersize=18, fillstyle="none", markeredgewidth=_MARK_WIDTH)
    length = 0.42 * _axis_length(array, size)
    arrows = (
        (array.positions[:, None] + np.linspace(0.2, 1.3, 6)[:, None] * length * array.axes[:, None]) @ view.T * _MM
    )
    drawn, room = [*arrows.reshape(-1, 2), *places], _NAME_AWAY * size * _MM
    named: list[NDArray[np.float64]] = []
    for place, text in _same_places(places, [short_name(chip.name) for chip in array.chips]):
        direction = _free_direction(place, drawn, named, room)
        named.append(place + room * direction)
        panel.annotate(
            text, _pair(place), xytext=_pair((13.0 + 2.0 * max(len(text) - 3, 0) * abs(direction[0])) * direction),
            textcoords="offset points", ha="center", va="center", fontweight="bold",
            fontsize=9 if len(places) <= 16 else 7, color=css(INK), zorder=6,
        )  # fmt: skip


def _sensing_axis(
    panel: Axes, array: AccelerometerArray, column: int, view: NDArray[np.float64], length: float, name: str
) -> None:
    """Draw one sensing axis: an arrow, or a ring where it points at the reader and a cross where it points away."""
    colour, style = channel_style(array, column)
    start, along = array.positions[column] @ view.T * _MM, length * array.axes[column] @ view.T * _MM
    if np.hypot(*along) < _ACROSS * length * _MM:
        towards = float(np.cross(view[0], view[1]) @ array.axes[column]) > 0
        panel.plot(*start, "o" if towards else "x", color=colour, markersize=12, fillstyle="none", zorder=1)
        return
    panel.annotate(
        "", _pair(start + along), xytext=_pair(start),
        arrowprops={"arrowstyle": "-|>", "color": colour, "linestyle": style, "linewidth": 1.3, "shrinkA": 0},
    )  # fmt: skip
    panel.plot(*(start + along), alpha=0.0, marker=".")  # arrows do not count for the limits of the axes
    if name:
        panel.annotate(
            name, _pair(start + along), xytext=_pair(10.0 * along / np.hypot(*along)), textcoords="offset points",
            ha="center", va="center", fontsize=8, color=colour,
        )  # fmt: skip


def _axis_line(
    panel: Axes, spin: TurningAxis, package: Package, view: NDArray[np.float64], size: float, *, is_marked: bool
) -> None:
    colour = _MARK if is_marked else css(SPIN_AXIS_ON_PAPER)
    foot = spin.point + ((package.centre - spin.point) @ spin.direction) * spin.direction
    ends = np.array([foot - 1.25 * size * spin.direction, foot + 1.25 * size * spin.direction]) @ view.T * _MM
    if np.hypot(*(ends[1] - ends[0])) < 2 * _ACROSS * size * _MM:
        panel.plot(*ends[0], marker="o", markersize=9, color=colour, fillstyle="none")
        panel.plot(*ends[0], marker=".", markersize=4, color=colour)
    else:
        panel.plot(*ends.T, color=colour, linestyle="-.", linewidth=_MARK_WIDTH if is_marked else 1.4)


def _triad(panel: Axes, array: AccelerometerArray, gravity: NDArray[np.float64] | None, gravity_name: str) -> None:
    """Draw the body's axes and gravity at the left of the oblique view."""
    size = drawing_size(array) * _MM
    low = (_outline(package_of(array)) @ _OBLIQUE.T * _MM).min(axis=0)
    corner = np.array([low[0] - 1.0 * size, low[1] + 0.1 * size])
    arrows = [(unit, name, css(colour)) for unit, name, colour in zip(np.eye(3), "xyz", AXES, strict=True)]
    for unit, name, colour in arrows:
        tip = corner + 0.45 * size * _OBLIQUE @ unit
        arrow = {"arrowstyle": "-|>", "color": colour, "shrinkA": 0}
        panel.annotate("", _pair(tip), xytext=_pair(corner), arrowprops=arrow)
        panel.annotate(name, _pair(corner + 0.58 * size * _OBLIQUE @ unit), ha="center", va="center", fontsize=9)
    if gravity is not None:
        start = corner + np.array([0.0, 1.5 * size])
        tip = start + 0.7 * size * _OBLIQUE @ gravity
        arrow = {"arrowstyle": "-|>", "color": css(INK), "lw": 2, "shrinkA": 0}
        panel.annotate("", _pair(tip), xytext=_pair(start), arrowprops=arrow)
        panel.annotate(gravity_name, _pair(start), xytext=(0, 7), textcoords="offset points", ha="center", fontsize=9)
        panel.plot(*np.array([start + np.array([0.0, 0.2 * size]), tip]).T, alpha=0.0)
    panel.plot(*(corner - 0.15 * size), alpha=0.0)


def _axis_length(array: AccelerometerArray, size: float) -> float:
    places = array.chip_positions
    apart = np.linalg.norm(places[:, None] - places[None], axis=2)
    beside = apart[apart > 0.25 * size]
    return min(size, 1.5 * float(beside.min()) if beside.size else size)


def _outline(package: Package) -> NDArray[np.float64]:
    """Return points of the package's surface that hold its outline from every side, (n, 3), m."""
    if package.kind == "disc":
        angle = np.linspace(0.0, 2 * np.pi, 72, endpoint=False)
        ring = np.column_stack([np.cos(angle), np.sin(angle), np.ones_like(angle)])
        own = np.concatenate([ring, ring * [1.0, 1.0, -1.0]])
    else:
        own = np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T
    return np.asarray(package.rotation.apply(own * package.half) + package.centre)


def _edges(package: Package) -> Sequence[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Return the edges of a box; other packages are known by their outline."""
    if package.kind not in {"box", "cube"}:
        return []
    corners = _outline(package)
    own = np.sign(package.rotation.inv().apply(corners - package.centre))
    return [
        (corners[i], corners[j])
        for i in range(8)
        for j in range(i)
        if np.count_nonzero(np.abs(own[i] - own[j]) > 0.5) == 1
    ]


def _free_direction(
    place: NDArray[np.float64],
    drawn: Sequence[NDArray[np.float64]],
    named: Sequence[NDArray[np.float64]],
    distance: float,
) -> NDArray[np.float64]:
    """Return the direction on paper, of eight, in which a name beside a place is farthest from what is drawn there.

    Names need more room than lines: their distance counts for less than half.
    """
    angle = np.arange(8) * np.pi / 4 + np.pi / 8
    directions = np.column_stack([np.cos(angle), np.sin(angle)])
    targets = place + distance * directions  # (8, 2)
    weighted = [(one, 1.0) for one in drawn if np.hypot(*(one - place)) > 0.0] + [(one, _NAME_WEIGHT) for one in named]
    if not weighted:
        return np.array([0.0, 1.0])
    apart = np.min([weight * np.linalg.norm(targets - one, axis=1) for one, weight in weighted], axis=0)
    return np.asarray(directions[int(np.argmax(apart))])


def _pair(point: NDArray[np.float64]) -> tuple[float, float]:
    return float(point[0]), float(point[1])


def _hull(points: NDArray[np.float64]) -> NDArray[np.float64]:
    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except QhullError:  # seen edge on
        return points


def _same_places(places: NDArray[np.float64], names: Sequence[str]) -> Sequence[tuple[NDArray[np.float64], str]]:
    """Join the names of chips that are drawn at one place, as chips on both sides of a board are from above."""
    near = 1e-3 * max(float(np.ptp(places, axis=0).max()), 1e-9)
    joined: list[tuple[NDArray[np.float64], list[str]]] = []
    for place, name in zip(places, names, strict=True):
        for known, others in joined:
            if np.hypot(*(place - known)) < near:
                others.append(name)
                break
        else:
            joined.append((place, [name]))
    return [(place, ", ".join(others)) for place, others in joined]
