"""A filter's innovations against χ²: false alarms as stated, temperature allowed for, faults found and named."""

from __future__ import annotations

import numpy as np
import pytest
from rate_worlds import cube, measure, sensor_errors, tumble
from scipy.stats import chi2

from gfimu import AccelerometerArray, Recording, estimate_from_rest, specific_force, summarise
from gfimu.array import PartLimits
from gfimu.base import STANDARD_GRAVITY
from gfimu.rate import filter_rate
from gfimu.rate.consistency import FALSE_ALARM, judge_consistency
from sim.scenarios import Scenario
from sim.simulation import simulate

CUBE = AccelerometerArray.load("cube12")
RATE = 100.0
SCENARIOS = ("paper_run", "rest", "tumble", "driven_run", "eccentric_mount", "speed_sweep")


def paper_run(seed, gain_std=0.0):
    """The table left and right at two speeds for 30 s; noise as stated, biases of 35 mg."""
    t = np.arange(3000) / RATE
    times = [0, 3, 4, 8, 9, 13, 14.5, 16, 17, 21, 22, 26, 27.5, 30]
    rate = np.interp(t, times, [0, 0, 2, 2, 4, 4, 0, 0, -2, -2, -4, -4, 0, 0])
    rng = np.random.default_rng(seed)
    axis = np.array([0.0, 0.0, 1.0])
    level = np.tile(STANDARD_GRAVITY * axis, (len(t), 1))
    readings = specific_force(CUBE, level, np.outer(np.gradient(rate, t), axis), np.outer(rate, axis))
    readings = readings * (1 + gain_std * rng.standard_normal(12)) + 0.3 * rng.standard_normal(12)
    readings = readings + PartLimits.of(CUBE, RATE).noise * rng.standard_normal(readings.shape)
    return Recording.from_arrays(t, readings, CUBE, reference={"tacho_rad_s": rate})


def consistency(run):
    return estimate_from_rest(run, CUBE, method="filter").metadata["consistency"]


@pytest.mark.study
def test_the_false_alarms_of_a_right_model_are_as_stated():
    array, scores, alarms = cube(), [], 0
    for seed in range(40):
        motion = tumble(RATE, 6.0, duration=4.0)
        values, errors = measure(array, motion, np.random.default_rng(seed)), sensor_errors(array, RATE)
        found = filter_rate(array, motion.t, values, errors)
        judged = judge_consistency(array, np.zeros_like(values), errors, found)
        freedom = judged.degrees_of_freedom
        assert judged.bound == pytest.approx(chi2.isf(FALSE_ALARM, freedom) / freedom)
        scores.append((judged.nis - 1.0) * np.sqrt(freedom / 2.0))
        alarms += not judged.consistent
    assert alarms == 0  # 80 tests of 1e-4
    # 40 standard normal scores: mean within 4/√40, mean square within 4 √(2/40).
    assert abs(np.mean(scores)) < 4 / np.sqrt(40)
    assert np.var(scores) == pytest.approx(1.0, abs=4 * np.sqrt(2 / 40))


def test_a_bias_that_changes_with_temperature_raises_the_bound():
    motion, array = tumble(RATE, 6.0, duration=8.0), CUBE
    values, errors = measure(array, motion, np.random.default_rng(3)), sensor_errors(array, RATE)
    temperature = 20.0 + 2.0 * motion.t
    coefficient = PartLimits.of(array, RATE).bias_tempco
    warmed = values + np.outer(temperature - 20.0, coefficient * np.random.default_rng(4).standard_normal(12))
    found = filter_rate(array, motion.t, warmed, errors)
    told, not_told = (judge_consistency(array, warmed, errors, found, temperature=one) for one in (temperature, None))
    assert told.noise_bound == not_told.bound < told.bound
    assert told.consistent


def step(size):
    def spoil(readings, rng, late):
        readings[late, 0] += size

    return spoil


def gain(readings, rng, late):
    readings[late, 6] *= 1.2


def noise(readings, rng, late):
    readings[late, 4] += 20 * 0.03 * rng.standard_normal(int(late.sum()))


@pytest.mark.study(but=["0-20 mg", "0-gain", "0-noise"])
@pytest.mark.parametrize(
    ("spoil", "channel"),
    [(step(0.020 * STANDARD_GRAVITY), "a11"), (step(1.0), "a11"), (gain, "a31"), (noise, "a22")],
    ids=["20 mg", "1 m/s²", "gain", "noise"],
)
@pytest.mark.parametrize("seed", [0, 1])
def test_a_fault_in_mid_run_is_flagged_and_its_channel_named(spoil, channel, seed):
    run = paper_run(seed, gain_std=0.01)
    spoil(run.readings, np.random.default_rng(seed), run.t_s >= 15.0)
    found = estimate_from_rest(run, CUBE, method="filter", keep_faulty=True)
    judged = found.metadata["consistency"]
    assert not judged["consistent"]
    assert judged["worst_channel"] == channel
    assert judged["nis_without_worst"] < 1.2
    (warning,) = (one for one in summarise(found, run, CUBE).warnings if "started again" not in one)
    assert channel in warning


@pytest.mark.study(only=["0-1 m/s\\xb2", "1-1 m/s\\xb2"])
@pytest.mark.parametrize(
    ("spoil", "channel"),
    [(step(0.020 * STANDARD_GRAVITY), "a11"), (step(1.0), "a11"), (gain, "a31"), (noise, "a22")],
    ids=["20 mg", "1 m/s²", "gain", "noise"],
)
@pytest.mark.parametrize("seed", [0, 1])
def test_without_the_faulty_channel_the_filter_is_consistent(spoil, channel, seed):
    run = paper_run(seed, gain_std=0.01)
    spoil(run.readings, np.random.default_rng(seed), run.t_s >= 15.0)
    found = estimate_from_rest(run, CUBE, method="filter")
    assert {name for fault in found.metadata["health"]["faults"] for name in fault["channels"]} == {channel}
    assert found.metadata["consistency"]["consistent"]


@pytest.mark.parametrize("seed", range(12))
def test_uncalibrated_chips_are_consistent(seed):
    judged = consistency(paper_run(seed, gain_std=0.01))
    assert judged["consistent"]
    assert judged["worst_channel"] is None
    assert judged["noise_bound"] == judged["bound"]


@pytest.mark.study(only=["11-eccentric_mount", "11-speed_sweep", "12-eccentric_mount", "12-speed_sweep"])
@pytest.mark.parametrize("name", SCENARIOS)
@pytest.mark.parametrize("seed", [11, 12])
def test_shipped_scenarios_are_consistent(name, seed):
    scenario = Scenario.load(name)
    run = simulate(scenario, seed=seed)
    judged = estimate_from_rest(run, scenario.array, method="filter").metadata["consistency"]
    assert judged["consistent"], judged
