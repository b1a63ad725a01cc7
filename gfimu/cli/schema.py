"""`gfimu schema`: the JSON schema of what a command prints with --json."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gfimu.cli import completion
from gfimu.cli.output import print_json, print_paths
from gfimu.cli.shared_options import JsonOption

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="schema")(_schema)


def _schema(
    command: Annotated[
        list[str],
        typer.Argument(
            metavar="COMMAND...", autocompletion=completion.commands, help="Command: estimate, or campaign table."
        ),
    ],
    out: Annotated[Path | None, typer.Option("--out", help="JSON schema to write (.json); printed without it.")] = None,
    json: JsonOption = False,
) -> None:
    """Print the JSON schema of what a command prints with --json: every key with its meaning and unit.

    Examples
    --------
    gfimu schema estimate
    # Of a command of a command, to a file
    gfimu schema campaign table --out table.schema.json
    """
    from gfimu.commands.schema import schema

    found = schema(" ".join(command), out=out)
    if out is None or json:
        print_json(found)
    else:
        print_paths([("schema", out)])
