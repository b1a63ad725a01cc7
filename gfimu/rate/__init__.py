"""Angular rate from an accelerometer array: per sample, filtered or smoothed, over a run or a stream.

In: readings (n, c), an array, the errors of its channels (`sensing`).
Out: `RateEstimate` with covariance; faulty channels (`health`), lower bounds (`bounds`), rotation about a known axis
(`axis`). One file per method, by name in `registry`; `methods` has one call for all.
"""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names

if TYPE_CHECKING:
    from gfimu.rate.axis.accuracy.bounds import axis_bounds
    from gfimu.rate.axis.live import LiveAxisFilter
    from gfimu.rate.bounds.sample import (
        alpha_std,
        omega_products_jacobian,
        rate_bound_isotropic,
        rate_information,
        steady_rate_bound,
    )
    from gfimu.rate.channel_errors import ChannelErrors, features_of
    from gfimu.rate.channel_sets import ChannelSets
    from gfimu.rate.feedback import integrate_rate_recursively
    from gfimu.rate.filter import filter_rate, smooth_rate
    from gfimu.rate.health.fault import HealthCode
    from gfimu.rate.path_start import PathStart
    from gfimu.rate.references import Measured, Reference, ReferencePolicy
    from gfimu.rate.rest_test import RestTest, constant_readings
    from gfimu.rate.result import joined_estimates
    from gfimu.rate.settings import FilterSettings
    from gfimu.rate.start import start_of_still
    from gfimu.rate.stream import filter_stream
else:
    __getattr__, __dir__, __all__ = declared_names(__name__)
