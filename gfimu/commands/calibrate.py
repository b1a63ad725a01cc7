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

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from gfimu.array.gravity import Latitude
from gfimu.base.errors import InputError
from gfimu.base.files.outputs import OutputFile
from gfimu.calibration.given import CalibrationPoses, CalibrationPrior, RateTable
from gfimu.commands import given
from gfimu.commands.opened import as_array, as_calibrated_run, as_calibration, as_source, name_of
from gfimu.commands.shell import options
from gfimu.commands.shell.declare import Group, Option, command

if TYPE_CHECKING:
    from gfimu.calibration.method import CalibrationMethod
    from gfimu.calibration.result import Calibration
    from gfimu.recording import Recording
    from gfimu.recording.mapped import RecordingLike, RecordingSource

__all__ = ["calibrate"]


_OPTION_NAMES = {
    "motion": "--motion is the motion of a whole array",
    "update": "--update carries the calibration of a whole array over",
    "levelling_std_rad": "--levelling-std is the tilt of levelled faces",
    "n_parameters": "--parameters chooses the model of single chips",
    "input_kind": "--input chooses the rows for single chips",
    "rows": "--rows is of poses",
    "row_noise_m_s2": "--row-noise is of a table of poses",
    "start": "--calibration is what a spin starts from",
    "radius_std_m": "--radius-std is of the arms on a turntable",
    "stretch_std_s2_rad2": "--stretch-std is of the arms on a turntable",
    "rate_table": "--rate-table, --also and --table-axes are of a gyro on a rate table",
}
"""What the options are that some methods do not use, by the field of the task."""

_METHODS = (
    "six-position", "recursive", "multi-position", "twelve-position", "array", "spin", "gyro", "gyro-rate-table",
)  # fmt: skip
"""Those of `gfimu.calibration.registry`, in its order; that has the functions, and help does not wait for scipy."""

_CALIBRATION_FILE = OutputFile("a calibration", (".json",))
_OUT = Option("Calibration to write (.json).", writes=_CALIBRATION_FILE, what="calibration", needed=True)
_RECORDING = given.RUN.also(" of static poses: .csv, .parquet, a MIMU4444 stream, or text rows time x y z.")
_MOTION = Option("array: recording of the motion, or of shakes (may be RUN).", kind=Path, reads=True)
_CHECK = Option("Other poses at rest, which the fit does not see: norm of a minus g on them.", kind=Path, reads=True)
_PROGRESS = Option("Called with the share done of a fit to shakes, 0 to 1.", shell=False)


def _gravity_of(
    gravity: Annotated[float | None, options.GRAVITY] = None,
    latitude: Annotated[float | None, options.LATITUDE.also(": gravity from it")] = None,
    height: Annotated[float, Option("Height above the ellipsoid, m.")] = 0.0,
) -> Latitude | float | None:
    if gravity is not None and latitude is not None:
        raise InputError("give --gravity or --latitude, not both")
    return gravity if latitude is None else Latitude(latitude, height)


_INPUT = Option(
    "Rows that the fit uses: averaged, raw or wavelet.", "KIND", name="--input", offers=("averaged", "raw", "wavelet")
)
_THRESHOLD = Option(
    "With --input wavelet: leave out all details (none, the default), or those below the universal threshold (soft or "
    "hard)."
)


_ROWS = Option(
    "What every row is: poses (one each, a table), samples (of a series), or auto: judged by the data.",
    "KIND", offers=("auto", "poses", "samples"),
)  # fmt: skip
_ROW_NOISE = Option("Of a table of poses: standard deviation of a reading, m/s²; else from the residuals of the fit.")


def _poses_of(
    input_kind: Annotated[str, _INPUT] = "averaged",
    wavelet_level: Annotated[int | None, Option("With --input wavelet: level of the transform; 4 by default.")] = None,
    wavelet_threshold: Annotated[str | None, _THRESHOLD] = None,
    rest_threshold: Annotated[float | None, options.REST_THRESHOLD] = None,
    min_rest: Annotated[float | None, Option("Shortest pose, s; 1 by default, 2 for array.")] = None,
    levelling_std: Annotated[float | None, Option("Standard deviation of a pose's tilt per axis, rad.")] = None,
    rows: Annotated[str, _ROWS] = "auto",
    row_noise: Annotated[float | None, _ROW_NOISE] = None,
) -> CalibrationPoses:
    stated = {"level": wavelet_level, "threshold": wavelet_threshold}
    wavelet = {key: value for key, value in stated.items() if value is not None}
    return CalibrationPoses(rest_threshold, min_rest, levelling_std, input_kind, wavelet, rows, row_noise)


_UPDATE = Option("array: calibration of an earlier run to carry over; the biases may have moved.", reads=True)
_TURN_ON = Option("With --update, --calibration: turn-on repeatability of a bias, m/s²; 0.03 by default.")
_WALK = Option("With --update: random walk of a bias between poses, m/s²/√s; 0 by default.")
_START = Option("spin: static calibration to start from, or that of another spin.", reads=True)
_RADIUS = Option("spin: standard deviation of a chip's place, m; 5e-4 by default.")
_STRETCH = Option("spin: standard deviation of the arm stretch, s²/rad²; 1e-7 by default.")


def _prior_of(
    update: Annotated[Path | None, _UPDATE] = None,
    turn_on_std: Annotated[float | None, _TURN_ON] = None,
    bias_walk: Annotated[float | None, _WALK] = None,
    calibration: Annotated[Path | None, _START] = None,
    radius_std: Annotated[float | None, _RADIUS] = None,
    stretch_std: Annotated[float | None, _STRETCH] = None,
) -> CalibrationPrior:
    return CalibrationPrior(update, calibration, turn_on_std, bias_walk, radius_std, stretch_std)


_ALSO = Option("With --rate-table: a recording of the gyro mounted otherwise; repeat it.", reads=True)
_AXES = Option("Gyro's axis along the table's, of RUN and each --also: x,y,-z; else by file.")


def _rate_table_of(
    rate_table: Annotated[bool, Option("gyro: RUN is of a rate table, whose tachometer is the reference.")] = False,
    also: Annotated[list[Path], _ALSO] = (),  # type: ignore[assignment]
    table_axes: Annotated[str, _AXES] = "",
) -> RateTable | None:
    if not (rate_table or also or table_axes):
        return None
    return RateTable(tuple(also), tuple(filter(None, table_axes.split(","))))


_GRAVITY = Group(_gravity_of, "Local gravity, m/s², or the `gfimu.Latitude` it follows from; else standard gravity.")
_POSES = Group(_poses_of, "How poses are found and what the fit uses of them: a `gfimu.CalibrationPoses`.")
_PRIOR = Group(
    _prior_of,
    "For ``array`` and ``spin``: an earlier calibration, and how exactly it and the chips' places are known, a "
    "`gfimu.CalibrationPrior`.",
    reads=True,
)
_RATE_TABLE = Group(
    _rate_table_of,
    "For ``gyro``: the recording is of a rate table, whose rate (``tacho_rad_s``) is the reference; it may hold "
    "references alone. A `gfimu.RateTable` names further recordings and the axes.",
    reads=True,
)


@command(doing="calibrating")
def calibrate(
    method: Annotated[str, Option(f"Method: {', '.join(_METHODS)}.", "METHOD", offers=_METHODS, argument=True)],
    recording: Annotated[given.Run, _RECORDING],
    *,
    out: Annotated["str | Path | None", _OUT] = None,
    array: given.Array = None,
    gravity: Annotated["Latitude | float | None", _GRAVITY] = None,
    parameters: Annotated[int | None, Option("Per chip: 12 (full matrix) or 9 (triangular).")] = None,
    poses: Annotated["CalibrationPoses | None", _POSES] = None,
    motion: Annotated["RecordingLike | None", _MOTION] = None,
    prior: Annotated["CalibrationPrior | None", _PRIOR] = None,
    check: Annotated["RecordingLike | None", _CHECK] = None,
    rate_table: Annotated["RateTable | None", _RATE_TABLE] = None,
    picture: given.Picture = None,
    force: Annotated[bool, options.FORCE] = False,
    column_map: given.Map = None,
    max_memory: given.Memory = None,
    progress: Annotated[Callable[[float], object] | None, _PROGRESS] = None,
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
    import numpy as np

    from gfimu.base.units import STANDARD_GRAVITY
    from gfimu.calibration.check_poses import check_on_poses
    from gfimu.calibration.method import CalibrationTask, run_calibration
    from gfimu.calibration.registry import calibration_method
    from gfimu.calibration.run_file import UNTIMED, open_poses, open_references
    from gfimu.recording.doubts.judge import examine, without_doubtful

    rests, known = poses or CalibrationPoses(), prior or CalibrationPrior()
    chosen = calibration_method("gyro-rate-table" if rate_table and method == "gyro" else method)
    rows = None if rests.input_kind == "averaged" and not rests.wavelet else rests.input_kind
    asked = {**vars(known), **vars(rests), "motion": motion, "n_parameters": parameters, "rate_table": rate_table}
    _refuse_unused(chosen, {**asked, "input_kind": rows, "rows": None if rests.rows == "auto" else rests.rows})
    drawing = None if array is None else as_array(array)
    latitude = gravity if isinstance(gravity, Latitude) else None
    local_gravity = gravity.gravity if isinstance(gravity, Latitude) else gravity

    def source_of(item: "RecordingLike") -> "RecordingSource":
        return as_source(item, array, column_map, max_memory=max_memory)

    def checked(item: "RecordingLike") -> "Recording":
        read = open_poses(source_of(item), array=drawing)
        found = examine(read, drawing, source=name_of(item), force=force)
        return read if UNTIMED in read.metadata else without_doubtful(read, drawing, found)  # each pose is unlike others

    others: Recording | None = None
    if "rate_table" in chosen.options:
        if check is not None or picture is not None or drawing is not None or gravity is not latitude:
            raise InputError(
                "--array, --gravity, --check and --picture are of accelerometers; leave them out for a gyro"
            )
        table = rate_table or RateTable()
        files = (recording, *table.also)
        first, *also = (open_references(source_of(item)) for item in files)
        mounted = RateTable(also, table.axes, [name_of(item) for item in files])
        degrees = None if latitude is None else latitude.deg
        task = CalibrationTask(first, latitude_deg=degrees, rate_table=mounted, **vars(rests))
    else:
        run = checked(recording)
        turned = None if motion is None else checked(motion)
        others = None if check is None else checked(check)
        if others is not None:
            same = run.channels == others.channels and np.array_equal(run.readings, others.readings, equal_nan=True)
            if same:
                raise InputError(f"{name_of(check)}: this is the recording of the fit; --check needs other poses")
        before = {name: value for name, value in vars(known).items() if value is not None}
        before |= {name: as_calibration(before[name]) for name in ("update", "start") if name in before}
        carries = drawing is None and "array" in chosen.options
        task = CalibrationTask(
            run,
            gravity=STANDARD_GRAVITY if local_gravity is None else local_gravity,
            n_parameters=parameters,
            array=as_calibrated_run(source_of(recording), None)[1] if carries else drawing,
            motion=turned,
            progress=progress,
            **vars(rests),
            **before,
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

        calibration_picture(picture, result, others or task.recording)
    return result


def _refuse_unused(method: "CalibrationMethod", asked: Mapping[str, object]) -> None:
    """Refuse an option that the method would ignore."""
    from gfimu.calibration.registry import METHODS

    for name, what in _OPTION_NAMES.items():
        if asked[name] is not None and name not in method.options:
            users = " or ".join(other.name for other in METHODS.values() if name in other.options)
            raise InputError(f"{what}; use it with {users}, not {method.name}")
