"""Calibration certificates: the terms of the standards, their uncertainty budget, comparisons of two laboratories."""
