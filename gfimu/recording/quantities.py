"""What the columns of a recording are named: quantities, their units and the factors to SI."""

from __future__ import annotations

import math

from gfimu.base.units import MILLI_G, STANDARD_GRAVITY

__all__ = [
    "ESTIMATE_REFERENCES",
    "GYRO_COLUMNS",
    "READING_UNITS",
    "REFERENCE_UNITS",
    "TIME_COLUMNS",
    "reference_quantity",
]

READING_UNITS: dict[str, float | None] = {
    "m_s2": 1.0,
    "g": STANDARD_GRAVITY,
    "mg": MILLI_G,
    "lsb": None,
}
"""Units of a sensing axis and their factor to m/s²; counts (``lsb``) need the part's sensitivity."""

_LENGTHS = {"m": 1.0, "mm": 1e-3}

REFERENCE_UNITS: dict[str, dict[str, float]] = {
    "t": {"s": 1.0},
    "tacho": {"rad_s": 1.0, "deg_s": math.pi / 180.0, "rpm": math.pi / 30.0},
    "command": {"rad_s": 1.0, "deg_s": math.pi / 180.0, "rpm": math.pi / 30.0},
    "angle": {"rad": 1.0, "deg": math.pi / 180.0},
    "position_x": _LENGTHS,
    "position_y": _LENGTHS,
    "position_z": _LENGTHS,
    "carriage": _LENGTHS,
    "carriage_speed": {"m_s": 1.0, "mm_s": 1e-3},
    "carriage_acceleration": {"m_s2": 1.0, "mm_s2": 1e-3, "g": STANDARD_GRAVITY},
    "temperature": {"degC": 1.0},
    "gyro_x": {"rad_s": 1.0, "deg_s": math.pi / 180.0},
    "gyro_y": {"rad_s": 1.0, "deg_s": math.pi / 180.0},
    "gyro_z": {"rad_s": 1.0, "deg_s": math.pi / 180.0},
}
"""Reference quantities of a recording, their units and factors; the first unit of each is the SI one."""


def reference_quantity(column: str) -> str | None:
    """Return the reference quantity that a column's name begins with, the longest one; None where there is none."""
    return max((name for name in REFERENCE_UNITS if column.startswith(f"{name}_")), key=len, default=None)


GYRO_COLUMNS = ("gyro_x_rad_s", "gyro_y_rad_s", "gyro_z_rad_s")
"""Columns of a recording's gyro, body axes."""

ESTIMATE_REFERENCES: dict[str, tuple[str, ...]] = {
    "gyro": GYRO_COLUMNS,
    "tacho": ("tacho_rad_s",),
    "angle": ("angle_rad",),
    "position": ("position_x_m", "position_y_m", "position_z_m"),
    "axis": (),
}
"""References that an estimate can use beside the readings, and their columns; a fixed axis has none."""

TIME_COLUMNS = {
    "tacho_rad_s": "tacho_t_s",
    "command_rad_s": "command_t_s",
    "angle_rad": "angle_t_s",
    **dict.fromkeys(GYRO_COLUMNS, "gyro_t_s"),
}
"""Column of a reference's own times, by the reference's; on the clock of ``t_s``, s."""
