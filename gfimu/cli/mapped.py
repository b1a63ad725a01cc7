"""Options of a recording that is read: --map and --map-set for a foreign file, --force for one that is refused."""

from __future__ import annotations

from typing import Annotated

import typer

__all__ = ["ForceOption", "MapOption", "MapSetOption", "ReferenceMapSetOption", "TableOption"]

MapOption = Annotated[
    str | None,
    typer.Option(
        "--map", metavar="MAP", help="Column map of a foreign file: a name, or a TOML file (`gfimu inspect`)."
    ),
]
ForceOption = Annotated[
    bool, typer.Option("--force", help="Go on where the checks of units, time, array and channels refuse the file.")
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
