"""The array of a command: given by name, array file or MJCF sites, or the twin's beside the recording's own."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from gfimu.array import AccelerometerArray
    from gfimu.recording import Recording

__all__ = ["load_array", "note_other_array"]


def load_array(name: str) -> AccelerometerArray:
    """Load an array by name, from an array file (.toml), or from the sites of an MJCF file (.xml)."""
    if name.endswith(".xml"):
        from sim.mjcf_array import array_from_mjcf

        return array_from_mjcf(name)
    from gfimu.array import AccelerometerArray

    return AccelerometerArray.load(name)


def note_other_array(run: Path, recording: Recording, twin_array: AccelerometerArray) -> None:
    """Print one line to standard error where a recording's own array is not the twin's, which is used."""
    from gfimu.carried_array import array_difference
    from gfimu.errors import InputError

    try:
        own = recording.array
    except InputError as error:
        if "array_toml" in recording.metadata:
            typer.echo(f"note: {run}: {error}".split(";", maxsplit=1)[0] + "; the twin's array is used", err=True)
        return
    difference = "" if own is None else array_difference(own, twin_array)
    if own is not None and difference:
        typer.echo(
            f"note: {run} was recorded with array {own.name!r}, the twin has {twin_array.name!r}, which is used; "
            f"they differ: {difference}",
            err=True,
        )
