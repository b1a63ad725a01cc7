"""`gfimu inspect`: what a file of unknown layout seems to hold."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gfimu.cli.output import print_json, print_paths, print_table, print_text, progress
from gfimu.cli.shared_options import JsonOption, shared

if TYPE_CHECKING:
    from gfimu.importing import Inspection

__all__ = ["register"]

_MOST_COLUMNS = 40


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="inspect")(_inspect)


def _inspect(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE", help="Text, gzipped or zipped, JSON, Parquet, Excel, MATLAB, HDF5, ULog, MCAP, ROS bag."
        ),
    ],
    table: Annotated[str, shared("--table")] = "",
    out: Annotated[
        Path | None, typer.Option("--out", help="Column map to write (.toml), to edit and give as --map.")
    ] = None,
    json: JsonOption = False,
) -> None:
    """Show what a file holds (columns, units, rate, gaps, rails, corrupt values, chips) and a column map to start from.

    Examples
    --------
    gfimu inspect log.csv
    # Write the column map, edit it, and import with it
    gfimu inspect log.csv --out log_map.toml
    gfimu convert log.csv run.parquet --map log_map.toml
    """
    from gfimu.commands.inspect import inspect

    with progress("looking at the file"):
        found = inspect(file, table=table, out=out)
    if json:
        print_json(found.to_dict() | {"files": {} if out is None else {"map": out}})
        return
    _print(found, shown=out is None)
    if out is not None:
        print_paths([("map", out)])


def _print(found: Inspection, *, shown: bool) -> None:
    rate = "" if found.sample_rate_hz != found.sample_rate_hz else f", {found.sample_rate_hz:.5g} Hz"
    chips = f", {found.chips} chip{'' if found.chips == 1 else 's'}" if found.chips else ", no accelerations found"
    if len(found.tables) > 1:
        print_text(f"Tables: {'; '.join(found.tables)}. Shown: {found.table or 'the file'}.")
    rows = [
        (one.name, one.role, f"{one.least:.6g}", f"{one.median:.6g}", f"{one.most:.6g}", str(one.missing or ""))
        for one in found.columns[:_MOST_COLUMNS]
    ]
    print_table(
        f"{found.source}: {found.format}, {found.rows} rows{rate}{chips}",
        ("column", "seems to be", "least", "median", "most", "missing"),
        rows,
        left=2,
        note=f"and {len(found.columns) - _MOST_COLUMNS} further columns" if len(found.columns) > _MOST_COLUMNS else "",
    )
    for line in found.reasons:
        print_text(f"- {line}")
    if found.findings:
        print_text("Odd:", style="bold")
        for line in found.findings:
            print_text(f"- {line}")
    if found.fitting:
        print_text(
            f"Maps that come with gfimu and fit: {', '.join(f'--map {name}' for name in found.fitting)}", style="bold"
        )
    if shown and found.column_map is not None:
        print_text("A column map to start from (--out FILE.toml writes it):", style="bold")
        print_text(found.map_text())
