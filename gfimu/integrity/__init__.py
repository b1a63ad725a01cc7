"""Which channels of an array are faulty: detection, isolation and exclusion from the other channels alone."""

from gfimu.integrity.fault import ChannelFault, ChannelHealth
from gfimu.integrity.monitor import ChannelMonitor, watch_channels
from gfimu.integrity.policy import MonitorPolicy

__all__ = ["ChannelFault", "ChannelHealth", "ChannelMonitor", "MonitorPolicy", "watch_channels"]
