"""What the estimate about a known axis reaches in a run of a given length, with its uncertain constants estimated.

The filter of `gfimu.rate.axis.recursion` runs over readings without error: rest, a gain of speed, a steady rotation.
Its covariance is what the noise of the channels and the hub's own acceleration leave, gravity that turns in an inclined
body included: one chip on a wheel has no other bound. The information that its innovations hold on the uncertain
constants of the mounting, with their priors, and the derivatives of the rate by them, are what the mounting leaves.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from gfimu.array.array import AccelerometerArray
from gfimu.array.turning_axis import TurningAxis
from gfimu.rate.axis.accuracy.bounds import AxisBounds, axis_bounds, require_visible
from gfimu.rate.axis.accuracy.predicted_readings import readings_of, spun_up
from gfimu.rate.axis.accuracy.predicted_run import PredictedEstimate, PredictedRun
from gfimu.rate.axis.channels import AxisChannels
from gfimu.rate.axis.mounting import Mounting
from gfimu.rate.axis.mounting_fit import MountingFit, mounting_information
from gfimu.rate.axis.problem import AxisProblem, Settings

__all__ = ["predicted_bounds", "predicted_estimate"]


def predicted_bounds(
    array: AccelerometerArray, axis: TurningAxis, run: PredictedRun, *, rate_rad_s: float, noise_std: ArrayLike
) -> AxisBounds:
    """Return the bounds of a rotation about an axis, with what `predicted_estimate` says of a run."""
    bounds = axis_bounds(array, axis, rate_rad_s=rate_rad_s, noise_std=noise_std, sample_rate_hz=run.sample_rate_hz)
    return replace(bounds, predicted=predicted_estimate(array, axis, run, rate_rad_s=rate_rad_s, noise_std=noise_std))


def predicted_estimate(
    array: AccelerometerArray,
    axis: TurningAxis,
    run: PredictedRun,
    *,
    rate_rad_s: float = 2.0 * np.pi,
    noise_std: ArrayLike = 0.0287,
) -> PredictedEstimate:
    """Return the standard deviation of the rate that `gfimu.rate.axis.estimate_about_axis` reaches in a run.

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
        tuple(MountingFit(mounting, none, remaining, 0.0).undetermined) if len(none) else (),
    )
