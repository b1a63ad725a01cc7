"""`gfimu new`: a commented file to start from, or the C files of a sender."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gfimu.cli import completion
from gfimu.cli.output import print_json, print_paths
from gfimu.cli.shared_options import JsonOption
from gfimu.commands.catalogue import SENDER, TEMPLATES

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="new")(_new)


def _new(
    kind: Annotated[
        str,
        typer.Argument(
            metavar="KIND",
            autocompletion=completion.words(*TEMPLATES, SENDER),
            help=f"What to begin: {', '.join((*TEMPLATES, SENDER))}.",
        ),
    ],
    folder: Annotated[
        Path | None,
        typer.Argument(
            metavar="[FOLDER]", help="Of a sender: folder to write; without it, what to do with it is printed."
        ),
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", help="File to write (.toml); printed without it.")] = None,
    schema: Annotated[
        Path | None, typer.Option("--schema", help="JSON schema to write (.json), for completion in an editor.")
    ] = None,
    json: JsonOption = False,
) -> None:
    """Write a commented file to edit.

    A sender is a folder of C files: with them a microcontroller of yours sends what gfimu record reads. Without --out
    the file is printed. A file that is there is not replaced.

    Examples
    --------
    gfimu new array --out my_array.toml --schema array.schema.json
    # C files for a board of your own
    gfimu new sender my_sender
    """
    from gfimu.commands.catalogue import new

    text = new(kind, folder, out=out, schema=schema)
    named = {kind: folder or out, "schema": schema}
    files = {what: path for what, path in named.items() if path is not None}
    if json:
        print_json({"kind": kind, "text": text, "files": files})
    elif files:
        print_paths(files.items())
    else:
        typer.echo(text, nl=False)
