"""The colours of every picture: the same quantity has the same colour everywhere.

Body axes follow the field's convention (x red, y green, z blue). Truth is grey, the estimate orange, the tachometer
sky blue, the command violet; chips take four hues that colour-blind people can tell apart (Okabe and Ito). All stand
out from the viewer's light and dark background alike.
"""

from __future__ import annotations

__all__ = [
    "AXES",
    "CHIPS",
    "COMMAND",
    "ESTIMATE",
    "ESTIMATE_BAND",
    "MEASURED",
    "METAL",
    "PREDICTED_AFTER",
    "PREDICTED_BEFORE",
    "TABLE",
    "TACHO",
    "TRUTH",
    "Colour",
    "chip_colour",
]

Colour = tuple[int, int, int] | tuple[int, int, int, int]
"""Red, green, blue and optionally opacity, each 0 to 255."""

AXES: tuple[Colour, Colour, Colour] = ((235, 87, 87), (88, 190, 96), (86, 148, 242))
CHIPS: tuple[Colour, ...] = ((230, 159, 0), (86, 180, 233), (0, 178, 132), (214, 120, 178))
TRUTH: Colour = (138, 142, 150)
ESTIMATE: Colour = (240, 140, 20)
ESTIMATE_BAND: Colour = (196, 146, 88)
TACHO: Colour = (86, 190, 240)
COMMAND: Colour = (152, 112, 220)
MEASURED: Colour = (138, 142, 150)
PREDICTED_BEFORE: Colour = (226, 92, 92)
PREDICTED_AFTER: Colour = (72, 190, 130)
METAL: Colour = (186, 194, 204)
TABLE: Colour = (78, 88, 102)


def chip_colour(chip: int) -> Colour:
    """Colour of a chip by its index; the four hues repeat."""
    return CHIPS[chip % len(CHIPS)]
