"""What the functions of `gfimu benchmark` return: the sets, worlds, a run of a method."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from numpy.typing import NDArray

from gfimu.base.declared import Declared, Table, figure, table
from gfimu.base.results import TableResult, columns_of, one_row
from sim.trials.benchmark.release import SetInfo

__all__ = ["BenchmarkList", "BenchmarkRun", "BenchmarkWorlds"]


@dataclass(frozen=True)
class BenchmarkList(Declared, TableResult):
    """What the benchmark holds."""

    release: Annotated[str, figure("Name of the release.")]
    digest: Annotated[
        str, figure("Hash of its truth, which holds the hash of each recording.", head="hash of the truth")
    ]
    sets: Annotated[tuple[SetInfo, ...], figure("Sets of worlds.")]
    methods: Annotated[tuple[str, ...], figure("Methods that come with it.", head="methods")]

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per set: name, worlds of each split, what it is, licence."""
        return columns_of(self.sets, "name dev test about licence")

    def shown(self) -> Iterator[Table | str]:
        """Yield the table and the sentence that people read."""
        yield table(f"{self.release}, hash {self.digest}", self.sets, "name about licence dev test", left=3)
        yield f"methods: {', '.join(self.methods)}, or FILE.py:function"

    def _heading(self) -> str:
        return f"Benchmark {self.release}"


@dataclass(frozen=True)
class BenchmarkWorlds(Declared):
    """Worlds that were written."""

    worlds: Annotated[tuple[str, ...], figure("Their folders, below that of all.")]

    def shown(self) -> Iterator[str]:
        """Yield how many there are."""
        yield f"{len(self.worlds)} worlds"


@dataclass(frozen=True)
class BenchmarkRun(Declared, TableResult):
    """A run of a method.

    Parameters
    ----------
    answers : Path
        Its answers (``answers.jsonl``), one line per world.
    """

    folder: Annotated[Path, figure("Its folder.")]
    answers: Path
    method: Annotated[str, figure("Name of the method in tables.")]
    worlds: Annotated[int, figure("Worlds that were answered.")]
    failed: Annotated[int, figure("Worlds in which the method failed.")]

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row: method, counts of worlds, folder and file."""
        return one_row({name: getattr(self, name) for name in ("method", "worlds", "failed", "folder", "answers")})

    def shown(self) -> Iterator[str]:
        """Yield how many worlds were answered."""
        failed = f", the method failed in {self.failed}" if self.failed else ""
        yield f"{self.method}: {self.worlds} worlds{failed}"

    def _heading(self) -> str:
        return "Run of a method"
