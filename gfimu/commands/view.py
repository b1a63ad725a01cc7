"""Under `gfimu view`: a run in the rerun viewer."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from gfimu.files.outputs import RERUN, check_outputs, writes
from gfimu.optional_packages import require

if TYPE_CHECKING:
    from gfimu.diagnosis.verdict.verdict import Diagnosis
    from gfimu.geometry.array import AccelerometerArray
    from gfimu.geometry.turning_axis import TurningAxis
    from gfimu.importing import ColumnMap
    from gfimu.motion.estimate import Estimate
    from gfimu.recording.mapped import RecordingLike

__all__ = ["view"]


@writes(reads=("file", "array", "column_map"), out=RERUN)
def view(
    file: RecordingLike | Estimate | Diagnosis,
    *,
    array: AccelerometerArray | str | Path | None = None,
    column_map: ColumnMap | str | Path | None = None,
    map_set: Sequence[str] = (),
    axis: TurningAxis | str | Sequence[float] | None = None,
    axis_point: Sequence[float] = (0.0, 0.0, 0.0),
    hub: str = "fixed",
    inclination_rad: float | None = None,
    out: str | Path | None = None,
    force: bool = False,
    on_picture: Callable[[Path], None] | None = None,
) -> Path:
    """Open a run in the rerun viewer, or write it as a picture.

    Parameters
    ----------
    file : path, Recording, Estimate, Diagnosis, table, or times (n,) with readings (n, c)
        A ``.rrd`` file, or a recording, an estimate or a diagnosis to make one from. That goes beside a file as
        ``FILE.view.rrd``, else into a temporary folder.
    array : AccelerometerArray, str or Path, optional
        The array, its name or file; the recording's own by default.
    column_map : ColumnMap, str or Path, optional
        What the columns of a foreign file are: a map, its name or TOML file (``--map``).
    map_set : sequence of str
        Keys of that map to set, such as ``"time.unit=ms"`` (``--map-set``); without a map they are all of it.
    axis : TurningAxis, str or sequence of float, optional
        The axis about which alone the array turns, body frame: x, y, z, or three numbers; by default the array's own,
        where it can't see all six motions.
    axis_point : sequence of float
        A point of that axis, body frame, m.
    hub : {"fixed", "free"}
        Whether that axis stands still (a table) or moves with a body (a wheel).
    inclination_rad : float, optional
        Angle between that axis and the vertical, rad; estimated by default.
    out : str or Path, optional
        Write the ``.rrd`` here and don't open it.
    force : bool
        Go on, with a warning, where the checks of the recording would refuse it.
    on_picture : callable, optional
        Called with the rerun recording once it is written, before the viewer opens.

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
    from gfimu.commands.known_axis import turning_axis
    from gfimu.commands.opened import as_array, as_source
    from gfimu.diagnosis.verdict.verdict import Diagnosis
    from gfimu.motion.estimate import Estimate
    from gfimu.visual.picture import picture_of, picture_path
    from gfimu.visual.viewer import open_viewer

    source = Path(file) if isinstance(file, str | Path) else None
    if source is not None and source.suffix == ".rrd" and out is None:
        open_viewer(source)
        return source
    picture = picture_path(source) if out is None else Path(out)
    check_outputs([("out", picture, RERUN)], [] if source is None else [source])
    if isinstance(file, Diagnosis):
        _picture_of_diagnosis(picture, file)
    else:
        drawing = None if array is None else as_array(array)
        picture_of(
            file if isinstance(file, Estimate) else as_source(source or file, drawing, column_map, map_set),
            picture,
            array=drawing,
            axis=turning_axis(axis, axis_point, hub, inclination_rad),
            force=force,
        )
    if on_picture is not None:
        on_picture(picture)
    if out is None:
        open_viewer(picture)
    return picture


def _picture_of_diagnosis(path: Path, diagnosis: Diagnosis) -> None:
    from gfimu.commands.diagnose import drawn_rig
    from gfimu.diagnosis.report.picture import write_picture

    write_picture(path, diagnosis, rig=drawn_rig(diagnosis))
