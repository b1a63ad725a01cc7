r"""Estimate p, α, ω, attitude and table angle from a recording.

Examples
--------
gfimu estimate run.parquet --method filter --rest-bias --out estimate.parquet
# Everything that a table shows, in one adjustment
gfimu estimate run.parquet --method batch --use tacho --use axis --out estimate.parquet
# One chip on a table
gfimu estimate run.csv --array arm.toml --axis z --out estimate.csv
# Two chips on a wheel
gfimu estimate run.csv --array wheel.toml --axis z --hub free --out est.csv
# Mounted by eye
gfimu estimate run.csv --array arm.toml --axis z --lever-std-m 0.003 --rotation-std-rad 0.05 \
    --bias-std-m-s2 0.3 --out est.csv
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

from gfimu.base.errors import InputError, check_name, naming
from gfimu.commands import given
from gfimu.commands.known_axis import AXIS, AxisLike, as_known_axis
from gfimu.commands.shell import options
from gfimu.commands.shell.declare import Group, Option, command
from gfimu.rate.registry import RATE_METHODS, rate_method
from gfimu.recording.quantities import ESTIMATE_REFERENCES

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from gfimu.array.array import AccelerometerArray
    from gfimu.motion.estimate import Estimate
    from gfimu.motion.estimate_summary import EstimateSummary
    from gfimu.recording import Recording

__all__ = ["Place", "estimate"]

_FILTERED = " (filter, smoother, batch)"
_METHOD = Option(f"Angular rate by: {', '.join(RATE_METHODS)}.", "METHOD", offers=tuple(RATE_METHODS))
_USE = Option(
    "What to use beside the readings (filter, smoother, batch): gyro, tacho, angle (encoder), position (columns "
    "position_x_m …), axis (the body turns about the table's axis only); repeat it.",
    "REFERENCE",
    offers=tuple(ESTIMATE_REFERENCES),
    kind=list[str],
)
_FORMS = ("auto", "linear", "joint", "recursive")
_FORM = Option("How readings turn into p and α: auto, linear, joint or recursive.", "FORM", offers=_FORMS)
_OMEGA = Option("Angular rate at the first sample (3,), body axes, rad/s, where it is known.", shell=False)
_QUATERNION = Option(
    "Attitude (w, x, y, z) at the first sample; by default the recording's mounting, or the one that levels the mean "
    "of p over the first second.",
    shell=False,
)
_NOISE = Option(
    "Standard deviation of one sample of each channel, scalar or (c,), m/s²; by default from the parts' data sheets.",
    shell=False,
)


_LATITUDE = options.LATITUDE.also(": the Earth's rotation and the local gravity from it")
_NORTH = Option("With --latitude: north from the x-axis at the start, about up, rad; else 0.", "RAD")


@dataclass(frozen=True)
class Place:
    """A place on the Earth; what is None is the recording's own.

    Parameters
    ----------
    latitude : float, optional
        Latitude, degrees (metadata ``latitude_deg``).
    north_rad : float, optional
        Direction of north from the world's x-axis (for a levelled body: from its own at the start), about up, rad
        (metadata ``north_rad``, or 0).

    Examples
    --------
    >>> import gfimu
    >>> gfimu.estimate("run.parquet", place=gfimu.Place(52.0, north_rad=0.5))  # doctest: +SKIP
    """

    latitude: Annotated[float | None, _LATITUDE] = None
    north_rad: Annotated[float | None, _NORTH] = None

    def of(self, recording: "Recording") -> dict[str, Any]:
        """Return the Earth's rotation and the gravity there as options of the estimate; none without a place.

        Raises
        ------
        InputError
            If north is known and the latitude is not.
        """
        from gfimu.motion.place import place_options

        return place_options(recording, self.latitude, self.north_rad)


_PLACE = Group(
    Place,
    "Where on the Earth the body is, such as ``gfimu.Place(52.0, north_rad=0.5)``: the Earth's rotation and the local "
    "gravity from it are taken into account. By default the recording's own place, or none.",
)

_EstimatedRun: TypeAlias = "tuple[Estimate, Recording, AccelerometerArray]"
"""An estimate with the recording and the array that it was made from, calibrated where that was asked for."""


def _summary(estimated: _EstimatedRun, _: Mapping[str, Any]) -> "EstimateSummary":
    from gfimu.motion.estimate_summary import summarise

    return summarise(*estimated)


def _estimate_of(estimated: _EstimatedRun) -> "Estimate":
    return estimated[0]


def _doing(given: Mapping[str, Any]) -> str:
    """Return what is being done, for the progress bar; says so when the filter is compiled first."""
    from gfimu.rate.first_call import must_compile

    if given["axis"].axis is not None:
        from gfimu.rate.axis.recursion import filter_axis

        doing, compiles = "estimating about one axis", must_compile(filter_axis)
    else:
        from gfimu.rate.body_rate import follow
        from gfimu.rate.open_loop import integrate_open

        method = rate_method(given["method"])
        doing = f"estimating by {method.name}"
        compiles = method.follows_path and must_compile(follow if method.recursive else integrate_open)
    return f"{doing}; compiling first, once: a minute or two" if compiles else doing


@command(report=_summary, gives=_estimate_of, doing=_doing)
def estimate(
    recording: Annotated[given.Run, given.RUN.also(": .csv, .parquet, or a MIMU4444 stream (.bin, .bin.gz).")],
    array: given.Array = None,
    *,
    out: Annotated["str | Path | None", options.ESTIMATE_OUT.also(what="estimate", needed=True)] = None,
    method: Annotated[str, _METHOD] = "integrate",
    form: Annotated[str, _FORM] = "auto",
    rest_bias: Annotated[bool, Option("Read the biases off the first rest (table level) and take them off.")] = False,
    calibration: given.CalibrationToApply = None,
    start: Annotated[str, options.START] = "any",
    gyro: Annotated[bool, options.GYRO.also(_FILTERED)] = False,
    use: Annotated[str | Sequence[str], _USE] = (),
    position: Annotated[bool, Option("Integrate to velocity and position too.")] = False,
    place: Annotated[Place, _PLACE] = Place(),
    force: Annotated[bool, options.FORCE] = False,
    keep_faulty: Annotated[bool, options.KEEP_FAULTY.also(_FILTERED)] = False,
    rrd: Annotated["str | Path | None", options.RRD] = None,
    column_map: given.Map = None,
    max_memory: given.Memory = None,
    axis: Annotated[AxisLike, AXIS] = None,
    omega0: Annotated["ArrayLike | None", _OMEGA] = None,
    quaternion0: Annotated["ArrayLike | None", _QUATERNION] = None,
    noise_std: Annotated["ArrayLike | None", _NOISE] = None,
    progress: Annotated[Callable[[float], object] | None, options.SHARE] = None,
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
    from gfimu.motion.rest_bias import rest_bias as read_off
    from gfimu.rate.axis.few_motions import require_motions_of_samples
    from gfimu.recording.carried_array import warn_of_other_array
    from gfimu.recording.doubts.judge import examine, without_doubtful
    from gfimu.recording.timing.reference_times import reference_on_rows

    source = as_source(recording, array, column_map, max_memory=max_memory)
    run, geometry = as_calibrated_run(source, array, calibration)
    if array is not None and calibration is None:
        warn_of_other_array(run.metadata, geometry, "the recording", whose="the given")
    run = reference_on_rows(run)
    about = as_known_axis(axis).of(geometry)
    check_name("start", start, options.STARTS)
    omega0 = (0.0, 0.0, 0.0) if start == "rest" and omega0 is None else omega0
    if about is None:
        require_motions_of_samples(geometry, run)
        there = place.of(run)
        solve = estimate_from_rest if rest_bias else estimate_with_biases
        with naming(name_of(recording)):
            result = solve(
                run,
                geometry,
                method=method,
                form=form,
                omega0=omega0,
                quaternion0=quaternion0,
                noise_std=noise_std,
                with_position=position,
                use=(*([use] if isinstance(use, str) else use), *(["gyro"] if gyro else [])),
                force=force,
                keep_faulty=keep_faulty,
                progress=progress,
                **there,
            )
    else:
        from gfimu.motion.axis_estimation import estimate_about_axis  # not for those without an axis: scipy.optimize

        useless = {"--latitude": place.latitude is not None, "--gyro": gyro, "--use": bool(use), "--position": position}
        for option, given_too in {**useless, "--keep-faulty": keep_faulty}.items():
            if given_too:
                raise InputError(f"{option} has no use with --axis: the rate about one axis is all that is estimated")
        with naming(name_of(recording)):
            findings = examine(run, geometry, force=force, whose="")
            alive = without_doubtful(run, geometry, findings)
            if rest_bias and about.hub == "free":
                raise InputError(
                    "biases can't be read off the rest of a free hub, as its inclination isn't known exactly"
                )
            result = estimate_about_axis(
                read_off(alive, geometry).remove(alive) if rest_bias else alive,
                geometry,
                about,
                at_rest=True if start == "rest" else None,
                smooth=rate_method(method).uses_later_samples,
                noise_std=noise_std,
                findings=findings,
            )
    if out is not None:
        result.write(out)
    if rrd is not None:
        from gfimu.array.turning_axis import TurningAxis
        from gfimu.visual import write_run

        axis_found = result.metadata.get("turning_axis")
        turning = None if axis_found is None else TurningAxis.from_dict(axis_found, source=geometry.name)
        write_run(rrd, run, replace(geometry, turning_axis=turning or geometry.turning_axis), estimate=result)
    return result, run, geometry
