"""The axis about which alone an array turns, as commands and functions take it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gfimu.geometry.array import AccelerometerArray
    from gfimu.geometry.turning_axis import TurningAxis

__all__ = ["known_axis", "turning_axis"]


def turning_axis(
    axis: TurningAxis | str | Sequence[float] | None,
    point: Sequence[float],
    hub: str,
    inclination_rad: float | None,
) -> TurningAxis | None:
    """Return an axis given as such or by its numbers; None without one.

    Raises
    ------
    InputError
        If the numbers are no axis, or point and hub are given without one.
    """
    from gfimu.errors import InputError
    from gfimu.geometry.turning_axis import TurningAxis

    if axis is None and (any(point) or hub != "fixed"):
        raise InputError("--axis-point and --hub are of a known axis; give the axis too (--axis)")
    if axis is None or isinstance(axis, TurningAxis):
        return axis
    return TurningAxis.of(axis, point=point, hub=hub, inclination=inclination_rad)


def known_axis(axis: TurningAxis | None, array: AccelerometerArray) -> TurningAxis | None:
    """Return the axis given, or the array's own where it can't see all six motions; else None."""
    from gfimu.geometry.observability import unseen_motions

    if axis is not None:
        return axis
    return array.turning_axis if unseen_motions(array) else None
