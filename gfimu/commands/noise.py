"""Identify velocity random walk N, bias instability B, acceleration random walk K, quantisation Q and ramp R.

Examples
--------
gfimu noise rest.parquet --picture allan.png
# For Kalibr
gfimu noise rest.parquet --kalibr imu.yaml
# One chip on a table
gfimu noise rest.parquet --axis z --axis-point -0.1 0 0
"""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from gfimu.base.files.outputs import OutputFile
from gfimu.commands import given
from gfimu.commands.known_axis import AXIS_PLACE, AxisLike, as_known_axis
from gfimu.commands.shell import options
from gfimu.commands.shell.declare import Option, command

if TYPE_CHECKING:
    from gfimu.sensor_noise import RecordingNoise

__all__ = ["noise"]


_STRETCH = Option("Samples to use: rest (the longest one) or all (up to the first gap).", "KIND")
_KALIBR = Option("Kalibr file to write (.yaml).", writes=OutputFile("a Kalibr file", (".yaml", ".yml")), what="Kalibr")


def _results() -> tuple[type, ...]:
    from gfimu.rate.axis.accuracy.noise import NoiseAboutAxis
    from gfimu.sensor_noise import RecordingNoise

    return RecordingNoise, NoiseAboutAxis


@command(results=_results, doing="identifying the noise")
def noise(
    recording: Annotated[given.Run, given.RUN.also(" at rest: .csv, .parquet, a MIMU4444 stream, or text rows.")],
    *,
    stretch: Annotated[Literal["rest", "all"], _STRETCH] = "rest",
    rest_threshold: Annotated[float | None, options.REST_THRESHOLD] = None,
    calibration: given.CalibrationToApply = None,
    kalibr: Annotated["str | Path | None", _KALIBR] = None,
    picture: given.Picture = None,
    force: Annotated[bool, options.FORCE] = False,
    column_map: given.Map = None,
    max_memory: given.Memory = None,
    axis: Annotated[AxisLike, AXIS_PLACE] = None,
    speed_rad_s: Annotated[float, options.SPEED_RAD_S.also(", at which that holds", when="With --axis: ")] = math.tau,
    array: Annotated[given.Array, options.ARRAY.also("; else the recording's own", when="With --axis: ")] = None,
) -> "RecordingNoise":
    """Identify velocity random walk N, bias instability B, acceleration random walk K, quantisation Q and ramp R.

    Returns
    -------
    RecordingNoise
        Noise of every channel. About an axis, given or the array's own where it can't see all six motions, it is a
        `gfimu.rate.axis.accuracy.noise.NoiseAboutAxis`, whose ``about_axis`` says what the noise means for the rate.

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
    from gfimu.base.files.atomic_file import write_text
    from gfimu.calibration.run_file import open_calibrated
    from gfimu.commands.opened import as_array, as_calibrated_run, as_calibration, as_source, name_of
    from gfimu.recording.doubts.judge import examine, without_doubtful
    from gfimu.sensor_noise import kalibr_yaml, recording_noise

    known = as_known_axis(axis)
    unit = None if calibration is None else as_calibration(calibration)
    source = as_source(recording, array, column_map, max_memory=max_memory)
    run = open_calibrated(source, unit)
    drawing = None if array is None else as_array(array)
    run = without_doubtful(run, drawing, examine(run, drawing, source=name_of(recording), force=force))
    result = recording_noise(run, stretch=stretch, rest_threshold=rest_threshold)
    if known.axis is not None or array is not None or "[turning_axis]" in str(run.metadata.get("array_toml", "")):
        from gfimu.rate.axis.accuracy.noise import axis_noise

        geometry = drawing or as_calibrated_run(source, None)[1]
        turning = known.of(geometry)
        if turning is not None:
            result = axis_noise(result, geometry, turning, rate_rad_s=speed_rad_s)
    if kalibr is not None:
        write_text(kalibr, kalibr_yaml(result))
    if picture is not None:
        result.to_picture(picture)
    return result
