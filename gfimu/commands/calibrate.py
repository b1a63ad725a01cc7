"""Calibrate the accelerometers or the gyro of a recording, each parameter with its standard deviation.

Examples
--------
gfimu calibrate multi-position poses.csv --latitude 52.3 --height 80 --out calibration.json
# Checked on other poses
gfimu calibrate multi-position poses.csv --out calibration.json --check others.csv
# Non-linearity on a turntable
gfimu calibrate spin run.parquet --calibration static.json --out spin.json
# A gyro on a rate table
gfimu calibrate gyro x.csv --rate-table --also y.csv --also z.csv --table-axes x,y,z --out gyro.json
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from gfimu.base.errors import InputError
from gfimu.base.files.outputs import CALIBRATION as CALIBRATION_FILE
from gfimu.commands.shell import completion
from gfimu.commands.shell.declare import Group, Option, command
from gfimu.commands.shell.options import (
    ARRAY,
    FORCE,
    GRAVITY,
    LATITUDE,
    MAP,
    MAX_MEMORY,
    PICTURE,
    REST_THRESHOLD,
)

if TYPE_CHECKING:
    from gfimu.array.array import AccelerometerArray
    from gfimu.array.gravity import Latitude
    from gfimu.base.files.memory import MemorySize
    from gfimu.calibration.given import CalibrationPoses, CalibrationPrior, RateTable
    from gfimu.calibration.method import CalibrationMethod
    from gfimu.calibration.result import Calibration
    from gfimu.commands.opened import Source
    from gfimu.recording import Recording
    from gfimu.recording.importing import ColumnMap
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

_METHODS = (
    "six-position", "recursive", "multi-position", "twelve-position", "array", "spin", "gyro", "gyro-rate-table",
)  # fmt: skip
"""Those of `gfimu.calibration.registry`, in its order; that has the functions, and help does not wait for scipy."""

_METHOD = Option(f"Method: {', '.join(_METHODS)}.", "METHOD", offers=completion.words(*_METHODS), argument=True)
_RECORDING = Option(
    "Recording of static poses: .csv, .parquet, a MIMU4444 stream, or text rows time x y z.",
    "RUN", kind=Path, argument=True, reads=True,
)  # fmt: skip
_OUT = Option("Calibration to write (.json).", kind=Path, writes=CALIBRATION_FILE, what="calibration", needed=True)


def _gravity(
    gravity: Annotated[float | None, GRAVITY] = None,
    latitude: Annotated[float | None, LATITUDE.also(": gravity from it")] = None,
    height: Annotated[float, Option("Height above the ellipsoid, m.")] = 0.0,
) -> "Latitude | float | None":
    from gfimu.array.gravity import Latitude

    if gravity is not None and latitude is not None:
        raise InputError("give --gravity or --latitude, not both")
    return gravity if latitude is None else Latitude(latitude, height)


def _poses(
    input_kind: Annotated[
        str,
        Option(
            "Rows that the fit uses: averaged, raw or wavelet.",
            "KIND",
            name="--input",
            offers=completion.words("averaged", "raw", "wavelet"),
        ),
    ] = "averaged",
    wavelet_level: Annotated[int | None, Option("With --input wavelet: level of the transform; 4 by default.")] = None,
    wavelet_threshold: Annotated[
        str | None,
        Option(
            "With --input wavelet: leave out all details (none, the default), or those below the universal threshold "
            "(soft or hard)."
        ),
    ] = None,
    rest_threshold: Annotated[float | None, REST_THRESHOLD] = None,
    min_rest: Annotated[float | None, Option("Shortest pose, s; 1 by default, 2 for array.")] = None,
    levelling_std: Annotated[float | None, Option("Standard deviation of a pose's tilt per axis, rad.")] = None,
) -> "CalibrationPoses":
    from gfimu.calibration.given import CalibrationPoses

    given = {"level": wavelet_level, "threshold": wavelet_threshold}
    wavelet = {key: value for key, value in given.items() if value is not None}
    return CalibrationPoses(rest_threshold, min_rest, levelling_std, input_kind, wavelet)


def _prior(
    update: Annotated[
        Path | None,
        Option("array: calibration of an earlier run to carry over; the biases may have moved.", reads=True),
    ] = None,
    turn_on_std: Annotated[
        float | None,
        Option("With --update, --calibration: turn-on repeatability of a bias, m/s²; 0.03 by default."),
    ] = None,
    bias_walk: Annotated[
        float | None, Option("With --update: random walk of a bias between poses, m/s²/√s; 0 by default.")
    ] = None,
    calibration: Annotated[
        Path | None, Option("spin: static calibration to start from, or that of another spin.", reads=True)
    ] = None,
    radius_std: Annotated[
        float | None, Option("spin: standard deviation of a chip's place, m; 5e-4 by default.")
    ] = None,
    stretch_std: Annotated[
        float | None, Option("spin: standard deviation of the arm stretch, s²/rad²; 1e-7 by default.")
    ] = None,
) -> "CalibrationPrior":
    from gfimu.calibration.given import CalibrationPrior

    return CalibrationPrior(update, calibration, turn_on_std, bias_walk, radius_std, stretch_std)


def _rate_table(
    rate_table: Annotated[bool, Option("gyro: RUN is of a rate table, whose tachometer is the reference.")] = False,
    also: Annotated[
        list[Path], Option("With --rate-table: a recording of the gyro mounted otherwise; repeat it.", reads=True)
    ] = (),  # type: ignore[assignment]
    table_axes: Annotated[
        str, Option("Gyro's axis along the table's, of RUN and each --also: x,y,-z; else by file.")
    ] = "",
) -> "RateTable | None":
    from gfimu.calibration.given import RateTable

    if not (rate_table or also or table_axes):
        return None
    return RateTable(tuple(also), tuple(filter(None, table_axes.split(","))))


def _results() -> tuple[type, ...]:
    from gfimu.calibration.result import Calibration

    return (Calibration,)


@command(results=_results, doing="calibrating")
def calibrate(
    method: Annotated[str, _METHOD],
    recording: Annotated["RecordingLike", _RECORDING],
    *,
    out: Annotated["str | Path | None", _OUT] = None,
    array: Annotated["AccelerometerArray | str | Path | None", ARRAY.also("; else the recording's own")] = None,
    gravity: Annotated[
        "Latitude | float | None",
        Group(_gravity, "Local gravity, m/s², or the `gfimu.Latitude` it follows from; else standard gravity."),
    ] = None,
    parameters: Annotated[int | None, Option("Per chip: 12 (full matrix) or 9 (triangular).")] = None,
    poses: Annotated[
        "CalibrationPoses | None",
        Group(_poses, "How poses are found and what the fit uses of them: a `gfimu.CalibrationPoses`."),
    ] = None,
    motion: Annotated[
        "RecordingLike | None",
        Option("array: recording of the motion, or of shakes (may be RUN).", kind=Path, reads=True),
    ] = None,
    prior: Annotated[
        "CalibrationPrior | None",
        Group(
            _prior,
            "For ``array`` and ``spin``: an earlier calibration, and how exactly it and the chips' places are known, "
            "a `gfimu.CalibrationPrior`.",
            reads=True,
        ),
    ] = None,
    check: Annotated[
        "RecordingLike | None",
        Option("Other poses at rest, which the fit does not see: |a| − g on them.", kind=Path, reads=True),
    ] = None,
    rate_table: Annotated[
        "RateTable | None",
        Group(
            _rate_table,
            "For ``gyro``: the recording is of a rate table, whose rate (``tacho_rad_s``) is the reference; it may "
            "hold references alone. A `gfimu.RateTable` names further recordings and the axes.",
            reads=True,
        ),
    ] = None,
    picture: Annotated["str | Path | None", PICTURE] = None,
    force: Annotated[bool, FORCE] = False,
    column_map: Annotated["ColumnMap | str | Path | None", MAP] = None,
    max_memory: Annotated["MemorySize | None", MAX_MEMORY] = None,
    progress: Annotated[
        Callable[[float], object] | None,
        Option("Called with the share done of a fit to shakes, 0 to 1.", shell=False),
    ] = None,
) -> "Calibration":
    """Calibrate the accelerometers of a recording, each parameter with its standard deviation.

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
    from gfimu.array.gravity import Latitude
    from gfimu.base.units import STANDARD_GRAVITY
    from gfimu.calibration.check_poses import check_on_poses
    from gfimu.calibration.given import CalibrationPoses, CalibrationPrior, RateTable
    from gfimu.calibration.method import CalibrationTask, run_calibration
    from gfimu.calibration.registry import calibration_method
    from gfimu.commands.opened import as_array, as_run, as_source, name_of
    from gfimu.recording.checks import examine

    rests, known = poses or CalibrationPoses(), prior or CalibrationPrior()
    chosen = calibration_method("gyro-rate-table" if rate_table and method == "gyro" else method)
    _refuse_unused(
        chosen,
        motion=motion,
        update=known.update,
        levelling_std_rad=rests.levelling_std_rad,
        n_parameters=parameters,
        input_kind=None if rests.input_kind == "averaged" and not rests.wavelet else rests.input_kind,
        start=known.start,
        radius_std_m=known.radius_std_m,
        stretch_std_s2_rad2=known.stretch_std_s2_rad2,
        rate_table=rate_table,
    )
    drawing = None if array is None else as_array(array)
    latitude = gravity if isinstance(gravity, Latitude) else None
    local_gravity = gravity.gravity if isinstance(gravity, Latitude) else gravity

    def read(one: "RecordingLike") -> "Source":
        return as_source(one, array, column_map, max_memory=max_memory)

    def checked(one: "RecordingLike") -> "Recording":
        run = _uncalibrated(read(one), drawing)
        examine(run, drawing, source=name_of(one), force=force)
        return run

    if "rate_table" in chosen.options:
        if check is not None or picture is not None or drawing is not None or gravity is not latitude:
            raise InputError(
                "--array, --gravity, --check and --picture are of accelerometers; leave them out for a gyro"
            )
        table = rate_table or RateTable()
        files = (recording, *table.also)
        first, *also = (_references(read(one)) for one in files)
        mounted = RateTable(also, table.axes, [name_of(one) for one in files])
        degrees = None if latitude is None else latitude.deg
        task = CalibrationTask(first, latitude_deg=degrees, rate_table=mounted, **vars(rests))
        result = run_calibration(chosen, task)
        if out is not None:
            result.save(out)
        return result
    run = checked(recording)
    turned = None if motion is None else checked(motion)
    others = None if check is None else checked(check)
    if others is not None:
        _refuse_the_same(run, others, name_of(check))
    task = CalibrationTask(
        run,
        gravity=STANDARD_GRAVITY if local_gravity is None else local_gravity,
        n_parameters=parameters,
        array=as_run(read(recording), None)[1] if drawing is None and "array" in chosen.options else drawing,
        motion=turned,
        progress=progress,
        **vars(rests),
        **_loaded(known),
    )
    result = run_calibration(chosen, task)
    if others is not None:
        rested = {} if task.min_rest_s is None else {"min_rest_s": task.min_rest_s}
        figures = check_on_poses(result, others, rest_threshold=task.rest_threshold, **rested)
        result = replace(result, statistics={**result.statistics, **figures})
    if out is not None:
        result.save(out)
    if picture is not None:
        from gfimu.calibration.pictures import calibration_picture

        calibration_picture(picture, result, others or run)
    return result


def _loaded(prior: "CalibrationPrior") -> dict[str, Any]:
    """Return what is known before, calibrations read from their files; without what the task has a default for."""
    from gfimu.commands.opened import as_calibration

    given = {name: value for name, value in vars(prior).items() if value is not None}
    return given | {name: as_calibration(given[name]) for name in ("update", "start") if name in given}


def _refuse_the_same(run: "Recording", others: "Recording", name: str) -> None:
    """Refuse to check a calibration on what it was made from."""
    import numpy as np

    if run.channels == others.channels and np.array_equal(run.readings, others.readings, equal_nan=True):
        raise InputError(f"{name}: this is the recording of the fit; --check needs other poses")


def _refuse_unused(method: "CalibrationMethod", **given: object) -> None:
    """Refuse an option that the method would ignore."""
    from gfimu.calibration.registry import METHODS

    for name, value in given.items():
        if value is not None and name not in method.options:
            users = " or ".join(other.name for other in METHODS.values() if name in other.options)
            raise InputError(f"{_OPTION_NAMES[name]}; use it with {users}, not {method.name}")


def _uncalibrated(recording: "Source", array: "AccelerometerArray | None") -> "Recording":
    from gfimu.calibration.run_file import open_uncalibrated
    from gfimu.recording import Recording

    return recording if isinstance(recording, Recording) else open_uncalibrated(recording, array=array)


def _references(recording: "Source") -> "Recording":
    from gfimu.calibration.run_file import open_references
    from gfimu.recording import Recording

    return recording if isinstance(recording, Recording) else open_references(recording)
