"""Under `gfimu demo`: the whole job on the paper's run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from gfimu.commands.diagnose import FOLDER as DIAGNOSIS
from gfimu.files.outputs import OutputFolder, check_outputs, writes
from gfimu.optional_packages import require
from gfimu.results import TableResult, text_column

if TYPE_CHECKING:
    from gfimu.commands.demo_steps import Row

__all__ = ["DemoResult", "demo"]

FOLDER = OutputFolder(("run.parquet", "estimate.parquet", "calibration.json", "run.rrd", "hidden.parquet"))
"""What the folder of the demo holds, beside the folder ``diagnosis``."""


@dataclass(frozen=True)
class DemoResult(TableResult):
    """Results of the demo, and the files that it wrote.

    Parameters
    ----------
    seed : int
        Seed of all random numbers.
    rows : tuple of Row
        The table: questions, answers, what to compare them with.
    files : mapping of str to Path
        What was written, by its meaning.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.demo("gfimu-demo").rows  # doctest: +SKIP
    """

    seed: int
    rows: tuple[Row, ...]
    files: Mapping[str, Path]

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per question: the answer, and what to compare it with."""
        keys = {"what": "what", "result": "result", "to_compare": "beside"}
        return {name: text_column(getattr(row, key) for row in self.rows) for name, key in keys.items()}

    def _heading(self) -> str:
        return f"The paper's experiment in simulation (seed {self.seed})"

    def _notes(self) -> tuple[str, ...]:
        return tuple(f"{meaning}: {path}" for meaning, path in self.files.items())

    def to_dict(self) -> dict[str, Any]:
        """Return the content of ``gfimu demo --json``."""
        return {
            "seed": self.seed,
            "results": [{"what": row.what} | row.figures for row in self.rows],
            "files": dict(self.files),
        }


@writes(out=FOLDER)
def demo(
    out: str | Path = "gfimu-demo", *, seed: int = 1, report: Callable[[int, int, str], None] | None = None
) -> DemoResult:
    """Run the paper's experiment in simulation: geometry, recording, estimate, drift, picture, diagnosis.

    Parameters
    ----------
    out : str or Path
        Folder to write to; made if it isn't there.
    seed : int
        Seed of all random numbers.
    report : callable, optional
        Called before each step with its number from 1, how many there are, and what it does.

    Raises
    ------
    InputError
        If the folder can't be written.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.demo("gfimu-demo")  # doctest: +SKIP
    """
    require("gfimu demo", "mujoco", "rerun", "matplotlib")
    from gfimu.commands.demo_steps import STEPS, Demo

    folder = Path(out)
    check_outputs([("out", folder, FOLDER)])  # the default too
    if folder.is_dir():
        check_outputs([("out", folder / "diagnosis", DIAGNOSIS)])
    folder.mkdir(exist_ok=True)
    done = Demo(folder, seed)
    for number, step in enumerate(STEPS, start=1):
        if report is not None:
            report(number, len(STEPS), (step.__doc__ or step.__name__).splitlines()[0].rstrip("."))
        step(done)
    return DemoResult(seed, tuple(done.rows), done.written)
