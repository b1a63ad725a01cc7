"""The colours of the rerun viewer and of HTML pages; those of pictures on paper are in `gfimu.base.results.colours`."""

from __future__ import annotations

from collections.abc import Mapping

from gfimu.base.results.colours import (
    AFTER_ON_PAPER,
    BEFORE_ON_PAPER,
    INK,
    NOISE_ON_PAPER,
    PALE,
    SPIN_AXIS_ON_PAPER,
    Colour,
)

__all__ = [
    "AFTER",
    "AXES",
    "BACKGROUND",
    "BEFORE",
    "COMMAND",
    "ESTIMATE",
    "ESTIMATE_BAND",
    "GRAVITY",
    "HEALTH",
    "MEASURED",
    "METAL",
    "PAGE",
    "SPIN_AXIS",
    "TABLE",
    "TACHO",
    "TONES",
    "TRUTH",
    "UNDECIDED",
]

AXES: tuple[Colour, Colour, Colour] = ((213, 60, 60), (150, 225, 120), (70, 130, 250))
TRUTH: Colour = (165, 168, 174)
ESTIMATE: Colour = (240, 140, 20)
ESTIMATE_BAND: Colour = (196, 146, 88)
UNDECIDED: Colour = (235, 90, 165)
"""The rate where its sign is not decided."""
TACHO: Colour = (86, 190, 240)
COMMAND: Colour = (140, 95, 215)
MEASURED: Colour = (138, 142, 150)
BEFORE: Colour = (230, 120, 0)
AFTER: Colour = (70, 160, 240)
METAL: Colour = (186, 194, 204)
TABLE: Colour = (78, 88, 102)
GRAVITY: Colour = (236, 236, 240)
SPIN_AXIS: Colour = (240, 228, 66)
BACKGROUND: Colour = (24, 26, 30)
"""Of the 3-D view."""

TONES: Mapping[str, Colour] = {
    "calm": (31, 122, 85),
    "found": (28, 95, 168),
    "open": (154, 98, 0),
    "alarm": (176, 48, 48),
}
"""Of the verdicts of a diagnosis, which are written beside them."""

PAGE: Mapping[str, Mapping[str, Colour]] = {
    "light": {
        "ground": (244, 245, 247),
        "card": (255, 255, 255),
        "code": (238, 240, 243),
        "pressed": (226, 232, 240),
        "ink": INK,
        "quiet": (93, 100, 112),
        "line": (223, 227, 232),
        "edge": (138, 143, 152),
        "focus": (28, 95, 168),
        "band": PALE,
        "noise": NOISE_ON_PAPER,
        "before": BEFORE_ON_PAPER,
        "after": AFTER_ON_PAPER,
        "spin-axis": SPIN_AXIS_ON_PAPER,
        **TONES,
    },
    "dark": {
        "ground": (17, 19, 23),
        "card": BACKGROUND,
        "code": (42, 46, 54),
        "pressed": (54, 62, 74),
        "ink": (228, 231, 236),
        "quiet": (160, 167, 178),
        "line": (54, 59, 68),
        "edge": (112, 119, 131),
        "focus": (120, 180, 250),
        "band": (66, 72, 82),
        "noise": MEASURED,
        "before": BEFORE,
        "after": AFTER,
        "spin-axis": SPIN_AXIS,
        "calm": (88, 196, 150),
        "found": (110, 175, 245),
        "open": (226, 166, 40),
        "alarm": (245, 125, 118),
    },
}
"""Of an HTML page by day and by night, by the names of its style sheet; a name means the same in both."""

HEALTH: Mapping[str, Colour] = {
    "not watched": (104, 110, 120),
    "used": (40, 130, 96),
    "in doubt": (226, 166, 40),
    "excluded": (205, 50, 50),
    "missing": (44, 48, 56),
    "saturated": (150, 86, 200),
    "stuck": (64, 132, 224),
}
"""Of the health of a channel, by the word that is written in its lane."""
