"""What the functions of `gfimu benchmark` return."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sim.benchmark.judge import Judged
    from sim.benchmark.table import Summary

__all__ = ["BenchmarkList", "BenchmarkRun", "Judgement"]


@dataclass(frozen=True)
class BenchmarkList:
    """What the benchmark holds.

    Parameters
    ----------
    release : str
        Name of the release.
    digest : str
        Hash of its truth, which holds the hash of each recording.
    sets : tuple of dict
        ``name``, ``about``, ``licence``, and the number of worlds ``dev`` and ``test``.
    methods : tuple of str
        Methods that come with it.
    """

    release: str
    digest: str
    sets: tuple[dict[str, Any], ...]
    methods: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return the content for JSON."""
        return {**vars(self), "sets": list(self.sets), "methods": list(self.methods)}


@dataclass(frozen=True)
class BenchmarkRun:
    """A run of a method.

    Parameters
    ----------
    folder, answers : Path
        Folder of the run, and its answers (``answers.jsonl``), one line per world.
    method : str
        Name of the method.
    worlds, failed : int
        Worlds that were answered, and those in which the method failed.
    """

    folder: Path
    answers: Path
    method: str
    worlds: int
    failed: int

    def to_dict(self) -> dict[str, Any]:
        """Return the content for JSON."""
        kept = {name: getattr(self, name) for name in ("method", "worlds", "failed")}
        return {"folder": str(self.folder), **kept, "files": {"answers": str(self.answers)}}


@dataclass(frozen=True)
class Judgement:
    """Judged answers.

    Parameters
    ----------
    judged : tuple of Judged
        One per world and method.
    summaries : tuple of Summary
        Per set and method.
    """

    judged: tuple[Judged, ...]
    summaries: tuple[Summary, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return the content for JSON."""
        return {
            "summaries": [one.to_dict() for one in self.summaries],
            "judged": [one.to_dict() for one in self.judged],
        }
