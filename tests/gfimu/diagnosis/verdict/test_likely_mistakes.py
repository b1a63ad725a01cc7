"""Channels in another order, wrong signs, lengths in another unit, another array: each is found and said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gfimu import AccelerometerArray
from gfimu.diagnosis import diagnose, likely_mistake, predicted_by_reference, prepare
from sim.effects import make_effect
from sim.trials import Measurement, measure
from sim.twin import Twin

CUBE = AccelerometerArray.load("cube12")
TWIN = Twin(array=CUBE, array_name="cube12")
SHORT = Measurement(duration=15.0)
WRONG = "the order or the signs of the channels are wrong"


@pytest.fixture(scope="module")
def sound():
    return measure(np.random.default_rng(5), TWIN, [], SHORT)


def mistake_in(recording, twin=TWIN):
    runs = prepare([recording], TWIN, ["run"]).runs
    return likely_mistake(twin, runs, predicted_by_reference)


def reordered(recording, order, signs):
    return replace(recording, readings=recording.readings[:, order] * signs)


def test_a_sound_recording_has_none(sound):
    assert mistake_in(sound) is None


def test_an_effect_of_the_library_is_none():
    world = measure(np.random.default_rng(6), TWIN, [make_effect("mount_tilt", {"x_rad": 0.05, "y_rad": -0.03})], SHORT)
    assert mistake_in(world) is None


def test_swapped_channels_are_named(sound):
    order = np.arange(12)
    order[[1, 4]] = order[[4, 1]]
    found = mistake_in(reordered(sound, order, 1.0))
    one, other = CUBE.channels[1], CUBE.channels[4]
    assert found.text == f"{WRONG} ({one} reads {other}, {other} reads {one})"
    assert found.after < 0.1 * found.before


@pytest.mark.parametrize(("share", "named"), [(0.5, True), (0.9, False)])
def test_a_chip_at_another_place_is_named(share, named):
    """A chip at half its arm is a mistake of the files; one that is a little off is an effect of the library."""
    places = CUBE.chip_positions.copy()
    places[1] *= [share, share, 1.0]
    world = measure(
        np.random.default_rng(9), TWIN.with_array(CUBE.with_geometry(places, [c.axes for c in CUBE.chips])), [], SHORT
    )
    found = mistake_in(world)
    seen = found.text if found is not None else ""
    assert (seen == "chip a2 reads as if at (0.025, -0.025, -0.050) m, not at (0.050, -0.050, -0.050) m") is named


def test_a_wrong_sign_is_named(sound):
    signs = np.ones(12)
    signs[[0, 7]] = -1.0
    found = mistake_in(reordered(sound, np.arange(12), signs))
    one, other = CUBE.channels[0], CUBE.channels[7]
    assert found.text == f"{WRONG} ({one} reads −{one}, {other} reads −{other})"


def test_chips_in_another_order_are_named(sound):
    order = np.r_[3:6, 6:9, 0:3, 9:12]
    found = mistake_in(reordered(sound, order, 1.0))
    assert found.text.startswith(WRONG)
    assert f"{CUBE.channels[0]} reads {CUBE.channels[3]}, {CUBE.channels[1]} reads {CUBE.channels[4]}" in found.text


def test_two_chips_in_each_others_place_are_named(sound):
    found = mistake_in(reordered(sound, np.r_[3:6, 0:3, 6:12], 1.0))
    a, b = CUBE.channels[:3], CUBE.channels[3:6]
    # The third axes all read gravity: which is which can't be told.
    pairs = [(a[0], b[0]), (a[1], b[1]), (b[0], a[0]), (b[1], a[1])]
    assert found.text == f"{WRONG} ({', '.join(f'{one} reads {other}' for one, other in pairs)})"


@pytest.mark.parametrize(
    ("scale", "told"), [(1e3, "in mm, not in m"), (1e2, "in cm, not in m"), (1e-3, "1000 times too small")]
)
def test_lengths_in_another_unit_are_named(sound, scale, told):
    wrong = TWIN.with_array(CUBE.with_geometry(CUBE.chip_positions * scale, [chip.axes for chip in CUBE.chips]))
    assert told in mistake_in(sound, wrong).text


def test_another_array_of_the_library_is_named():
    other = "cube12_as_built"
    built = Twin(array=AccelerometerArray.load(other), array_name=other)
    assert built.array.channels == CUBE.channels
    recording = measure(np.random.default_rng(8), built, [], SHORT)
    assert other in mistake_in(recording).text


@pytest.mark.study
def test_a_diagnosis_says_which_mistake_fits(sound):
    order = np.r_[3:12, 0:3]
    found = diagnose([reordered(sound, order, 1.0)], TWIN)
    assert found.verdict == "unknown"
    assert found.unexplained.mistake.startswith(WRONG)
    assert "with that mended the misfit falls" in found.sentences[1]
    assert found.to_dict()["unexplained"]["mistake"] == found.unexplained.mistake
