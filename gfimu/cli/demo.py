"""`gfimu demo`: the whole job on the paper's run, with one table at the end."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from gfimu.cli.output import JsonOption, console, print_json, print_paths, print_table

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="demo")(_demo)


def _demo(
    out: Annotated[Path, typer.Option("--out", help="Folder to write to; made if it isn't there.")] = Path(
        "gfimu-demo"
    ),
    seed: Annotated[int, typer.Option("--seed", min=0, help="Seed of everything left to chance.")] = 1,
    json: JsonOption = False,
) -> None:
    """Run the paper's experiment in simulation: geometry, recording, estimate, drift, picture, diagnosis.

    Example: gfimu demo --out demo
    """
    from gfimu.cli.demo_steps import STEPS, Demo

    status = Console(stderr=True)
    demo = Demo(out, seed)
    began = time.perf_counter()
    for number, step in enumerate(STEPS, start=1):
        what = (step.__doc__ or step.__name__).splitlines()[0].rstrip(".")
        status.print(f"[dim]{number}/{len(STEPS)}[/dim] {what}", highlight=False)
        step(demo)
    status.print(f"[dim]done in {time.perf_counter() - began:.0f} s[/dim]", highlight=False)
    if json:
        print_json(
            {
                "seed": seed,
                "results": [{"what": row.what} | row.figures for row in demo.rows],
                "files": demo.written,
            }
        )
        return
    print_table(
        f"The paper's experiment in simulation (seed {seed})",
        ("what", "result", "to compare"),
        [(row.what, row.result, row.beside) for row in demo.rows],
    )
    print_paths(demo.written.items())
    console.print(f"look at it with: gfimu view {demo.written['rerun recording']}", highlight=False, soft_wrap=True)
    console.print(f"and open {demo.written['diagnosis report']} in a browser", highlight=False, soft_wrap=True)
