"""`gfimu show`: a file that comes with gfimu or of one's own."""

from __future__ import annotations

from typing import Annotated

import typer

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="show")(_show)


def _show(
    name: Annotated[
        str, typer.Argument(help="Name of an array, part, map, twin, scenario or effect; a file; or a recording.")
    ],
) -> None:
    """Print a file that comes with gfimu, a checked file of one's own, or the array of a recording.

    Example: gfimu show adxl355
    """
    from gfimu.commands.catalogue import show

    typer.echo(show(name), nl=False)
