"""Recordings and calibrations in the formats of others: MCAP for ROS 2, EuRoC / ASL; Kalibr and imu_calib."""

from gfimu.calibration.exporting.euroc import write_euroc
from gfimu.calibration.exporting.kalibr import calibration_as_kalibr
from gfimu.calibration.exporting.mcap import write_mcap
from gfimu.calibration.exporting.ros import calibration_as_ros

__all__ = ["calibration_as_kalibr", "calibration_as_ros", "write_euroc", "write_mcap"]
