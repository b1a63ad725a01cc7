"""What a command prints of its result: one JSON object, or tables, sentences and the names of the files it wrote."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from typing import Any

from gfimu.base.declared import FileText, Line, Table, Written
from gfimu.base.units import duration_text
from gfimu.commands.shell.declare import Command
from gfimu.commands.shell.output import print_file, print_json, print_paths, print_table, print_text, progress

__all__ = ["print_blocks", "print_report"]


def print_report(declared: Command, given: dict[str, Any], *, as_json: bool) -> None:
    """Call the function of a command and print what it gives; its exit code is that of the report, if it has one."""
    found = _called(declared, given)
    shown = found if declared.report is None else declared.report(found, given)
    files = declared.written(given) if declared.files is None else declared.files(found, given)
    if as_json:
        print_json(shown.to_dict() | ({"files": files} if declared.names_files(type(shown)) else {}))
    else:
        print_blocks(shown.shown())
        print_paths(files.items())
    if declared.exit_code is not None and (code := declared.exit_code(shown)):
        raise SystemExit(code)  # as typer.Exit the code of an interruption would be taken for one of the program


def _called(declared: Command, given: dict[str, Any]) -> Any:
    doing = declared.doing(given) if callable(declared.doing) else declared.doing
    if not doing:
        return declared.function(**given)
    advances = "progress" in declared.parameters
    with progress(doing, total=1.0 if advances else None, time_left=not declared.continues) as show:
        return declared.function(
            **given, **({"progress": _share(show, doing, pace=declared.continues)} if advances else {})
        )


def _share(show: Callable[..., None], doing: str, *, pace: bool) -> Callable[..., None]:
    """Return a progress that takes a share, with or without words, or how many of how many are done.

    With ``pace`` it says how many a second are done in this call, and the time left by that.
    """
    first: list[float] = []
    began = time.monotonic()

    def advance(done: float, more: Any = None) -> None:
        if isinstance(more, int | float):
            first.append(done)
            spent = time.monotonic() - began
            rate = (done - first[0]) / spent if pace and spent else 0.0
            left = f", {rate:.3g}/s, {duration_text((more - done) / rate)} left" if rate else ""
            show(done / max(more, 1), f"{doing}: {done} of {more}{left}")
        else:
            show(done, more)

    return advance


def print_blocks(blocks: Iterable[Any]) -> None:
    """Print tables, sentences and the texts of files."""
    for block in blocks:
        if isinstance(block, Table):
            print_table(block.title, block.header, block.rows, note=block.note, left=block.left)
        elif isinstance(block, FileText):
            print_file(block.text)
        elif isinstance(block, Written):
            print_paths([(block.what, block.path)])
        elif isinstance(block, Line):
            print_text(block.text, style=block.style)
        else:
            print_text(block)
