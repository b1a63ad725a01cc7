"""The axis about which a body turns, where it is known: a table, a wheel, a pendulum."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.errors import InputError
from gfimu.geometry.axis_uncertainty import AxisUncertainty
from gfimu.short_repr import short_repr

__all__ = ["HUBS", "TurningAxis"]

HUBS = ("fixed", "free")
_KEYS = ("direction", "point_m", "hub", "inclination_rad", *AxisUncertainty.names())


@dataclass(frozen=True)
class TurningAxis:
    """An axis fixed in the body, about which alone it turns.

    Parameters
    ----------
    direction : ndarray, shape (3,)
        Unit vector along the axis, body frame.
    point : ndarray, shape (3,)
        A point of the axis, body frame, m.
    hub : {"fixed", "free"}
        Whether the axis stands still (a table), or moves with a body whose acceleration is not known (a wheel).
    inclination : float or None
        Angle between the axis and the vertical, rad; None if it is to be estimated.
    uncertainty : AxisUncertainty
        How exactly axis, places, orientations and biases of the chips are known; exactly by default.
    """

    direction: NDArray[np.float64]
    point: NDArray[np.float64]
    hub: str = "fixed"
    inclination: float | None = None
    uncertainty: AxisUncertainty = field(default_factory=AxisUncertainty)

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
            raise InputError(f"{source}: unknown hub {hub!r}; valid: {', '.join(HUBS)}")
        if inclination is not None and not 0.0 <= inclination <= np.pi:
            raise InputError(f"{source}: inclination {inclination!r} rad; give an angle from 0 (upright) to π")
        return cls(vector / length, place, hub, inclination, uncertainty or AxisUncertainty())

    @classmethod
    def from_dict(cls, data: Any, *, source: str) -> TurningAxis:
        """Return the axis of the table ``[turning_axis]`` of an array file."""
        if not isinstance(data, Mapping) or "direction" not in data:
            raise InputError(f"{source}: [turning_axis] needs direction, as [0, 0, 1]")
        for key in data:
            if key not in _KEYS:
                raise InputError(f"{source}: [turning_axis]: unknown key {key!r}; valid: {', '.join(_KEYS)}")
        tilt = data.get("inclination_rad")
        if tilt is not None and (isinstance(tilt, bool) or not isinstance(tilt, int | float)):
            raise InputError(f"{source}: [turning_axis]: inclination_rad is {tilt!r}; give a number, in rad")
        return cls.of(
            data["direction"],
            point=data.get("point_m", (0.0, 0.0, 0.0)),
            hub=data.get("hub", "fixed"),
            inclination=tilt,
            uncertainty=AxisUncertainty(**{name: data[name] for name in AxisUncertainty.names() if name in data}),
            source=f"{source}: [turning_axis]",
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the table of an array file."""
        found = {"direction": self.direction.tolist(), "point_m": self.point.tolist(), "hub": self.hub}
        tilt = {} if self.inclination is None else {"inclination_rad": self.inclination}
        return found | tilt | self.uncertainty.to_dict()
