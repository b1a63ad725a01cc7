"""Units at the border: column suffixes, their factors to SI, and standard gravity."""

from __future__ import annotations

import math

from gfimu.errors import UnitError

__all__ = ["NAME", "NUMBER", "RATIO", "READING_UNITS", "REFERENCE_UNITS", "STANDARD_GRAVITY", "split_key", "split_unit"]

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


RATIO, NUMBER, NAME = "ratio", "number", "name"
"""What stands in place of a unit: a small relative number (people read percent), a count or factor, words."""

_KEY_UNITS = {
    "_m_s2_per_rad4_s4": "m/s²/(rad/s)⁴",
    "_m_s2_rts": "m/s²/√s",
    "_s2_rad2": "s²/rad²",
    "_m_s2_K": "m/s²/K",
    "_rad_s2": "rad/s²",
    "_rad_s": "rad/s",
    "_m_s2": "m/s²",
    "_s2_m": "s²/m",
    "_1_s": "1/s",
    "_rad": "rad",
    "_hz": "Hz",
    "_s": "s",
    "_m": "m",
}
"""How a parameter's key ends and the unit this means; the longest come first."""


def split_key(key: str) -> tuple[str, str]:
    """Split a parameter's key into its name and the unit in which it ends: ``a11_m_s2`` into ``a11`` and m/s².

    The unit is empty where the key ends in none; a key that is nothing but a unit has the name ``value``.
    """
    for suffix, unit in _KEY_UNITS.items():
        if key == suffix[1:]:
            return "value", unit
        if key.endswith(suffix):
            return key.removesuffix(suffix), unit
    return key, ""


def split_unit(column: str, quantity: str, units: dict[str, float] | dict[str, float | None]) -> str:
    """Return the unit suffix of ``column`` for ``quantity``; raises `UnitError` listing the valid units."""
    unit = column[len(quantity) + 1 :]
    if unit not in units:
        raise UnitError(
            f"column {column!r}: unknown unit {unit!r} for {quantity}; valid: "
            + ", ".join(f"{quantity}_{name}" for name in units)
        )
    return unit
