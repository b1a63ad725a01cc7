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

import inspect
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from gfimu.base.files.outputs import RERUN, check_outputs
from gfimu.base.optional_packages import require
from gfimu.commands import given
from gfimu.commands.known_axis import AXIS_ALONE, AxisLike, as_known_axis
from gfimu.commands.shell.declare import Option, command
from gfimu.commands.shell.options import FORCE, file_argument

if TYPE_CHECKING:
    from gfimu.diagnosis.verdict.verdict import Diagnosis
    from gfimu.motion.estimate import Estimate
    from gfimu.recording.mapped import RecordingLike
    from gfimu.visual.picture import Viewed

__all__ = ["view"]

_FILE = file_argument("A .rrd file, or a recording or estimate (.csv, .parquet, .bin) to make one from.", "FILE")
_OUT = Option("Rerun recording to write (.rrd); the viewer is not opened.", writes=RERUN)


def _opened(viewed: "Viewed") -> Path:
    """Open the picture where that is asked for, and return it."""
    from gfimu.visual.viewer import open_viewer

    if viewed.opens:
        open_viewer(viewed.picture)
    return viewed.picture


def _show(values: Mapping[str, Any], as_json: bool) -> None:
    """Name a picture before the viewer opens, which stays open as long as its user likes."""
    from gfimu.commands.shell.output import print_json, print_paths, progress

    with progress("making the picture"):
        viewed = inspect.unwrap(view)(**values)
    files = {"rerun recording": viewed.picture}
    if not viewed.made:
        _opened(viewed)
    if as_json:
        print_json({"files": files})
    elif viewed.made:
        print_paths(files.items())
    if viewed.made:
        _opened(viewed)


@command(gives=_opened, run=_show)
def view(
    file: Annotated["RecordingLike | Estimate | Diagnosis", _FILE],
    *,
    array: given.Array = None,
    column_map: given.Map = None,
    max_memory: given.Memory = None,
    axis: Annotated[AxisLike, AXIS_ALONE] = None,
    out: Annotated["str | Path | None", _OUT] = None,
    force: Annotated[bool, FORCE] = False,
) -> "Viewed":
    """Open a run in the rerun viewer, or write it as a picture.

    The picture of a file goes beside it as ``FILE.view.rrd``, that of a recording, an estimate or a diagnosis into a
    temporary folder.

    Returns
    -------
    Path
        The rerun recording.

    Raises
    ------
    InputError
        If the file can't be read, its checks refuse it, or the output can't be written where it is asked for.
    GfimuError
        If this machine has no display, or the viewer fails; the message says what to do instead.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.view("run.parquet")  # doctest: +SKIP
    >>> gfimu.view(run, out="run.rrd")  # doctest: +SKIP
    """
    require("gfimu view", "rerun")
    from gfimu.base.files.input_file import as_path
    from gfimu.commands.opened import as_array, as_source
    from gfimu.diagnosis.verdict.verdict import Diagnosis
    from gfimu.motion.estimate import Estimate
    from gfimu.visual.picture import Viewed, picture_of, picture_path

    source = as_path(file) if isinstance(file, str | Path) else None
    if source is not None and source.suffix == ".rrd" and out is None:
        return Viewed(source, made=False)
    picture = picture_path(source) if out is None else Path(out)
    check_outputs([("out", picture, RERUN)], [] if source is None else [source])
    if isinstance(file, Diagnosis):
        from gfimu.commands.diagnose import drawn_rig
        from gfimu.diagnosis.report.picture import write_picture

        write_picture(picture, file, rig=drawn_rig(file))
    else:
        drawn = None if array is None else as_array(array)
        run = (
            file if isinstance(file, Estimate) else as_source(source or file, drawn, column_map, max_memory=max_memory)
        )
        picture_of(run, picture, array=drawn, axis=as_known_axis(axis).axis, force=force)
    return Viewed(picture, opens=out is None)
