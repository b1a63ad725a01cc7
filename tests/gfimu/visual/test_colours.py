"""Colours: what has to be told from each other stays apart for the colour-blind; a chip's hue depends on nothing else.

Dichromatic vision is simulated with the matrices of G. M. Machado, M. M. Oliveira and L. A. F. Fernandes, "A
physiologically-based model for simulation of color vision deficiency", IEEE TVCG 15 (2009), severity 1, in linear RGB.
Differences are CIEDE2000 as in G. Sharma, W. Wu and E. N. Dalal, Color Res. Appl. 30 (2005).
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from every_item import every

from gfimu.base import chip_colour, css
from gfimu.base.results.colours import AFTER_ON_PAPER, AXES_ON_PAPER, BEFORE_ON_PAPER, INK, NOISE_ON_PAPER
from gfimu.visual.colours import AFTER, AXES, BEFORE, COMMAND, ESTIMATE, MEASURED, TACHO, TRUTH

SEPARATED = {  # colours of one picture that a reader has to distinguish, by picture
    "run": {"truth": TRUTH, "estimate": ESTIMATE, "tacho": TACHO, "command": COMMAND},
    "body axes": dict(zip("xyz", AXES, strict=True)),
    "body axes on paper": dict(zip("xyz", AXES_ON_PAPER, strict=True)),
    "comparison": {"measured": MEASURED, "before": BEFORE, "after": AFTER},
    "report": {"noise": NOISE_ON_PAPER, "before": BEFORE_ON_PAPER, "after": AFTER_ON_PAPER, "ink": INK},
}
VISION = {
    "normal": np.eye(3),
    "protanopia": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
    "tritanopia": np.array(
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]]
    ),
}
LEAST = 15.0  # ΔE₀₀ between colours of one picture, by choice; 2.3 is just noticeable side by side
LEAST_OF_CHIPS = {2: 20.0, 4: 10.0, 8: 5.0}  # for the first chips, which have their names beside them


def lab(colour, vision: str) -> np.ndarray:
    """CIELAB (D65) of an sRGB colour as it is seen with a vision, shape (3,)."""
    encoded = np.array(colour[:3]) / 255.0
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    seen = np.clip(VISION[vision] @ linear, 0.0, 1.0)
    to_xyz = np.array(
        [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.119192, 0.9503041]]
    )
    ratio = to_xyz @ seen / np.array([0.95047, 1.0, 1.08883])
    f = np.where(ratio > (6 / 29) ** 3, np.cbrt(ratio), ratio / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def difference(first: np.ndarray, second: np.ndarray) -> float:
    """CIEDE2000 of two CIELAB colours."""
    (l1, a1, b1), (l2, a2, b2) = first, second
    chroma = (np.hypot(a1, b1) + np.hypot(a2, b2)) / 2
    stretch = 1.5 - 0.5 * np.sqrt(chroma**7 / (chroma**7 + 25.0**7))
    c1, c2 = np.hypot(a1 * stretch, b1), np.hypot(a2 * stretch, b2)
    h1, h2 = np.degrees(np.arctan2([b1, b2], [a1 * stretch, a2 * stretch])) % 360
    turn = (h2 - h1 + 180) % 360 - 180 if c1 * c2 else 0.0
    light, mean_c, hue = (l1 + l2) / 2, (c1 + c2) / 2, np.radians(h1 + turn / 2 if c1 * c2 else h1 + h2)
    weight = (
        1
        - 0.17 * np.cos(hue - np.radians(30))
        + 0.24 * np.cos(2 * hue)
        + 0.32 * np.cos(3 * hue + np.radians(6))
        - 0.20 * np.cos(4 * hue - np.radians(63))
    )
    s_l = 1 + 0.015 * (light - 50) ** 2 / np.sqrt(20 + (light - 50) ** 2)
    s_c, s_h = 1 + 0.045 * mean_c, 1 + 0.015 * mean_c * weight
    away = (np.degrees(hue) % 360 - 275) / 25
    rotation = -2 * np.sqrt(mean_c**7 / (mean_c**7 + 25.0**7)) * np.sin(np.radians(60 * np.exp(-(away**2))))
    d_l, d_c = (l2 - l1) / s_l, (c2 - c1) / s_c
    d_h = 2 * np.sqrt(c1 * c2) * np.sin(np.radians(turn / 2)) / s_h
    return float(np.sqrt(d_l**2 + d_c**2 + d_h**2 + rotation * d_c * d_h))


def least_difference(colours, vision: str) -> float:
    seen = [lab(colour, vision) for colour in colours]
    return min(difference(one, other) for one, other in itertools.combinations(seen, 2))


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [  # pairs 1, 7, 17 and 20 of the table of Sharma, Wu and Dalal
        ((50.0, 2.6772, -79.7751), (50.0, 0.0, -82.7485), 2.0425),
        ((50.0, 0.0, 0.0), (50.0, -1.0, 2.0), 2.3669),
        ((50.0, 2.5, 0.0), (73.0, 25.0, -18.0), 27.1492),
        ((50.0, 2.5, 0.0), (58.0, 24.0, 15.0), 19.4535),
    ],
)
def test_the_colour_difference_agrees_with_its_published_pairs(first, second, expected):
    assert difference(np.array(first), np.array(second)) == pytest.approx(expected, abs=1e-4)


def test_the_former_red_and_green_would_not_pass():
    assert least_difference([(226, 92, 92), (72, 190, 130)], "deuteranopia") < LEAST


@pytest.mark.parametrize("vision", VISION)
@every("picture", SEPARATED)
def test_colours_of_one_picture_stay_apart(picture, vision):
    assert least_difference(SEPARATED[picture].values(), vision) > LEAST


@pytest.mark.parametrize("vision", VISION)
def test_before_and_after_stay_far_apart(vision):
    assert least_difference([BEFORE, AFTER], vision) > 2 * LEAST
    assert least_difference([BEFORE_ON_PAPER, AFTER_ON_PAPER], vision) > 2 * LEAST


@pytest.mark.parametrize("on_paper", [False, True])
@pytest.mark.parametrize("vision", VISION)
@every("count", LEAST_OF_CHIPS)
def test_few_chips_stay_apart(count, vision, on_paper):
    colours = [chip_colour(chip, on_paper=on_paper) for chip in range(count)]
    assert least_difference(colours, vision) > LEAST_OF_CHIPS[count]


def test_64_chips_have_64_colours_and_neighbours_are_far_apart():
    colours = [chip_colour(chip) for chip in range(64)]
    assert len(set(colours)) == 64
    for one, other in itertools.pairwise(colours):
        assert difference(lab(one, "normal"), lab(other, "normal")) > 20.0


def hue(colour) -> float:
    _, a, b = lab(colour, "normal")
    return float(np.degrees(np.arctan2(b, a)))


@every("chip", range(0, 64, 7))
def test_axes_of_a_chip_share_its_hue_and_differ_in_lightness(chip):
    axes = [chip_colour(chip, axis) for axis in range(3)]
    light = [lab(colour, "normal")[0] for colour in axes]
    assert np.diff(light).min() > 5.0
    for colour in (*axes, chip_colour(chip, on_paper=True)):
        assert abs((hue(colour) - hue(chip_colour(chip)) + 180) % 360 - 180) < 20.0  # CIELAB bends the blue hues


def test_colours_as_text():
    assert css((213, 94, 0)) == "#d55e00"
    assert css((1, 2, 3, 128)) == "#010203"
