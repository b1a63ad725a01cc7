"""What a recording can show is said before its diagnosis: odd data, effects that its motion separates, next steps."""

import numpy as np
import pytest

from gfimu import AccelerometerArray, InputError
from gfimu.diagnosis import check_runs, turns_one_way
from gfimu.recording import Recording
from sim.trials import Measurement, measure
from sim.twin import Twin

TWIN = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")


@pytest.fixture(scope="module")
def run():
    return measure(np.random.default_rng(3), TWIN, (), Measurement(duration=40.0))


def views(found):
    return {one.name: one for one in found.effects}


def test_a_run_of_many_speeds_shows_most_effects(run):
    found = check_runs([run], TWIN, ["run"])
    assert found.findings == ()
    seen = [one for one in found.effects if one.detectability > 5.0]
    assert len(seen) > 15
    # An eccentric cube is four chips displaced alike, as the page of the diagnosis says.
    assert "sensor_position" in views(found)["eccentricity"].confused_with
    assert any("on its side" in line for line in found.advice)
    (facts,) = found.runs
    assert facts.duration_s == pytest.approx(40.0, abs=0.1)
    assert facts.share_forwards > 0.05


def test_a_short_slow_run_of_one_way_is_told_what_it_lacks(run):
    tacho = run.reference["tacho_rad_s"]
    slow = Recording.from_arrays(
        run.t_s[:1200],
        np.tile([0.0, 0.0, 9.80665], 4) + 0.03 * np.random.default_rng(0).standard_normal((1200, 12)),
        TWIN.array,
        reference={"tacho_rad_s": 0.7 + 0.02 * np.random.default_rng(1).standard_normal(1200) + 0.0 * tacho[:1200]},
    )
    found = check_runs([slow], TWIN, ["slow"])
    advice = " ".join(found.advice)
    assert "record longer" in advice
    assert "turn backwards as well" in advice
    assert "whole turns" in advice
    assert "rest" in advice
    fast = views(check_runs([run], TWIN, ["run"]))
    # A steady slow rotation can't tell a gain from a bias, the other run can.
    assert "bias" in views(found)["scale_factor"].confused_with
    assert "bias" not in fast["scale_factor"].confused_with


def test_odd_data_are_said(run):
    readings = run.readings.copy()
    readings[:, 4] = np.minimum(readings[:, 4], np.quantile(readings[:, 4], 0.9))
    readings[1000:1200, 7] = np.nan
    odd = Recording.from_arrays(run.t_s, readings, TWIN.array, reference=run.reference)
    findings = " ".join(check_runs([odd], TWIN, ["odd"]).findings)
    assert "odd: a22" in findings
    assert "rail" in findings
    assert "a32: 200 of 4000 cells are empty" in findings


def test_a_run_without_its_reference_is_refused(run):
    bare = Recording.from_arrays(run.t_s, run.readings, TWIN.array)
    with pytest.raises(InputError, match="tacho"):
        check_runs([bare], TWIN, ["bare"])


def test_turning_back_takes_no_turns_away():
    t = np.linspace(0.0, 20.0, 2001)
    rate = np.where(t < 10.0, 2.0 * np.pi, -2.0 * np.pi)
    assert turns_one_way(rate, t) == pytest.approx(10.0, abs=0.02)
