"""Uncertainty of a calibration after the GUM: type B of stage and reference by simulation, budget, coverage."""
