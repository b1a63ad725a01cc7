"""Measure how well a method names what a simulation gets wrong: fixed worlds, a judge, baselines.

A method is a Python function, or a program in any language that reads the worlds as files and writes its answers as
lines of JSON.

Examples
--------
gfimu benchmark run greedy_bic --out greedy --sets own --limit 2
gfimu benchmark judge greedy --out greedy.jsonl
gfimu benchmark table greedy.jsonl
"""

import functools
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from gfimu.base.errors import InputError
from gfimu.base.files.outputs import OutputFile, OutputFolder
from gfimu.base.optional_packages import require
from gfimu.commands.shell.declare import Option, command
from gfimu.commands.shell.options import DATA, LIMIT, SETS, SPLIT, WORKERS, file_argument

if TYPE_CHECKING:
    from sim.trials.benchmark.results import BenchmarkList, BenchmarkRun, BenchmarkWorlds
    from sim.trials.benchmark.table import Judgement

__all__ = ["benchmark_list", "judge", "run", "table", "worlds"]

OWN = "gfimu"
"""Name of the project's own method."""

_ANSWERS = "answers.jsonl"
_SCHEMA = "answer.schema.json"
_PROGRESS = Option("Called with the number of worlds that are done and of all.", shell=False)
_WORLDS = Option(
    "Folder to write: a folder per world, such as own/dev/007, and the schema of answers.", "FOLDER",
    writes=OutputFolder((_SCHEMA,)),
)  # fmt: skip
_METHOD = Option("FILE.py:function, or a method that comes with the benchmark.", "METHOD", argument=True)
_RUN = Option(
    "Folder to write; one that was begun is continued.", "FOLDER", writes=OutputFolder(("plan.toml", _ANSWERS))
)
_GIVEN = file_argument("Answers (.jsonl, .jsonl.xz), or folders of runs.", "ANSWERS...", list[Path])
_LINES = OutputFile("a file of judged answers", (".jsonl", ".xz"))
_JUDGED = Option("File to write: judged answers (.jsonl or .jsonl.xz).", "FILE", writes=_LINES, what="judged")
_RESULTS = file_argument("Judged answers, as judge --out writes them.", "RESULTS...", list[Path])


@command("benchmark list")
def benchmark_list() -> "BenchmarkList":
    """List the sets of the benchmark, their sizes and licences, and the methods that come with it.

    Writes nothing.

    Examples
    --------
    >>> import gfimu
    >>> found = gfimu.benchmark_list()
    >>> [one.name for one in found.sets]
    ['own', 'independent', 'unlisted', 'dcmotor', 'real']

    Shell
    -----
    gfimu benchmark list
    # Hash of the release, sets and methods for a program
    gfimu benchmark list --json
    """
    from sim.trials.benchmark.baselines import BASELINES
    from sim.trials.benchmark.release import RELEASE, SETS, release_hash
    from sim.trials.benchmark.results import BenchmarkList

    return BenchmarkList(RELEASE, release_hash(), tuple(SETS.values()), (OWN, *BASELINES))


def _written_worlds(folders: list[Path], given: Any) -> "BenchmarkWorlds":
    from sim.trials.benchmark.results import BenchmarkWorlds

    return BenchmarkWorlds(tuple(str(folder.relative_to(given["out"])) for folder in folders))


@command(
    "benchmark worlds",
    report=_written_worlds,
    files=lambda _, given: {"worlds": given["out"], "schema": given["out"] / _SCHEMA},
    doing="worlds",
)
def worlds(
    out: Annotated[str | Path, _WORLDS],
    *,
    sets: Annotated[Sequence[str], SETS] = (),
    split: Annotated[Literal["dev", "test"], SPLIT] = "dev",
    limit: Annotated[int | None, LIMIT] = None,
    file_type: Annotated[Literal["parquet", "csv"], Option("Type of the recordings.", "TYPE")] = "parquet",
    progress: Annotated[Callable[[int, int], None] | None, _PROGRESS] = None,
) -> list[Path]:
    """Write worlds as plain files, for a method in any language: a recording and a twin each, no truth.

    Returns
    -------
    list of Path
        Folders of the worlds.

    Raises
    ------
    InputError
        If there is no such set, split or format.

    Shell
    -----
    gfimu benchmark worlds --out worlds
    # A few, as text
    gfimu benchmark worlds --out worlds --sets own --limit 5 --file-type csv
    """
    require("gfimu benchmark", "mujoco")
    from sim.trials.benchmark.release import chosen_cases
    from sim.trials.benchmark.truth_file import write_tasks

    return write_tasks([case.world for case in chosen_cases(sets, split, limit)], out, file_type, progress)


@command(
    "benchmark run",
    files=lambda run, _: {"answers": run.answers},
    doing=lambda given: f"benchmark {given['method']}",
    continues=True,
)
def run(
    method: Annotated[str, _METHOD],
    *,
    out: Annotated[str | Path, _RUN],
    sets: Annotated[Sequence[str], SETS] = (),
    split: Annotated[Literal["dev", "test"], SPLIT] = "dev",
    limit: Annotated[int | None, LIMIT] = None,
    name: Annotated[str, Option("Name in tables; that of the file by default.", "NAME")] = "",
    workers: Annotated[int | None, WORKERS] = None,
    data: Annotated[str | Path | None, DATA] = None,
    progress: Annotated[Callable[[int, int], None] | None, _PROGRESS] = None,
) -> "BenchmarkRun":
    """Run a method over worlds; a second call goes on where one ended.

    After Ctrl-C the finished worlds stay; the same command goes on with the others.

    Raises
    ------
    InputError
        If the method, a set or the split is not there, or the folder holds another run.

    Notes
    -----
    The function takes a `sim.trials.benchmark.world.Task` and returns an answer.

    Shell
    -----
    # A method of one's own, on the worlds to develop on
    gfimu benchmark run my_method.py:answer --out mine
    # A baseline, on a few worlds
    gfimu benchmark run greedy_bic --out greedy --sets own --limit 10
    """
    require("gfimu benchmark", "mujoco")
    from gfimu.commands.benchmark_engine import answer
    from sim.trials.benchmark.answer import write_answers
    from sim.trials.benchmark.methods import BASELINE_METHODS, answers_of, benchmark_plan, benchmark_work, named_method
    from sim.trials.benchmark.results import BenchmarkRun
    from sim.trials.sweep.dataset import Dataset
    from sim.trials.sweep.engine import run_campaign
    from sim.trials.sweep.executors import open_workers, processors

    if workers is not None and workers < 1:
        raise InputError(f"--workers {workers}: must be at least 1")
    reference, own = named_method(method, {OWN: answer, **BASELINE_METHODS})  # before anything is written
    dataset = Dataset.create(out, benchmark_plan(reference, sets, split, limit, _folder(data)))
    work = functools.partial(benchmark_work, own=own)
    run_campaign(dataset, work, functools.partial(open_workers, workers or processors()), progress=progress)
    called = name or (Path(method.rpartition(":")[0]).stem if ".py:" in method else method)
    answers = answers_of(dataset, called)
    path = dataset.folder / _ANSWERS
    write_answers(answers, path)
    failed = sum(answer.verdict == "error" for answer in answers)
    return BenchmarkRun(dataset.folder, path, called, len(answers), failed)


@command("benchmark judge")
def judge(
    answers: Annotated[str | Path | Sequence[str | Path], _GIVEN],
    *,
    out: Annotated[str | Path | None, _JUDGED] = None,
    partial: Annotated[bool, Option("Leave out worlds without an answer, instead of counting them as errors.")] = False,
    data: Annotated[str | Path | None, DATA] = None,
) -> "Judgement":
    """Judge answers by the truth: right, in a set, unknown, missed, wrong; sizes, prediction, time.

    Raises
    ------
    InputError
        If a file is wrong, a world is not of the release, or has two answers by one method.

    Shell
    -----
    gfimu benchmark judge mine --out mine.jsonl
    # Answers of a program in another language, to some worlds of the split
    gfimu benchmark judge answers.jsonl --partial
    """
    require("gfimu benchmark", "mujoco")
    from sim.trials.benchmark.answer import read_answers
    from sim.trials.benchmark.judge import judge as judge_answers
    from sim.trials.benchmark.judged_file import write_judged
    from sim.trials.benchmark.table import Judgement

    files = [Path(file) for file in ([answers] if isinstance(answers, str | Path) else answers)]
    read = (read_answers(file / _ANSWERS if file.is_dir() else file, complete=not partial) for file in files)
    judged = [verdict for one in read for verdict in judge_answers(one, _folder(data))]
    if out is not None:
        write_judged(judged, out)
    return Judgement(tuple(judged))


@command("benchmark table")
def table(results: Annotated[str | Path | Sequence[str | Path], _RESULTS]) -> "Judgement":
    """Summarise judged answers of one or several methods, with 95 % intervals: shares, points, calibration.

    Writes nothing.

    Raises
    ------
    InputError
        If a file is wrong.
    MissingPackageError
        If MuJoCo is not installed.

    Shell
    -----
    gfimu benchmark table mine.jsonl greedy.jsonl
    # One method, for a program
    gfimu benchmark table mine.jsonl --json
    """
    require("gfimu benchmark", "mujoco")
    from sim.trials.benchmark.judged_file import read_judged
    from sim.trials.benchmark.table import Judgement

    files = [results] if isinstance(results, str | Path) else results
    return Judgement(tuple(judged for file in files for judged in read_judged(file)))


def _folder(data: str | Path | None) -> str:
    return "" if data is None else str(Path(data).resolve())
