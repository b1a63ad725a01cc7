"""Writing one .rrd file: a scene, its plots and notes, and the layout in which the viewer opens them."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import rerun.blueprint as rrb

from gfimu.base.files.outputs import RERUN
from gfimu.base.files.rerun_stream import markdown, rrd_stream
from gfimu.visual.plots import Plot
from gfimu.visual.scene import TIMELINE, Scene
from gfimu.visual.trace import PositionTrace

__all__ = ["NOTES", "notes_view", "write_rrd"]

NOTES = "notes"
"""Entity of the notes."""


def write_rrd(
    path: str | Path,
    *,
    title: str,
    layout: rrb.Container,
    scene: Scene,
    plots: Iterable[Plot | PositionTrace],
    notes: str = "",
) -> None:
    """Write a rerun recording with its blueprint, whole or not at all.

    Parameters
    ----------
    path : str or Path
        File to write, ``.rrd``.
    title : str
        Name that the viewer shows.
    layout : rerun.blueprint container
        Arrangement of the views.
    scene, plots : Scene, iterable of Plot or PositionTrace
        What to write.
    notes : str
        Markdown shown in the notes view.

    Raises
    ------
    InputError
        If the file name does not end in ``.rrd`` or its folder can't be written to.
    """
    RERUN.check_suffix(Path(path))
    panel = rrb.TimePanel(
        state="collapsed", timeline=TIMELINE, playback_speed=1.0, play_state="playing", loop_mode="all"
    )
    blueprint = rrb.Blueprint(
        layout,
        panel,
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_views=False,
        auto_layout=False,
    )
    with rrd_stream(path, "gfimu", blueprint=blueprint) as stream:
        stream.send_recording_name(title)
        if notes:
            stream.log(NOTES, markdown(notes), static=True)
        scene.log(stream)
        for plot in plots:
            plot.log(stream)


def notes_view() -> rrb.TextDocumentView:
    """Return the view of the notes for a blueprint."""
    return rrb.TextDocumentView(origin=f"/{NOTES}", name="what you see")
