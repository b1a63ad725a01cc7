"""The best single effect by an F test: one term of the library, the one that least squares prefers."""

from __future__ import annotations

from math import log
from typing import Any

from scipy.special import gammaln
from scipy.stats import chi2

from sim.trials.benchmark.library import Candidate, LinearLibrary
from sim.trials.benchmark.world import Task

__all__ = ["answer"]

_LEVEL = 1e-3  # chance of a false alarm over all terms together, if the noise were white
_LEAST_LOG = -600.0  # numerical: below, a tail probability underflows and its asymptotic form is exact enough


def answer(task: Task) -> dict[str, Any]:
    """Name the term with the least p-value of an F test, after Bonferroni's correction; nothing if none passes."""
    library = LinearLibrary.of(task.recording, task.twin, free_motion=True)

    def log_chance(one: Candidate) -> float:
        explained = library.explained([one])
        variance = max((library.chi2 - explained) / (library.samples - one.free), 1e-12)
        return _log_tail(explained / variance, one.free)

    best = min(library.candidates, key=log_chance)
    if log_chance(best) > log(_LEVEL / len(library.candidates)):
        return {"verdict": "nothing_found"}
    return {"verdict": "explained", "causes": library.causes([best])}


def _log_tail(x: float, free: int) -> float:
    """Log of the tail of χ², to which free times F tends with tens of thousands of readings."""
    found = float(chi2.logsf(x, free)) if x < -2.0 * _LEAST_LOG else -float("inf")
    if found > _LEAST_LOG:
        return found
    return float(-x / 2.0 + (free / 2.0 - 1.0) * log(x / 2.0) - gammaln(free / 2.0))
