"""Which channels of an array are faulty: detection, isolation and exclusion from the other channels alone."""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names

if TYPE_CHECKING:
    from gfimu.rate.health.detectable import detectable_faults
    from gfimu.rate.health.monitor import ChannelMonitor
    from gfimu.rate.health.policy import MonitorPolicy
    from gfimu.rate.health.protection import fault_protection
    from gfimu.rate.health.watch import watch_channels, watch_from_rest
else:
    __getattr__, __dir__, __all__ = declared_names(__name__)
