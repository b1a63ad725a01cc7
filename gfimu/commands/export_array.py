"""Under `gfimu convert` of an array: a MuJoCo model (MJCF)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from gfimu.base.errors import InputError

if TYPE_CHECKING:
    from gfimu.array.array import AccelerometerArray

__all__ = ["export_array"]


def export_array(array: AccelerometerArray, target: str | Path | None, rig: str | None) -> AccelerometerArray:
    """Write an array as a MuJoCo model and return it; see `sim.rigs.mjcf_export.array_as_mjcf`.

    Raises
    ------
    InputError
        If the target is no ``.xml`` file, or there is no such rig.
    """
    from gfimu.base.files.atomic_file import write_text
    from sim.rigs.mjcf_export import array_as_mjcf

    if target is not None and Path(target).suffix != ".xml":
        raise InputError(f"{target}: an array is written as a MuJoCo model; name it .xml")
    text = array_as_mjcf(array, rig or "turntable")
    if target is not None:
        write_text(target, text)
    return array
