"""Recordings and calibrations in the formats of others: MCAP for ROS 2, EuRoC / ASL; Kalibr and imu_calib."""

from gfimu.calibration.exporting.calibrated_chip import calibrated_chips
from gfimu.calibration.exporting.euroc import write_euroc
from gfimu.calibration.exporting.kalibr import calibration_as_kalibr
from gfimu.calibration.exporting.mcap import write_mcap
from gfimu.calibration.exporting.notes import notes_of
from gfimu.calibration.exporting.ros import calibration_as_ros

__all__ = ["TARGETS", "calibrated_chips", "notes_of", "write_euroc", "write_mcap"]

TARGETS = {"kalibr": calibration_as_kalibr, "ros": calibration_as_ros}
"""Formats of a calibration for others: what returns the text of one, from its chips and notes."""
