"""`gfimu view`: a rerun recording, or a recording of readings, in the viewer."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from gfimu.cli.axis_options import AxisOption, AxisPointOption, HubOption, InclinationOption
from gfimu.cli.output import print_json, print_paths, progress
from gfimu.cli.shared_options import ForceOption, JsonOption, MapOption, MapSetOption, shared

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="view")(_view)


def _view(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE", help="A .rrd file, or a recording or estimate (.csv, .parquet, .bin) to make one from."
        ),
    ],
    array: Annotated[str | None, shared("--array", more="; else the recording's own")] = None,
    column_map: MapOption = None,
    map_set: MapSetOption = None,
    axis: AxisOption = None,
    axis_point: AxisPointOption = (0.0, 0.0, 0.0),
    hub: HubOption = "fixed",
    inclination_rad: InclinationOption = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Rerun recording to write (.rrd); the viewer is not opened.")
    ] = None,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Open a run in the rerun viewer: the rig in 3-D, raw channels, and the estimate over time.

    A recording of readings is estimated first; its picture goes beside it as FILE.view.rrd.

    Examples
    --------
    gfimu view run.parquet
    # Write the picture without opening it
    gfimu view run.parquet --out run.rrd
    # One chip on a table
    gfimu view run.csv --array arm.toml --axis z
    """
    from gfimu.commands.view import view

    shown: list[Path] = []
    bar = ExitStack()

    def show(picture: Path) -> None:
        bar.close()  # the viewer stays open as long as its user likes
        shown.append(picture)
        if json:
            print_json({"files": {"rerun recording": picture}})
        else:
            print_paths([("rerun recording", picture)])

    with bar:
        bar.enter_context(progress("making the picture"))
        picture = view(
            file,
            array=array,
            column_map=column_map,
            map_set=map_set or [],
            axis=axis,
            axis_point=axis_point,
            hub=hub,
            inclination_rad=inclination_rad,
            out=out,
            force=force,
            on_picture=show,
        )
    if json and not shown:  # the file is a picture itself
        show(picture)
