"""What the estimate about a known axis reaches in a run of a given length, with its uncertain constants estimated.

The filter of `gfimu.known_axis.recursion` runs over readings without error: rest, a gain of speed, a steady rotation.
Its covariance is what the noise of the channels and the hub's own acceleration leave, gravity that turns in an inclined
body included: one chip on a wheel has no other bound. The information that its innovations hold on the uncertain
constants of the mounting, with their priors, and the derivatives of the rate by them, are what the mounting leaves.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gfimu.errors import InputError
from gfimu.geometry.array import AccelerometerArray
from gfimu.geometry.turning_axis import TurningAxis
from gfimu.known_axis.accuracy.bounds import require_visible
from gfimu.known_axis.accuracy.predicted_readings import readings_of, spun_up
from gfimu.known_axis.channels import AxisChannels
from gfimu.known_axis.mounting import Mounting
from gfimu.known_axis.mounting_fit import MountingFit, mounting_information
from gfimu.known_axis.problem import AxisProblem, Settings

__all__ = ["PredictedEstimate", "PredictedRun", "predicted_estimate"]

_MOST_SAMPLES = 400_000  # numerical: more take too long


@dataclass(frozen=True)
class PredictedRun:
    """A run that does not exist yet.

    Parameters
    ----------
    duration_s : float
        Length, s; a tenth is rest, another tenth the gain of speed.
    sample_rate_hz : float
        Rate of the samples, Hz.
    hub_std_m_s2 : float
        Of a free hub, standard deviation of its own specific force in each direction, m/s²; the default is that of a
        wheel of a car (Wheel Inertial Dataset).
    jerk_rad2_s5 : float
        Spectral density of the change of α that the motion has, rad²/s⁵; the default is that of a smooth motion, by
        choice.

    Raises
    ------
    InputError
        If a number is not positive, or the run has too many samples.
    """

    duration_s: float = 60.0
    sample_rate_hz: float = 100.0
    hub_std_m_s2: float = 0.7
    jerk_rad2_s5: float = 1.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not 0.0 < value < np.inf:
                raise InputError(f"{name} is {value!r}; give a number above 0")
        if not 20 <= self.duration_s * self.sample_rate_hz <= _MOST_SAMPLES:
            raise InputError(
                f"{self.duration_s:g} s at {self.sample_rate_hz:g} Hz are {self.duration_s * self.sample_rate_hz:.0f} "
                f"samples; give a run of 20 to {_MOST_SAMPLES}"
            )


@dataclass(frozen=True)
class PredictedEstimate:
    """Standard deviation of the rate in the steady part of a run, by cause.

    Parameters
    ----------
    run : PredictedRun
        The run.
    inclination_rad : float
        Angle between axis and vertical at which it holds, rad.
    noise_std, mounting_std : float
        By noise (of channels and hub) and by what remains uncertain of the mounting, rad/s.
    std : float
        By both, rad/s.
    undetermined : tuple of str
        Combinations of constants that such a run does not determine (`MountingFit.undetermined`).
    """

    run: PredictedRun
    inclination_rad: float
    noise_std: float
    mounting_std: float
    std: float
    undetermined: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return the prediction as JSON holds it."""
        return {
            **vars(self.run),
            "inclination_rad": self.inclination_rad,
            "sigma_rate_by_noise_rad_s": self.noise_std,
            "sigma_rate_by_mounting_rad_s": self.mounting_std,
            "sigma_rate_rad_s": self.std,
            "undetermined_combinations_in_prior_std": list(self.undetermined),
        }


def predicted_estimate(
    array: AccelerometerArray,
    axis: TurningAxis,
    run: PredictedRun,
    *,
    rate_rad_s: float = 2.0 * np.pi,
    noise_std: ArrayLike = 0.0287,
) -> PredictedEstimate:
    """Return the standard deviation of the rate that `gfimu.known_axis.estimate_about_axis` reaches in a run.

    Parameters
    ----------
    array : AccelerometerArray
        The array.
    axis : TurningAxis
        The axis with its uncertainty; without an inclination a fixed one is upright and a free one level.
    run : PredictedRun
        The run.
    rate_rad_s : float
        Rate of the steady part, rad/s.
    noise_std : array_like, scalar or shape (c,)
        Standard deviation of one sample of each channel, m/s².

    Raises
    ------
    GeometryError
        If the array can't see the rotation.
    """
    require_visible(array, axis)
    free = axis.hub == "free"
    tilt = (np.pi / 2.0 if free else 0.0) if axis.inclination is None else axis.inclination
    t = np.arange(round(run.duration_s * run.sample_rate_hz)) / run.sample_rate_hz
    channels = AxisChannels.of(array, axis)
    noise = np.ascontiguousarray(np.broadcast_to(np.asarray(noise_std, dtype=float), array.n_channels))
    problem = AxisProblem(t, readings_of(channels, tilt, *spun_up(t, rate_rad_s)), channels, noise)
    settings = Settings(1.0, run.jerk_rad2_s5, run.hub_std_m_s2 if free else 0.0, tilt)
    estimated = axis.inclination is None and not axis.uncertainty.exact and free
    mounting = Mounting.of(array, replace(axis, inclination=tilt), tilt, free_inclination=estimated)
    none = np.zeros(len(mounting.constants))
    start, covariance = np.zeros(3), np.diag([0.25, 1e-4, 1e-2])
    found, information = mounting_information(problem, mounting, settings, start, covariance, none)
    steady = slice(len(t) // 2, None)
    noise_variance = float(np.mean(found.covariances[steady, 1, 1]))
    by_rate = found.by_constants[steady, 1]  # (n, m)
    remaining = np.asarray(np.linalg.inv(information), dtype=np.float64)
    mounting_variance = float(np.mean(np.einsum("ni,ij,nj->n", by_rate, remaining, by_rate)))
    return PredictedEstimate(
        run,
        float(tilt),
        float(np.sqrt(noise_variance)),
        float(np.sqrt(mounting_variance)),
        float(np.sqrt(noise_variance + mounting_variance)),
        tuple(MountingFit(mounting, none, remaining, 0.0).undetermined()) if len(none) else (),
    )
