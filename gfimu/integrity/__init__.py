"""Which channels of an array are faulty: detection, isolation and exclusion from the other channels alone."""

from gfimu.lazy_names import names_on_first_use

__getattr__ = names_on_first_use(
    "gfimu.integrity",
    {
        "ChannelFault": "fault",
        "ChannelHealth": "fault",
        "ChannelMonitor": "monitor",
        "DetectableFaults": "detectable",
        "FaultProtection": "protection",
        "HealthCode": "fault",
        "MonitorPolicy": "policy",
        "detectable_faults": "detectable",
        "fault_protection": "protection",
        "watch_channels": "watch",
        "watch_from_rest": "watch",
    },
)
