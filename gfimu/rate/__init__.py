"""Angular rate from an accelerometer array: per sample, filtered or smoothed, over a run or a stream.

In: readings (n, c), an array, the errors of its channels (`sensing`).
Out: `RateEstimate` with covariance; faulty channels (`health`), lower bounds (`bounds`), rotation about a known axis
(`axis`). One file per method, by name in `registry`; `methods` has one call for all.
"""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names

if TYPE_CHECKING:
    from gfimu.rate.axis.accuracy.bounds import axis_bounds as axis_bounds
    from gfimu.rate.axis.accuracy.drift import axis_drift as axis_drift
    from gfimu.rate.axis.channels import AxisChannels as AxisChannels
    from gfimu.rate.axis.few_motions import few_motions_text as few_motions_text
    from gfimu.rate.axis.live import LiveAxisFilter as LiveAxisFilter
    from gfimu.rate.axis.mounting import Mounting as Mounting
    from gfimu.rate.axis.mounting_fit import fit_mounting as fit_mounting
    from gfimu.rate.axis.problem import AxisProblem as AxisProblem
    from gfimu.rate.axis.problem import Settings as Settings
    from gfimu.rate.bounds.sample import alpha_std as alpha_std
    from gfimu.rate.bounds.sample import omega_products_jacobian as omega_products_jacobian
    from gfimu.rate.bounds.sample import rate_bound_isotropic as rate_bound_isotropic
    from gfimu.rate.bounds.sample import rate_information as rate_information
    from gfimu.rate.bounds.sample import steady_rate_bound as steady_rate_bound
    from gfimu.rate.disagreement import MeasuredNoise as MeasuredNoise
    from gfimu.rate.feedback import integrate_rate_recursively as integrate_rate_recursively
    from gfimu.rate.filter import filter_rate as filter_rate
    from gfimu.rate.health.fault import HealthCode as HealthCode
    from gfimu.rate.health.live.channel_watch import LiveWatch as LiveWatch
    from gfimu.rate.health.live.watched_filter import WatchedRateFilter as WatchedRateFilter
    from gfimu.rate.health.watch import watch_from_rest as watch_from_rest
    from gfimu.rate.kalman import FilterSettings as FilterSettings
    from gfimu.rate.rest_test import RestTest as RestTest
    from gfimu.rate.rest_test import constant_readings as constant_readings
    from gfimu.rate.sensing import ChannelTables as ChannelTables
    from gfimu.rate.smoother import smooth_rate as smooth_rate
    from gfimu.rate.stream import filter_stream as filter_stream
else:
    __getattr__, __dir__, __all__ = declared_names(__name__)
