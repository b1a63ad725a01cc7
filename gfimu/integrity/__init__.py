"""Which channels of an array are faulty: detection, isolation and exclusion from the other channels alone."""

from gfimu.integrity.detectable import DetectableFaults, detectable_faults
from gfimu.integrity.fault import ChannelFault, ChannelHealth
from gfimu.integrity.monitor import ChannelMonitor
from gfimu.integrity.policy import MonitorPolicy
from gfimu.integrity.protection import FaultProtection, fault_protection
from gfimu.integrity.watch import watch_channels, watch_from_rest

__all__ = [
    "ChannelFault",
    "ChannelHealth",
    "ChannelMonitor",
    "DetectableFaults",
    "FaultProtection",
    "MonitorPolicy",
    "detectable_faults",
    "fault_protection",
    "watch_channels",
    "watch_from_rest",
]
