"""Recordings in the formats of others: MCAP with `sensor_msgs/Imu` for ROS 2, and the EuRoC / ASL layout."""

from gfimu.exporting.euroc import write_euroc
from gfimu.exporting.mcap import write_mcap

__all__ = ["write_euroc", "write_mcap"]
