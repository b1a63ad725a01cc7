"""All estimators of the angular rate behind one call.

=============  ==========================================  =======================  ==========================
method         uses                                        sign of ω                error in steady turning
=============  ==========================================  =======================  ==========================
``integrate``  α                                           from the start           grows with √t, and with
                                                                                    b t of what bias is left
``algebraic``  null space, sample by sample                by α, with probability   σ_α/|ω| × 1.0 … 1.22
``ml``         null space, sample by sample                by α, with probability   σ_α/|ω|
``filter``     α, null space, rest, gyro; samples so far   start, or manoeuvre      σ_α √(Δt/|ω|)
``smoother``   the same, all samples                       start, or manoeuvre      σ_α √(Δt/2|ω|)
=============  ==========================================  =======================  ==========================
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.integration import integrate_rate
from gfimu.base.errors import InputError
from gfimu.rate.algebraic import algebraic_rate
from gfimu.rate.kalman import FilterSettings, plausible_start
from gfimu.rate.maximum_likelihood import maximum_likelihood_rate
from gfimu.rate.null_readings import null_readings
from gfimu.rate.per_sample import KnownStart
from gfimu.rate.registry import RATE_METHODS, rate_method
from gfimu.rate.result import RateEstimate
from gfimu.rate.sensing import ChannelTables, SensorErrors

__all__ = [
    "RATE_METHODS",
    "algebraic_from_rest",
    "estimate_rate",
    "integrate_from_rest",
    "maximum_likelihood_from_rest",
]


def estimate_rate(
    array: AccelerometerArray,
    t: ArrayLike,
    readings: ArrayLike,
    errors: SensorErrors,
    *,
    method: str = "filter",
    settings: FilterSettings | None = None,
    gyro: ArrayLike | None = None,
    progress: Callable[[float], object] | None = None,
) -> RateEstimate:
    """Estimate the angular rate of a recording.

    Parameters
    ----------
    array : AccelerometerArray
        The array, with c channels.
    t : array_like, shape (n,)
        Sample times, s.
    readings : array_like, shape (n, c)
        Specific force, m/s²; NaN where a channel is missing.
    errors : SensorErrors
        Errors of the sensors; `SensorErrors.from_parts` takes them from data sheets.
    method : str
        A key of `gfimu.rate.registry.RATE_METHODS`; see the module's table.
    settings : FilterSettings, optional
        Start of the run, quadrature, recognition of rest. The per-sample methods and the integration take their
        biases from a leading rest if the start is at rest.
    gyro : array_like, shape (n, 3), optional
        Gyro that ``filter`` and ``smoother`` fuse, rad/s; NaN where saturated.
    progress : callable, optional
        Called by ``filter`` and ``smoother`` with the share of the work done so far, 0 to 1.

    Raises
    ------
    InputError
        If the method is unknown, can't use a gyro or an unknown start, or the data don't fit.
    GeometryError
        If the array can't see what the method needs.

    Examples
    --------
    >>> import gfimu
    >>> run = gfimu.simulate("paper_run", seed=1)
    >>> found = gfimu.estimate_rate(run.array, run.t_s, run.readings, gfimu.SensorErrors.from_parts(run.array, 100.0))
    >>> found.omega.shape
    (3000, 3)
    """
    chosen = rate_method(method)
    start = settings or FilterSettings()
    if chosen.recursive:
        return chosen.solver(array, t, readings, errors, start, gyro=gyro, progress=progress)
    if gyro is not None:
        chosen.refuse_gyro()
    if chosen.open_loop and start.start_omega is None:
        chosen.refuse_unknown_start()
    return chosen.solver(array, t, readings, errors, start)


def integrate_from_rest(
    array: AccelerometerArray, t: ArrayLike, readings: ArrayLike, errors: SensorErrors, settings: FilterSettings
) -> RateEstimate:
    """Integrate α (GF-IMU paper, step 10 d) with the mean over a leading rest as bias."""
    if settings.start_omega is None:
        raise InputError("an integration needs the rate at the start; give it as start_omega")
    if ChannelTables(array, errors).alpha_leak[0].any():
        raise InputError(
            f"array {array.name!r} leaves products of the rate in α; use filter, or gfimu.estimate, which "
            "feeds the rate back"
        )
    at_rest = not np.any(settings.start_omega)
    null = null_readings(array, t, readings, errors, least_rank=0, start_at_rest=at_rest)
    omega = integrate_rate(null.t, null.alpha, settings.start_omega)
    noise = ChannelTables(array, errors).alpha_noise[0]
    period = float(np.median(np.diff(null.t)))
    turned = (null.t - null.t[0])[:, None, None]
    spread = ChannelTables(array, errors).bias_covariance(errors.bias_std)[:3, :3]
    if null.rest.any():
        spread = noise / int(null.rest.sum())
    covariance = settings.start_std**2 * np.eye(3) + noise * period * turned + spread * turned**2
    n = len(null.t)
    return RateEstimate(
        "integrate", null.t, omega, covariance, np.full(n, np.nan), np.zeros(n, dtype=np.int64), null.rest
    )


def algebraic_from_rest(
    array: AccelerometerArray, t: ArrayLike, readings: ArrayLike, errors: SensorErrors, settings: FilterSettings
) -> RateEstimate:
    """Solve the products of ω sample by sample in closed form, with the mean over a leading rest as bias."""
    return _per_sample(algebraic_rate, array, t, readings, errors, settings)


def maximum_likelihood_from_rest(
    array: AccelerometerArray, t: ArrayLike, readings: ArrayLike, errors: SensorErrors, settings: FilterSettings
) -> RateEstimate:
    """Solve ω sample by sample by maximum likelihood, with the mean over a leading rest as bias."""
    return _per_sample(maximum_likelihood_rate, array, t, readings, errors, settings)


def _per_sample(
    solve: Callable[..., RateEstimate],
    array: AccelerometerArray,
    t: ArrayLike,
    readings: ArrayLike,
    errors: SensorErrors,
    settings: FilterSettings,
) -> RateEstimate:
    times, rows = np.asarray(t, dtype=float), np.asarray(readings, dtype=float)
    settings = plausible_start(array, times, rows, errors, settings)
    start: NDArray[np.float64] | None = settings.start_omega
    at_rest = start is not None and not np.any(start)
    known = None if start is None or at_rest else KnownStart(start, settings.start_std)
    return solve(array, t, readings, errors, start_at_rest=at_rest, start=known)
