"""Under `gfimu noise`: Allan deviation and noise terms of a recording at rest."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from gfimu.files.outputs import KALIBR, PICTURE, writes

if TYPE_CHECKING:
    from gfimu.calibration.result import Calibration
    from gfimu.importing import ColumnMap
    from gfimu.recording import Recording
    from gfimu.recording.mapped import MappedFile
    from gfimu.sensor_noise import RecordingNoise

__all__ = ["noise"]


@writes(reads=("recording", "calibration", "column_map"), kalibr=KALIBR, picture=PICTURE)
def noise(
    recording: Recording | str | Path | MappedFile,
    *,
    stretch: str = "rest",
    rest_threshold: float | None = None,
    calibration: Calibration | str | Path | None = None,
    column_map: ColumnMap | str | Path | None = None,
    map_set: Sequence[str] = (),
    kalibr: str | Path | None = None,
    picture: str | Path | None = None,
) -> RecordingNoise:
    """Identify velocity random walk N, bias instability B, acceleration random walk K, quantisation Q and ramp R.

    Parameters
    ----------
    recording : Recording, str or Path
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

    Raises
    ------
    InputError
        If the recording can't be read or never rests, or an output can't be written where it is asked for.
    """
    from gfimu.calibration.run_file import open_calibrated, open_uncalibrated
    from gfimu.commands.opened import as_calibration, by_map
    from gfimu.files.atomic_file import write_text
    from gfimu.recording import Recording
    from gfimu.sensor_noise import kalibr_yaml, recording_noise

    unit = None if calibration is None else as_calibration(calibration)
    source = by_map(recording, column_map, map_set)
    if isinstance(source, Recording):
        run = source if unit is None else unit.apply(source)
    else:
        run = open_uncalibrated(source) if unit is None else open_calibrated(source, unit)
    result = recording_noise(run, stretch=stretch, rest_threshold=rest_threshold)
    if kalibr is not None:
        write_text(kalibr, kalibr_yaml(result))
    if picture is not None:
        from gfimu.sensor_noise.pictures import noise_picture

        noise_picture(picture, result)
    return result
