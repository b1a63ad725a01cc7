"""What every command shares: printing a table or JSON, naming the files it wrote, a progress bar."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

__all__ = ["JsonOption", "console", "plain", "print_json", "print_paths", "print_table", "progress"]

JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object for machines instead of tables.")]

console = Console()


def plain(value: Any) -> Any:
    """Turn arrays, paths and NaN into what JSON can hold (NaN and infinity become null)."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, Path):
        return str(value)
    return value


def print_json(value: Any) -> None:
    """Print one JSON object to standard output."""
    typer.echo(json.dumps(plain(value), indent=2, allow_nan=False))


def print_table(
    title: str, header: Sequence[str], rows: Iterable[Sequence[object]], *, note: str = "", left: int = 1
) -> None:
    """Print a table for people: the first ``left`` columns hold words, numbers go to the right."""
    table = Table(title=title, title_justify="left", title_style="bold", caption=note or None)
    table.caption_justify = "left"
    for place, name in enumerate(header):
        table.add_column(name, justify="left" if place < left else "right", overflow="fold")
    for row in rows:
        table.add_row(*[str(cell) for cell in row])
    console.print(table)


def print_paths(paths: Iterable[tuple[str, str | Path]]) -> None:
    """Print what was written and where, one line each."""
    for meaning, path in paths:
        console.print(f"[green]wrote[/green] {meaning}: {path}", highlight=False, soft_wrap=True)


@contextmanager
def progress(description: str, total: float | None = None) -> Iterator[Any]:
    """Show a progress bar on a terminal; yields a function called with the work done so far (0 to ``total``)."""
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TimeRemainingColumn(),
        console=Console(stderr=True),
        transient=True,
        disable=not Console(stderr=True).is_terminal,
    ) as bar:
        task = bar.add_task(description, total=total)
        yield lambda done, text=None: bar.update(task, completed=done, description=text or description)
