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
    schema: Annotated[
        Path | None, typer.Option("--schema", help="JSON schema to write (.json), for completion in an editor.")
    ] = None,
) -> None:
    """Write a commented file to edit.

    Example: gfimu new array --out my_array.toml --schema array.schema.json
    """
    from gfimu.commands.catalogue import new

    text = new(kind, out=out, schema=schema)
    if out is None and schema is None:
        typer.echo(text, nl=False)
    else:
        written = {kind: out, "schema": schema}
        print_paths([(what, path) for what, path in written.items() if path is not None])
