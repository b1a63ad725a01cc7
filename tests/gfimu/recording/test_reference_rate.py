"""A reference rate in another unit is named: the accelerometers off the axis fix the scale of the rate."""

from dataclasses import replace

import numpy as np
import pytest

from gfimu import AccelerometerArray, InputError, Recording, estimate, simulate
from gfimu.array import PartLimits
from gfimu.recording import doubts_of, odd_rates

CUBE = AccelerometerArray.load("cube12")
RPM, DEG = 30.0 / np.pi, 180.0 / np.pi


@pytest.fixture(scope="module")
def table_run():
    return simulate("paper_run", seed=11)


@pytest.fixture(scope="module")
def hand_run():
    return simulate("hand", seed=11)


def with_reference(run, **factors):
    """Return the run with references times a factor each; those that are not named are left out."""
    return replace(run, reference={name: run.reference[name] * factor for name, factor in factors.items()})


@pytest.mark.parametrize(
    ("column", "factor", "words"),
    [
        ("tacho_rad_s", RPM, "tacho_rad_s is in rev/min, not in rad/s: it is 9."),
        ("tacho_rad_s", DEG, "name it tacho_deg_s, or convert it to rad/s"),
        ("tacho_rad_s", -DEG, "is in deg/s"),
        ("tacho_rad_s", 0.5 / np.pi, "is in rev/s, not in rad/s"),
        ("command_rad_s", RPM, "name it command_rpm"),
        ("angle_rad", DEG, "angle_rad is in deg, not in rad"),
    ],
)
def test_a_rate_in_another_unit_is_refused_with_the_unit(table_run, column, factor, words):
    assert doubts_of(with_reference(table_run, **{column: 1.0}), CUBE) == ()
    wrong = with_reference(table_run, **{column: factor})
    (found,) = doubts_of(wrong, CUBE)
    assert (found.kind, found.refused) == ("reference", True)
    assert words in found.text
    assert "\n" not in found.text
    with pytest.raises(InputError, match=words.split(",", maxsplit=1)[0]):
        estimate(wrong, CUBE)


def test_a_gyro_in_degrees_is_refused(hand_run):
    gyro = {f"gyro_{axis}_rad_s": DEG for axis in "xyz"}
    assert doubts_of(hand_run, hand_run.array) == ()
    (found,) = doubts_of(with_reference(hand_run, **gyro), hand_run.array)
    assert found.refused
    assert "gyro_x_rad_s is in deg/s" in found.text


def test_another_scale_is_a_warning(table_run):
    assert doubts_of(with_reference(table_run, tacho_rad_s=1.3), CUBE) == ()  # a gain, which a diagnosis names
    (found,) = doubts_of(with_reference(table_run, tacho_rad_s=3.0), CUBE)
    assert (found.kind, found.refused) == ("reference", False)
    assert "check its unit, the gear, and the lengths of the array file" in found.text


@pytest.mark.parametrize("factor", [1.0, RPM, DEG])
def test_a_rest_shows_no_rate(factor):
    """The noise of a tachometer at rest goes with slow changes of the biases by chance."""
    assert doubts_of(with_reference(simulate("rest", seed=2), tacho_rad_s=factor), CUBE) == ()


def test_an_array_file_in_cm_is_no_tachometer_in_revolutions(table_run):
    """Lengths 100 times too large make the rate ten times too small: near 9.55, but the chips are metres apart."""
    large = CUBE.with_geometry(100.0 * CUBE.chip_positions, [chip.axes for chip in CUBE.chips])
    limits = PartLimits.of(large, table_run.sample_rate)
    run = with_reference(table_run, tacho_rad_s=1.0)
    (found,) = odd_rates(run, large, limits, np.ones(12, dtype=bool))
    assert not found.certain
    assert "lengths of the array file are in cm" in found.text


def test_a_rate_beyond_any_table_is_a_warning_where_one_chip_can_not_tell():
    one = AccelerometerArray.load("one_adxl345")
    t = np.arange(3000) / 100.0
    readings = np.array([0.0, 0.0, 9.81]) + 0.05 * np.random.default_rng(1).standard_normal((3000, 3))
    run = Recording.from_arrays(t, readings, one, reference={"tacho_rad_s": 300.0 * np.sin(t)})
    (found,) = doubts_of(run, one)
    assert (found.kind, found.refused) == ("reference", False)
    assert "more than a table or wheel has: it may be in rev/min or deg/s" in found.text
    assert doubts_of(with_reference(run, tacho_rad_s=0.1), one) == ()
