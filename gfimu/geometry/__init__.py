"""Geometry of an accelerometer array: its file, kinematics, solutions, figures of merit; gravity, smooth ramps."""
