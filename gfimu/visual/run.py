"""The picture of a run: the array turning with truth and estimate, and every quantity over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path as FilePath

import numpy as np
import rerun.blueprint as rrb
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.array.array import AccelerometerArray
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.motion.attitude import from_rotation, to_rotation
from gfimu.recording import Recording
from gfimu.recording.timing.reference_times import reference_on_rows
from gfimu.visual.motion import (
    ExpectedDrift,
    KnownMotion,
    MotionEstimate,
    about_axis,
    about_z,
    on_hub,
    spin_axis,
)
from gfimu.visual.plots import Plot
from gfimu.visual.rig import (
    array_shapes,
    axes_shapes,
    axis_shapes,
    channel_shapes,
    chip_names,
    drawing_size,
    ghost_shapes,
    gravity_shapes,
    is_cube,
    post_shapes,
    stand_height,
    table_axis_shapes,
    table_shapes,
)
from gfimu.visual.rig.words import run_legend, scene_title
from gfimu.visual.rrd_file import notes_view, write_rrd
from gfimu.visual.run_plots import (
    angle_plot,
    banded_rate_plots,
    carriage_plots,
    drift_plot,
    free_rate_plots,
    health_plot,
    known_motion_plots,
    motion_plots,
    position_plot,
    raw_plots,
    spin_rate_plots,
    true_displacement,
)
from gfimu.visual.scene import Body, Path, Scene, SensingArrows, Shape
from gfimu.visual.trace import PositionTrace

__all__ = ["reading_arrows", "run_scene", "write_estimate", "write_run"]

_ARROW_PER_G = 1.2  # length of an arrow at 1 g, in sizes of the drawing
_UNCROWDED = 6  # chips that can have arrows of that length


def write_run(
    path: str | FilePath,
    recording: Recording,
    array: AccelerometerArray,
    *,
    estimate: MotionEstimate | None = None,
    known: KnownMotion | None = None,
    drift: ExpectedDrift | None = None,
    shapes: Mapping[str, Sequence[Shape]] | None = None,
    notes: str = "",
    title: str = "",
) -> None:
    """Write the rerun recording of a run.

    Parameters
    ----------
    path : str or Path
        File to write, ``.rrd``.
    recording : Recording
        Readings in m/s² and references.
    array : AccelerometerArray
        Geometry of the channels.
    estimate : MotionEstimate, optional
        The estimate; without it the readings and references are shown alone.
    known : KnownMotion, optional
        Truth; without it the encoder or the tachometer turns the table where the recording has one.
    drift : ExpectedDrift, optional
        Position error and its expectation.
    shapes : mapping of str to sequence of Shape, optional
        Shapes of ``base``, ``table`` and ``cube`` (from a MuJoCo model, say); a plain rig otherwise.
    notes : str
        Markdown put above the explanation of the colours.
    title : str
        Name that the viewer shows; the scenario's or array's name otherwise.

    Raises
    ------
    InputError
        If the recording lacks a channel of the array, or the file can't be written.
    """
    recording = reference_on_rows(recording)
    readings = recording.for_array(array)
    axis = array.turning_axis
    known = known or KnownMotion.from_reference(recording, array, estimate)
    spins = axis is not None or _on_table(recording, known)
    arrows = [reading_arrows(array, recording.t_s, readings)]
    scene = run_scene(arrows, array, estimate=estimate, known=known, shapes=shapes, on_table=spins)
    raw = raw_plots(recording.t_s, readings, array)
    about = spin_axis(recording, array)
    carried = carriage_plots(recording)  # of a body that does not turn: its rate would be a line at zero
    rates = spin_rate_plots(recording, estimate, known, about) if spins else free_rate_plots(recording, estimate, known)
    rates = carried or rates
    cells: list[Sequence[Plot | PositionTrace]] = [[plot] for plot in rates]
    if estimate is not None:
        cells += _motion_cells(estimate, known, array)
    else:
        cells += [[plot] for plot in known_motion_plots(known)]
    angle = angle_plot(estimate, known, about) if spins or known is not None else None
    cells += [[plot] for plot in (angle, drift_plot(drift) if drift is not None else None) if plot is not None]
    write_rrd(
        path,
        title=title or str(recording.metadata.get("scenario", array.name)),
        layout=_layout(scene.view(scene_title(array)), raw, cells, notes_apart=bool(notes) and estimate is None),
        scene=scene,
        plots=[plot for group in (*raw, *cells) for plot in group],
        notes=f"{notes}\n\n{run_legend(array, estimate=estimate is not None, known=known)}".strip(),
    )


def write_estimate(
    path: str | FilePath, estimate: MotionEstimate, array: AccelerometerArray, *, notes: str = "", title: str = ""
) -> None:
    """Write the rerun recording of an estimate alone: the body as it turns, and all that was estimated over time.

    Parameters
    ----------
    path : str or Path
        File to write, ``.rrd``.
    estimate : MotionEstimate
        The estimate.
    array : AccelerometerArray
        The array that it is of.
    notes : str
        Markdown put above the explanation of the colours.
    title : str
        Name that the viewer shows; the array's name otherwise.

    Raises
    ------
    InputError
        If the file can't be written.
    """
    scene = run_scene([], array, estimate=estimate, on_table=False)
    cells: list[Sequence[Plot | PositionTrace]] = [[plot] for plot in banded_rate_plots(estimate)]
    cells += _motion_cells(estimate, None, array)
    write_rrd(
        path,
        title=title or array.name,
        layout=_layout(scene.view(scene_title(array)), [], cells),
        scene=scene,
        plots=[plot for group in cells for plot in group],
        notes=f"{notes}\n\n{run_legend(array, estimate=True, known=None)}".strip(),
    )


def _motion_cells(
    estimate: MotionEstimate, known: KnownMotion | None, array: AccelerometerArray
) -> list[Sequence[Plot | PositionTrace]]:
    """Return what is drawn of an estimate beside its rate: health of the channels, α, p and the position."""
    cells: list[Sequence[Plot | PositionTrace]] = []
    if estimate.health:
        cells.append([health_plot(estimate.t_s, estimate.health, array)])
    alpha, *force = motion_plots(estimate, known)
    cells += [[alpha], force] if force else [[alpha]]
    place = position_plot(estimate, known)
    if place is not None and estimate.position is not None:
        cells.append([place, PositionTrace(estimate.t_s, estimate.position, true_displacement(known))])
    return cells


def run_scene(
    arrows: Sequence[SensingArrows],
    array: AccelerometerArray,
    *,
    estimate: MotionEstimate | None = None,
    known: KnownMotion | None = None,
    shapes: Mapping[str, Sequence[Shape]] | None = None,
    on_table: bool = True,
) -> Scene:
    """Build the scene: table and cube turn with what is known, the estimate's ghost with the estimate.

    Parameters
    ----------
    arrows : sequence of SensingArrows
        Readings or residuals, drawn along the sensing axes.
    array, estimate, known, shapes
        As for `write_run`.
    on_table : bool
        Whether to draw the table.
    """
    axis = array.turning_axis
    solid = _solid(array, estimate, known)
    start = np.nan_to_num(np.atleast_2d(solid.position)[0])
    table = "table" in (shapes or {}) or (on_table and axis is None)
    bodies = []
    if table:
        angle = 0.0 if known is None or known.angle is None or not len(known.angle) else float(known.angle[0])
        centre = Rotation.from_rotvec([0.0, 0.0, -angle]).apply(start)  # of the body, in the table frame
        drawn = {**table_shapes(array, centre), **(shapes or {})}
        if "table" in (shapes or {}):
            drawn["table"] = [*drawn["table"], *post_shapes(array, centre)]
        turning = solid if known is None or known.angle is None else Path(known.t, about_z(known.angle))
        bodies += [
            Body("base", drawn["base"]),
            Body("table", drawn["table"], Path(turning.t, turning.quaternion)),
        ]
    body = [
        *(shapes or {}).get("cube", array_shapes(array)),
        channel_shapes(array),
        chip_names(array),
        axes_shapes(array),
        *([] if axis is None else axis_shapes(axis, array)),
    ]
    bodies.append(Body("cube" if is_cube(array) else "array", body, solid, arrows))
    bodies.append(Body("gravity", gravity_shapes(array, start)))
    if table and axis is None:
        bodies.append(Body("axis", table_axis_shapes(array, start)))
    if estimate is not None and known is not None:
        bodies.append(Body("estimate", ghost_shapes(array), _ghost_path(array, estimate, known)))
    if table and is_cube(array):
        return Scene(bodies)
    size, centre = drawing_size(array), start
    if axis is not None and axis.hub == "fixed":  # body and pivot are both in the picture
        pivot = to_rotation(np.nan_to_num(solid.quaternion[:1])).apply(axis.point)[0] if len(solid.t) else axis.point
        size, centre = max(size, 0.8 * float(np.linalg.norm(pivot))), start + 0.5 * pivot
    return Scene(bodies, eye=centre + 3.2 * size * np.array([1.1, -1.0, 0.8]), look_at=centre, grid_spacing=size)


def reading_arrows(array: AccelerometerArray, t: NDArray[np.float64], readings: NDArray[np.float64]) -> SensingArrows:
    """Return the arrows of readings (n, c), m/s²: 1 g is 1.2 sizes of the drawing, less where many chips crowd."""
    size = drawing_size(array) * min(1.0, np.sqrt(_UNCROWDED / len(array.chips)))
    return SensingArrows(array, t, readings, _ARROW_PER_G * size / STANDARD_GRAVITY, 0.044 * size)


def _solid(array: AccelerometerArray, estimate: MotionEstimate | None, known: KnownMotion | None) -> Path:
    """Return the path of the body: as known, else as estimated, else at rest."""
    if known is not None:
        return Path(known.t, known.quaternion, known.position)
    height, axis = np.array([0.0, 0.0, stand_height(array)]), array.turning_axis
    if estimate is not None:
        place = height if axis is None else on_hub(array, to_rotation(estimate.quaternion))
        return Path(estimate.t_s, estimate.quaternion, place)
    if axis is None:
        return Path(np.zeros(1), np.array([[1.0, 0.0, 0.0, 0.0]]), height)
    attitude = about_axis(axis, np.zeros(1))
    return Path(np.zeros(1), from_rotation(attitude), on_hub(array, attitude))


def _ghost_path(array: AccelerometerArray, estimate: MotionEstimate, known: KnownMotion) -> Path:
    """Return the path of the estimate's ghost, which stands where the body is known to stand."""
    position = known.position
    if array.turning_axis is not None and known.omega is None:
        position = on_hub(array, to_rotation(estimate.quaternion))
    elif position.ndim == 2:
        position = np.column_stack([np.interp(estimate.t_s, known.t, column) for column in position.T])
    return Path(estimate.t_s, estimate.quaternion, position)


def _on_table(recording: Recording, known: KnownMotion | None) -> bool:
    """Whether the body turned on a table: it has an angle, or the recording a table's rate."""
    if known is not None:
        return known.angle is not None
    return any(name in recording.reference for name in ("angle_rad", "tacho_rad_s", "command_rad_s"))


def _layout(
    scene: rrb.Spatial3DView,
    raw: Sequence[Sequence[Plot]],
    cells: Sequence[Sequence[Plot | PositionTrace]],
    *,
    notes_apart: bool = False,
) -> rrb.Container:
    """Scene above the raw channels on the left, everything derived in a grid on the right.

    The notes are a tab beside the channels, or a view of their own where they say why something is missing.
    """
    if len(raw) == 1:
        readings = [plot.view() for plot in raw[0]]
    else:
        readings = [rrb.Vertical(*[plot.view() for plot in group], name=_group_name(group)) for group in raw]
    if not cells:
        beside = rrb.Vertical(*readings) if len(raw) == 1 else rrb.Tabs(*readings, active_tab=0)
        left = rrb.Vertical(scene, notes_view(), row_shares=[3, 1])
        return rrb.Horizontal(left, beside, column_shares=[2, 3])
    if notes_apart:
        left = rrb.Vertical(scene, notes_view(), rrb.Tabs(*readings, active_tab=0), row_shares=[5, 3, 4])
    else:
        left = rrb.Vertical(scene, rrb.Tabs(*readings, notes_view(), active_tab=0), row_shares=[3, 2])
    views = [cell[0].view() if len(cell) == 1 else rrb.Tabs(*[plot.view() for plot in cell]) for cell in cells]
    across = 2 if len(views) > 3 else 1
    rows = [views[first : first + across] for first in range(0, len(views), across)]
    right = rrb.Vertical(*[row[0] if len(row) == 1 else rrb.Horizontal(*row) for row in rows])
    return rrb.Horizontal(left, right, column_shares=[2, 3])


def _group_name(group: Sequence[Plot]) -> str:
    """Return "raw, a1 to a8" of a group of plots with such titles."""
    return group[0].title.rpartition(", axis")[0]
