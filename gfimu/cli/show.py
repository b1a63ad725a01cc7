"""`gfimu show`: a file that comes with gfimu or of one's own."""

from __future__ import annotations

from typing import Annotated

import typer

from gfimu.cli import completion
from gfimu.cli.output import print_json
from gfimu.cli.shared_options import JsonOption

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="show")(_show)


def _show(
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME",
            autocompletion=completion.shown,
            help="Name of an array, part, map, twin, scenario or effect; a file; or a recording.",
        ),
    ],
    json: JsonOption = False,
) -> None:
    """Print a shipped file, a file of your own (checked), the array of a recording, or an effect.

    A file of one's own is checked by its schema first; exit code 2 if it is wrong.

    Examples
    --------
    gfimu show adxl355
    # The array file that a recording carries
    gfimu show run.parquet
    # Check a twin of your own
    gfimu show my_twin.toml
    """
    from gfimu.commands.catalogue import show

    text = show(name)
    if json:
        print_json({"name": name, "text": text})
    else:
        typer.echo(text, nl=False)
