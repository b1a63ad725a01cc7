"""The picture of a run: the rig turning with truth and estimate, and every quantity over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path as FilePath

import numpy as np
import rerun.blueprint as rrb

from gfimu.geometry.array import AccelerometerArray
from gfimu.recording import Recording
from gfimu.visual.motion import CUBE_HEIGHT, ExpectedDrift, KnownMotion, MotionEstimate, about_z
from gfimu.visual.plots import Plot
from gfimu.visual.rrd_file import notes_view, write_rrd
from gfimu.visual.run_plots import (
    angle_plot,
    drift_plot,
    free_rate_plots,
    motion_plots,
    raw_plots,
    table_rate_plots,
)
from gfimu.visual.scene import Body, Path, Scene, SensingArrows, Shape, bounding_box, ghost_shapes, rig_shapes

__all__ = ["run_scene", "write_run"]


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
    readings = recording.for_array(array)
    known = known or KnownMotion.from_reference(recording)
    on_table = _on_table(recording, known)
    arrows = [SensingArrows(array, recording.t_s, readings)]
    scene = run_scene(arrows, array, estimate=estimate, known=known, shapes=shapes, on_table=on_table)
    raw = raw_plots(recording.t_s, readings, array)
    cells: list[Sequence[Plot]] = [
        [plot] for plot in (table_rate_plots if on_table else free_rate_plots)(recording, estimate, known)
    ]
    if estimate is not None:
        alpha, *force = motion_plots(estimate, known)
        cells += [[alpha], force]
    angle = angle_plot(recording, estimate, known) if on_table or known is not None else None
    cells += [[plot] for plot in (angle, drift_plot(drift) if drift is not None else None) if plot is not None]
    write_rrd(
        path,
        title=title or str(recording.metadata.get("scenario", array.name)),
        layout=_layout(scene.view("table and cube" if on_table else "body"), raw, cells),
        scene=scene,
        plots=[*raw, *[plot for cell in cells for plot in cell]],
        notes=f"{notes}\n\n{_LEGEND}".strip(),
    )


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
    shapes = {**rig_shapes(array), **(shapes or {})}
    height = np.array([0.0, 0.0, CUBE_HEIGHT])
    if known is not None:
        solid = Path(known.t, known.quaternion, known.position)
    elif estimate is not None:
        solid = Path(estimate.t_s, estimate.quaternion, height)
    else:
        solid = Path(np.zeros(1), np.array([[1.0, 0.0, 0.0, 0.0]]), height)
    bodies = []
    if on_table:
        turning = solid if known is None or known.angle is None else Path(known.t, about_z(known.angle))
        bodies += [
            Body("base", shapes["base"]),
            Body("table", shapes["table"], Path(turning.t, turning.quaternion)),
        ]
    bodies.append(Body("cube", shapes["cube"], solid, arrows))
    if estimate is not None and known is not None:
        position = known.position
        if position.ndim == 2:
            position = np.column_stack([np.interp(estimate.t_s, known.t, column) for column in position.T])
        bodies.append(Body("estimate", ghost_shapes(array), Path(estimate.t_s, estimate.quaternion, position)))
    if on_table:
        return Scene(bodies)
    start = np.nan_to_num(np.atleast_2d(solid.position)[0])
    distance = 4.0 * float(bounding_box(array)[0].max())
    return Scene(bodies, eye=start + distance * np.array([1.1, -1.0, 0.8]), look_at=start)


def _on_table(recording: Recording, known: KnownMotion | None) -> bool:
    """Whether the body turned on a table: it has an angle, or the recording a table's rate."""
    if known is not None:
        return known.angle is not None
    return any(name in recording.reference for name in ("angle_rad", "tacho_rad_s", "command_rad_s"))


def _layout(scene: rrb.Spatial3DView, raw: Sequence[Plot], cells: Sequence[Sequence[Plot]]) -> rrb.Container:
    """Scene above the raw channels on the left, everything derived in a grid on the right."""
    if not cells:
        return rrb.Horizontal(
            rrb.Vertical(scene, notes_view(), row_shares=[3, 1]),
            rrb.Vertical(*[plot.view() for plot in raw]),
            column_shares=[2, 3],
        )
    left = rrb.Vertical(scene, rrb.Tabs(*[plot.view() for plot in raw], notes_view(), active_tab=0), row_shares=[3, 2])
    views = [cell[0].view() if len(cell) == 1 else rrb.Tabs(*[plot.view() for plot in cell]) for cell in cells]
    across = 2 if len(views) > 3 else 1
    rows = [views[first : first + across] for first in range(0, len(views), across)]
    right = rrb.Vertical(*[row[0] if len(row) == 1 else rrb.Horizontal(*row) for row in rows])
    return rrb.Horizontal(left, right, column_shares=[2, 3])


_LEGEND = """\
**3-D.** Table and cube stand as they truly stand, or as the reference says; the orange outline and its pointer turn
with the estimate. Thin lines are the sensing axes; each arrow is as long as its axis reads; 1 g is a little
more than half the cube.

**Colours.** Grey: truth. Orange: estimate, its ±2σ paler. Sky blue: tachometer or encoder. Violet: command.
Red, green, blue: x, y, z. One hue per chip.

All plots share the time axis. Drag to move, scroll to zoom, double-click to see everything.
"""
