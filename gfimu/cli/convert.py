"""`gfimu convert`: a recording in another format."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gfimu.cli.array_option import load_array
from gfimu.cli.output import JsonOption, print_json, print_paths, print_table

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(name="convert")(_convert)


def _convert(
    source: Annotated[Path, typer.Argument(help="Recording: .csv, .parquet, or a MIMU4444 stream (.bin, .bin.gz).")],
    target: Annotated[Path, typer.Argument(help="Recording to write, .csv or .parquet.")],
    array: Annotated[
        str | None, typer.Option("--array", help="Array whose channels must be there; else every channel found.")
    ] = None,
    json: JsonOption = False,
) -> None:
    """Convert a recording between CSV and Parquet, or import a MIMU4444 stream. Readings become m/s².

    Example: gfimu convert exp_1.bin.gz run.parquet
    """
    from gfimu.carried_array import carried_array
    from gfimu.recording_formats import open_recording

    geometry = None if array is None else load_array(array)
    recording = open_recording(source, array=geometry)
    if geometry is not None:
        recording = recording.carrying(geometry)
    elif "array_toml" in recording.metadata:
        carried_array(recording.metadata, source=source)  # a damaged one is not passed on
    recording.write(target)
    figures = {
        "samples": len(recording),
        "channels": len(recording.channels),
        "duration_s": recording.duration,
        "sample_rate_hz": recording.sample_rate if len(recording) > 1 else None,
        "gaps": len(recording.gaps) if len(recording) > 1 else 0,
    } | {key: value for key, value in recording.metadata.items() if key.startswith(("packets", "bytes"))}
    if json:
        print_json(figures | {"files": {"recording": target}})
    else:
        print_table(str(source), ("quantity", "value"), figures.items())
        print_paths([("recording", target)])
