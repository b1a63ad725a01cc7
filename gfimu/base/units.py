"""Standard gravity, the sizes that numbers may have, and times in words."""

from __future__ import annotations

from itertools import pairwise

__all__ = ["LARGEST", "MILLI_G", "SIZES", "STANDARD_GRAVITY", "duration_text", "is_usable"]

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


def is_usable(number: float) -> bool:
    """Whether a number is finite and of a size that can be computed with."""
    return number == 0 or _SMALLEST <= abs(number) <= LARGEST


def duration_text(seconds: float) -> str:
    """Return a time as people say it, to two places: ``3 h 20 min``."""
    units = (("d", 86400), ("h", 3600), ("min", 60), ("s", 1))
    whole = round(seconds)
    for (name, size), (smaller, part) in pairwise(units):
        if whole >= size:
            return f"{whole // size} {name} {whole % size // part} {smaller}"
    return f"{whole} s"
