"""Call gfimu's commands where only its core is installed: those that work, and those that are refused.

    python tests/core_commands.py            in an environment with the core alone (`tests/matrix.py light` makes one)
    python tests/core_commands.py --block    in any environment: imports of all optional packages fail

Ends with exit code 1 and the calls that went wrong.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib.util
import io
import os
import sys
import tempfile
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

# One entry per extra: a package whose import shows whether it is installed.
OPTIONAL = (
    "mujoco", "rerun", "matplotlib", "mpl_toolkits", "unicorn", "ziglang", "distributed", "dask_jobqueue", "pandas",
    "polars", "h5py", "mcap", "pyulog", "rosbags", "openpyxl",
)  # fmt: skip


@dataclass(frozen=True)
class Call:
    """A call of the program, its exit code, and words of its output or of its error."""

    arguments: str
    code: int = 0
    words: str = ""


def refused(arguments: str, what: str, packages: str, extras: str) -> Call:
    """Return a call that is refused, with the line that says so."""
    verb = "are" if " and " in packages else "is"
    line = f"gfimu: {what} needs {packages}, which {verb} not installed; run: pip install 'gfimu[{extras}]'"
    return Call(arguments, 2, line)


MUJOCO = ("a scenario or a MuJoCo model", "mujoco", "sim")
PICTURE = ("a picture", "matplotlib", "plot")

WORKING = (
    Call("score cube12", 0, "1.4142"),
    Call("list scenarios", 0, "paper_run"),
    Call("list effects", 0, "eccentricity"),
    Call("show paper_run", 0, "[sensor]"),
    Call("show cube12_turntable", 0, "array"),
    Call("new scenario --out scenario.toml", 0, "scenario.toml"),
    Call("drift --array cube12 --duration 0.3 --bias-mg 35 --noise-ug 290 --monte-carlo 20", 0, "Position error"),
    Call("optimize --chips 4 --restarts 1 --out found.toml", 0, "found.toml"),
    Call("inspect run.parquet", 0, "a11"),
    Call("convert run.parquet run.csv", 0, "run.csv"),
    Call("check run.parquet --twin cube12_turntable", 0, "eccentricity"),
    Call("noise rest.csv", 0, "bias"),
    Call("estimate run.csv --out estimate.parquet", 0, "estimate.parquet"),
    Call("calibrate array poses.csv --out cal.json", 0, "cal.json"),
    Call("certificate cal.json --out certificate", 0, "certificate"),
    Call("diagnose run.parquet --twin cube12_turntable --out diagnosis", 0, "eccentricity"),
    Call("campaign plan.toml --out campaign --workers 1", 0, "rad"),
    Call("list frames", 0, "packet"),
    Call("benchmark list", 0, "greedy_bic"),
)
"""Calls that need the core alone."""

REFUSED = (
    refused("demo", "gfimu demo", "mujoco, rerun-sdk and matplotlib", "sim,view,plot"),
    refused("simulate paper_run --out no.csv", *MUJOCO),
    refused("tolerance cube12 --closed-form", *MUJOCO),
    refused("benchmark worlds --out no", "gfimu benchmark", "mujoco", "sim"),
    refused("benchmark table rest.csv", "gfimu benchmark", "mujoco", "sim"),
    refused("benchmark run greedy_bic --out no", "gfimu benchmark", "mujoco", "sim"),
    refused("firmware run --out no.csv", "gfimu firmware run", "unicorn and mujoco", "firmware,sim"),
    refused("convert cube12 no.xml", "no.xml: what is converted", "mujoco", "sim"),
    refused("convert run.csv no.mcap", "no.mcap: what is converted", "mcap and rosbags", "formats"),
    refused("inspect made.xlsx", "made.xlsx: an Excel workbook", "openpyxl", "formats"),
    refused("view run.csv", "gfimu view", "rerun-sdk", "view"),
    refused("estimate run.csv --out no.csv --rrd no.rrd", "no.rrd: a rerun recording", "rerun-sdk", "view"),
    refused("record --port socket://127.0.0.1:1 --out no.csv --live", "--live", "rerun-sdk", "view"),
    refused("firmware trace --out no.rrd", "no.rrd: a trace", "rerun-sdk", "view"),
    refused("noise rest.csv --picture no.png", f"no.png: {PICTURE[0]}", *PICTURE[1:]),
    refused("calibrate array rest.csv --out no.json --picture no.svg", f"no.svg: {PICTURE[0]}", *PICTURE[1:]),
    refused("optimize --chips 4 --picture no.pdf", f"no.pdf: {PICTURE[0]}", *PICTURE[1:]),
    refused("optimize --chips 4 --pareto gdop size --front no", "no: what is written there", *PICTURE[1:]),
    refused("campaign plot campaign --out no.html", f"no.html: {PICTURE[0]}", *PICTURE[1:]),
    refused("campaign plan.toml --out no --cluster tcp://127.0.0.1:1", "a cluster", "distributed", "cluster"),
    refused("firmware build", "building the firmware", "ziglang", "firmware"),
    refused("firmware check none.elf", "the emulated board", "unicorn", "firmware"),
)
"""Calls that need an extra: refused with one line before any work."""

PLAN = 'kind = "measure"\ndesign = "grid"\nrepeats = 2\n[factors]\n"eccentricity.x_m" = [0.0, 0.001]\n'


class Blocked:
    """A finder that fails on packages as if they were not installed."""

    def find_spec(self, name: str, path: object = None, target: object = None) -> None:
        """Refuse the optional packages, and leave the others to the next finder."""
        if name.partition(".")[0] in OPTIONAL:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


def write_inputs() -> None:
    """Write the files that the calls read: a run with an eccentric cube, a rest, a plan, an empty workbook."""
    import numpy as np

    from gfimu import AccelerometerArray, Recording
    from sim.effects import make_effect
    from sim.trials import Measurement, WorldFactory
    from sim.twin import Twin

    rng = np.random.default_rng(1)
    world = WorldFactory(Twin.load("cube12_turntable"), Measurement(duration=20.0))
    world.measure(rng, [make_effect("eccentricity", {"x_m": 2e-3, "y_m": 0.0})]).write("run.parquet")
    cube = AccelerometerArray.load("cube12")
    still = cube.regression_matrix[:, 5] * 9.81 + 0.01 * rng.standard_normal((3000, cube.n_channels))
    Recording.from_arrays(np.arange(3000) / 100.0, still, cube).write("rest.csv")
    poses = np.repeat(rng.permutation(np.vstack([np.eye(3), -np.eye(3), rng.standard_normal((6, 3))])), 300, axis=0)
    poses = 9.81 * poses / np.linalg.norm(poses, axis=1, keepdims=True)
    tumbled = poses @ cube.regression_matrix[:, 3:].T + 0.01 * rng.standard_normal((len(poses), cube.n_channels))
    Recording.from_arrays(np.arange(len(poses)) / 100.0, tumbled, cube).write("poses.csv")
    Path("plan.toml").write_text(PLAN, encoding="utf-8")
    with zipfile.ZipFile("made.xlsx", "w") as book:
        book.writestr("xl/workbook.xml", "")


def call(arguments: str) -> tuple[int, str]:
    """Return the exit code of a call of the program, and all that it printed."""
    from gfimu.commands import main

    printed = io.StringIO()
    sys.argv = ["gfimu", *arguments.split()]
    with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
        try:
            main()
        except SystemExit as stop:
            return int(stop.code or 0), printed.getvalue()
    return 0, printed.getvalue()


def wrong_calls(calls: Sequence[Call]) -> list[str]:
    """Return what went wrong, a line per call."""
    wrong = []
    for one in calls:
        code, printed = call(one.arguments)
        if code != one.code or one.words not in printed:
            wrong.append(f"gfimu {one.arguments}: exit code {code}, not {one.code} with {one.words!r}:\n{printed}")
    written = [file.name for file in Path().glob("no*") if file.name != "noise"]
    return wrong + [f"{name}: written by a call that is refused" for name in written]


def main() -> None:
    """Make the calls in a folder that is removed."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--block", action="store_true", help="let imports of all optional packages fail")
    options.add_argument("--part", choices=("all", "refused"), default="all", help="which calls")
    given = options.parse_args()
    if given.block:
        sys.meta_path.insert(0, Blocked())
    elif there := [name for name in OPTIONAL if importlib.util.find_spec(name) is not None]:
        sys.exit(f"not the core alone: {', '.join(there)} installed; give --block")
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        write_inputs()
        calls = REFUSED if given.part == "refused" else (*WORKING, *REFUSED)
        wrong = wrong_calls(calls)
        os.chdir("/")
    print(*wrong, f"{len(calls)} calls, {len(wrong)} wrong", sep="\n")
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
