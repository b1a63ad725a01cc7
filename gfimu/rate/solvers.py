"""The methods for the angular rate, each a function of the array, times, readings, errors of the sensors and settings.

Each imports what it needs when it runs, so that a list of the methods does not wait for the compiled filter.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from gfimu.array.array import AccelerometerArray
    from gfimu.rate.path_start import PathStart
    from gfimu.rate.result import RateEstimate
    from gfimu.rate.sensing import SensorErrors
    from gfimu.rate.settings import FilterSettings

__all__ = [
    "adjust_readings",
    "algebraic_from_rest",
    "filter_readings",
    "integrate_from_rest",
    "maximum_likelihood_from_rest",
    "smooth_readings",
]


def integrate_from_rest(
    array: AccelerometerArray,
    t: ArrayLike,
    readings: ArrayLike,
    errors: SensorErrors,
    settings: FilterSettings,
    *,
    path: PathStart | None = None,
) -> RateEstimate:
    """Integrate α (GF-IMU paper, step 10 d), with biases and errors of the channels by a leading rest."""
    import numpy as np

    from gfimu.rate.filter import increasing_times
    from gfimu.rate.live import LiveRateFilter
    from gfimu.rate.result import SignDecision

    times, period = increasing_times(t, "the integration")
    live = LiveRateFilter(array, errors, period, settings, path=path)
    live.leading_rest(times, readings)
    start = live.start
    assert start is not None
    found = live.estimate_of(times, live.follow_rates(), "integrate")
    lost = live.samples.channel_set < 0
    covariance = found.covariance
    if start.sign_open:  # the error is nought or twice the rate
        covariance = covariance + 2.0 * np.outer(start.omega, start.omega)
    return replace(
        found,
        omega=np.where(lost[:, None], np.nan, found.omega),
        covariance=covariance,
        nis=np.full(len(times), np.nan),
        scale=None,
        sign_probability=np.full(len(times), 0.5 if start.sign_open else 1.0),
        sign=SignDecision("undecided", 0.0) if start.sign_open else SignDecision(),
    )


def algebraic_from_rest(*run: Any, **options: Any) -> RateEstimate:
    """Solve the products of ω sample by sample, as `gfimu.rate.per_sample.algebraic_rate`."""
    from gfimu.rate.per_sample import algebraic_rate

    return algebraic_rate(*run, **options)


def maximum_likelihood_from_rest(*run: Any, **options: Any) -> RateEstimate:
    """Solve ω sample by sample, as `gfimu.rate.per_sample.maximum_likelihood_rate`."""
    from gfimu.rate.per_sample import maximum_likelihood_rate

    return maximum_likelihood_rate(*run, **options)


def filter_readings(*run: Any, **options: Any) -> RateEstimate:
    """Filter, as `gfimu.rate.filter.filter_rate`."""
    from gfimu.rate.filter import filter_rate

    return filter_rate(*run, **options)


def smooth_readings(*run: Any, **options: Any) -> RateEstimate:
    """Smooth, as `gfimu.rate.filter.smooth_rate`."""
    from gfimu.rate.filter import smooth_rate

    return smooth_rate(*run, **options)


def adjust_readings(*run: Any, **options: Any) -> RateEstimate:
    """Adjust the whole run, as `gfimu.rate.filter.adjust_rate`."""
    from gfimu.rate.filter import adjust_rate

    return adjust_rate(*run, **options)
