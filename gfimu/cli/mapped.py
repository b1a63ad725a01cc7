"""The options --map and --map-set: a foreign file read by a map of its columns."""

from __future__ import annotations

from typing import Annotated

import typer

__all__ = ["MapOption", "MapSetOption", "ReferenceMapSetOption", "TableOption"]

MapOption = Annotated[
    str | None,
    typer.Option(
        "--map", metavar="MAP", help="Column map of a foreign file: a name, or a TOML file (`gfimu inspect`)."
    ),
]
MapSetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--map-set",
        metavar="KEY=VALUE",
        help="Set a key of the column map, or with no --map all of it: time.column=t time.unit=ms unit=g "
        "channels.a11=ax drop=corrupt,duplicates; may be repeated.",
    ),
]
ReferenceMapSetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--reference-map-set", metavar="KEY=VALUE", help="Set a key of the reference's column map; may be repeated."
    ),
]
TableOption = Annotated[
    str | None, typer.Option("--table", help="With --map: table, topic or member of a file that holds several.")
]
