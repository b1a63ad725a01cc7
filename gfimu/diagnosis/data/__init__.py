"""Recordings as a diagnosis takes them: time grid, faults of the samples, checks before any fit."""
