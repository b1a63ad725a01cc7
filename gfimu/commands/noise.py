"""Under `gfimu noise`: Allan deviation and noise terms of a recording at rest, also as a rate about a known axis."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from gfimu.files.outputs import KALIBR, PICTURE, writes

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gfimu.calibration.result import Calibration
    from gfimu.geometry.array import AccelerometerArray
    from gfimu.geometry.turning_axis import TurningAxis
    from gfimu.importing import ColumnMap
    from gfimu.recording.mapped import RecordingLike
    from gfimu.sensor_noise import RecordingNoise

__all__ = ["noise"]


@writes(reads=("recording", "calibration", "column_map", "array"), kalibr=KALIBR, picture=PICTURE)
def noise(
    recording: RecordingLike,
    *,
    stretch: str = "rest",
    rest_threshold: float | None = None,
    calibration: Calibration | str | Path | None = None,
    column_map: ColumnMap | str | Path | None = None,
    map_set: Sequence[str] = (),
    kalibr: str | Path | None = None,
    picture: str | Path | None = None,
    array: AccelerometerArray | str | Path | None = None,
    axis: TurningAxis | str | Sequence[float] | None = None,
    axis_point: Sequence[float] = (0.0, 0.0, 0.0),
    hub: str = "fixed",
    speed_rad_s: float = math.tau,
    force: bool = False,
) -> RecordingNoise:
    """Identify velocity random walk N, bias instability B, acceleration random walk K, quantisation Q and ramp R.

    Parameters
    ----------
    recording : Recording, path, table, or times (n,) with readings (n, c)
        The recording at rest, or its file.
    stretch : {"rest", "all"}
        Samples to use: the longest rest, or everything up to the first gap.
    rest_threshold : float, optional
        Threshold of rest, reading unit squared; chosen by the data if not given.
    calibration : Calibration, str or Path, optional
        Calibration to apply first.
    column_map : ColumnMap, str or Path, optional
        What the columns of a foreign file are: a map, its name or TOML file (``--map``); see `gfimu.inspect`.
    map_set : sequence of str
        Keys of that map to set, such as ``"time.unit=ms"`` (``--map-set``); without a map they are all of it.
    kalibr : str or Path, optional
        Kalibr ``imu.yaml`` to write.
    picture : str or Path, optional
        Picture to write, ``.png``, ``.svg`` or ``.pdf``.
    array : AccelerometerArray, str or Path, optional
        The array, its name or file, for its rotation about a known axis; the recording's own by default.
    axis : TurningAxis, str or sequence of float, optional
        Axis about which alone the array turns, body frame: x, y, z, or three numbers; with it the result says what the
        noise means for the rate (``about_axis``). By default the array's own, where it sees too little without.
    axis_point : sequence of float
        A point of that axis, body frame, m.
    hub : {"fixed", "free"}
        Whether that axis stands still (a table) or moves with a body (a wheel).
    speed_rad_s : float
        Rate at which that holds, rad/s.
    force : bool
        Go on, with a warning, where the checks of the recording would refuse it.

    Raises
    ------
    InputError
        If the recording can't be read, is refused by its checks or never rests, or holds counts where an axis is given,
        or an output can't be written where it is asked for.

    Examples
    --------
    >>> import gfimu
    >>> found = gfimu.noise(gfimu.simulate("rest", seed=1))
    >>> list(found.models)[:3]
    ['a11', 'a12', 'a13']
    """
    from gfimu.calibration.run_file import open_calibrated, open_uncalibrated
    from gfimu.commands.known_axis import known_axis, turning_axis
    from gfimu.commands.opened import as_array, as_calibration, as_source, name_of
    from gfimu.files.atomic_file import write_text
    from gfimu.recording import Recording
    from gfimu.recording.checks import examine
    from gfimu.sensor_noise import kalibr_yaml, recording_noise

    chosen = turning_axis(axis, axis_point, hub, None)
    unit = None if calibration is None else as_calibration(calibration)
    source = as_source(recording, array, column_map, map_set)
    if isinstance(source, Recording):
        run = source if unit is None else unit.apply(source)
    else:
        run = open_uncalibrated(source) if unit is None else open_calibrated(source, unit)
    given = None if array is None else as_array(array)
    examine(run, given, source=name_of(recording), force=force)
    result = recording_noise(run, stretch=stretch, rest_threshold=rest_threshold)
    if axis is not None or array is not None or "[turning_axis]" in str(run.metadata.get("array_toml", "")):
        from gfimu.commands.opened import as_run
        from gfimu.known_axis.accuracy.noise import axis_noise

        geometry = given or as_run(source, None)[1]
        turning = known_axis(chosen, geometry)
        if turning is not None:
            result = replace(result, about_axis=axis_noise(result, geometry, turning, rate_rad_s=speed_rad_s))
    if kalibr is not None:
        write_text(kalibr, kalibr_yaml(result))
    if picture is not None:
        from gfimu.sensor_noise.pictures import noise_picture

        noise_picture(picture, result)
    return result
