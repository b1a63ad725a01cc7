"""The oracle: it is given names and shapes and fits the sizes; no method that has to find them can do better.

It reads the truth of the release, as any program could: a published benchmark rests on the good faith of its users.
"""

from __future__ import annotations

from typing import Any

from sim.effects import EFFECTS, make_effect
from sim.trials.benchmark.library import fitted_sizes
from sim.trials.benchmark.truth_file import fixed_world
from sim.trials.benchmark.world import Task

__all__ = ["answer"]


def answer(task: Task) -> dict[str, Any]:
    """Name what is hidden, with sizes by least squares, the motion free, started at the true ones."""
    truth = fixed_world(task.world).truth
    if not truth.hidden or truth.place == "nothing":
        return {"verdict": "nothing_found"}
    if any(name not in EFFECTS for name, _ in truth.hidden):
        return {"verdict": "explained", "causes": [{"effect": "unlisted", "place": truth.place}]}
    effects = [make_effect(name, parameters) for name, parameters in truth.hidden]
    return {"verdict": "explained", "causes": fitted_sizes(task.recording, task.twin, effects)}
