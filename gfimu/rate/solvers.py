"""The methods for the angular rate, each a function of the array, times, readings, errors of the sensors and settings.

Each imports what it needs when it runs, so that a list of the methods does not wait for the compiled filter.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from gfimu.base.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike

    from gfimu.array.array import AccelerometerArray
    from gfimu.rate.kalman import FilterSettings
    from gfimu.rate.result import RateEstimate
    from gfimu.rate.sensing import SensorErrors

__all__ = [
    "algebraic_from_rest",
    "filter_readings",
    "integrate_from_rest",
    "maximum_likelihood_from_rest",
    "smooth_readings",
]


def integrate_from_rest(
    array: AccelerometerArray, t: ArrayLike, readings: ArrayLike, errors: SensorErrors, settings: FilterSettings
) -> RateEstimate:
    """Integrate α (GF-IMU paper, step 10 d) with the mean over a leading rest as bias."""
    import numpy as np

    from gfimu.array.integration import integrate_rate
    from gfimu.rate.null_readings import null_readings
    from gfimu.rate.result import RateEstimate
    from gfimu.rate.sensing import ChannelTables

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
    from gfimu.rate.algebraic import algebraic_rate

    return _per_sample(algebraic_rate, array, t, readings, errors, settings)


def maximum_likelihood_from_rest(
    array: AccelerometerArray, t: ArrayLike, readings: ArrayLike, errors: SensorErrors, settings: FilterSettings
) -> RateEstimate:
    """Solve ω sample by sample by maximum likelihood, with the mean over a leading rest as bias."""
    from gfimu.rate.maximum_likelihood import maximum_likelihood_rate

    return _per_sample(maximum_likelihood_rate, array, t, readings, errors, settings)


def filter_readings(*run: Any, **options: Any) -> RateEstimate:
    """Filter, as `gfimu.rate.filter.filter_rate`."""
    from gfimu.rate.filter import filter_rate

    return filter_rate(*run, **options)


def smooth_readings(*run: Any, **options: Any) -> RateEstimate:
    """Smooth, as `gfimu.rate.smoother.smooth_rate`."""
    from gfimu.rate.smoother import smooth_rate

    return smooth_rate(*run, **options)


def _per_sample(
    solve: Callable[..., RateEstimate],
    array: AccelerometerArray,
    t: ArrayLike,
    readings: ArrayLike,
    errors: SensorErrors,
    settings: FilterSettings,
) -> RateEstimate:
    import numpy as np

    from gfimu.rate.kalman import plausible_start
    from gfimu.rate.per_sample import KnownStart

    times, rows = np.asarray(t, dtype=float), np.asarray(readings, dtype=float)
    settings = plausible_start(array, times, rows, errors, settings)
    start = settings.start_omega
    at_rest = start is not None and not np.any(start)
    known = None if start is None or at_rest else KnownStart(start, settings.start_std)
    return solve(array, t, readings, errors, start_at_rest=at_rest, start=known)
