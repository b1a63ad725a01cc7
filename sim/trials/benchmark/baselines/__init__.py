"""Baselines of the benchmark, one file each: examples of a method, and marks to compare with."""

from collections.abc import Callable
from typing import Any

__all__ = ["BASELINES", "baselines"]

BASELINES = ("always_unknown", "best_single", "greedy_bic", "sysid", "oracle")
"""Methods that come with the benchmark, beside gfimu's own (`gfimu.commands.benchmark`)."""


def baselines() -> dict[str, Callable[..., dict[str, Any]]]:
    """Return the function of each by name; these need MuJoCo, a list of the names does not."""
    from sim.trials.benchmark.baselines import always_unknown, best_single, greedy_bic, oracle, sysid

    files = (always_unknown, best_single, greedy_bic, sysid, oracle)
    return {name: file.answer for name, file in zip(BASELINES, files, strict=True)}
