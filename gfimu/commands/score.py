"""Score array geometries: condition number, GDOP, errors, leakage of ω², visible products of ω, least faults.

Examples
--------
gfimu score cube12 p3_three_plus_one --speed-rad-s 10
# Two chips on a wheel
gfimu score wheel.toml --axis z --hub free --speed-rad-s 12
# Mounted by eye
gfimu score one_chip --axis z --axis-point -0.1 0 0 --lever-std-m 0.003 --rotation-std-rad 0.05 --bias-std-m-s2 0.2
"""

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from gfimu.base.errors import InputError
from gfimu.commands.known_axis import AXIS, AxisLike, as_known_axis
from gfimu.commands.opened import as_array
from gfimu.commands.shell.declare import Option, command
from gfimu.commands.shell.options import ARRAYS, DURATION, RATE, SPEED_RAD_S

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from gfimu.array.array import AccelerometerArray
    from gfimu.array_search.scores import Scores
    from gfimu.array_search.scoring import Score
    from gfimu.rate.axis.accuracy.bounds import AxisBounds

__all__ = ["score"]

_FASTEST = 1e6  # rad/s
_LENGTH_UNIT = Option("Length that counts as 1, m; else half of each cube's edge.", "M")
_NOISE = Option("Standard deviation of a channel, m/s²: 0.0287 is ADXL345 at 100 Hz.", "M/S²")
_OMEGA = Option("Angular rate (3,) in place of speed and axis, rad/s.", shell=False)
_HUB = Option("With a free hub: standard deviation of its own acceleration, m/s².", "M/S²")
_JERK = Option("With --axis: spectral density of the change of α, rad²/s⁵.", "RAD²/S⁵")
_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


@command()
def score(
    arrays: Annotated[
        "AccelerometerArray | str | Path | Sequence[AccelerometerArray | str | Path] | None", ARRAYS
    ] = None,
    *,
    length_unit_m: Annotated[float | None, _LENGTH_UNIT] = None,
    speed_rad_s: Annotated[float, SPEED_RAD_S.also(", of the rate bound")] = math.tau,
    spin_axis: Annotated[Literal["x", "y", "z"], Option("Body axis of that spin: x, y or z.", "AXIS")] = "z",
    noise_m_s2: Annotated[float, _NOISE] = 0.0287,
    omega_rad_s: Annotated["ArrayLike | None", _OMEGA] = None,
    axis: Annotated[AxisLike, AXIS] = None,
    rate: Annotated[float, RATE.also(", of least faults, and with --axis")] = 100.0,
    duration: Annotated[float, DURATION.also(", that the estimate is predicted for", when="With --axis: ")] = 60.0,
    hub_std_m_s2: Annotated[float, _HUB] = 0.7,
    jerk_rad2_s5: Annotated[float, _JERK] = 1.0,
    fault_time_s: Annotated[float, Option("Time within which a fault of a channel is to be found, s.", "S")] = 1.0,
    per_channel: Annotated[bool, Option("Least fault of every channel.")] = False,
) -> "Scores":
    """Score the geometry of one or several arrays.

    An array that can't see all six motions is scored about its own axis, if its file names one.

    Raises
    ------
    GeometryError
        If an array can't see all six motions; the message names the motions.
    InputError
        If an array is unknown or an argument is out of range.

    Examples
    --------
    >>> import gfimu
    >>> [f"{one.name} {one.gdop:.3f}" for one in gfimu.score(["cube12", "corners8"]).rigid]
    ['cube12 1.061', 'corners8 0.750']
    """
    from gfimu.array.array import AccelerometerArray
    from gfimu.array.observability import seeing_arrays
    from gfimu.array_search.scores import Scores
    from gfimu.array_search.scoring import score as score_arrays
    from gfimu.rate.health.protection import fault_protection

    if not abs(speed_rad_s) <= _FASTEST:
        raise InputError(f"--speed-rad-s {speed_rad_s}: must be a number of at most {_FASTEST:g}")
    omega = [speed_rad_s * component for component in _AXES[spin_axis]] if omega_rad_s is None else omega_rad_s
    said, scores = as_known_axis(axis), list["Score | AxisBounds"]()
    several = [arrays] if isinstance(arrays, AccelerometerArray | str | Path) else arrays or seeing_arrays()
    for array in map(as_array, several):
        about = said.of(array)
        if about is None:
            faults = fault_protection(
                array, noise_m_s2=noise_m_s2, sample_rate_hz=rate, duration_s=fault_time_s, per_channel=per_channel
            )
            (found,) = score_arrays(array, length_unit_m=length_unit_m, omega_rad_s=omega, noise_m_s2=noise_m_s2)
            scores.append(replace(found, protection=faults))
        else:
            from gfimu.rate.axis.accuracy.predicted import predicted_bounds
            from gfimu.rate.axis.accuracy.predicted_run import PredictedRun

            run = PredictedRun(duration, rate, hub_std_m_s2, jerk_rad2_s5)
            scores.append(predicted_bounds(array, about, run, rate_rad_s=speed_rad_s, noise_std=noise_m_s2))
    return Scores(tuple(scores))
