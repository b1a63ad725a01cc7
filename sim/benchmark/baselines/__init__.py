"""Baselines of the benchmark, one file each: examples of a method, and marks to compare with."""
