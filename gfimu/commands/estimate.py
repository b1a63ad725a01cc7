r"""Estimate p, α, ω, attitude and table angle from a recording.

Examples
--------
gfimu estimate run.parquet --method filter --rest-bias --out estimate.parquet
# One chip on a table
gfimu estimate run.csv --array arm.toml --axis z --out estimate.csv
# Two chips on a wheel
gfimu estimate run.csv --array wheel.toml --axis z --hub free --unknown-start --out est.csv
# Mounted by eye
gfimu estimate run.csv --array arm.toml --axis z --lever-std-m 0.003 --rotation-std-rad 0.05 \
    --bias-std-m-s2 0.3 --out est.csv
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from gfimu.base.errors import GeometryError, InputError, naming
from gfimu.base.files.outputs import ESTIMATE
from gfimu.commands.known_axis import AXIS, AxisLike, as_known_axis
from gfimu.commands.place import PLACE, Place
from gfimu.commands.shell.completion import words
from gfimu.commands.shell.declare import Option, command
from gfimu.commands.shell.options import (
    ARRAY,
    CALIBRATION,
    FORCE,
    GYRO,
    KEEP_FAULTY,
    MAP,
    MAX_MEMORY,
    RRD,
    UNKNOWN_START,
)
from gfimu.rate.registry import RATE_METHODS, rate_method

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from gfimu.array.array import AccelerometerArray
    from gfimu.array.turning_axis import TurningAxis
    from gfimu.base.files.memory import MemorySize
    from gfimu.calibration.result import Calibration
    from gfimu.motion.estimate import Estimate
    from gfimu.motion.estimate_summary import EstimateSummary
    from gfimu.recording import Recording
    from gfimu.recording.importing import ColumnMap
    from gfimu.recording.mapped import RecordingLike

__all__ = ["estimate"]

_FILTERED = " (filter, smoother)"


@dataclass(frozen=True)
class _EstimatedRun:
    """An estimate with the recording and the array that it was made from, calibrated where that was asked for."""

    estimate: "Estimate"
    recording: "Recording"
    array: "AccelerometerArray"


def _results() -> tuple[type, ...]:
    from gfimu.motion.estimate_summary import EstimateSummary

    return (EstimateSummary,)


def _summary(run: _EstimatedRun, given: Mapping[str, Any]) -> "EstimateSummary":
    from gfimu.motion.estimate_summary import summarise

    del given
    return summarise(run.estimate, run.recording, run.array)


def _estimate_of(run: _EstimatedRun) -> "Estimate":
    return run.estimate


def _doing(given: Mapping[str, Any]) -> str:
    """Return what is being done, for the progress bar; says so when the filter is compiled first."""
    from gfimu.rate.first_call import must_compile

    if given["axis"].axis is not None:
        from gfimu.rate.axis.recursion import filter_axis

        doing, compiles = "estimating about one axis", must_compile(filter_axis)
    else:
        doing = f"estimating by {given['method']}"
        compiles = rate_method(given["method"]).recursive and must_compile()
    return f"{doing}; compiling the filter first, once: a minute or so" if compiles else doing


@command(results=_results, report=_summary, gives=_estimate_of, doing=_doing)
def estimate(
    recording: Annotated[
        "RecordingLike",
        Option(
            "Recording: .csv, .parquet, or a MIMU4444 stream (.bin, .bin.gz).",
            "RUN",
            kind=Path,
            argument=True,
            reads=True,
        ),
    ],
    array: Annotated["AccelerometerArray | str | Path | None", ARRAY.also("; else the recording's own")] = None,
    *,
    out: Annotated[
        "str | Path | None",
        Option("Estimate to write (.csv, .parquet)", kind=Path, writes=ESTIMATE, what="estimate", needed=True),
    ] = None,
    method: Annotated[
        str, Option(f"Angular rate by: {', '.join(RATE_METHODS)}.", "METHOD", offers=words(*RATE_METHODS))
    ] = "integrate",
    form: Annotated[
        str,
        Option(
            "How readings turn into p and α: auto, linear, joint or recursive.",
            "FORM",
            offers=words("auto", "linear", "joint", "recursive"),
        ),
    ] = "auto",
    rest_bias: Annotated[bool, Option("Read the biases off the first rest (table level) and take them off.")] = False,
    calibration: Annotated["Calibration | str | Path | None", CALIBRATION] = None,
    unknown_start: Annotated[bool, UNKNOWN_START.also(_FILTERED)] = False,
    gyro: Annotated[bool, GYRO.also(_FILTERED)] = False,
    position: Annotated[bool, Option("Integrate to velocity and position too.")] = False,
    place: Annotated[Place, PLACE] = Place(),
    force: Annotated[bool, FORCE] = False,
    keep_faulty: Annotated[bool, KEEP_FAULTY.also(_FILTERED)] = False,
    rrd: Annotated["str | Path | None", RRD] = None,
    column_map: Annotated["ColumnMap | str | Path | None", MAP] = None,
    max_memory: Annotated["MemorySize | None", MAX_MEMORY] = None,
    axis: Annotated[AxisLike, AXIS] = None,
    omega0: Annotated[
        "ArrayLike", Option("Angular rate at the first sample (3,), body axes, rad/s; at rest by default.", shell=False)
    ] = (0.0, 0.0, 0.0),
    quaternion0: Annotated[
        "ArrayLike | None",
        Option(
            "Attitude (w, x, y, z) at the first sample; by default the recording's mounting, or the one that levels "
            "the mean of p over the first second.",
            shell=False,
        ),
    ] = None,
    noise_std: Annotated[
        "ArrayLike | None",
        Option(
            "Standard deviation of one sample of each channel, scalar or (c,), m/s²; by default from the parts' data "
            "sheets.",
            shell=False,
        ),
    ] = None,
    progress: Annotated[
        Callable[[float], object] | None, Option("Called with the share done, 0 to 1.", shell=False)
    ] = None,
) -> _EstimatedRun:
    """Estimate p, α, ω, attitude and table angle at every sample of a recording.

    ``recording`` is a `Recording`, its file, a table, or times (n,), s, with readings (n, c), m/s².

    Raises
    ------
    InputError
        As `gfimu.motion.estimation.estimate`, or if an output can't be written where it is asked for.
    GeometryError
        If the array can't see all six motions; the message names those it can't.

    Examples
    --------
    >>> import gfimu
    >>> run = gfimu.simulate("paper_run", seed=1)
    >>> gfimu.estimate(run, rest_bias=True)
    Estimate(cube12, integrate, 3000 samples, 29.99 s at 100 Hz)
    >>> gfimu.estimate((run.t_s, run.readings), "cube12", rest_bias=True).omega.shape
    (3000, 3)
    """
    from gfimu.commands.opened import as_calibrated_run, as_source, name_of
    from gfimu.motion.estimation import estimate as estimate_with_biases
    from gfimu.motion.rest_bias import estimate_from_rest
    from gfimu.recording.carried_array import warn_of_other_array
    from gfimu.recording.timing.reference_times import reference_on_rows

    source = as_source(recording, array, column_map, max_memory=max_memory)
    run, geometry = as_calibrated_run(source, array, calibration)
    if array is not None and calibration is None:
        warn_of_other_array(run.metadata, geometry, "the recording", whose="the given")
    run = reference_on_rows(run)
    about = as_known_axis(axis).of(geometry)
    start = None if unknown_start else omega0
    if about is None:
        _require_all_motions(run, geometry)
        there = place.of(run)
        solve = estimate_from_rest if rest_bias else estimate_with_biases
        with naming(name_of(recording)):
            result = solve(
                run,
                geometry,
                method=method,
                form=form,
                omega0=start,
                quaternion0=quaternion0,
                noise_std=noise_std,
                with_position=position,
                fuse_gyro=gyro,
                force=force,
                keep_faulty=keep_faulty,
                progress=progress,
                **there,
            )
    else:
        if place.latitude is not None:
            raise _useless_about_axis("--latitude")
        with naming(name_of(recording)):
            for name, value in (("--gyro", gyro), ("--position", position), ("--keep-faulty", keep_faulty)):
                if value:
                    raise _useless_about_axis(name)
            result = _about_axis(
                run,
                geometry,
                about,
                rest_bias=rest_bias,
                force=force,
                at_rest=start is not None,
                smooth=rate_method(method).uses_later_samples,
                noise_std=noise_std,
            )
    if out is not None:
        result.write(out)
    if rrd is not None:
        from gfimu.visual import write_run

        write_run(rrd, run, _with_axis(geometry, result), estimate=result)
    return _EstimatedRun(result, run, geometry)


def _require_all_motions(recording: "Recording", array: "AccelerometerArray") -> None:
    """Raise `GeometryError` for an array of low rank, with what it gives nevertheless."""
    from gfimu.array.observability import unseen_motions
    from gfimu.rate.axis.few_motions import few_motions_text

    if unseen_motions(array):
        raise GeometryError(few_motions_text(array, recording.sample_rate))


def _useless_about_axis(option: str) -> InputError:
    return InputError(f"{option} has no use with --axis: the rate about one axis is all that is estimated")


def _about_axis(
    recording: "Recording",
    array: "AccelerometerArray",
    axis: "TurningAxis",
    *,
    rest_bias: bool,
    force: bool,
    **options: Any,
) -> "Estimate":
    """Estimate about a known axis, with the biases read off a level rest first where that is asked for."""
    from gfimu.motion.axis_estimation import estimate_about_axis
    from gfimu.motion.rest_bias import rest_bias as read_off
    from gfimu.recording.checks import examine, without_dead_channels

    findings = examine(recording, array, force=force, whose="")
    recording = without_dead_channels(recording, array, findings)
    if rest_bias:
        if axis.hub == "free":
            raise InputError("biases can't be read off the rest of a free hub, as its inclination isn't known exactly")
        recording = read_off(recording, array).remove(recording)
    return estimate_about_axis(recording, array, axis, **options)


def _with_axis(array: "AccelerometerArray", result: "Estimate") -> "AccelerometerArray":
    """Return the array with the axis that the estimate is about, as it was found to stand, for a picture."""
    from gfimu.array.turning_axis import TurningAxis

    axis = result.metadata.get("turning_axis")
    return array if axis is None else replace(array, turning_axis=TurningAxis.from_dict(axis, source=array.name))
