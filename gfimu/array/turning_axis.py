"""The axis about which a body turns, where it is known: a table, a wheel, a pendulum."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array_file import MountingTable, TurningAxisTable
from gfimu.base.declared import Declared, figure
from gfimu.base.errors import InputError, did_you_mean
from gfimu.base.files.schema import read
from gfimu.base.short_repr import short_repr

__all__ = ["HUBS", "AxisUncertainty", "TurningAxis"]

_LARGEST_STD = 1e3  # numerical: m, rad or m/s², far beyond any mounting

HUBS = ("fixed", "free")


@dataclass(frozen=True)
class AxisUncertainty(Declared):
    """Standard deviations of what an array file says of chips on an axis; 0 is exact.

    What is not exact is estimated together with the rotation, with these as its prior.

    Raises
    ------
    InputError
        If one is negative or not a number.
    """

    point_std_m: Annotated[
        float, figure("How exactly the point of the axis is known, each direction across it.", "m", absent=True)
    ] = 0.0
    direction_std_rad: Annotated[
        float, figure("How exactly its direction in the body is known, each of two angles.", "rad", absent=True)
    ] = 0.0
    lever_std_m: Annotated[
        float, figure("How exactly the place of each chip is known, each direction.", "m", absent=True)
    ] = 0.0
    rotation_std_rad: Annotated[
        float, figure("How exactly the orientation of each chip is known, each of three angles.", "rad", absent=True)
    ] = 0.0
    bias_std_m_s2: Annotated[
        float, figure("How exactly the constant bias of each channel is known.", "m/s²", absent=True)
    ] = 0.0

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 <= value < _LARGEST_STD:
                raise InputError(
                    f"[turning_axis]: {name} is {value!r}; give a standard deviation of 0 to {_LARGEST_STD:g}"
                )

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """Return the keys of the table ``[turning_axis]`` that hold these."""
        return tuple(one.name for one in fields(cls))

    @property
    def exact(self) -> bool:
        """Whether nothing is uncertain."""
        return not any(asdict(self).values())

    def to_dict(self) -> dict[str, Any]:
        """Return the keys of the table ``[turning_axis]``; those of 0 are left out."""
        return {name: value for name, value in asdict(self).items() if value}


@dataclass(frozen=True)
class TurningAxis(Declared):
    """An axis fixed in the body, about which alone it turns.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.AccelerometerArray.load("wheel_pair").turning_axis.direction
    array([0., 0., 1.])
    """

    direction: Annotated[NDArray[np.float64], figure("Unit vector along the axis, body frame.")]
    point: Annotated[NDArray[np.float64], figure("A point of the axis, body frame.", "m", key="point_m")]
    hub: Annotated[str, figure("fixed (a table) or free (a wheel on a moving body).", head="hub")] = "fixed"
    inclination: Annotated[
        float | None,
        figure(
            "Angle between the axis and the vertical; estimated where it is absent.", "rad",
            key="inclination_rad", absent=True,
        ),
    ] = None  # fmt: skip
    uncertainty: Annotated[
        AxisUncertainty, figure("How exactly axis and chips are known; exactly by default.", flat=True)
    ] = field(default_factory=AxisUncertainty)

    __repr__ = short_repr

    @classmethod
    def of(
        cls,
        direction: str | Sequence[float] | NDArray[np.float64],
        *,
        point: Sequence[float] | NDArray[np.float64] = (0.0, 0.0, 0.0),
        hub: str = "fixed",
        inclination: float | None = None,
        uncertainty: AxisUncertainty | None = None,
        source: str = "axis",
    ) -> TurningAxis:
        """Return an axis given as x, y or z, or as three numbers of any length.

        Raises
        ------
        InputError
            If the direction or the point are not three finite numbers, or the hub is unknown.
        """
        unit = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
        if isinstance(direction, str):
            text = direction.strip().lower()
            given: Any = unit.get(text.lstrip("+-"), text.split(","))
            sign = -1.0 if text.startswith("-") and text.lstrip("+-") in unit else 1.0
        else:
            given, sign = direction, 1.0
        try:
            vector = sign * np.asarray([float(one) for one in given])
            place = np.asarray([float(one) for one in point])
        except (TypeError, ValueError):
            raise InputError(
                f"{source}: {direction!r} is no direction; give x, y, z or three numbers as 0,0,1"
            ) from None
        length = float(np.linalg.norm(vector)) if vector.shape == (3,) else 0.0
        if not (np.isfinite(length) and length > 0.0) or place.shape != (3,) or not np.isfinite(place).all():
            raise InputError(
                f"{source}: direction and point must hold three finite numbers, the direction not all zero"
            )
        if hub not in HUBS:
            raise InputError(f"{source}: unknown hub {hub!r}; valid: {', '.join(HUBS)}{did_you_mean(hub, HUBS)}")
        if inclination is not None and not 0.0 <= inclination <= np.pi:
            raise InputError(f"{source}: inclination {inclination!r} rad; give an angle from 0 (upright) to π")
        return cls(vector / length, place, hub, inclination, uncertainty or AxisUncertainty())

    @classmethod
    def from_table(cls, table: TurningAxisTable, *, source: str) -> TurningAxis:
        """Return the axis of the table ``[turning_axis]`` of an array file."""
        return cls.of(
            table.direction,
            point=table.point_m,
            hub=table.hub,
            inclination=table.inclination_rad,
            uncertainty=AxisUncertainty(**{name: getattr(table, name) for name in AxisUncertainty.names()}),
            source=f"{source}: [turning_axis]",
        )

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], *, source: str) -> TurningAxis:
        """Return the axis whose table `to_dict` returned."""
        return cls.from_table(read(data, TurningAxisTable, source), source=source)

    @classmethod
    def from_mounting(cls, table: MountingTable, *, source: str) -> TurningAxis:
        """Return the axis of the table ``[mounting]`` of an array or twin file."""
        return cls.of(
            table.axis,
            point=table.origin_m,
            hub="free" if table.hub == "moving" else "fixed",
            inclination=None if table.inclination_deg is None else math.radians(table.inclination_deg),
            source=f"{source}: [mounting]",
        )

    def to_mounting(self) -> dict[str, Any]:
        """Return the table ``[mounting]`` of an array or twin file."""
        tilt = {} if self.inclination is None else {"inclination_deg": math.degrees(self.inclination)}
        hub = "moving" if self.hub == "free" else "fixed"
        return {"axis": self.direction.tolist(), "origin_m": self.point.tolist(), "hub": hub} | tilt
