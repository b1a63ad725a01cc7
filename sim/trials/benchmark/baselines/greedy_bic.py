"""Greedy least squares over the library by the Bayesian information criterion (Schwarz, Ann. Statist. 6:461, 1978)."""

from __future__ import annotations

from math import log
from typing import Any

from sim.trials.benchmark.library import Candidate, LinearLibrary
from sim.trials.benchmark.world import Task

__all__ = ["answer"]

_MOST = 5  # terms


def answer(task: Task) -> dict[str, Any]:
    """Add the term that lowers BIC most, until none does."""
    library = LinearLibrary.of(task.recording, task.twin, free_motion=True)

    def score(terms: list[Candidate]) -> float:
        return library.explained(terms) - sum(term.free for term in terms) * log(library.samples)

    chosen: list[Candidate] = []
    reached = 0.0
    for _ in range(_MOST):
        longer = max(([*chosen, candidate] for candidate in library.candidates), key=score)
        if score(longer) <= reached:
            break
        chosen, reached = longer, score(longer)
    return {"verdict": "explained" if chosen else "nothing_found", "causes": library.causes(chosen)}
