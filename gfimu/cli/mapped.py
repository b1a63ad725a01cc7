"""The option --map: a foreign file read by a map of its columns."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from gfimu.recording.mapped import MappedFile

__all__ = ["MapOption", "TableOption", "mapped"]

MapOption = Annotated[
    str | None,
    typer.Option(
        "--map", metavar="MAP", help="Column map of a foreign file: a name, or a TOML file (`gfimu inspect`)."
    ),
]
TableOption = Annotated[
    str | None, typer.Option("--table", help="With --map: table, topic or member of a file that holds several.")
]


def mapped(
    path: Path, column_map: str | None, *, table: str | None = None, others: tuple[Path, ...] = ()
) -> Path | MappedFile:
    """Return a path, with its column map where there is one."""
    if column_map is None:
        return path

    import msgspec

    from gfimu.importing import load_map
    from gfimu.recording.mapped import MappedFile

    chosen = load_map(column_map)
    if table is not None:
        chosen = msgspec.structs.replace(chosen, table=table)
    return MappedFile(path, chosen, others)
