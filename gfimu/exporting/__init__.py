"""Recordings and calibrations in the formats of others: MCAP for ROS 2, EuRoC / ASL; Kalibr and imu_calib."""

from gfimu.exporting.euroc import write_euroc
from gfimu.exporting.kalibr import calibration_as_kalibr
from gfimu.exporting.mcap import write_mcap
from gfimu.exporting.ros import calibration_as_ros

__all__ = ["calibration_as_kalibr", "calibration_as_ros", "write_euroc", "write_mcap"]
