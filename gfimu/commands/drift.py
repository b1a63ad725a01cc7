"""Position-drift budget of an array in closed form, with a Monte Carlo; the drift of a recording at rest.

Examples
--------
gfimu drift --array cube12 --duration 0.3 --bias-mg 35 --noise-ug 290 --monte-carlo 400
# The paper's inversion
gfimu drift --from-position 6.42 0 0 --known-bias-mg 1 0 0 --latitude 35.7
# Of a recording at rest
gfimu drift run.parquet --duration 30 --picture drift.png
# One chip on a table
gfimu drift --array one_chip --axis z --speed-rad-s 6 --duration 60 --bias-mg 5 --noise-ug 290
"""

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Annotated, Any

from gfimu.base.errors import InputError, naming
from gfimu.commands import given
from gfimu.commands.known_axis import AXIS_ALONE, AxisLike, KnownAxis, as_known_axis
from gfimu.commands.opened import as_array, as_calibrated_run, as_source, name_of
from gfimu.commands.shell import options
from gfimu.commands.shell.declare import Option, command, command_of

if TYPE_CHECKING:
    from gfimu.budget.drift.equivalent import EquivalentErrors
    from gfimu.budget.drift.rest_windows import RestDrift
    from gfimu.budget.drift.result import Drift
    from gfimu.rate.axis.accuracy.drift import AxisDrift

__all__ = ["axis_drift", "drift", "drift_from_position", "drift_of_rest"]

_RECORDING = given.RUN.also(" with long rests: the drift that it has, beside what its noise predicts.", metavar="[RUN]")
_USUAL = "cube12"
_ARRAY = options.ARRAY.also(f"; else the recording's own, or {_USUAL} without a recording")
_TIME = options.DURATION.also(", from the start of navigation")
_WALK = Option("Random walk of each channel's bias, µg/√s.")
_SPEED = options.SPEED_RAD_S.also(", of the table about the vertical or the known axis; 0 is at rest")
_LEAD = Option("With RUN: rest before each window, from which tilt and biases are read off, s.")
_POSITION = Option("Measured position error x y z after --duration, m, z up: which bias or drift would explain it?")
_KNOWN_BIAS = Option("With --from-position: known bias of p, x y z, mg; its share is taken off first.")
_LATITUDE = options.LATITUDE.also(", for the Earth's share", when="With --from-position: ")
_OF_RECORDINGS = {"lead", "calibration", "picture", "column_map", "force"}
_OF_POSITIONS = {"known_bias_mg", "latitude"}
_OF_FREE_BODIES = {"rate_drift_deg_h", "offset", "monte_carlo"}


@command(doing="navigating through the rests")
def drift_of_rest(
    recording: Annotated[given.Run, _RECORDING],
    array: Annotated[given.Array, _ARRAY] = None,
    *,
    duration: Annotated[float, _TIME] = 30.0,
    lead: Annotated[float, _LEAD] = 10.0,
    gravity: Annotated[float, options.GRAVITY] = 9.80665,
    calibration: Annotated[given.CalibrationToApply, options.CALIBRATION.also(when="With RUN: ")] = None,
    picture: Annotated[given.Picture, options.PICTURE.also(when="With RUN: ")] = None,
    column_map: given.Map = None,
    max_memory: given.Memory = None,
    force: Annotated[bool, options.FORCE] = False,
) -> "RestDrift":
    """Navigate through the rests of a recording, and compare the errors with the prediction from its noise.

    Raises
    ------
    InputError
        If no rest is long enough, the recording is refused by its checks, or the picture can't be written.
    GeometryError
        If the array can't see all six motions.

    Examples
    --------
    >>> import gfimu
    >>> rest = gfimu.simulate("rest", seed=3, changes=["duration_s=30"])
    >>> found = gfimu.drift_of_rest(rest, duration=2.0)
    >>> len(found.start_s) > 1
    True
    """
    from gfimu.budget.drift.rest_windows import rest_drift
    from gfimu.recording.doubts.judge import examine

    source = as_source(recording, array, column_map, max_memory=max_memory)
    run, geometry = as_calibrated_run(source, array, calibration)
    examine(run, geometry, source=name_of(recording), force=force, whose="" if array is None else "the given")
    with naming(name_of(recording)):
        windows = rest_drift(run, geometry, time=duration, lead=lead, gravity=gravity)
    if picture is not None:
        windows.to_picture(picture)
    return windows


@command()
def drift_from_position(
    from_position: Annotated[tuple[float, float, float], _POSITION],
    *,
    duration: Annotated[float, _TIME] = 30.0,
    known_bias_mg: Annotated[tuple[float, float, float], _KNOWN_BIAS] = (0.0, 0.0, 0.0),
    latitude: Annotated[float | None, _LATITUDE] = None,
    gravity: Annotated[float, options.GRAVITY] = 9.80665,
) -> "EquivalentErrors":
    """Compute the bias of p and the error of the rate that would explain a measured position error of a unit at rest.

    Raises
    ------
    InputError
        If the duration is not positive or the latitude out of range.

    Examples
    --------
    >>> import gfimu
    >>> found = gfimu.drift_from_position((6.4, 0.0, 0.0), duration=30.0)
    >>> print(f"{found.rate_drift_deg_h[1]:.1f} °/h")
    29.9 °/h
    """
    from gfimu.budget.drift.equivalent import equivalent_errors

    return equivalent_errors(from_position, duration, known_bias_mg=known_bias_mg, latitude=latitude, gravity=gravity)


@command()
def axis_drift(
    array: Annotated[given.Array, _ARRAY] = None,
    *,
    axis: Annotated[AxisLike, AXIS_ALONE] = None,
    duration: Annotated[float, _TIME] = 30.0,
    bias_mg: Annotated[float, options.BIAS_MG] = 0.0,
    noise_ug: Annotated[float, options.NOISE_UG] = 0.0,
    walk_ug: Annotated[float, _WALK] = 0.0,
    speed_rad_s: Annotated[float, _SPEED] = 0.0,
    hub_noise_m_s2_rthz: Annotated[float, Option("Of a free hub: density of its own force, m/s²/√Hz.")] = 0.1,
) -> "AxisDrift":
    """Budget the drift of rate and angle about a known axis, for as few as one chip.

    Raises
    ------
    InputError
        If there is no error to budget, no axis, or an argument is out of range.

    Examples
    --------
    >>> import gfimu
    >>> found = gfimu.axis_drift("wheel_pair", duration=10.0, noise_ug=290.0, speed_rad_s=5.0)
    >>> [one.name for one in found.terms]
    ['white noise']
    """
    from gfimu.rate.axis.accuracy.drift import axis_drift as drift_about

    sources = _sources(bias_mg, noise_ug, walk_ug)
    geometry = as_array(array or _USUAL)
    turning = as_known_axis(axis).of(geometry) or geometry.turning_axis
    if turning is None:
        raise InputError(f"array {geometry.name!r} has no axis of its own; give one, such as axis='z' (--axis z)")
    return drift_about(geometry, turning, duration, rate_rad_s=speed_rad_s, hub_density=hub_noise_m_s2_rthz, **sources)


def _run(values: Mapping[str, Any], as_json: bool) -> None:
    """Call the function that the options are of, and print what it gives; refuse an option that is of another one."""
    from gfimu.commands.shell.printing import print_report

    functions = tuple(command_of(function) for function in (drift, drift_of_rest, drift_from_position, axis_drift))
    of_body, of_rest, of_position, of_axis = functions
    usual = {name: parameter.default for one in functions for name, parameter in one.parameters.items()}
    used = {name for name, default in usual.items() if values.get(name) not in (default, None, KnownAxis())}
    if values["recording"] is not None:
        meant = of_rest
        if used - meant.parameters.keys():
            raise InputError(
                f"{values['recording']}: the drift of a recording goes with --array, --calibration, --duration, "
                "--lead, --gravity, --picture, --map and --force; its noise is measured"
            )
    elif used & _OF_RECORDINGS:
        raise InputError("--lead, --calibration, --picture, --map and --force are of a recording; name it first")
    elif values["from_position"] is not None:
        meant = of_position
        if used - meant.parameters.keys():
            raise InputError(
                "--from-position works errors out; give it with --duration, --known-bias-mg, --latitude, --gravity"
            )
    elif used & _OF_POSITIONS:
        raise InputError("--known-bias-mg and --latitude go with --from-position")
    elif values["axis"].of(as_array(values["array"] or _USUAL)) is None:
        meant = of_body
    else:
        meant = of_axis
        if used & _OF_FREE_BODIES:
            raise InputError("--rate-drift-deg-h, --offset and --monte-carlo have no use with a known axis (--axis)")
    print_report(meant, meant.taken(values), as_json=as_json)


@command(doing="Monte Carlo", run=_run, parts=(drift_of_rest, drift_from_position, axis_drift))
def drift(
    array: Annotated[given.Array, _ARRAY] = None,
    *,
    duration: Annotated[float, _TIME] = 30.0,
    bias_mg: Annotated[float, options.BIAS_MG] = 0.0,
    noise_ug: Annotated[float, options.NOISE_UG] = 0.0,
    walk_ug: Annotated[float, _WALK] = 0.0,
    rate_drift_deg_h: Annotated[float, Option("Constant error of the angular rate per axis, °/h.")] = 0.0,
    speed_rad_s: Annotated[float, _SPEED] = 0.0,
    offset: Annotated[tuple[float, float], Option("Horizontal place of the unit off the axis, x y, m.")] = (0.0, 0.0),
    gravity: Annotated[float, options.GRAVITY] = 9.80665,
    monte_carlo: Annotated[int, Option("Number of nonlinear Monte Carlo runs; 0 for none.")] = 0,
    seed: Annotated[int, options.SEED] = 0,
    progress: Annotated[Callable[[float], None] | None, options.PROGRESS] = None,
) -> "Drift":
    """Budget the position drift of an array; about a known axis see `axis_drift`.

    Raises
    ------
    InputError
        If there is no error to budget, or an argument is out of range.
    GeometryError
        If the array can't see all six motions.

    Examples
    --------
    >>> import gfimu
    >>> found = gfimu.drift("cube12", duration=10.0, noise_ug=290.0)
    >>> print(f"{found.budget.total_std[0]:.1f} m")
    27.8 m
    """
    import numpy as np

    from gfimu.budget.drift import ErrorSources, drift_budget
    from gfimu.budget.drift.monte_carlo import monte_carlo_drift
    from gfimu.budget.drift.result import Drift

    if monte_carlo == 1 or monte_carlo < 0:
        raise InputError(f"--monte-carlo {monte_carlo}: give 0 for none, or 2 or more runs")
    sources = ErrorSources(**_sources(bias_mg, noise_ug, walk_ug, rate_drift_deg_h))
    geometry = as_array(array or _USUAL)
    motion: dict[str, Any] = {"rate": speed_rad_s, "offset": offset, "gravity": gravity}
    budget = drift_budget(geometry, duration, sources, **motion)
    sample = None
    if monte_carlo:
        rng = np.random.default_rng(seed)
        sample = monte_carlo_drift(geometry, duration, sources, runs=monte_carlo, rng=rng, progress=progress, **motion)
    return Drift(budget, sample, seed)


def _sources(bias_mg: float, noise_ug: float, walk_ug: float, rate_drift_deg_h: float = 0.0) -> dict[str, float]:
    """Return the errors in SI units, without those that are zero; raises `InputError` if there is none."""
    from gfimu.base.units import STANDARD_GRAVITY

    sources = {
        "bias": bias_mg * 1e-3 * STANDARD_GRAVITY,
        "noise_density": noise_ug * 1e-6 * STANDARD_GRAVITY,
        "bias_random_walk": walk_ug * 1e-6 * STANDARD_GRAVITY,
        "rate_drift": math.radians(rate_drift_deg_h / 3600.0),
    }
    if not any(sources.values()):
        raise InputError(
            "no error to budget: give at least one of --bias-mg, --noise-ug, --walk-ug, --rate-drift-deg-h"
        )
    return {name: size for name, size in sources.items() if size}
