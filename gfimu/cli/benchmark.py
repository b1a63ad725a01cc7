"""`gfimu benchmark`: the open benchmark of naming what a simulation gets wrong: list, worlds, run, judge, table."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from gfimu.cli.command import CommandApp
from gfimu.cli.output import print_json, print_paths, print_table, print_text, progress
from gfimu.cli.shared_options import JsonOption, shared

if TYPE_CHECKING:
    from gfimu.commands.benchmark_results import Judgement

__all__ = ["register"]

SetsOption = Annotated[list[str] | None, shared("--sets")]
SplitOption = Annotated[str, shared("--split")]
LimitOption = Annotated[int | None, shared("--limit", min=1)]
DataOption = Annotated[Path | None, shared("--data")]


def register(app: typer.Typer) -> None:
    """Add the commands."""
    group = CommandApp(
        help="Measure how well a method names what a simulation gets wrong: fixed worlds, a judge, baselines.\n\n"
        "A method is a Python function, or a program in any language that reads the worlds as files and writes its "
        "answers as lines of JSON.\n\nExamples\n--------\n"
        "gfimu benchmark run greedy_bic --out greedy --sets own --limit 2\n"
        "gfimu benchmark judge greedy --out greedy.jsonl\ngfimu benchmark table greedy.jsonl",
        no_args_is_help=True,
    )
    group.command(name="list")(_list)
    group.command(name="worlds")(_worlds)
    group.command(name="run")(_run)
    group.command(name="judge")(_judge)
    group.command(name="table")(_table)
    app.add_typer(group, name="benchmark")


def _list(json: JsonOption = False) -> None:
    """List the sets of the benchmark, their sizes and licences, and the methods that come with it.

    Writes nothing.

    Examples
    --------
    gfimu benchmark list
    # Hash of the release, sets and methods for a program
    gfimu benchmark list --json
    """
    from gfimu.commands.benchmark import benchmark_list

    found = benchmark_list()
    if json:
        print_json(found.to_dict())
        return
    rows = [(one["name"], one["about"], one["licence"], str(one["dev"]), str(one["test"])) for one in found.sets]
    print_table(f"{found.release}, hash {found.digest}", ("set", "worlds", "licence", "dev", "test"), rows, left=3)
    print_text(f"methods: {', '.join(found.methods)}, or FILE.py:function")


def _worlds(
    out: Annotated[Path, typer.Option("--out", help="Folder to write: a folder per world, and the schema of answers.")],
    sets: SetsOption = None,
    split: SplitOption = "dev",
    limit: LimitOption = None,
    file_type: Annotated[
        Literal["parquet", "csv"], typer.Option("--file-type", help="Type of the recordings.")
    ] = "parquet",
    json: JsonOption = False,
) -> None:
    """Write worlds as plain files, for a method in any language: a recording and a twin each, no truth.

    Examples
    --------
    gfimu benchmark worlds --out worlds
    # A few, as text
    gfimu benchmark worlds --out worlds --sets own --limit 5 --file-type csv
    """
    from gfimu.commands.benchmark import worlds

    with progress("worlds", total=1.0) as show:
        found = worlds(
            out, sets=sets or [], split=split, limit=limit, file_type=file_type, progress=_shown("worlds", show)
        )
    if json:
        files = {"worlds": out, "schema": out / "answer.schema.json"}
        print_json({"worlds": [str(folder.relative_to(out)) for folder in found], "files": files})
        return
    print_text(f"{len(found)} worlds")
    print_paths([("worlds", out), ("schema of answers", out / "answer.schema.json")])


def _run(
    method: Annotated[
        str, typer.Argument(metavar="METHOD", help="FILE.py:function, or a method that comes with the benchmark.")
    ],
    out: Annotated[Path, typer.Option("--out", help="Folder to write; one that was begun is continued.")],
    sets: SetsOption = None,
    split: SplitOption = "dev",
    limit: LimitOption = None,
    name: Annotated[str, typer.Option("--name", help="Name in tables; that of the file by default.")] = "",
    workers: Annotated[int | None, shared("--workers")] = None,
    data: DataOption = None,
    json: JsonOption = False,
) -> None:
    """Run a method over worlds; a second call goes on where one ended.

    After Ctrl-C the finished worlds stay; the same command goes on with the others.

    Examples
    --------
    # A method of one's own, on the worlds to develop on
    gfimu benchmark run my_method.py:answer --out mine
    # A baseline, on a few worlds
    gfimu benchmark run greedy_bic --out greedy --sets own --limit 10
    """
    from gfimu.commands.benchmark import run

    title = f"benchmark {method}"
    with progress(title, total=1.0, time_left=False) as show:
        found = run(
            method,
            out=out,
            sets=sets or [],
            split=split,
            limit=limit,
            name=name,
            workers=workers,
            data=data,
            progress=_shown(title, show),
        )
    if json:
        print_json(found.to_dict())
        return
    failed = f", the method failed in {found.failed}" if found.failed else ""
    print_text(f"{found.method}: {found.worlds} worlds{failed}")
    print_paths([("answers", found.answers)])


def _judge(
    answers: Annotated[
        list[Path], typer.Argument(metavar="ANSWERS...", help="Answers (.jsonl, .jsonl.xz), or folders of runs.")
    ],
    out: Annotated[
        Path | None, typer.Option("--out", help="File to write: judged answers (.jsonl or .jsonl.xz).")
    ] = None,
    partial: Annotated[
        bool, typer.Option("--partial", help="Leave out worlds without an answer, instead of counting them as errors.")
    ] = False,
    data: DataOption = None,
    json: JsonOption = False,
) -> None:
    """Judge answers by the truth: right, in a set, unknown, missed, wrong; sizes, prediction, time.

    Examples
    --------
    gfimu benchmark judge mine --out mine.jsonl
    # Answers of a program in another language, to some worlds of the split
    gfimu benchmark judge answers.jsonl --partial
    """
    from gfimu.commands.benchmark import judge

    found = judge([*answers], out=out, partial=partial, data=data)
    if json:
        print_json(found.to_dict() | {"files": {} if out is None else {"judged": out}})
        return
    _print(found)
    if out is not None:
        print_paths([("judged answers", out)])


def _table(
    results: Annotated[
        list[Path], typer.Argument(metavar="RESULTS...", help="Judged answers, as judge --out writes them.")
    ],
    json: JsonOption = False,
) -> None:
    """Summarise judged answers of one or several methods, with 95 % intervals.

    Writes nothing.

    Examples
    --------
    gfimu benchmark table mine.jsonl greedy.jsonl
    # One method, for a program
    gfimu benchmark table mine.jsonl --json
    """
    from gfimu.commands.benchmark import table

    found = table([*results])
    if json:
        print_json(found.to_dict())
    else:
        _print(found)


def _print(found: Judgement) -> None:
    """Print a table per set, a column per method."""
    from sim.benchmark.table import COLUMNS, POINTS_NOTE

    for name in dict.fromkeys(one.set_name for one in found.summaries):
        columns = [one.row()[1:] for one in found.summaries if one.set_name == name]
        first, *rows = zip(COLUMNS[1:], *columns, strict=True)
        print_table(name, first, rows)
    print_text(POINTS_NOTE)


def _shown(title: str, show: Any) -> Callable[[int, int], None]:
    return lambda done, total: show(done / max(total, 1), f"{title}: {done} of {total}")
