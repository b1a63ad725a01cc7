"""The axis about which alone an array turns, as commands and functions take it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

from gfimu.base.errors import InputError
from gfimu.commands.shell.declare import Group, Option
from gfimu.commands.shell.options import BIAS_STD_M_S2

if TYPE_CHECKING:
    from gfimu.array.array import AccelerometerArray
    from gfimu.array.turning_axis import AxisUncertainty, TurningAxis

__all__ = ["AXIS", "AXIS_ALONE", "AXIS_PLACE", "AxisLike", "KnownAxis", "as_known_axis"]

_Point: TypeAlias = tuple[float, float, float]


@dataclass(frozen=True)
class KnownAxis:
    """What a call says of the axis: nothing, an axis, or how exactly that of the array's file is known.

    Parameters
    ----------
    axis : TurningAxis, optional
        The axis.
    inclination_rad : float, optional
        Angle between the axis and the vertical, rad; that of the axis without it.
    uncertainty : AxisUncertainty, optional
        How exactly axis and chips are known; those of the axis without it.
    """

    axis: "TurningAxis | None" = None
    inclination_rad: float | None = None
    uncertainty: "AxisUncertainty | None" = None

    def of(self, array: "AccelerometerArray") -> "TurningAxis | None":
        """Return the axis, or the array's own where that can't see all six motions; None where there is neither.

        Raises
        ------
        InputError
            If something is said of an axis, and there is none.
        """
        from gfimu.array.observability import unseen_motions

        axis = self.axis or (array.turning_axis if unseen_motions(array) else None)
        if axis is None:
            if self.uncertainty is not None:
                said = next(iter(self.uncertainty.to_dict()))
                raise InputError(f"{said} is of a known axis; give the axis too (--axis)")
            return None
        tilt = axis.inclination if self.inclination_rad is None else self.inclination_rad
        return replace(axis, inclination=tilt, uncertainty=self.uncertainty or axis.uncertainty)


AxisLike: TypeAlias = "KnownAxis | TurningAxis | str | Sequence[float] | None"
"""An axis as Python gives it: x, y, z, three numbers, or one with all that is known of it."""


def as_known_axis(axis: AxisLike) -> KnownAxis:
    """Return what a call says of the axis."""
    from gfimu.array.turning_axis import TurningAxis

    if isinstance(axis, KnownAxis):
        return axis
    return KnownAxis(axis if axis is None or isinstance(axis, TurningAxis) else TurningAxis.of(axis))


_AXIS = Option("Axis about which alone the array turns: x, y, z or 0,0,1. Few chips then suffice.", "AXIS")
_HUB = Option("With --axis: fixed (a table) or free (a wheel on a moving body).", "KIND")
_INCLINATION = Option(
    "Angle between the axis and the vertical, rad; else from the data, or 0 (a free hub: π/2) where there are none.",
    "RAD",
)
_ROTATION = Option("With --axis: how exactly each chip's orientation is known, rad.", "RAD")


def _from_options(
    axis: Annotated[str | None, _AXIS] = None,
    axis_point: Annotated[_Point, Option("A point of that axis, body frame, m.", "X Y Z")] = (0.0, 0.0, 0.0),
    hub: Annotated[Literal["fixed", "free"], _HUB] = "fixed",
    inclination_rad: Annotated[float | None, _INCLINATION] = None,
    point_std_m: Annotated[float, Option("With --axis: how exactly --axis-point is known, m.", "M")] = 0.0,
    direction_std_rad: Annotated[float, Option("With --axis: how exactly its direction is known, rad.", "RAD")] = 0.0,
    lever_std_m: Annotated[float, Option("With --axis: how exactly each chip's place is known, m.", "M")] = 0.0,
    rotation_std_rad: Annotated[float, _ROTATION] = 0.0,
    bias_std_m_s2: Annotated[float, BIAS_STD_M_S2.also(when="With --axis: ")] = 0.0,
) -> KnownAxis:
    """Return what the options of the shell say of the axis."""
    from gfimu.array.turning_axis import AxisUncertainty, TurningAxis

    if axis is None and (any(axis_point) or hub != "fixed"):
        raise InputError("--axis-point and --hub are of a known axis; give the axis too (--axis)")
    known = None if axis is None else TurningAxis.of(axis, point=axis_point, hub=hub, inclination=inclination_rad)
    doubt = AxisUncertainty(point_std_m, direction_std_rad, lever_std_m, rotation_std_rad, bias_std_m_s2)
    return KnownAxis(known, inclination_rad, None if doubt.exact else doubt)


_TEXT = (
    "The axis about which alone the array turns, body frame: x, y, z, three numbers, or a `TurningAxis`, such as "
    "``TurningAxis.of('z', point=(-0.1, 0, 0), hub='free', uncertainty=…)``. Few chips then suffice. By default the "
    "array's own, where it can't see all six motions."
)
_PANEL = "Rotation about a known axis"
_DOUBTS = ("point_std_m", "direction_std_rad", "lever_std_m", "rotation_std_rad", "bias_std_m_s2")

AXIS = Group(_from_options, _TEXT, panel=_PANEL)
"""The axis, and how exactly it and the chips about it are known."""

AXIS_ALONE = Group(_from_options, _TEXT, panel=_PANEL, without=_DOUBTS)
"""The axis with its inclination."""

AXIS_PLACE = Group(_from_options, _TEXT, panel=_PANEL, without=(*_DOUBTS, "inclination_rad"))
"""The axis alone."""
