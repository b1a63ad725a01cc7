"""Rotation about one known axis from few accelerometers: rate, angle, and the bounds of both."""

from gfimu.known_axis.accuracy.bounds import AxisBounds, axis_bounds
from gfimu.known_axis.estimation import estimate_about_axis

__all__ = ["AxisBounds", "axis_bounds", "estimate_about_axis"]
