"""`gfimu list`: what comes with gfimu."""

from __future__ import annotations

from typing import Annotated

import typer

from gfimu.cli import completion
from gfimu.cli.output import print_json, print_table
from gfimu.cli.shared_options import JsonOption
from gfimu.commands.catalogue import KINDS

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="list")(_list)


def _list(
    kind: Annotated[
        str,
        typer.Argument(
            metavar="KIND", autocompletion=completion.words(*KINDS), help=f"What to list: {', '.join(KINDS)}."
        ),
    ],
    json: JsonOption = False,
) -> None:
    """List what gfimu ships: arrays, parts, scenarios, twins, effects and other kinds.

    Examples
    --------
    gfimu list arrays
    # Names for a script
    gfimu list scenarios --json
    """
    from gfimu.commands.catalogue import catalogue

    found = catalogue(kind)
    if json:
        print_json(found)
    else:
        print_table(kind, ("name", "what it is"), found.items(), left=2)
