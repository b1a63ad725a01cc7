"""How exactly the mounting of an array on an axis is known."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields
from typing import Any

from gfimu.errors import InputError

__all__ = ["AxisUncertainty"]


@dataclass(frozen=True)
class AxisUncertainty:
    """Standard deviations of what a drawing says of chips on an axis; 0 is exact.

    What is not exact is estimated together with the rotation, with these as its prior.

    Parameters
    ----------
    point_std_m : float
        Of the point of the axis, each direction across it, m.
    direction_std_rad : float
        Of the direction of the axis in the body, each of two angles, rad.
    lever_std_m : float
        Of the place of each chip, each direction, chips independent, m.
    rotation_std_rad : float
        Of the orientation of each chip, each of three angles, chips independent, rad.
    bias_std_m_s2 : float
        Of the constant bias of each channel, m/s².

    Raises
    ------
    InputError
        If one is negative or not a number.
    """

    point_std_m: float = 0.0
    direction_std_rad: float = 0.0
    lever_std_m: float = 0.0
    rotation_std_rad: float = 0.0
    bias_std_m_s2: float = 0.0

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 <= value < math.inf:
                raise InputError(f"[turning_axis]: {name} is {value!r}; give a standard deviation of at least 0")

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
