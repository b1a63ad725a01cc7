"""`gfimu demo`: the whole job on the paper's run, with one table at the end."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Annotated

import typer

from gfimu.cli.output import print_json, print_paths, print_table, print_text
from gfimu.cli.shared_options import JsonOption, shared

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="demo")(_demo)


def _demo(
    out: Annotated[Path, typer.Option("--out", help="Folder to write; made where it is not there.")] = Path(
        "gfimu-demo"
    ),
    seed: Annotated[int, shared("--seed", min=0)] = 1,
    json: JsonOption = False,
) -> None:
    """Run the paper's experiment in simulation: geometry, recording, estimate, drift, picture, diagnosis.

    Writes a folder with the recording, the estimate, pictures, a rerun recording and the diagnosis with its report. It
    takes about a minute.

    Examples
    --------
    gfimu demo
    # Another draw of the noise, in a folder of your own
    gfimu demo --out demo --seed 2
    """
    from gfimu.commands.demo import demo

    began = time.perf_counter()
    watched = sys.stderr.isatty()

    def report(number: int, total: int, what: str) -> None:
        if watched:
            print_text(f"{number}/{total} {what}", style="dim", stderr=True)

    result = demo(out, seed=seed, report=report)
    if watched:
        print_text(f"done in {time.perf_counter() - began:.0f} s", style="dim", stderr=True)
    if json:
        print_json(result.to_dict())
        return
    print_table(
        f"The paper's experiment in simulation (seed {seed})",
        ("what", "result", "to compare"),
        [(row.what, row.result, row.beside) for row in result.rows],
    )
    print_paths(result.files.items())
    print_text(f"look at it with: gfimu view {result.files['rerun recording']}")
    print_text(f"and open {result.files['diagnosis report']} in a browser")
