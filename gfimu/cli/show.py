"""`gfimu show`: a file that comes with gfimu."""

from __future__ import annotations

from typing import Annotated

import typer

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="show")(_show)


def _show(name: Annotated[str, typer.Argument(help="Name of an array, part, map, twin, scenario or effect.")]) -> None:
    """Print a file that comes with gfimu.

    Example: gfimu show adxl355
    """
    from gfimu.commands.catalogue import show

    typer.echo(show(name), nl=False)
