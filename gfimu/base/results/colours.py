"""The colours of pictures on paper and of chips, so that the same quantity has the same colour everywhere.

Chips take one hue each, in any number: hue and lightness in OKLCH (B. Ottosson, 2020), a space whose steps look alike,
with the hue turned by the golden angle from chip to chip. A chip's hue follows from its number alone, so it is the same
in each picture, and neighbours in number are far apart in hue. The sensing axes of a chip differ in lightness.

Body axes follow the field's convention (x red, y green, z blue). What was before is orange and what came after is blue
(vermilion and blue of M. Okabe and K. Ito, 2008, on paper). The colours of one picture stay apart for the
colour-blind; the tests simulate their vision. Those of the viewer and of HTML pages are in `gfimu.visual.colours`.
"""

from __future__ import annotations

import numpy as np

__all__ = [
    "AFTER_ON_PAPER",
    "AXES_ON_PAPER",
    "BEFORE_ON_PAPER",
    "DIVERGING",
    "INK",
    "NOISE_ON_PAPER",
    "PALE",
    "SPIN_AXIS_ON_PAPER",
    "STYLES",
    "Colour",
    "chip_colour",
    "css",
]

Colour = tuple[int, int, int] | tuple[int, int, int, int]
"""Red, green, blue and optionally opacity, each 0 to 255."""

AXES_ON_PAPER: tuple[Colour, Colour, Colour] = ((180, 30, 40), (96, 178, 60), (36, 72, 190))
BEFORE_ON_PAPER: Colour = (213, 94, 0)
AFTER_ON_PAPER: Colour = (0, 114, 178)
NOISE_ON_PAPER: Colour = (138, 143, 152)
SPIN_AXIS_ON_PAPER: Colour = (150, 120, 0)
INK: Colour = (34, 38, 46)
PALE: Colour = (201, 206, 214)
DIVERGING = "RdBu_r"
"""Colour map of signed quantities (C. Brewer); red and blue stay apart for the colour-blind."""

STYLES = ("-", (0, (4.5, 1.2)), (0, (1.2, 1.0)))
"""Lines of the first, second and third sensing axis of a chip on paper: full, dashed, dotted (of matplotlib)."""

_GOLDEN_TURN = (np.sqrt(5.0) - 1.0) / 2.0
_FIRST_HUE = 80.0  # degrees; of those tried in steps of 10, the colour-blind see the first eight chips best apart
_LIGHTNESS, _CHROMA = (0.72, 0.58), (0.11, 0.09)  # on the dark background, on paper: within sRGB at nearly every hue
_EVERY_OTHER = 0.10  # lightness by which even and odd chips differ from the mean, as hues alone merge for dichromats
_AXIS_STEP = 0.06  # lightness from one sensing axis of a chip to the next


def chip_colour(chip: int, axis: int = 1, *, on_paper: bool = False) -> Colour:
    """Return the colour of a chip, or of one of its sensing axes, by their indices from 0.

    Parameters
    ----------
    chip : int
        Index of the chip in its array.
    axis : int
        Sensing axis on the chip: 0 darker, 1 the chip's own colour, 2 lighter. On paper the style of the line,
        `STYLES`, stands for the axis instead.
    on_paper : bool
        Whether the background is white; the dark one of the viewer by default. The hue is the same.
    """
    lightness = _LIGHTNESS[on_paper] + _EVERY_OTHER * (1 if chip % 2 else -1)
    lightness += 0.0 if on_paper else _AXIS_STEP * (axis - 1)
    return _from_oklch(lightness, _CHROMA[on_paper], np.deg2rad(_FIRST_HUE) + 2.0 * np.pi * _GOLDEN_TURN * chip)


def css(colour: Colour) -> str:
    """Return a colour as ``#rrggbb``, for SVG, HTML and matplotlib."""
    return "#" + "".join(f"{part:02x}" for part in colour[:3])


def _from_oklch(lightness: float, chroma: float, hue: float) -> Colour:
    """Return the sRGB colour of OKLCH coordinates (hue in rad), cut to what a screen shows."""
    a, b = chroma * np.cos(hue), chroma * np.sin(hue)
    to_cones = np.array([[1.0, 0.3963377774, 0.2158037573], [1.0, -0.1055613458, -0.0638541728],
                         [1.0, -0.0894841775, -1.2914855480]])  # fmt: skip
    to_rgb = np.array([[4.0767416621, -3.3077115913, 0.2309699292], [-1.2684380046, 2.6097574011, -0.3413193965],
                       [-0.0041960863, -0.7034186147, 1.7076147010]])  # fmt: skip
    linear = np.clip(to_rgb @ (to_cones @ np.array([lightness, a, b])) ** 3, 0.0, 1.0)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)
    red, green, blue = (round(255.0 * float(part)) for part in encoded)
    return red, green, blue
