"""Numbers as a certificate prints them: the uncertainty with two significant digits, the value to the same place."""

from __future__ import annotations

import math

__all__ = ["plain_number", "plus_minus"]

_DIGITS = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
_SMALLEST, _LARGEST = -3, 5
"""Powers of ten between which a number is printed without one (numerical: of the layout)."""


def plus_minus(value: float, expanded: float) -> str:
    """Print a value with its expanded uncertainty: ``414.419 ± 0.071``, ``(−0.3 ± 2.4) × 10⁻⁵``."""
    if expanded <= 0.0:
        return plain_number(value)
    power = math.floor(math.log10(max(abs(value), expanded)))
    if _SMALLEST <= power <= _LARGEST:
        return _signed(_rounded(value, expanded))
    text = _rounded(value / 10.0**power, expanded / 10.0**power)
    return _signed(f"({text}) × 10{str(power).translate(_DIGITS)}")


def plain_number(value: float) -> str:
    """Print a number without uncertainty."""
    return _signed(f"{value:.6g}")


def _rounded(value: float, expanded: float) -> str:
    """Round to the place of the second significant digit of the uncertainty."""
    places = 1 - math.floor(math.log10(expanded))
    places -= round(expanded, places) >= 10.0 ** (2 - places)  # 0.0996 is 0.10, not 0.100
    show = max(places, 0)
    return f"{round(value, places) + 0.0:.{show}f} ± {round(expanded, places):.{show}f}"


def _signed(text: str) -> str:
    return text.replace("-", "−")
