"""Always ``unknown``: the mark below which naming is worse than silence."""

from __future__ import annotations

from typing import Any

from sim.trials.benchmark.world import Task

__all__ = ["answer"]


def answer(task: Task) -> dict[str, Any]:
    """Say that something unknown is there, whatever was measured."""
    del task
    return {"verdict": "unknown"}
