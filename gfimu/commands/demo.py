"""Run the paper's experiment in simulation: geometry, recording, estimate, drift, picture, diagnosis.

Writes a folder with the recording, the estimate, pictures, a rerun recording and the diagnosis with its report. It
takes about a minute.

Examples
--------
gfimu demo
# Another draw of the noise, in a folder of your own
gfimu demo --out demo --seed 2
"""

import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from gfimu.base.files.outputs import OutputFolder, check_outputs
from gfimu.base.optional_packages import require
from gfimu.commands.diagnose import FOLDER as DIAGNOSIS
from gfimu.commands.shell.declare import Option, command
from gfimu.commands.shell.options import SEED

if TYPE_CHECKING:
    from gfimu.commands.demo_steps import DemoResult

__all__ = ["FOLDER", "demo"]

FOLDER = OutputFolder(("run.parquet", "estimate.parquet", "calibration.json", "run.rrd", "hidden.parquet"))
"""What the folder of the demo holds, beside the folder ``diagnosis``."""

_OUT = Option("Folder to write; made where it is not there.", "DIR", writes=FOLDER)
_REPORT = Option("Called before each step with its number from 1, how many there are, and what it does.", shell=False)


def _run(given: Mapping[str, Any], as_json: bool) -> None:
    from gfimu.commands.shell.output import print_json, print_text
    from gfimu.commands.shell.printing import print_blocks

    began = time.perf_counter()
    watched = sys.stderr.isatty()

    def report(number: int, total: int, what: str) -> None:
        if watched:
            print_text(f"{number}/{total} {what}", style="dim", stderr=True)

    result = demo(**given, report=report)
    if watched:
        print_text(f"done in {time.perf_counter() - began:.0f} s", style="dim", stderr=True)
    if as_json:
        print_json(result.to_dict())
    else:
        print_blocks(result.shown())


@command(run=_run)
def demo(
    out: Annotated[str | Path, _OUT] = "gfimu-demo",
    *,
    seed: Annotated[int, SEED] = 1,
    report: Annotated[Callable[[int, int, str], None] | None, _REPORT] = None,
) -> "DemoResult":
    """Run the paper's experiment in simulation: geometry, recording, estimate, drift, picture, diagnosis.

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
    from gfimu.commands.demo_steps import STEPS, Demo, DemoResult

    folder = Path(out)
    check_outputs([("out", folder, FOLDER)])  # the default too
    if folder.is_dir():
        check_outputs([("out", folder / "diagnosis", DIAGNOSIS)])
    folder.mkdir(exist_ok=True)
    done = Demo(folder, seed)
    for number, step in enumerate(STEPS, start=1):
        if report is not None:
            report(number, len(STEPS), (step.__doc__ or step.__name__).splitlines()[0].rstrip("."))
        done.rows.extend(step(done))
    return DemoResult(seed, tuple(done.rows), done.written)
