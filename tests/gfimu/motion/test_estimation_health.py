"""`gfimu.estimate` leaves out a channel that contradicts the others, says so, and writes its health."""

from dataclasses import replace

import numpy as np
import pytest

import gfimu
from gfimu import AccelerometerArray, Estimate, InputError
from gfimu.rate import HealthCode


@pytest.fixture(scope="module")
def run():
    return gfimu.simulate("paper_run", seed=1)


def faulty(run, size):
    readings = run.for_array(AccelerometerArray.load("cube12")).copy()
    readings[run.t_s >= 15.0, 0] += size
    return replace(run, readings=readings)


def error(estimate, run):
    late = run.t_s > 15.0
    return np.sqrt(np.nanmean((estimate.omega[late, 2] - run.reference["tacho_rad_s"][late]) ** 2))


@pytest.mark.parametrize("method", ["filter", "smoother"])
def test_a_step_on_one_channel_hardly_harms(run, method):
    bad = faulty(run, 0.2)
    left_out = gfimu.estimate(bad, method=method, rest_bias=True)
    kept = gfimu.estimate(bad, method=method, rest_bias=True, keep_faulty=True)
    assert error(kept, run) > 3 * error(left_out, run)
    assert error(left_out, run) < 0.03
    (fault,) = left_out.metadata["health"]["faults"]
    assert fault["channels"] == ["a11"]
    assert any("a11: step" in warning for warning in left_out.metadata["warnings"])
    assert kept.health is None


def test_a_method_that_leaves_no_channel_out_refuses_to_keep_them(run):
    with pytest.raises(InputError, match=r"--keep-faulty has no use with method 'integrate'.*filter"):
        gfimu.estimate(run, keep_faulty=True)
    with pytest.raises(InputError, match="--keep-faulty has no use with --axis"):
        gfimu.estimate(run, axis="z", keep_faulty=True)


def test_health_is_in_the_file(run, tmp_path):
    found = gfimu.estimate(faulty(run, 0.2), method="filter", rest_bias=True)
    assert set(np.unique(found.health["a11"])) == {HealthCode.USED, HealthCode.EXCLUDED}
    assert not any(codes.any() for name, codes in found.health.items() if name != "a11")
    for name in ("e.csv", "e.parquet"):
        found.write(tmp_path / name)
        again = Estimate.read(tmp_path / name)
        np.testing.assert_array_equal(again.health["a11"], found.health["a11"])


def test_readings_that_are_missing_clipped_or_stuck_have_codes_of_their_own(run):
    readings = run.for_array(AccelerometerArray.load("cube12")).copy()
    limit = 0.6 * np.nanmax(readings[:, 0])  # far below the part's range
    readings[:, 0] = np.minimum(readings[:, 0], limit)
    readings[1000:1005, 1] = np.nan
    readings[1500:, 8] = readings[1500, 8]
    found = gfimu.estimate(replace(run, readings=readings), method="filter", rest_bias=True, force=True)
    health = found.health
    assert (health["a12"][1000:1005] == HealthCode.MISSING).all()
    assert np.sum(health["a12"] != HealthCode.USED) == 5
    clipped = readings[:, 0] == limit
    assert (health["a11"][clipped] == HealthCode.SATURATED).all()
    assert np.mean(health["a33"][1600:] == HealthCode.STUCK) > 0.9
    assert not np.isin(health["a33"][:1400], (HealthCode.STUCK, HealthCode.EXCLUDED)).any()


def test_methods_that_watch_no_channel_have_codes_where_a_reading_is_missing(run):
    assert gfimu.estimate(run, rest_bias=True).health is None
    readings = run.for_array(AccelerometerArray.load("cube12")).copy()
    readings[100, 3] = np.nan
    health = gfimu.estimate(replace(run, readings=readings), method="ml").health
    assert health["a21"][100] == HealthCode.MISSING


def test_a_sound_run_is_estimated_as_before(run):
    found = gfimu.estimate(run, method="filter", rest_bias=True)
    kept = gfimu.estimate(run, method="filter", rest_bias=True, keep_faulty=True)
    np.testing.assert_array_equal(found.omega, kept.omega)
    assert found.metadata["health"]["faults"] == []


@pytest.mark.parametrize("seed", [1, 2])
def test_readings_that_are_missing_for_a_while_make_no_channel_faulty(seed):
    """With eleven channels products of ω remain in α, at 12 rad/s hundreds of rad/s²."""
    run = gfimu.simulate("paper_run", seed=seed)
    readings = run.for_array(AccelerometerArray.load("cube12")).copy()
    readings[1000:1005, 1] = np.nan
    readings[1700:1740, 5] = np.nan
    found = gfimu.estimate(replace(run, readings=readings), method="filter", rest_bias=True)
    assert found.metadata["health"]["faults"] == []


@pytest.mark.parametrize("seed", [10, 30, 73])
def test_gains_that_were_not_calibrated_are_no_faults(seed):
    """Parts as bought: 1 % of the centripetal acceleration is 8 mm/s² here, for as long as the table turns."""
    found = gfimu.estimate(gfimu.simulate("paper_run", seed=seed), method="filter", rest_bias=True)
    assert found.metadata["health"]["faults"] == []
