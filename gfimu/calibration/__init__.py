"""Calibration: one error model, one result class, one method per file."""
