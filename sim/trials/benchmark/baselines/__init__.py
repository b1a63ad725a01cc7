"""Baselines of the benchmark, one file each: examples of a method, and marks to compare with."""

__all__ = ["BASELINES"]

BASELINES = ("always_unknown", "best_single", "greedy_bic", "sysid", "oracle")
"""Methods that come with the benchmark, beside gfimu's own (`gfimu.commands.benchmark`)."""
