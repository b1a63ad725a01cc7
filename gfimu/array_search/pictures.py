"""Pictures of a search: the array in its volume, and the front of two objectives."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array_search.front import CHIPS, Front
from gfimu.array_search.problem import Problem, Sites
from gfimu.array_search.shapes import Shape
from gfimu.base.files.atomic_file import write_text
from gfimu.base.results import save_figure
from gfimu.base.results.colours import AFTER_ON_PAPER, BEFORE_ON_PAPER, INK, NOISE_ON_PAPER, PALE, chip_colour, css

__all__ = ["array_picture", "write_front"]

_ARROW = 0.32  # of half the longest edge: length of a sensing axis
_MM = 1e3
_DPI = 130


def write_front(folder: str | Path, front: Front) -> None:
    """Write the folder of a front: an array file per point, the table, the picture; a former front's files go."""
    folder = Path(folder)
    folder.mkdir(exist_ok=True)
    files = [folder / f"{point.name}.toml" for point in front.points]
    for file, point in zip(files, front.points, strict=True):
        write_text(file, point.array.to_toml())
    write_text(folder / "front.json", json.dumps(front.to_dict(), indent=2) + "\n")
    _front_picture(folder / "front.png", front)
    for former in set(folder.glob("front_[0-9][0-9].toml")).difference(files):  # that one may have had more points
        former.unlink()


def _front_picture(path: Path, front: Front) -> None:
    """Draw the front: one dot per array, and the proven bounds of the figures."""
    figure = Figure(figsize=(7.2, 4.8), layout="constrained")
    axes = figure.subplots()
    values = front.values
    axes.plot(values[:, 0], values[:, 1], "o-", color=css(AFTER_ON_PAPER), lw=1.0, ms=5, label="best arrays found")
    stepped = {0, 1} - {i for i in (0, 1) if all(point.bounds[i] is not None for point in front.points)}
    for i in {0, 1} - stepped:
        bounds = np.array([point.bounds[i] for point in front.points], dtype=float)
        style: dict[str, Any] = {"color": css(BEFORE_ON_PAPER), "ls": "--", "lw": 1.0}
        if 1 - i in stepped and np.ptp(bounds) > 0:
            line = (values[:, 1 - i], bounds) if i == 1 else (bounds, values[:, 1 - i])
            axes.plot(*line, label="proven bound", **style)
        elif i == 1:
            axes.axhline(bounds[0], label=f"proven bound of {front.objectives[i].name}", **style)
        else:
            axes.axvline(bounds[0], label=f"proven bound of {front.objectives[i].name}", **{**style, "ls": ":"})
    for point in front.points:
        mark = point.array.name.removeprefix("front_")
        axes.annotate(mark, point.values, xytext=(5, 5), textcoords="offset points", fontsize=7, color=css(INK))
    for aim, side in zip(front.objectives, (axes.xaxis, axes.yaxis), strict=True):
        side.set_label_text(f"{aim.meaning}, {aim.unit}" if aim.unit else aim.meaning)
        if aim.name == CHIPS:
            side.set_major_locator(MaxNLocator(integer=True))
    axes.margins(0.08)
    axes.grid(lw=0.3)
    axes.legend(fontsize=8)
    save_figure(path, figure, _DPI)


def array_picture(path: str | Path, array: AccelerometerArray, problem: Problem) -> None:
    """Draw the chips with their sensing axes in the volume, beside the keep-out zones; lengths in mm."""
    figure = Figure(figsize=(7.2, 6.4), layout="constrained")
    axes: Any = figure.add_subplot(projection="3d", computed_zorder=False)
    volume, unit = problem.volume, problem.unit * _MM
    if isinstance(volume, Sites):
        axes.scatter(*(volume.positions.T * _MM), s=12, marker="s", color=css(NOISE_ON_PAPER), label="candidate sites")
        reach = volume.positions * _MM
    else:
        for line in _wires(volume):
            axes.plot(*(line.T * _MM), color=css(NOISE_ON_PAPER), lw=0.8)
        reach = (volume.centre + np.array([[1.0], [-1.0]]) * volume.half) * _MM
    low, high = reach.min(axis=0), reach.max(axis=0)
    span = 0.6 * np.maximum(high - low, 0.35 * (high - low).max())  # half of what is shown; flat volumes get some depth
    low, high = (low + high) / 2.0 - span, (low + high) / 2.0 + span
    floor = low[2]
    for number, zone in enumerate(problem.keep_out):
        _draw_zone(axes, zone, (low, high), "keep-out" if number == 0 else None)
    for number, chip in enumerate(array.chips):
        place, colour = chip.position * _MM, css(chip_colour(number, on_paper=True))
        axes.plot([place[0]] * 2, [place[1]] * 2, [floor, place[2]], color=css(PALE), lw=0.7)
        axes.plot(*place[:2], floor, marker="x", ms=4, color=css(PALE))
        for axis in chip.axes if problem.axes_per_chip < 3 else ():
            axes.quiver(*place, *(axis * _ARROW * unit), color=colour, lw=1.4, arrow_length_ratio=0.25)
        axes.scatter(*place, s=42, color=colour, edgecolors=css(INK), linewidths=0.6)
        axes.text(*(place + 0.06 * unit), chip.name, fontsize=8, color=css(INK))
    axes.set(
        xlim=(low[0], high[0]),
        ylim=(low[1], high[1]),
        zlim=(low[2], high[2]),
        xlabel="x, mm",
        ylabel="y, mm",
        zlabel="z, mm",
    )
    axes.set_box_aspect(tuple(span), zoom=0.9)
    axes.view_init(elev=22, azim=-62)
    axes.set_title(f"{array.name}: {len(array.chips)} chips, {_axes(problem)} each", fontsize=10)
    if problem.keep_out or isinstance(volume, Sites):
        axes.legend(fontsize=8, loc="upper left")
    save_figure(path, figure, _DPI)


def _axes(problem: Problem) -> str:
    return "1 axis" if problem.axes_per_chip == 1 else f"{problem.axes_per_chip} axes"


def _wires(shape: Shape) -> list[NDArray[np.float64]]:
    """Lines that show a shape, each of shape (p, 3), m."""
    centre, half, turn = shape.centre, shape.half, np.linspace(0.0, 2.0 * np.pi, 73)
    if shape.kind == "box":
        corners = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])
        return [
            centre + np.array([corner, other]) * half
            for a, corner in enumerate(corners)
            for other in corners[a + 1 :]
            if np.abs(corner - other).sum() == 2
        ]
    ring = np.column_stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)])
    if shape.kind == "sphere":
        return [centre + np.roll(ring, shift, axis=1) * half for shift in range(3)]
    along = int(np.argmax(np.abs(shape.linear).sum(axis=0)))
    flat = np.roll(ring, along - 2, axis=1)
    up = np.eye(3)[along]
    sides = [np.array([flat[i] - up, flat[i] + up]) for i in range(0, 72, 9)]
    return [centre + line * half for line in (flat - up, flat + up, *sides)]


def _draw_zone(
    axes: Any, zone: Shape, shown: tuple[NDArray[np.float64], NDArray[np.float64]], label: str | None
) -> None:
    """Draw a zone as far as it is within the limits that are shown, mm."""
    from scipy.spatial import ConvexHull

    round_one = zone.kind == "sphere"
    points = np.clip((zone.sample(400, np.random.default_rng(0)) if round_one else zone.outer_points) * _MM, *shown)
    if np.linalg.matrix_rank(points - points[0]) == 3:
        style: dict[str, Any] = {"color": css(BEFORE_ON_PAPER), "alpha": 0.18, "linewidth": 0.0}
        axes.plot_trisurf(*points.T, triangles=ConvexHull(points).simplices, shade=False, **style)
    for index, line in enumerate(_wires(zone)):
        within = np.clip(line * _MM, *shown)
        axes.plot(*within.T, color=css(BEFORE_ON_PAPER), lw=0.7, label=label if index == 0 else None)
