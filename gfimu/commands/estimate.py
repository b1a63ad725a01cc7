"""Under `gfimu estimate`: motion from a recording."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gfimu.files.outputs import ESTIMATE, RERUN, writes

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from gfimu.calibration.result import Calibration
    from gfimu.geometry.array import AccelerometerArray
    from gfimu.geometry.turning_axis import AxisUncertainty, TurningAxis
    from gfimu.importing import ColumnMap
    from gfimu.motion.estimate import Estimate
    from gfimu.recording import Recording
    from gfimu.recording.mapped import RecordingLike

__all__ = ["EstimatedRun", "estimate", "estimate_run"]


@dataclass(frozen=True)
class EstimatedRun:
    """An estimate with what it was made from.

    Parameters
    ----------
    estimate : Estimate
        The estimate.
    recording : Recording
        The recording, calibrated where that was asked for.
    array : AccelerometerArray
        The array, with the calibration's positions where it has some.
    """

    estimate: Estimate
    recording: Recording
    array: AccelerometerArray


_READS = ("recording", "array", "calibration", "column_map")


@writes(reads=_READS, out=ESTIMATE, rrd=RERUN)
def estimate(
    recording: RecordingLike,
    array: AccelerometerArray | str | Path | None = None,
    *,
    out: str | Path | None = None,
    method: str = "integrate",
    form: str = "auto",
    rest_bias: bool = False,
    calibration: Calibration | str | Path | None = None,
    column_map: ColumnMap | str | Path | None = None,
    map_set: Sequence[str] = (),
    axis: TurningAxis | str | Sequence[float] | None = None,
    axis_point: Sequence[float] = (0.0, 0.0, 0.0),
    hub: str = "fixed",
    inclination_rad: float | None = None,
    point_std_m: float = 0.0,
    direction_std_rad: float = 0.0,
    lever_std_m: float = 0.0,
    rotation_std_rad: float = 0.0,
    bias_std_m_s2: float = 0.0,
    unknown_start: bool = False,
    gyro: bool = False,
    position: bool = False,
    latitude: float | None = None,
    north_rad: float | None = None,
    rrd: str | Path | None = None,
    force: bool = False,
    keep_faulty: bool = False,
    progress: Callable[[float], None] | None = None,
    omega0: ArrayLike | None = (0.0, 0.0, 0.0),
    quaternion0: ArrayLike | None = None,
    noise_std: ArrayLike | None = None,
    with_position: bool = False,
    fuse_gyro: bool = False,
) -> Estimate:
    """Estimate p, α, ω, attitude and table angle at every sample of a recording.

    Parameters
    ----------
    recording : Recording, path, table, or times (n,) with readings (n, c)
        The recording, or its file.
    array : AccelerometerArray, str or Path, optional
        The array, its name or file; the recording's own by default.
    out : str or Path, optional
        Estimate file to write, ``.parquet`` or ``.csv``.
    method : str
        Method for the angular rate, a key of `gfimu.rate.registry.RATE_METHODS`.
    form : {"auto", "linear", "joint", "recursive"}
        How readings turn into α and p; see `gfimu.geometry.linear_solution`.
    rest_bias : bool
        Read the biases off the first rest (table level) and take them off.
    calibration : Calibration, str or Path, optional
        Calibration to apply first.
    column_map : ColumnMap, str or Path, optional
        What the columns of a foreign file are: a map, its name or TOML file (``--map``); see `gfimu.inspect`.
    map_set : sequence of str
        Keys of that map to set, such as ``"time.unit=ms"`` (``--map-set``); without a map they are all of it.
    axis : TurningAxis, str or sequence of float, optional
        The axis about which alone the array turns, body frame: x, y, z, or three numbers. Few chips then suffice. By
        default the array's own, where it can't see all six motions.
    axis_point : sequence of float
        A point of that axis, body frame, m.
    hub : {"fixed", "free"}
        Whether that axis stands still (a table) or moves with a body (a wheel).
    inclination_rad : float, optional
        Angle between that axis and the vertical, rad; estimated by default.
    point_std_m, direction_std_rad, lever_std_m, rotation_std_rad, bias_std_m_s2 : float
        How exactly the point and the direction of that axis, and place, orientation and biases of the chips are known
        (`gfimu.geometry.turning_axis.AxisUncertainty`); what is not exact is estimated with the rotation. Where all
        are 0, those of the array file hold.
    unknown_start : bool
        The run may start spinning (filter, smoother); the same as ``omega0=None``.
    gyro, fuse_gyro : bool
        Fuse the recording's gyro (filter, smoother); two names of one argument.
    position, with_position : bool
        Integrate to velocity and position as well; two names of one argument.
    latitude : float, optional
        Latitude, degrees: the Earth's rotation and the local gravity from it are taken into account
        (`gfimu.motion.earth`). By default the recording's own (metadata ``latitude_deg``), or none.
    north_rad : float, optional
        Direction of north from the world's x-axis (for a levelled body: from its own at the start), about up, rad.
        By default the recording's own (metadata ``north_rad``), or 0.
    rrd : str or Path, optional
        Rerun recording to write.
    force : bool
        Go on, with a warning in the estimate, where the checks of the recording would refuse it.
    keep_faulty : bool
        Use every channel, without looking for faulty ones (``--keep-faulty``).
    progress : callable, optional
        Called with the share done, 0 to 1.
    omega0, quaternion0, noise_std
        As for `gfimu.motion.estimation.estimate`.

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
    from gfimu.commands.known_axis import turning_axis
    from gfimu.geometry.turning_axis import AxisUncertainty

    return estimate_run(
        recording,
        array,
        out=out,
        rrd=rrd,
        rest_bias=rest_bias,
        calibration=calibration,
        column_map=column_map,
        map_set=map_set,
        axis=turning_axis(axis, axis_point, hub, inclination_rad),
        uncertainty=AxisUncertainty(point_std_m, direction_std_rad, lever_std_m, rotation_std_rad, bias_std_m_s2),
        method=method,
        form=form,
        omega0=None if unknown_start else omega0,
        quaternion0=quaternion0,
        noise_std=noise_std,
        fuse_gyro=gyro or fuse_gyro,
        with_position=position or with_position,
        latitude=latitude,
        north_rad=north_rad,
        force=force,
        keep_faulty=keep_faulty,
        progress=progress,
    ).estimate


@writes(reads=_READS, out=ESTIMATE, rrd=RERUN)
def estimate_run(
    recording: RecordingLike,
    array: AccelerometerArray | str | Path | None = None,
    *,
    out: str | Path | None = None,
    rrd: str | Path | None = None,
    rest_bias: bool = False,
    calibration: Calibration | str | Path | None = None,
    column_map: ColumnMap | str | Path | None = None,
    map_set: Sequence[str] = (),
    axis: TurningAxis | None = None,
    uncertainty: AxisUncertainty | None = None,
    latitude: float | None = None,
    north_rad: float | None = None,
    **options: Any,
) -> EstimatedRun:
    """Estimate and keep the recording and array beside the result, for a summary; ``options`` as `estimate`.

    Raises
    ------
    InputError
        As `estimate`.
    """
    from gfimu.commands.opened import as_calibrated_run, as_source, name_of
    from gfimu.errors import InputError, naming
    from gfimu.motion.estimation import estimate as solve
    from gfimu.motion.rest_bias import estimate_from_rest
    from gfimu.recording.carried_array import warn_of_other_array
    from gfimu.recording.timing.reference_times import reference_on_rows

    run, geometry = as_calibrated_run(as_source(recording, array, column_map, map_set), array, calibration)
    if array is not None and calibration is None:
        warn_of_other_array(run.metadata, geometry, "the recording", whose="the given")
    run = reference_on_rows(run)
    turning = _turning(axis, geometry, uncertainty)
    if turning is not None:
        if latitude is not None:
            raise InputError("--latitude has no use with --axis: the rate about one axis is all that is estimated")
        with naming(name_of(recording)):
            found = _about_axis(run, geometry, turning, rest_bias=rest_bias, **options)
    else:
        _require_all_motions(run, geometry)
        options |= _place(run, latitude, north_rad)
        with naming(name_of(recording)):
            found = (estimate_from_rest if rest_bias else solve)(run, geometry, **options)
    if out is not None:
        found.write(out)
    if rrd is not None:
        from gfimu.visual import write_run

        write_run(rrd, run, _with_axis(geometry, found), estimate=found)
    return EstimatedRun(found, run, geometry)


def _place(recording: Recording, latitude: float | None, north_rad: float | None) -> dict[str, Any]:
    """Return the Earth's rotation and the gravity of a place, given or of the recording, as options of the estimate."""
    from gfimu.errors import InputError
    from gfimu.geometry.gravity import local_gravity
    from gfimu.motion.earth import EarthRotation

    place = recording.metadata.get("latitude_deg") if latitude is None else latitude
    gravity = recording.metadata.get("gravity_m_s2") if latitude is None else None
    if place is None:
        if north_rad is not None:
            raise InputError("the direction of north has no use without a latitude; give that too (--latitude)")
        return {} if gravity is None else {"gravity": float(gravity)}
    north = float(recording.metadata.get("north_rad", 0.0)) if north_rad is None else north_rad
    return {
        "earth": EarthRotation(float(place), north),
        "gravity": local_gravity(float(place)) if gravity is None else float(gravity),
    }


def _with_axis(array: AccelerometerArray, estimate: Estimate) -> AccelerometerArray:
    """Return the array with the axis that the estimate is about, as it was found to stand, for a picture."""
    from gfimu.geometry.turning_axis import TurningAxis

    axis = estimate.metadata.get("turning_axis")
    return array if axis is None else replace(array, turning_axis=TurningAxis.from_dict(axis, source=array.name))


def _turning(
    axis: TurningAxis | None, array: AccelerometerArray, uncertainty: AxisUncertainty | None
) -> TurningAxis | None:
    """Return the axis to estimate about: the one given, or the array's own where it can't see all six motions."""
    from gfimu.commands.known_axis import known_axis
    from gfimu.errors import InputError

    chosen = known_axis(axis, array)
    if uncertainty is None or uncertainty.exact:
        return chosen
    if chosen is None:
        raise InputError(f"{next(iter(uncertainty.to_dict()))} is of a known axis; give the axis too (--axis)")
    return replace(chosen, uncertainty=uncertainty)


def _require_all_motions(recording: Recording, array: AccelerometerArray) -> None:
    """Raise `GeometryError` for an array of low rank, with what it gives nevertheless."""
    from gfimu.errors import GeometryError
    from gfimu.geometry.observability import unseen_motions
    from gfimu.known_axis.few_motions import few_motions_text

    if unseen_motions(array):
        raise GeometryError(few_motions_text(array, recording.sample_rate))


def _about_axis(
    recording: Recording, array: AccelerometerArray, axis: TurningAxis, *, rest_bias: bool, **options: Any
) -> Estimate:
    """Estimate about a known axis, with the biases read off a level rest first where that is asked for."""
    from gfimu.errors import InputError
    from gfimu.known_axis.estimation import estimate_about_axis
    from gfimu.rate.registry import rate_method
    from gfimu.recording.checks import examine, without_dead_channels

    for name, word in (("fuse_gyro", "--gyro"), ("with_position", "--position"), ("keep_faulty", "--keep-faulty")):
        if options.get(name):
            raise InputError(f"{word} has no use with --axis: the rate about one axis is all that is estimated")
    findings = examine(recording, array, force=bool(options.get("force")), whose="")
    recording = without_dead_channels(recording, array, findings)
    if rest_bias:
        from gfimu.motion.rest_bias import rest_bias as read_off

        if axis.hub == "free":
            raise InputError("biases can't be read off the rest of a free hub, as its inclination isn't known exactly")
        recording = read_off(recording, array).remove(recording)
    return estimate_about_axis(
        recording,
        array,
        axis,
        at_rest=options.get("omega0") is not None,
        smooth=rate_method(options.get("method", "integrate")).uses_later_samples,
        noise_std=options.get("noise_std"),
    )
