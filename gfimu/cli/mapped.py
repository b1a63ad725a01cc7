"""The option --map: a foreign file read by a map of its columns."""

from __future__ import annotations

from typing import Annotated

import typer

__all__ = ["MapOption", "TableOption"]

MapOption = Annotated[
    str | None,
    typer.Option(
        "--map", metavar="MAP", help="Column map of a foreign file: a name, or a TOML file (`gfimu inspect`)."
    ),
]
TableOption = Annotated[
    str | None, typer.Option("--table", help="With --map: table, topic or member of a file that holds several.")
]
