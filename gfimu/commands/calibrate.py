"""Under `gfimu calibrate`: sensitivity, bias and alignment of the chips from a recording at rest."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from gfimu.errors import InputError
from gfimu.files.outputs import CALIBRATION, PICTURE, writes

if TYPE_CHECKING:
    from gfimu.calibration.registry import CalibrationMethod
    from gfimu.calibration.result import Calibration
    from gfimu.commands.opened import Source
    from gfimu.geometry.array import AccelerometerArray
    from gfimu.importing import ColumnMap
    from gfimu.recording import Recording
    from gfimu.recording.mapped import RecordingLike

__all__ = ["calibrate"]


_OPTION_NAMES = {
    "motion": "--motion is the motion of a whole array",
    "update": "--update carries the calibration of a whole array over",
    "start": "--calibration is what a spin starts from",
    "radius_std_m": "--radius-std is of the arms on a turntable",
    "stretch_std_s2_rad2": "--stretch-std is of the arms on a turntable",
    "levelling_std_rad": "--levelling-std is the tilt of levelled faces",
    "n_parameters": "--parameters chooses the model of single chips",
    "input_kind": "--input chooses the rows for single chips",
    "rate_table": "--rate-table, --also and --table-axes are of a gyro on a rate table",
}
"""What the options are that some methods do not use, by the field of the task."""


@writes(
    reads=("recording", "array", "motion", "update", "calibration", "check", "also", "column_map"),
    out=CALIBRATION,
    picture=PICTURE,
)
def calibrate(
    method: str,
    recording: RecordingLike,
    *,
    out: str | Path | None = None,
    array: AccelerometerArray | str | Path | None = None,
    column_map: ColumnMap | str | Path | None = None,
    map_set: Sequence[str] = (),
    gravity: float | None = None,
    latitude: float | None = None,
    height: float = 0.0,
    parameters: int | None = None,
    input_kind: str = "averaged",
    wavelet_level: int | None = None,
    wavelet_threshold: str | None = None,
    rest_threshold: float | None = None,
    min_rest: float | None = None,
    levelling_std: float | None = None,
    motion: RecordingLike | None = None,
    update: Calibration | str | Path | None = None,
    turn_on_std: float | None = None,
    bias_walk: float | None = None,
    calibration: Calibration | str | Path | None = None,
    radius_std: float | None = None,
    stretch_std: float | None = None,
    check: RecordingLike | None = None,
    rate_table: bool = False,
    also: Sequence[RecordingLike] = (),
    table_axes: Sequence[str] | str = (),
    picture: str | Path | None = None,
    force: bool = False,
    progress: Callable[[float], object] | None = None,
    n_parameters: int | None = None,
    min_rest_s: float | None = None,
    levelling_std_rad: float | None = None,
) -> Calibration:
    """Calibrate the accelerometers of a recording, each parameter with its standard deviation.

    Parameters
    ----------
    method : str
        A key of `gfimu.calibration.registry.METHODS`.
    recording : Recording, path, table, or times (n,) with readings (n, c)
        Static poses in m/s² or raw counts, or the file.
    out : str or Path, optional
        Calibration file to write, ``.json``.
    array : AccelerometerArray, str or Path, optional
        The array, its name or file; the recording's own by default.
    column_map : ColumnMap, str or Path, optional
        What the columns of a foreign file are: a map, its name or TOML file (``--map``); see `gfimu.inspect`.
    map_set : sequence of str
        Keys of that map to set, such as ``"time.unit=ms"`` (``--map-set``); without a map they are all of it.
    gravity : float, optional
        Local gravity, m/s²; standard gravity by default.
    latitude, height : float, optional
        Latitude, degrees, and height above the ellipsoid, m, in place of ``gravity``.
    parameters, n_parameters : {9, 12}, optional
        Parameters per triad; two names of one argument.
    input_kind : {"averaged", "raw", "wavelet"}
        Rows that the fit uses (``--input``).
    wavelet_level, wavelet_threshold : int and {"none", "soft", "hard"}, optional
        With the wavelet input: level of the transform, 4 by default, and what becomes of its details: all are left out,
        or those below the universal threshold (`gfimu.calibration.observations.denoised_samples`).
    rest_threshold : float, optional
        Threshold of rest, reading unit squared; chosen by the data if not given.
    min_rest, min_rest_s : float, optional
        Shortest pose, s; two names of one argument; 1 by default, 2 for ``array``.
    levelling_std, levelling_std_rad : float, optional
        Standard deviation of the tilt of a pose, rad; two names of one argument.
    motion : Recording, str or Path, optional
        For ``array``: recording with the motion. With a tachometer or gyro, positions are fitted to it; without, it
        is taken for shakes by hand from rest to rest, which may be in ``recording`` itself.
    update : Calibration, str or Path, optional
        For ``array``: calibration of an earlier run to carry over.
    turn_on_std, bias_walk : float, optional
        With ``update``: change of a bias between power-ons, m/s², 0.03 by default; random walk between poses, m/s²/√s,
        0 by default. The first also with ``calibration``.
    calibration : Calibration, str or Path, optional
        For ``spin``: static calibration to start from, or the result of another spin; else the data sheets.
    radius_std, stretch_std : float, optional
        For ``spin``: standard deviations of each coordinate of a chip, m, and of the arm stretch, s²/rad²
        (`gfimu.calibration.spin.policy`).
    check : Recording, str or Path, optional
        Other poses at rest, which the fit does not see: ``|a| − g`` on them goes into the statistics
        (`gfimu.calibration.check_poses`).
    rate_table : bool
        For ``gyro``: the recording is of a rate table, whose rate (``tacho_rad_s``) is the reference
        (`gfimu.calibration.rate_table`); the same as the method ``gyro-rate-table``. It may hold references alone.
    also : sequence of Recording, str or Path
        With ``rate_table``: recordings of the gyro mounted otherwise.
    table_axes : sequence of str or str
        With ``rate_table``: the gyro's axis along the table's, up, of the recording and each of ``also``, such as
        ``["x", "y", "-z"]`` or ``"x,y,-z"``; by default those of the recordings' mountings.
    picture : str or Path, optional
        Picture to write, ``.png``, ``.svg`` or ``.pdf``; its magnitudes are those of ``check``, where that is given.
    force : bool
        Go on, with a warning, where the checks of a recording would refuse it.
    progress : callable, optional
        Called with the share done of a fit to shakes, 0 to 1.

    Raises
    ------
    InputError
        If the method is unknown, an option has no use with it, a recording is refused by its checks, the data are
        faulty, the poses don't suffice, or an output can't be written where it is asked for.

    Examples
    --------
    >>> import gfimu
    >>> poses = gfimu.simulate("calibration_poses", seed=2)
    >>> gfimu.calibrate("array", poses)
    Calibration(array, 12 channels in m/s², 60 parameters, 3 directions undetermined)
    """
    from gfimu.calibration.check_poses import check_on_poses
    from gfimu.calibration.methods import CalibrationTask, RateTable, run_calibration
    from gfimu.calibration.registry import calibration_method
    from gfimu.commands.opened import as_array, as_calibration, as_source, name_of
    from gfimu.recording.checks import examine

    on_table = rate_table or bool(also) or bool(table_axes)
    chosen = calibration_method("gyro-rate-table" if on_table and method == "gyro" else method)
    given = {"level": wavelet_level, "threshold": wavelet_threshold}
    wavelet = {key: value for key, value in given.items() if value is not None}
    levelling = levelling_std_rad if levelling_std is None else levelling_std
    count = n_parameters if parameters is None else parameters
    _refuse_unused(
        chosen,
        motion=motion,
        update=update,
        levelling_std_rad=levelling,
        n_parameters=count,
        input_kind=None if input_kind == "averaged" and not wavelet else input_kind,
        start=calibration,
        radius_std_m=radius_std,
        stretch_std_s2_rad2=stretch_std,
        rate_table=on_table or None,
    )
    if update is None and (bias_walk is not None or (turn_on_std is not None and calibration is None)):
        raise InputError("--turn-on-std and --bias-walk are of --update; give the calibration to carry over")
    drawing = None if array is None else as_array(array)
    local_gravity = _gravity(gravity, latitude, height)
    source = as_source(recording, array, column_map, map_set)
    if on_table or "rate_table" in chosen.options:
        if check is not None or picture is not None or drawing is not None or gravity is not None:
            raise InputError(
                "--array, --gravity, --check and --picture are of accelerometers; leave them out for a gyro"
            )
        task = CalibrationTask(
            _references(source),
            rest_threshold=rest_threshold,
            min_rest_s=min_rest_s if min_rest is None else min_rest,
            levelling_std_rad=levelling,
            latitude_deg=latitude,
            rate_table=RateTable(
                tuple(_references(as_source(one, array, column_map, map_set)) for one in also),
                tuple(filter(None, table_axes.split(","))) if isinstance(table_axes, str) else tuple(table_axes),
                tuple(name_of(one) for one in (recording, *also)),
            ),
        )
        result = run_calibration(chosen, task)
        if out is not None:
            result.save(out)
        return result
    run = _uncalibrated(source, drawing)
    examine(run, drawing, source=name_of(recording), force=force)
    turned = None if motion is None else _uncalibrated(as_source(motion, array, column_map, map_set), drawing)
    if turned is not None:
        examine(turned, drawing, source=name_of(motion), force=force)
    others = None if check is None else _uncalibrated(as_source(check, array, column_map, map_set), drawing)
    if others is not None:
        examine(others, drawing, source=name_of(check), force=force)
        _refuse_the_same(run, others, name_of(check))
    task = CalibrationTask(
        run,
        gravity=local_gravity,
        n_parameters=count,
        input_kind=input_kind,
        rest_threshold=rest_threshold,
        min_rest_s=min_rest_s if min_rest is None else min_rest,
        levelling_std_rad=levelling,
        array=_own_array(source) if drawing is None and "array" in chosen.options else drawing,
        motion=turned,
        update=None if update is None else as_calibration(update),
        start=None if calibration is None else as_calibration(calibration),
        radius_std_m=radius_std,
        stretch_std_s2_rad2=stretch_std,
        turn_on_std_m_s2=0.03 if turn_on_std is None else turn_on_std,
        bias_walk_m_s2_rt_s=bias_walk or 0.0,
        wavelet=wavelet,
        progress=progress,
    )
    result = run_calibration(chosen, task)
    if others is not None:
        rested = {} if task.min_rest_s is None else {"min_rest_s": task.min_rest_s}
        figures = check_on_poses(result, others, rest_threshold=rest_threshold, **rested)
        result = replace(result, statistics={**result.statistics, **figures})
    if out is not None:
        result.save(out)
    if picture is not None:
        from gfimu.calibration.pictures import calibration_picture

        calibration_picture(picture, result, others or run)
    return result


def _refuse_the_same(run: Recording, others: Recording, name: str) -> None:
    """Refuse to check a calibration on what it was made from."""
    import numpy as np

    if run.channels == others.channels and np.array_equal(run.readings, others.readings, equal_nan=True):
        raise InputError(f"{name}: this is the recording of the fit; --check needs other poses")


def _refuse_unused(method: CalibrationMethod, **given: object) -> None:
    """Refuse an option that the method would ignore."""
    from gfimu.calibration.registry import METHODS

    for name, value in given.items():
        if value is not None and name not in method.options:
            users = " or ".join(other.name for other in METHODS.values() if name in other.options)
            raise InputError(f"{_OPTION_NAMES[name]}; use it with {users}, not {method.name}")


def _uncalibrated(recording: Source, array: AccelerometerArray | None) -> Recording:
    from gfimu.calibration.run_file import open_uncalibrated
    from gfimu.recording import Recording

    return recording if isinstance(recording, Recording) else open_uncalibrated(recording, array=array)


def _references(recording: Source) -> Recording:
    from gfimu.calibration.run_file import open_references
    from gfimu.recording import Recording

    return recording if isinstance(recording, Recording) else open_references(recording)


def _own_array(recording: Source) -> AccelerometerArray:
    from gfimu.commands.opened import as_run

    return as_run(recording, None)[1]


def _gravity(gravity: float | None, latitude: float | None, height: float) -> float:
    from gfimu.geometry.gravity import local_gravity
    from gfimu.units import STANDARD_GRAVITY

    if gravity is not None and latitude is not None:
        raise InputError("give --gravity or --latitude, not both")
    if latitude is not None:
        return local_gravity(latitude, height)
    return STANDARD_GRAVITY if gravity is None else gravity
