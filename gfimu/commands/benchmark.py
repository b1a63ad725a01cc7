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

from gfimu.base.errors import InputError, unknown_name
from gfimu.base.files.outputs import OutputFile, OutputFolder
from gfimu.base.optional_packages import require
from gfimu.commands.shell.declare import Option, command
from gfimu.commands.shell.options import DATA, LIMIT, SETS, SPLIT, WORKERS

if TYPE_CHECKING:
    from gfimu.commands.benchmark_results import BenchmarkList, BenchmarkRun, BenchmarkWorlds
    from sim.trials.benchmark.answer import Answer
    from sim.trials.benchmark.judged import Judged
    from sim.trials.benchmark.table import Judgement

__all__ = ["benchmark_list", "judge", "methods", "run", "table", "worlds"]

OWN = "gfimu"
"""Name of the project's own method."""

_OWN_METHOD = "gfimu.commands.benchmark_engine:answer"
_DRAWN = ("own", "independent", "unlisted", "dcmotor")
_ANSWERS = "answers.jsonl"
_SCHEMA = "answer.schema.json"
_LINES = OutputFile("a file of judged answers", (".jsonl", ".xz"))
_PROGRESS = Option("Called with the number of worlds that are done and of all.", shell=False)


def methods() -> dict[str, str]:
    """Return the methods that come with the benchmark: name, and the function behind it."""
    from sim.trials.benchmark.baselines import BASELINES

    return {OWN: _OWN_METHOD, **BASELINES}


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
    from gfimu.commands.benchmark_results import BenchmarkList
    from sim.trials.benchmark.release import RELEASE, SETS, release_hash

    return BenchmarkList(RELEASE, release_hash(), tuple(SETS.values()), tuple(methods()))


def _written_worlds(folders: list[Path], given: Any) -> "BenchmarkWorlds":
    from gfimu.commands.benchmark_results import BenchmarkWorlds

    return BenchmarkWorlds(tuple(str(folder.relative_to(given["out"])) for folder in folders))


@command(
    "benchmark worlds",
    report=_written_worlds,
    files=lambda _, given: {"worlds": given["out"], "schema": given["out"] / _SCHEMA},
    doing="worlds",
)
def worlds(
    out: Annotated[
        str | Path,
        Option(
            "Folder to write: a folder per world, such as own/dev/007, and the schema of answers.",
            "FOLDER",
            kind=Path,
            writes=OutputFolder((_SCHEMA,)),
        ),
    ],
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
    import json

    from gfimu.base.files.atomic_file import write_text

    require("gfimu benchmark", "mujoco")
    from sim.trials.benchmark.answer import answer_schema
    from sim.trials.benchmark.release import cases
    from sim.trials.benchmark.truth_file import task_of

    listed = [case.world for name in _chosen(sets) for case in cases(name, split)[:limit]]
    folders = []
    for number, world in enumerate(listed, start=1):
        task, folder = task_of(world), Path(out) / world
        folder.mkdir(parents=True, exist_ok=True)
        task.recording.write(folder / f"recording.{file_type}")
        write_text(folder / "twin.toml", task.twin.to_toml())
        folders.append(folder)
        if progress is not None:
            progress(number, len(listed))
    Path(out).mkdir(exist_ok=True)
    write_text(Path(out) / _SCHEMA, json.dumps(answer_schema(), indent=2) + "\n")
    return folders


@command(
    "benchmark run",
    files=lambda run, _: {"answers": run.answers},
    doing=lambda given: f"benchmark {given['method']}",
    continues=True,
)
def run(
    method: Annotated[
        str, Option("FILE.py:function, or a method that comes with the benchmark.", "METHOD", argument=True)
    ],
    *,
    out: Annotated[
        str | Path,
        Option(
            "Folder to write; one that was begun is continued.",
            "FOLDER",
            kind=Path,
            writes=OutputFolder(("plan.toml", _ANSWERS)),
        ),
    ],
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
    from gfimu.commands.benchmark_results import BenchmarkRun
    from sim.trials.benchmark.answer import write_answers
    from sim.trials.benchmark.methods import answers_of, benchmark_plan, benchmark_work, load_method
    from sim.trials.sweep.dataset import Dataset
    from sim.trials.sweep.engine import run_campaign
    from sim.trials.sweep.executors import open_workers, processors

    for option, value in (("--workers", workers), ("--limit", limit)):
        if value is not None and value < 1:
            raise InputError(f"{option} {value}: must be at least 1")
    reference = _reference(method)
    load_method(reference)  # one that is not there is reported before anything is written
    dataset = Dataset.create(out, benchmark_plan(reference, _chosen(sets), split, limit, _folder(data)))
    work = functools.partial(open_workers, workers or processors())
    run_campaign(dataset, benchmark_work, work, progress=progress)
    called = name or (method if ".py:" not in method else f"{Path(method.rpartition(':')[0]).stem}")
    answers = answers_of(dataset, called)
    path = dataset.folder / _ANSWERS
    write_answers(answers, path)
    failed = sum(answer.verdict == "error" for answer in answers)
    return BenchmarkRun(dataset.folder, path, called, len(answers), failed)


@command("benchmark judge")
def judge(
    answers: Annotated[
        str | Path | Sequence[str | Path],
        Option(
            "Answers (.jsonl, .jsonl.xz), or folders of runs.",
            "ANSWERS...",
            kind=list[Path],
            argument=True,
            reads=True,
        ),
    ],
    *,
    out: Annotated[
        str | Path | None,
        Option("File to write: judged answers (.jsonl or .jsonl.xz).", "FILE", kind=Path, writes=_LINES, what="judged"),
    ] = None,
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
    from sim.trials.benchmark.judge import judge as judge_answers
    from sim.trials.benchmark.judged_file import write_judged
    from sim.trials.benchmark.table import Judgement

    judged: list[Judged] = []
    for file in [answers] if isinstance(answers, str | Path) else answers:
        path = Path(file)
        complete = _complete(path / _ANSWERS if path.is_dir() else path, partial=partial)
        judged += judge_answers(complete, _folder(data))
    if out is not None:
        write_judged(judged, out)
    return Judgement(tuple(judged))


@command("benchmark table")
def table(
    results: Annotated[
        str | Path | Sequence[str | Path],
        Option("Judged answers, as judge --out writes them.", "RESULTS...", kind=list[Path], argument=True, reads=True),
    ],
) -> "Judgement":
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


def _complete(path: Path, *, partial: bool) -> "list[Answer]":
    """Return the answers of a file, with an error for each world of its sets and splits that it lacks."""
    from sim.trials.benchmark.answer import Answer, read_answers
    from sim.trials.benchmark.release import cases, find_case

    found = read_answers(path)
    given: dict[tuple[str, str], Answer] = {}
    for answer in found:
        if (answer.method, answer.world) in given:
            raise InputError(f"{path}: two answers for {answer.world} by method {answer.method!r}; give one")
        given[answer.method, answer.world] = answer
    if partial:
        return found
    groups = {(one.method, case.set_name, case.split) for one in found for case in [find_case(one.world)]}
    return found + [
        Answer(case.world, "error", method=method, error="no answer")
        for method, name, split in sorted(groups)
        for case in cases(name, split)
        if (method, case.world) not in given
    ]


def _reference(method: str) -> str:
    """Return a method as the workers load it: the path of a file in full."""
    if method in methods():
        return methods()[method]
    file, colon, function = method.rpartition(":")
    if not colon or not file.endswith(".py"):
        raise unknown_name("method", method, methods())
    return f"{Path(file).resolve()}:{function}"


def _folder(data: str | Path | None) -> str:
    return "" if data is None else str(Path(data).resolve())


def _chosen(sets: Sequence[str]) -> list[str]:
    from sim.trials.benchmark.release import SETS

    for name in sets:
        if name not in SETS:
            raise unknown_name("set", name, SETS)
    return list(dict.fromkeys(sets)) or list(_DRAWN)
