"""Units at the border: column suffixes, their factors to SI, and standard gravity."""

from __future__ import annotations

import math
from itertools import pairwise

__all__ = [
    "GYRO_COLUMNS",
    "KEY_ENDINGS",
    "LARGEST",
    "MILLI_G",
    "NAME",
    "NUMBER",
    "RATIO",
    "READING_UNITS",
    "REFERENCE_UNITS",
    "SIZES",
    "STANDARD_GRAVITY",
    "TIME_COLUMNS",
    "duration_text",
    "is_usable",
    "key_name",
    "reference_quantity",
]

STANDARD_GRAVITY = 9.80665
"""Standard gravity, m/s²."""

MILLI_G = STANDARD_GRAVITY / 1000.0
"""A thousandth of it, the unit mg, m/s²."""

LARGEST = 1e30
"""Of a number from a file or an option: numerical, by choice, far beyond any in SI units; its tenth power is finite."""

_SMALLEST = 1e-60
"""Likewise: below what rounding leaves of a zero that a fit has found; its fifth power is a number."""

SIZES = f"a finite number, zero or between {_SMALLEST:g} and {LARGEST:g} in size"
"""What a number must be, in words."""

READING_UNITS: dict[str, float | None] = {
    "m_s2": 1.0,
    "g": STANDARD_GRAVITY,
    "mg": MILLI_G,
    "lsb": None,
}
"""Units of a sensing axis and their factor to m/s²; counts (``lsb``) need the part's sensitivity."""

REFERENCE_UNITS: dict[str, dict[str, float]] = {
    "t": {"s": 1.0},
    "tacho": {"rad_s": 1.0, "deg_s": math.pi / 180.0, "rpm": math.pi / 30.0},
    "command": {"rad_s": 1.0, "deg_s": math.pi / 180.0, "rpm": math.pi / 30.0},
    "angle": {"rad": 1.0, "deg": math.pi / 180.0},
    "carriage": {"m": 1.0, "mm": 1e-3},
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

TIME_COLUMNS = {
    "tacho_rad_s": "tacho_t_s",
    "command_rad_s": "command_t_s",
    "angle_rad": "angle_t_s",
    **dict.fromkeys(GYRO_COLUMNS, "gyro_t_s"),
}
"""Column of a reference's own times, by the reference's; on the clock of ``t_s``, s."""

RATIO, NUMBER, NAME = "ratio", "number", "name"
"""What stands in place of a unit: a small relative number (people read percent), a count or factor, words."""

KEY_ENDINGS: dict[str, str] = {
    **{
        f"{one}/({many})": f"{start}_per_{end}"
        for one, start in (("rad/s", "rad_s"), ("rad", "rad"), ("m/s²", "m_s2"))
        for many, end in (("rad", "rad"), ("rad/s", "rad_s"), ("rad²/s²", "rad2_s2"), ("rad³/s³", "rad3_s3"))
    },
    "rad/(rad/s²)": "rad_per_rad_s2",
    "m/s²/(rad/s²)": "m_s2_per_rad_s2",
    "1/(rad/s)": "per_rad_s",
    "1/(rad²/s²)": "per_rad2_s2",
    "1/(rad/s²)": "per_rad_s2",
    "1/K": "per_K",
    "s⁴/m²": "s4_m2",
    "m/s²/(rad/s)⁴": "m_s2_per_rad4_s4",
    "m/s²/√s": "m_s2_rts",
    "s²/rad²": "s2_rad2",
    "m/s²/K": "m_s2_K",
    "rad/s²": "rad_s2",
    "rad/s": "rad_s",
    "m/s²": "m_s2",
    "s²/m": "s2_m",
    "1/s": "1_s",
    "rad": "rad",
    "Hz": "hz",
    "s": "s",
    "m": "m",
}
"""Units of parameters as people read them, and how the key of a parameter in that unit ends."""


def is_usable(number: float) -> bool:
    """Whether a number is finite and of a size that can be computed with."""
    return number == 0 or _SMALLEST <= abs(number) <= LARGEST


def key_name(key: str, unit: str) -> str:
    """Return a parameter's key without the unit in which it ends: ``a11_m_s2`` in m/s² is ``a11``.

    A key that is nothing but its unit has the name ``value``; one that does not end in its unit stays as it is.
    """
    ending = KEY_ENDINGS.get(unit, "")
    if key == ending:
        return "value"
    return key.removesuffix(f"_{ending}") if ending else key


def duration_text(seconds: float) -> str:
    """Return a time as people say it, to two places: ``3 h 20 min``."""
    units = (("d", 86400), ("h", 3600), ("min", 60), ("s", 1))
    whole = round(seconds)
    for (name, size), (smaller, part) in pairwise(units):
        if whole >= size:
            return f"{whole // size} {name} {whole % size // part} {smaller}"
    return f"{whole} s"
