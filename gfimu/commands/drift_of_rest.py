"""Under `gfimu drift RUN`: the position error of a unit that stands still, from a recording of one's own."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from gfimu.commands.former_arguments import former_arguments
from gfimu.files.outputs import PICTURE, writes

if TYPE_CHECKING:
    from gfimu.calibration.result import Calibration
    from gfimu.geometry.array import AccelerometerArray
    from gfimu.importing import ColumnMap
    from gfimu.position_drift.rest_windows import RestDrift
    from gfimu.recording.mapped import RecordingLike

__all__ = ["drift_of_rest"]


@former_arguments(time="duration")
@writes(reads=("recording", "array", "calibration", "column_map"), picture=PICTURE)
def drift_of_rest(
    recording: RecordingLike,
    array: AccelerometerArray | str | Path | None = None,
    *,
    duration: float = 30.0,
    lead: float = 10.0,
    gravity: float = 9.80665,
    calibration: Calibration | str | Path | None = None,
    picture: str | Path | None = None,
    column_map: ColumnMap | str | Path | None = None,
    map_set: Sequence[str] = (),
    force: bool = False,
) -> RestDrift:
    """Navigate through the rests of a recording, and compare the errors with the prediction from its noise.

    Parameters
    ----------
    recording : Recording, path, table, or times (n,) with readings (n, c)
        The recording, or its file, with a rest of ``lead + duration`` or more.
    array : AccelerometerArray, str or Path, optional
        The array, its name or file; the recording's own by default.
    duration, lead : float
        Time of navigation, and of the rest before it from which tilt and biases are read off, s.
    gravity : float
        Local gravity, m/s².
    calibration : Calibration, str or Path, optional
        Calibration to apply first.
    picture : str or Path, optional
        Picture to write, ``.png``, ``.svg`` or ``.pdf``.
    column_map : ColumnMap, str or Path, optional
        What the columns of a foreign file are: a map, its name or TOML file (``--map``); see `gfimu.inspect`.
    map_set : sequence of str
        Keys of that map to set, such as ``"time.unit=ms"`` (``--map-set``); without a map they are all of it.
    force : bool
        Go on, with a warning, where the checks of the recording would refuse it.

    Raises
    ------
    InputError
        If no rest is long enough, the recording is refused by its checks, or the picture can't be written.
    GeometryError
        If the array can't see all six motions.

    Examples
    --------
    >>> import gfimu
    >>> rest = gfimu.simulate("rest", seed=3, changes=["duration_s=30"])
    >>> found = gfimu.drift_of_rest(rest, time=2.0)
    >>> len(found.start_s) > 1
    True
    """
    from gfimu.commands.opened import as_calibrated_run, as_source, name_of
    from gfimu.errors import naming
    from gfimu.position_drift.rest_windows import rest_drift
    from gfimu.recording.checks import examine

    run, geometry = as_calibrated_run(as_source(recording, array, column_map, map_set), array, calibration)
    examine(run, geometry, source=name_of(recording), force=force, whose="" if array is None else "the given")
    with naming(name_of(recording)):
        found = rest_drift(run, geometry, time=duration, lead=lead, gravity=gravity)
    if picture is not None:
        from gfimu.position_drift.pictures import rest_drift_picture

        rest_drift_picture(picture, found)
    return found
