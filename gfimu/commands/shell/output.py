"""What every command shares: printing a table or JSON, naming the files it wrote, a progress bar.

Text from outside (file names, array names, descriptions, messages) is never read as markup, nor by the terminal: a
file called ``[red]x[/red].csv`` is printed as it is called, and characters that steer a terminal are printed escaped.
"""

from __future__ import annotations

import json
import os
import sys
import threading
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from gfimu.base.declared import plain
from gfimu.base.errors import one_line, printable

if TYPE_CHECKING:
    from rich.console import Console

__all__ = ["console", "print_file", "print_json", "print_paths", "print_table", "print_text", "progress"]

_LINE_S = 10.0  # s between lines of progress where there is no terminal
_FRAME = 3  # characters that a column takes besides its cells (of the layout)


def console(*, stderr: bool = False) -> Console:
    """Return a console that takes no text for markup, and prints none that steers the terminal."""
    from rich.console import Console
    from rich.segment import Segment

    class Screen(Console):
        def render(self, *what: Any, **settings: Any) -> Iterator[Segment]:
            for text, style, control in super().render(*what, **settings):
                # A carriage return of its own is the end of a line that is written over; texts have none.
                yield Segment(text if control or text == "\r" else printable(text), style, control)

    return Screen(markup=False, emoji=False, highlight=False, stderr=stderr)


def print_json(value: Any) -> None:
    """Print one JSON object to standard output."""
    typer.echo(json.dumps(plain(value), indent=2, allow_nan=False))


def print_text(text: str, *, style: str = "", stderr: bool = False) -> None:
    """Print a line of text, in one style."""
    from rich.text import Text

    console(stderr=stderr).print(Text(one_line(text), style=style), soft_wrap=True)


def print_file(text: str) -> None:
    """Print the text of a file."""
    typer.echo(printable(text), nl=False)


def print_table(
    title: str, header: Sequence[str], rows: Iterable[Sequence[object]], *, note: str = "", left: int = 1
) -> None:
    """Print a table for people: the first ``left`` columns hold words, numbers go to the right.

    On a terminal too narrow for its words and numbers, each row is printed as a list of its cells.
    """
    from rich.table import Table
    from rich.text import Text

    screen, cells = console(), [[one_line(str(cell)) for cell in row] for row in rows]
    title, note, header = one_line(title), one_line(note), [one_line(name) for name in header]
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
        console().print(Text.assemble(("wrote", "green"), one_line(f" {meaning}: {path}")), soft_wrap=True)


@contextmanager
def _progress_lines(description: str, total: float | None) -> Iterator[Any]:
    """Write a line on standard error every 10 s while the block runs: how far the work is, the time, what is done."""
    began, over = time.monotonic(), threading.Event()
    now = (0.0, description)

    def report(done: float, text: str | None = None) -> None:
        nonlocal now
        now = (done, text or description)

    def write() -> None:
        while not over.wait(_LINE_S):
            done, text = now
            share = f"{100.0 * done / total:.0f} %, " if total else ""
            state = text.removeprefix(description).removeprefix(": ")
            line = ": ".join(["gfimu", description, f"{share}{time.monotonic() - began:.0f} s", *filter(None, [state])])
            # At once and without a lock, which a process that is split off meanwhile would find taken.
            with suppress(OSError, ValueError):
                os.write(sys.stderr.fileno(), f"{line}\n".encode(errors="backslashreplace"))

    writer = threading.Thread(target=write, daemon=True)
    writer.start()
    try:
        yield report
    finally:
        over.set()
        writer.join()


@contextmanager
def progress(description: str, total: float | None = None, *, time_left: bool = True) -> Iterator[Any]:
    """Show a progress bar on a terminal; yields a function called with the work done so far (0 to ``total``).

    Without ``total`` the bar moves but does not say how far the work is. In a pipe a line is written every 10 s.
    Without ``time_left`` the bar shows none: where some of the work was done before, its rate is not that of this call.
    """
    if not sys.stderr.isatty() and not os.environ.get("FORCE_COLOR"):  # a pipe: rich need not be loaded
        with _progress_lines(description, total) as report:
            yield report
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
