"""What the functions of `gfimu benchmark` return: the sets, a run of a method, judged answers."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gfimu.results import Panel, PlottedResult, Series, TableResult, one_row, text_column

if TYPE_CHECKING:
    from sim.benchmark.judge import Judged
    from sim.benchmark.table import Summary

__all__ = ["BenchmarkList", "BenchmarkRun", "Judgement"]


@dataclass(frozen=True)
class BenchmarkList(TableResult):
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

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per set: name, worlds of each split, what it is, licence."""
        texts = {key: text_column(one[key] for one in self.sets) for key in ("name", "about", "licence")}
        counts = {key: np.array([one[key] for one in self.sets], dtype=int) for key in ("dev", "test")}
        return {"name": texts.pop("name"), **counts, **texts}

    def _heading(self) -> str:
        return f"Benchmark {self.release}"

    def _facts(self) -> list[tuple[str, str]]:
        return [("hash of the truth", self.digest), ("methods", ", ".join(self.methods))]

    def to_dict(self) -> dict[str, Any]:
        """Return the content for JSON."""
        return {**vars(self), "sets": list(self.sets), "methods": list(self.methods)}


@dataclass(frozen=True)
class BenchmarkRun(TableResult):
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

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row: method, counts of worlds, folder and file."""
        return one_row({name: getattr(self, name) for name in ("method", "worlds", "failed", "folder", "answers")})

    def _heading(self) -> str:
        return "Run of a method"

    def to_dict(self) -> dict[str, Any]:
        """Return the content for JSON."""
        kept = {name: getattr(self, name) for name in ("method", "worlds", "failed")}
        return {"folder": str(self.folder), **kept, "files": {"answers": str(self.answers)}}


@dataclass(frozen=True)
class Judgement(PlottedResult):
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

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per set and method: mean points with standard deviation, shares, median removal and time."""
        found = self.summaries
        names = {"set": text_column(one.set_name for one in found), "method": text_column(one.method for one in found)}
        numbers = [
            {
                "points": one.points[0],
                "points_std": one.points_std,
                **{f"{name}_share": share.value for name, share in one.shares.items()},
                "removed_median_share": one.removed[0],
                "processor_median_s": one.processor_s,
            }
            for one in found
        ]
        worlds = np.array([len(one.judged) for one in found], dtype=int)
        keys = numbers[0] if numbers else {}
        return {**names, "worlds": worlds, **{key: np.array([row[key] for row in numbers]) for key in keys}}

    def _heading(self) -> str:
        return "Judged answers"

    def _shown(self) -> dict[str, NDArray[Any]]:
        from sim.benchmark.table import COLUMNS

        rows = [one.row() for one in self.summaries]
        return {name: text_column(row[place] for row in rows) for place, name in enumerate(COLUMNS)}

    def _notes(self) -> tuple[str, ...]:
        from sim.benchmark.table import POINTS_NOTE

        return (POINTS_NOTE, "intervals: 95 %")

    def _panels(self) -> list[Panel]:
        sets = tuple(dict.fromkeys(one.set_name for one in self.summaries))
        series = []
        for method in dict.fromkeys(one.method for one in self.summaries):
            by_set = {one.set_name: (one.points[0], one.points_std) for one in self.summaries if one.method == method}
            mean, std = np.array([by_set.get(name, (np.nan, np.nan)) for name in sets]).T
            series.append(Series(method, mean, std))
        return [Panel("mean points of each method", "points", tuple(series), sets)]

    def to_dict(self) -> dict[str, Any]:
        """Return the content for JSON."""
        return {
            "summaries": [one.to_dict() for one in self.summaries],
            "judged": [one.to_dict() for one in self.judged],
        }
