"""Which channels unknowns change: those that change different ones share a difference."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.model.world_model import Effect

__all__ = ["behind_wiring", "disjoint"]


def behind_wiring(
    reach: NDArray[np.bool_] | None, effects: Sequence[Effect], array: AccelerometerArray
) -> NDArray[np.bool_] | None:
    """Return which channels of a recording unknowns change, (k, c), given those of the sensors they change.

    Exchanged wires carry what changes a sensor to another channel. None where the reach is not known, as behind an
    effect on the samples that does not state the order of its channels (``channel_order``).
    """
    if reach is None:
        return None
    for effect in effects:
        if effect.place == "data":
            order = getattr(effect, "channel_order", None)
            if order is None:
                return None
            reach = np.asarray(reach[:, order(array)])
    return reach


def disjoint(reach: NDArray[np.bool_] | None, count: int) -> list[list[int]]:
    """Group unknowns whose reaches do not overlap."""
    if reach is None:
        return [[unknown] for unknown in range(count)]
    groups: list[tuple[list[int], NDArray[np.bool_]]] = []
    for unknown in range(count):
        for members, taken in groups:
            if not (taken & reach[unknown]).any():
                members.append(unknown)
                np.logical_or(taken, reach[unknown], out=taken)
                break
        else:
            groups.append(([unknown], reach[unknown].copy()))
    return [members for members, _ in groups]
