"""Readings at a rail are left out of an estimate, and said; a level that is held is no rail."""

from dataclasses import replace

import numpy as np
import pytest

import gfimu
from gfimu.recording import doubts_of, without_doubtful


def without_clipped(recording, array):
    found = [one for one in doubts_of(recording, array) if one.kind == "clipped"]
    return without_doubtful(recording, array, found), tuple(found)


@pytest.fixture(scope="module")
def run():
    return gfimu.simulate("speed_sweep", seed=1)


def test_a_held_level_is_no_rail(run):
    same, found = without_clipped(run, run.array)
    assert same is run
    assert found == ()


def test_an_adc_that_overshoots_is_at_its_rail(run):
    """The pile is a few counts wide, as on a real logger; other channels see the motion all the same."""
    readings = run.readings.copy()
    place = run.array.index("a22")
    level = np.quantile(readings[:, place], 0.8)
    over = readings[:, place] > level
    count = 0.0039 * 9.80665
    rng = np.random.default_rng(2)
    readings[over, place] = level + count * rng.choice([0, 1, 10], over.sum(), p=[0.98, 0.01, 0.01])
    clipped = replace(run, readings=readings)
    cleaned, found = without_clipped(clipped, run.array)
    assert [one.channels for one in found] == [("a22",)]
    assert np.isnan(cleaned.readings[over, place]).all()
    # The one count below the rail goes with it.
    assert np.isfinite(cleaned.readings[readings[:, place] < level - 1.5 * count]).all()
    estimate = gfimu.estimate(clipped, method="filter", rest_bias=True)
    tacho = run.reference["tacho_rad_s"]
    assert np.sqrt(np.nanmean((estimate.omega[:, 2] - tacho) ** 2)) < 0.06
    assert any("a22 reads its rail" in text for text in estimate.metadata["warnings"])


def test_a_gyro_at_its_range_is_left_out(run):
    rate = np.clip(40.0 * np.sin(run.t_s), -34.9, 34.9) + 0.0
    turned = replace(run, reference={**run.reference, "gyro_x_rad_s": rate})
    cleaned, found = without_clipped(turned, run.array)
    assert len(found) == 2
    assert np.isnan(cleaned.reference["gyro_x_rad_s"]).mean() == pytest.approx(np.mean(np.abs(rate) == 34.9), abs=1e-3)
