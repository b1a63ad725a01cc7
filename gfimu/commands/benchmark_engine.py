"""gfimu's own diagnosis as a method of the benchmark: a verdict has the form of an answer already."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sim.trials.benchmark.world import Task

__all__ = ["answer"]


def answer(task: Task) -> dict[str, Any]:
    """Diagnose the recording; the expected error is that of the held-out part of the same recording."""
    from gfimu.diagnosis import diagnose

    found = diagnose([task.recording], task.twin)
    verdict = found.to_dict()
    kept = {key: verdict[key] for key in ("verdict", "causes")}
    return {**kept, "expected_rms_m_s2": found.gain.rms_after}
