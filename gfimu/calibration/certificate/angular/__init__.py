"""The whole array as an angular sensor without a spinning mass (IEEE Std 671): the sheet of its figures."""

from gfimu.calibration.certificate.angular.sheet import angular_sensor_sheet

__all__ = ["angular_sensor_sheet"]
