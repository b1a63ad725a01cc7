"""The methods for the angular rate, each a function of the array, times, readings, errors of the sensors and settings.

Each imports what it needs when it runs, so that a list of the methods does not wait for the compiled filter.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from gfimu.base.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from gfimu.array.array import AccelerometerArray
    from gfimu.rate.result import RateEstimate
    from gfimu.rate.sensing import SensorErrors
    from gfimu.rate.settings import FilterSettings

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
    from gfimu.rate.filter import increasing_times
    from gfimu.rate.live import LiveRateFilter
    from gfimu.rate.result import RateEstimate

    times, period = increasing_times(t, "the integration")
    live = LiveRateFilter(array, errors, period, settings)
    if live.sets.full.leak.any():
        raise InputError(
            f"array {array.name!r} leaves products of the rate in α; use filter, or gfimu.estimate, which "
            "feeds the rate back"
        )
    known = live.leading_rest(times, readings)
    start, samples = live.start, live.samples
    assert start is not None
    of_alpha, slopes = known.of_alpha(samples)
    alpha = np.where((samples.channel_set >= 0)[:, None], samples.alpha - of_alpha, np.nan)
    omega = integrate_rate(times, alpha, start.omega)
    first = start.covariance
    if start.sign_open:  # the error is nought or twice the rate
        first = first + 2.0 * np.outer(start.omega, start.omega)
    steps = np.diff(times, prepend=times[0])
    sums = np.cumsum(slopes * steps[:, None, None], axis=0)  # (n, 3, constants)
    noise = live.sets.full.alpha_noise * (period * (times - times[0]))[:, None, None]
    covariance = first + noise + sums @ known.covariance @ np.swapaxes(sums, 1, 2)
    n = len(times)
    none = np.zeros(n, dtype=np.int64)
    chance = np.full(n, 0.5 if start.sign_open else 1.0)
    return RateEstimate(
        "integrate",
        times,
        omega,
        covariance,
        np.full(n, np.nan),
        none,
        known.rest,
        sign_probability=chance,
        start=start,
    )


def algebraic_from_rest(*run: Any) -> RateEstimate:
    """Solve the products of ω sample by sample, as `gfimu.rate.per_sample.algebraic_rate`."""
    from gfimu.rate.per_sample import algebraic_rate

    return algebraic_rate(*run)


def maximum_likelihood_from_rest(*run: Any) -> RateEstimate:
    """Solve ω sample by sample, as `gfimu.rate.per_sample.maximum_likelihood_rate`."""
    from gfimu.rate.per_sample import maximum_likelihood_rate

    return maximum_likelihood_rate(*run)


def filter_readings(*run: Any, **options: Any) -> RateEstimate:
    """Filter, as `gfimu.rate.filter.filter_rate`."""
    from gfimu.rate.filter import filter_rate

    return filter_rate(*run, **options)


def smooth_readings(*run: Any, **options: Any) -> RateEstimate:
    """Smooth, as `gfimu.rate.filter.smooth_rate`."""
    from gfimu.rate.filter import smooth_rate

    return smooth_rate(*run, **options)
