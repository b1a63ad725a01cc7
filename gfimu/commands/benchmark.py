"""Functions of `gfimu benchmark`: the benchmark of naming what a simulation gets wrong, from worlds to table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from gfimu.commands.benchmark_results import BenchmarkList, BenchmarkRun, Judgement
from gfimu.errors import InputError, unknown_name
from gfimu.files.outputs import OutputFile, OutputFolder, writes
from gfimu.optional_packages import require

if TYPE_CHECKING:
    from sim.benchmark.answer import Answer
    from sim.benchmark.judge import Judged

__all__ = ["BenchmarkList", "BenchmarkRun", "Judgement", "benchmark_list", "judge", "methods", "run", "table", "worlds"]

OWN = "gfimu"
"""Name of the project's own method."""

_OWN_METHOD = "gfimu.commands.benchmark_engine:answer"
_DRAWN = ("own", "independent", "unlisted", "dcmotor")
_ANSWERS = "answers.jsonl"
_SCHEMA = "answer.schema.json"
_LINES = OutputFile("a file of judged answers", (".jsonl", ".xz"))


def methods() -> dict[str, str]:
    """Return the methods that come with the benchmark: name, and the function behind it."""
    from sim.benchmark.baselines import BASELINES

    return {OWN: _OWN_METHOD, **BASELINES}


def benchmark_list() -> BenchmarkList:
    """List the sets of the benchmark, their sizes and licences, and the methods that come with it.

    Examples
    --------
    >>> import gfimu
    >>> found = gfimu.benchmark_list()
    >>> [one["name"] for one in found.sets]
    ['own', 'independent', 'unlisted', 'dcmotor', 'real']
    """
    from sim.benchmark.release import RELEASE, SETS, SPLITS, cases, release_hash

    sets = tuple(
        {"name": one.name, "about": one.about, "licence": one.licence}
        | {split: len(cases(one.name, split)) for split in SPLITS}
        for one in SETS.values()
    )
    return BenchmarkList(RELEASE, release_hash(), sets, tuple(methods()))


@writes(out=OutputFolder((_SCHEMA,)))
def worlds(
    out: str | Path,
    *,
    sets: Sequence[str] = (),
    split: str = "dev",
    limit: int | None = None,
    file_type: Literal["parquet", "csv"] = "parquet",
    progress: Callable[[int, int], None] | None = None,
) -> list[Path]:
    """Write worlds as plain files, for a method in any language: a recording and a twin each, no truth.

    Parameters
    ----------
    out : str or Path
        Folder; each world becomes a folder in it, such as ``own/dev/007``. The schema of answers stands beside them.
    sets : sequence of str
        Sets; by default all that are drawn.
    split : {"dev", "test"}
        Which worlds.
    limit : int, optional
        Only so many worlds of each set; they stand in a fixed random order.
    file_type : {"parquet", "csv"}
        Format of the recordings.
    progress : callable, optional
        Called with the number of worlds that are written and of all.

    Returns
    -------
    list of Path
        Folders of the worlds.

    Raises
    ------
    InputError
        If there is no such set, split or format.
    """
    import json

    from gfimu.files.atomic_file import write_text

    require("gfimu benchmark", "mujoco")
    from sim.benchmark.answer import answer_schema
    from sim.benchmark.release import cases
    from sim.benchmark.truth_file import task_of

    if file_type not in ("parquet", "csv"):
        raise unknown_name("file type", file_type, ("parquet", "csv"))
    listed = [case.world for name in _chosen(sets) for case in cases(name, split)[:limit]]
    report = progress or (lambda done, total: None)
    folders = []
    for number, world in enumerate(listed):
        task, folder = task_of(world), Path(out) / world
        folder.mkdir(parents=True, exist_ok=True)
        task.recording.write(folder / f"recording.{file_type}")
        write_text(folder / "twin.toml", task.twin.to_toml())
        folders.append(folder)
        report(number + 1, len(listed))
    Path(out).mkdir(exist_ok=True)
    write_text(Path(out) / _SCHEMA, json.dumps(answer_schema(), indent=2) + "\n")
    return folders


@writes(reads=("data",), out=OutputFolder(("plan.toml", _ANSWERS)))
def run(
    method: str,
    *,
    out: str | Path,
    sets: Sequence[str] = (),
    split: str = "dev",
    limit: int | None = None,
    name: str = "",
    workers: int | None = None,
    data: str | Path | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> BenchmarkRun:
    """Run a method over worlds; a second call goes on where one ended.

    Parameters
    ----------
    method : str
        ``FILE.py:function``, or the name of one that comes with the benchmark (`benchmark_list`). The function takes a
        `sim.benchmark.world.Task` and returns an answer.
    out : str or Path
        Folder of the run; ``answers.jsonl`` in it holds the answers.
    sets : sequence of str
        Sets; by default all that are drawn.
    split : {"dev", "test"}
        Which worlds. Develop on ``dev``; run ``test`` once.
    limit : int, optional
        Only so many worlds of each set.
    name : str
        Name of the method in tables; by default that of its file and function.
    workers : int, optional
        Worker processes; by default as many as this process has processors.
    data : str or Path, optional
        Folder of the measured data, which the set ``real`` needs.
    progress : callable, optional
        Called with the number of worlds that are done and of all.

    Raises
    ------
    InputError
        If the method, a set or the split is not there, or the folder holds another run.
    """
    require("gfimu benchmark", "mujoco")
    from sim.benchmark.answer import write_answers
    from sim.benchmark.methods import answers_of, benchmark_plan, benchmark_work, load_method
    from sim.sweep.dataset import Dataset
    from sim.sweep.engine import run_campaign
    from sim.sweep.executors import open_workers, processors

    for option, value in (("--workers", workers), ("--limit", limit)):
        if value is not None and value < 1:
            raise InputError(f"{option} {value}: must be at least 1")
    reference = _reference(method)
    load_method(reference)  # one that is not there is reported before anything is written
    dataset = Dataset.create(out, benchmark_plan(reference, _chosen(sets), split, limit, _folder(data)))
    run_campaign(dataset, benchmark_work, partial(open_workers, workers or processors()), progress=progress)
    called = name or (method if ".py:" not in method else f"{Path(method.rpartition(':')[0]).stem}")
    answers = answers_of(dataset, called)
    path = dataset.folder / _ANSWERS
    write_answers(answers, path)
    return BenchmarkRun(
        dataset.folder, path, called, len(answers), sum(answer.verdict == "error" for answer in answers)
    )


@writes(reads=("answers", "data"), out=_LINES)
def judge(
    answers: str | Path | Sequence[str | Path],
    *,
    out: str | Path | None = None,
    partial: bool = False,
    data: str | Path | None = None,
) -> Judgement:
    """Judge answers by the truth of the release.

    Parameters
    ----------
    answers : path or sequence of paths
        Lines of JSON, one answer each (schema: ``answer.schema.json`` of `worlds`), or folders of runs.
    out : str or Path, optional
        File to write: the judged answers as lines of JSON, packed where the name ends in ``.xz``.
    partial : bool
        Whether the worlds of a set that a file lacks are left out; otherwise each of them counts as an error.
    data : str or Path, optional
        Folder of the measured data, for answers to worlds of the set ``real``.

    Raises
    ------
    InputError
        If a file is wrong, a world is not of the release, or has two answers by one method.
    """
    require("gfimu benchmark", "mujoco")
    from sim.benchmark.judge import judge as judge_answers
    from sim.benchmark.judged_file import write_judged
    from sim.benchmark.table import summaries

    judged: list[Judged] = []
    for file in [answers] if isinstance(answers, str | Path) else answers:
        path = Path(file)
        complete = _complete(path / _ANSWERS if path.is_dir() else path, partial=partial)
        judged += judge_answers(complete, _folder(data))
    if out is not None:
        write_judged(judged, out)
    return Judgement(tuple(judged), tuple(summaries(judged)))


@writes(reads=("results",))
def table(results: str | Path | Sequence[str | Path]) -> Judgement:
    """Summarise judged answers of one or several methods: shares with 95 % intervals, points, calibration.

    Parameters
    ----------
    results : path or sequence of paths
        Files of judged answers, as `judge` writes them.

    Raises
    ------
    InputError
        If a file is wrong.
    MissingPackageError
        If MuJoCo is not installed.
    """
    require("gfimu benchmark", "mujoco")
    from sim.benchmark.judged_file import read_judged
    from sim.benchmark.table import summaries

    judged: list[Judged] = []
    for file in [results] if isinstance(results, str | Path) else results:
        judged += read_judged(file)
    return Judgement(tuple(judged), tuple(summaries(judged)))


def _complete(path: Path, *, partial: bool) -> list[Answer]:
    """Return the answers of a file, with an error for each world of its sets and splits that it lacks."""
    from sim.benchmark.answer import Answer, read_answers
    from sim.benchmark.release import cases, find_case

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
    from sim.benchmark.release import SETS

    for name in sets:
        if name not in SETS:
            raise unknown_name("set", name, SETS)
    return list(dict.fromkeys(sets)) or list(_DRAWN)
