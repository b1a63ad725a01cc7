"""Units at the border: column suffixes, their factors to SI, and standard gravity."""

from __future__ import annotations

import math

from gfimu.errors import UnitError

__all__ = ["READING_UNITS", "REFERENCE_UNITS", "STANDARD_GRAVITY", "split_unit"]

STANDARD_GRAVITY = 9.80665
"""Standard gravity, m/s²."""

READING_UNITS: dict[str, float | None] = {
    "m_s2": 1.0,
    "g": STANDARD_GRAVITY,
    "mg": STANDARD_GRAVITY / 1000.0,
    "lsb": None,
}
"""Units of a sensing axis and their factor to m/s²; counts (``lsb``) need the part's sensitivity."""

REFERENCE_UNITS: dict[str, dict[str, float]] = {
    "t": {"s": 1.0},
    "tacho": {"rad_s": 1.0, "deg_s": math.pi / 180.0, "rpm": math.pi / 30.0},
    "command": {"rad_s": 1.0, "deg_s": math.pi / 180.0, "rpm": math.pi / 30.0},
    "angle": {"rad": 1.0, "deg": math.pi / 180.0},
    "temperature": {"degC": 1.0},
    "gyro_x": {"rad_s": 1.0, "deg_s": math.pi / 180.0},
    "gyro_y": {"rad_s": 1.0, "deg_s": math.pi / 180.0},
    "gyro_z": {"rad_s": 1.0, "deg_s": math.pi / 180.0},
}
"""Reference quantities of a recording, their units and factors; the first unit of each is the SI one."""


def split_unit(column: str, quantity: str, units: dict[str, float] | dict[str, float | None]) -> str:
    """Return the unit suffix of ``column`` for ``quantity``; raises `UnitError` listing the valid units."""
    unit = column[len(quantity) + 1 :]
    if unit not in units:
        raise UnitError(
            f"column {column!r}: unknown unit {unit!r} for {quantity}; valid: "
            + ", ".join(f"{quantity}_{name}" for name in units)
        )
    return unit
