"""Which channels of an array are faulty: detection, isolation and exclusion from the other channels alone."""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names

if TYPE_CHECKING:
    from gfimu.rate.health.detectable import DetectableFaults as DetectableFaults
    from gfimu.rate.health.detectable import detectable_faults as detectable_faults
    from gfimu.rate.health.fault import ChannelFault as ChannelFault
    from gfimu.rate.health.fault import ChannelHealth as ChannelHealth
    from gfimu.rate.health.fault import HealthCode as HealthCode
    from gfimu.rate.health.monitor import ChannelMonitor as ChannelMonitor
    from gfimu.rate.health.policy import MonitorPolicy as MonitorPolicy
    from gfimu.rate.health.protection import FaultProtection as FaultProtection
    from gfimu.rate.health.protection import fault_protection as fault_protection
    from gfimu.rate.health.watch import watch_channels as watch_channels
    from gfimu.rate.health.watch import watch_from_rest as watch_from_rest
else:
    __getattr__, __dir__, __all__ = declared_names(__name__)
