"""The array that a command is given: a name, an array file, or the sites of an MJCF file."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gfimu.array import AccelerometerArray

__all__ = ["load_array"]


def load_array(name: str) -> AccelerometerArray:
    """Load an array by name, from an array file (.toml), or from the sites of an MJCF file (.xml)."""
    if name.endswith(".xml"):
        from sim.mjcf_array import array_from_mjcf

        return array_from_mjcf(name)
    from gfimu.array import AccelerometerArray

    return AccelerometerArray.load(name)
