"""What an array of low rank gives nevertheless, in words."""

import numpy as np
import pytest

from gfimu import AccelerometerArray, Chip, GeometryError, Recording, estimate


def few_motions_text(array, sample_rate):
    recording = Recording.from_arrays(np.arange(20) / sample_rate, np.zeros((20, array.n_channels)), array)
    with pytest.raises(GeometryError) as refusal:
        estimate(recording, array)
    return str(refusal.value)


def test_one_chip_gives_its_force_and_names_the_axis_option():
    text = few_motions_text(AccelerometerArray.load("one_adxl345"), 100.0)
    assert "rank 3 of 6" in text
    assert "p_x (σ 0.02" in text  # 0.75 counts of 3.9 mg by the data sheet
    assert "alpha_x" not in text.split("can't see")[0]
    assert "--axis" in text
    assert "\n" not in text


def test_a_chip_off_the_origin_gives_the_force_at_its_place():
    far = AccelerometerArray("far", (Chip("a1", np.array([0.1, 0.02, 0.03]), np.eye(3)),))
    given = few_motions_text(far, 100.0).split("can't see")[0]
    assert "p_y" not in given
    assert "the specific force at a1" in given


def test_two_chips_give_the_turning_that_they_see_with_its_error():
    """Two chips d apart along z see α_x to σ √2 / d, and p at the first to σ."""
    pair = AccelerometerArray(
        "pair", (Chip("a1", np.zeros(3), np.eye(3)), Chip("a2", np.array([0.0, 0.0, 0.1]), np.eye(3)))
    )
    given, unseen = few_motions_text(pair, 100.0).split("can't see")
    sigma = float(given.split("p_x (σ ")[1].split()[0])
    assert abs(float(given.split("alpha_x (σ ")[1].split()[0]) / (np.sqrt(2.0) * sigma / 0.1) - 1.0) < 0.05
    assert "angular acceleration about z" in unseen
