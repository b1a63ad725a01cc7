"""The best single effect by an F test: one term of the library, the one that least squares prefers."""

from __future__ import annotations

from math import log
from typing import Any

from scipy.stats import f as f_distribution

from sim.benchmark.library import Candidate, LinearLibrary
from sim.benchmark.world import Task

__all__ = ["answer"]

_LEVEL = 1e-3  # chance of a false alarm over all terms together, if the noise were white


def answer(task: Task) -> dict[str, Any]:
    """Name the term with the least p-value of an F test, after Bonferroni's correction; nothing if none passes."""
    library = LinearLibrary.of(task.recording, task.twin)

    def log_chance(one: Candidate) -> float:
        explained, rest = library.explained([one]), library.samples - one.free
        ratio = (explained / one.free) / max((library.chi2 - explained) / rest, 1e-12)
        return float(f_distribution.logsf(ratio, one.free, rest))

    best = min(library.candidates, key=lambda one: (log_chance(one), -library.explained([one]) / one.free))
    if log_chance(best) > log(_LEVEL / len(library.candidates)):
        return {"verdict": "nothing_found"}
    return {"verdict": "explained", "causes": library.causes([best])}
