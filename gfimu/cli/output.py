"""What every command shares: printing a table or JSON, naming the files it wrote, a progress bar.

Text from outside (file names, array names, descriptions, messages) is never read as markup: a file called
``[red]x[/red].csv`` is printed as it is called.
"""

from __future__ import annotations

import json
import math
import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from rich.console import Console

__all__ = ["console", "plain", "print_json", "print_paths", "print_table", "print_text", "progress"]

_FRAME = 3  # characters that a column takes besides its cells (of the layout)


def console(*, stderr: bool = False) -> Console:
    """Return a console that takes no text for markup."""
    from rich.console import Console

    return Console(markup=False, emoji=False, highlight=False, stderr=stderr)


def plain(value: Any) -> Any:
    """Turn arrays, paths and NaN into what JSON can hold (NaN and infinity become null)."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if hasattr(value, "tolist"):  # NumPy's arrays and numbers
        return plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, Path):
        return str(value)
    return value


def print_json(value: Any) -> None:
    """Print one JSON object to standard output."""
    typer.echo(json.dumps(plain(value), indent=2, allow_nan=False))


def print_text(text: str, *, style: str = "", stderr: bool = False) -> None:
    """Print a line of text as it is, in one style."""
    from rich.text import Text

    console(stderr=stderr).print(Text(text, style=style), soft_wrap=True)


def print_table(
    title: str, header: Sequence[str], rows: Iterable[Sequence[object]], *, note: str = "", left: int = 1
) -> None:
    """Print a table for people: the first ``left`` columns hold words, numbers go to the right.

    On a terminal too narrow for its words and numbers, each row is printed as a list of its cells.
    """
    from rich.table import Table
    from rich.text import Text

    screen, cells = console(), [[str(cell) for cell in row] for row in rows]
    table = Table(title=Text(title), title_justify="left", title_style="bold", caption=Text(note) if note else None)
    table.caption_justify = "left"
    widths = _column_widths([header, *cells], screen.width)
    if screen.is_terminal and widths is None:
        _print_as_lists(title, header, cells, note)
        return
    for place, name in enumerate(header):
        width = None if widths is None else widths[place]
        table.add_column(Text(name), justify="left" if place < left else "right", overflow="fold", width=width)
    for row in cells:
        table.add_row(*[Text(cell) for cell in row])
    screen.print(table)


def _column_widths(rows: Sequence[Sequence[str]], screen: int) -> list[int] | None:
    """Return the widths of a table's columns, with no word broken; None where the screen is too narrow for that.

    The widest columns are the first to wrap. Rich's own division breaks words of a column while others have room.
    """
    from rich.cells import cell_len

    columns = list(zip_longest(*rows, fillvalue=""))
    least = [max((cell_len(word) for cell in column for word in cell.split()), default=0) for column in columns]
    most = [max((cell_len(line) for cell in column for line in cell.splitlines()), default=0) for column in columns]
    room = screen - _FRAME * len(columns) - 1
    if sum(least) > room:
        return None
    for widest in range(max(most), 0, -1):
        widths = [max(low, min(high, widest)) for low, high in zip(least, most, strict=True)]
        if sum(widths) <= room:
            return widths
    return least


def _print_as_lists(title: str, header: Sequence[str], rows: Iterable[Sequence[str]], note: str) -> None:
    """Print the rows of a table one after another, a line for each cell that is not empty."""
    from rich.text import Text

    screen = console()
    screen.print(Text(title, style="bold"))
    for first, *others in rows:
        screen.print(Text(f"{header[0]}: {first}" if header[0] else first))
        for name, cell in zip(header[1:], others, strict=True):
            if cell:
                screen.print(Text(f"  {name}: {cell}" if name else f"  {cell}"))
    if note:
        screen.print(Text(note, style="dim italic"))


def print_paths(paths: Iterable[tuple[str, str | Path]]) -> None:
    """Print what was written and where, one line each."""
    from rich.text import Text

    for meaning, path in paths:
        console().print(Text.assemble(("wrote", "green"), f" {meaning}: {path}"), soft_wrap=True)


@contextmanager
def progress(description: str, total: float | None = None, *, time_left: bool = True) -> Iterator[Any]:
    """Show a progress bar on a terminal; yields a function called with the work done so far (0 to ``total``).

    Without ``total`` the bar moves but does not say how far the work is. In a pipe nothing is shown.
    Without ``time_left`` the bar shows none: where some of the work was done before, its rate is not that of this call.
    """
    if not sys.stderr.isatty() and not os.environ.get("FORCE_COLOR"):  # a pipe: rich need not be loaded
        yield lambda done, text=None: None
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    with Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        *([TimeRemainingColumn()] if time_left and total is not None else []),
        console=console(stderr=True),
        transient=True,
    ) as bar:
        task = bar.add_task(description, total=total)
        yield lambda done, text=None: bar.update(task, completed=done, description=text or description)
