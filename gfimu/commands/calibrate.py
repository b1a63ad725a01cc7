"""Under `gfimu calibrate`: sensitivity, bias and alignment of the chips from a recording at rest."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from gfimu.errors import InputError, unknown_name
from gfimu.files.outputs import CALIBRATION, PICTURE, writes

if TYPE_CHECKING:
    from gfimu.calibration.result import Calibration
    from gfimu.geometry.array import AccelerometerArray
    from gfimu.recording import Recording

__all__ = ["calibrate"]

_MIN_REST_S = 1.0
_MIN_REST_ARRAY_S = 2.0


@writes(reads=("recording", "array", "motion", "update"), out=CALIBRATION, picture=PICTURE)
def calibrate(
    method: str,
    recording: Recording | str | Path,
    *,
    out: str | Path | None = None,
    array: AccelerometerArray | str | Path | None = None,
    gravity: float | None = None,
    latitude: float | None = None,
    height: float = 0.0,
    parameters: int | None = None,
    input_kind: str = "averaged",
    rest_threshold: float | None = None,
    min_rest: float | None = None,
    levelling_std: float | None = None,
    motion: Recording | str | Path | None = None,
    update: Calibration | str | Path | None = None,
    turn_on_std: float = 0.03,
    bias_walk: float = 0.0,
    picture: str | Path | None = None,
    n_parameters: int | None = None,
    min_rest_s: float | None = None,
    levelling_std_rad: float | None = None,
) -> Calibration:
    """Calibrate the accelerometers of a recording, each parameter with its standard deviation.

    Parameters
    ----------
    method : str
        A key of `gfimu.calibration.methods.METHODS`, ``array`` or ``gyro``.
    recording : Recording, str or Path
        Static poses in m/s² or raw counts, or the file.
    out : str or Path, optional
        Calibration file to write, ``.json``.
    array : AccelerometerArray, str or Path, optional
        The array, its name or file; the recording's own by default.
    gravity : float, optional
        Local gravity, m/s²; standard gravity by default.
    latitude, height : float, optional
        Latitude, degrees, and height above the ellipsoid, m, in place of ``gravity``.
    parameters, n_parameters : {9, 12}, optional
        Parameters per triad; two names of one argument.
    input_kind : {"averaged", "raw", "wavelet"}
        What the method is given (``--input``).
    rest_threshold : float, optional
        Threshold of rest, reading unit squared; chosen by the data if not given.
    min_rest, min_rest_s : float, optional
        Shortest pose, s; two names of one argument; 1 by default, 2 for ``array``.
    levelling_std, levelling_std_rad : float, optional
        Standard deviation of the tilt of a pose, rad; two names of one argument.
    motion : Recording, str or Path, optional
        For ``array``: recording with the motion, if it is another one.
    update : Calibration, str or Path, optional
        For ``array``: calibration of an earlier run to carry over.
    turn_on_std, bias_walk : float
        With ``update``: change of a bias between power-ons, m/s², and random walk between poses, m/s²/√s.
    picture : str or Path, optional
        Picture to write, ``.png``, ``.svg`` or ``.pdf``.

    Raises
    ------
    InputError
        If the method is unknown, the data are faulty, the poses don't suffice, or an output can't be written where it
        is asked for.
    """
    from gfimu.calibration.methods import METHODS, calibrate_gyro
    from gfimu.calibration.methods import calibrate as calibrate_triads
    from gfimu.commands.opened import as_array

    if method not in {*METHODS, "array", "gyro"}:
        raise unknown_name("calibration method", method, (*METHODS, "array", "gyro"))
    if update is not None and method != "array":
        raise InputError(f"--update carries the calibration of a whole array over; use it with array, not {method}")
    drawing = None if array is None else as_array(array)
    local_gravity = _gravity(gravity, latitude, height)
    run = _uncalibrated(recording, drawing)
    rest_s = min_rest_s if min_rest is None else min_rest
    if method == "array":
        result = _calibrate_array(
            run,
            drawing or _own_array(recording),
            local_gravity,
            rest_threshold,
            rest_s or _MIN_REST_ARRAY_S,
            None if motion is None else _uncalibrated(motion, drawing),
            update,
            (turn_on_std, bias_walk),
        )
    elif method == "gyro":
        result = calibrate_gyro(run, rest_threshold=rest_threshold, min_rest_s=rest_s or _MIN_REST_S)
    else:
        result = calibrate_triads(
            method,
            run,
            gravity=local_gravity,
            n_parameters=n_parameters if parameters is None else parameters,
            input_kind=input_kind,
            rest_threshold=rest_threshold,
            min_rest_s=rest_s or _MIN_REST_S,
            levelling_std_rad=levelling_std_rad if levelling_std is None else levelling_std,
        )
    if out is not None:
        result.save(out)
    if picture is not None:
        from gfimu.calibration.pictures import calibration_picture

        calibration_picture(picture, result, run)
    return result


def _calibrate_array(
    run: Recording,
    array: AccelerometerArray,
    gravity: float,
    rest_threshold: float | None,
    min_rest_s: float,
    motion: Recording | None,
    update: Calibration | str | Path | None,
    change: tuple[float, float],
) -> Calibration:
    """Calibrate a whole array anew, or carry an earlier calibration over."""
    from gfimu.calibration.array_calibration import calibrate_array, update_array_calibration
    from gfimu.commands.opened import as_calibration

    if update is None:
        return calibrate_array(
            run, array, gravity=gravity, motion=motion, rest_threshold=rest_threshold, min_rest_s=min_rest_s
        )
    turn_on_std, bias_walk = change
    return update_array_calibration(
        as_calibration(update),
        run,
        array,
        turn_on_std_m_s2=turn_on_std,
        bias_walk_m_s2_rt_s=bias_walk,
        rest_threshold=rest_threshold,
        min_rest_s=min_rest_s,
    )


def _uncalibrated(recording: Recording | str | Path, array: AccelerometerArray | None) -> Recording:
    from gfimu.calibration.run_file import open_uncalibrated
    from gfimu.recording import Recording

    return recording if isinstance(recording, Recording) else open_uncalibrated(recording, array=array)


def _own_array(recording: Recording | str | Path) -> AccelerometerArray:
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
