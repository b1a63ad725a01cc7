"""`gfimu new`: a commented file to start from."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gfimu.cli.output import print_paths
from gfimu.commands.catalogue import TEMPLATES

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="new")(_new)


def _new(
    kind: Annotated[str, typer.Argument(help=f"What to begin: {', '.join(TEMPLATES)}.")],
    out: Annotated[Path | None, typer.Option("--out", help="File to write (.toml); printed without it.")] = None,
) -> None:
    """Write a commented file to edit.

    Example: gfimu new array --out my_array.toml
    """
    from gfimu.commands.catalogue import new

    text = new(kind, out=out)
    if out is None:
        typer.echo(text, nl=False)
    else:
        print_paths([(kind, out)])
