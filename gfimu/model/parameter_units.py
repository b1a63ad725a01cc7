"""Units of the parameters of effects, as people read them, and the keys that end in them."""

from __future__ import annotations

__all__ = ["KEY_ENDINGS", "NAME", "NUMBER", "RATIO", "key_name"]

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


def key_name(key: str, unit: str) -> str:
    """Return a parameter's key without the unit in which it ends: ``a11_m_s2`` in m/s² is ``a11``.

    A key that is nothing but its unit has the name ``value``; one that does not end in its unit stays as it is.
    """
    ending = KEY_ENDINGS.get(unit, "")
    if key == ending:
        return "value"
    return key.removesuffix(f"_{ending}") if ending else key
