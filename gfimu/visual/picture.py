"""The picture of a recording file: read, estimate where the array allows, draw."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from gfimu.errors import GeometryError, InputError
from gfimu.estimation import Estimate, estimate
from gfimu.recording_formats import open_run
from gfimu.visual.run import write_run

__all__ = ["picture_of", "picture_path"]


def picture_path(recording: Path) -> Path:
    """Where the picture of a recording goes: beside it, or in a temporary folder if that can't be written to."""
    name = f"{recording.name.split('.')[0]}.view.rrd"
    if os.access(recording.parent, os.W_OK):
        return recording.parent / name
    return Path(tempfile.mkdtemp(prefix="gfimu-")) / name


def picture_of(recording: Path, out: Path, *, array: str | Path | None = None) -> None:
    """Write the rerun recording of a recording file, with its estimate where the array sees all six motions.

    Parameters
    ----------
    recording : Path
        Recording, in any format that `gfimu.recording_formats.open_run` reads.
    out : Path
        File to write, ``.rrd``.
    array : str or Path, optional
        Name or file of the array; the recording's own otherwise.

    Raises
    ------
    InputError
        If the recording can't be read, names no array, or the picture can't be written.
    """
    if recording.suffix == ".rrd":
        raise InputError(f"{recording}: already a rerun recording; open it without --out")
    run, geometry = open_run(recording, array)
    found: Estimate | None = None
    note = ""
    try:
        found = estimate(run, geometry)
    except GeometryError as error:
        note = f"No estimate: {error}."
    write_run(out, run, geometry, estimate=found, notes=note, title=recording.stem)
