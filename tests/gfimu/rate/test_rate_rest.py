"""Rest: its stated false-alarm rate, what it is not taken for, and its use."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rate_worlds import GRAVITY, Motion, cube, measure, sensor_errors, smooth_step, total_noise_std, turntable

from gfimu.errors import InputError
from gfimu.rate.filter import filter_rate
from gfimu.rate.kalman import FilterSettings
from gfimu.rate.rest_test import RestTest, constant_readings

ARRAY = cube(0.1)
RATE = 100.0


def still(duration):
    t = np.arange(round(duration * RATE)) / RATE
    return Motion(t, np.zeros((len(t), 3)), np.zeros((len(t), 3)), np.tile([0, 0, GRAVITY], (len(t), 1)))


def test_blocks_at_rest_are_recognised_at_the_stated_rate():
    motion = still(200.0)
    test = RestTest(noise_margin=0.0)
    missed = 0
    for seed in range(10):
        values = measure(ARRAY, motion, np.random.default_rng(seed), quantise=False)
        noise = total_noise_std(ARRAY, RATE)
        passed = constant_readings(ARRAY, values, np.sqrt(noise**2 - (0.0039 * GRAVITY) ** 2 / 12), 1 / RATE, test)
        missed += np.count_nonzero(~passed.reshape(-1, 50)[:, 0])
    # Two of the five statistics, 4000 blocks: 16 expected; within four standard deviations of Poisson.
    assert abs(missed - 4000 * test.false_alarm * 2 / 5) < 4 * 4


def test_rest_holds_the_rate_and_ends_with_the_motion():
    motion = turntable(RATE, 2 * np.pi)
    found = filter_rate(ARRAY, motion.t, measure(ARRAY, motion, np.random.default_rng(0)), sensor_errors(ARRAY, RATE))
    assert found.rest[motion.t < 1.99].mean() > 0.99
    assert not found.rest[np.linalg.norm(motion.omega, axis=1) > 0.1].any()
    without = filter_rate(
        ARRAY, motion.t, measure(ARRAY, motion, np.random.default_rng(0)), sensor_errors(ARRAY, RATE),
        FilterSettings(rest=None),
    )  # fmt: skip
    rows = slice(100, 200)
    assert np.abs(found.omega[rows]).max() < 0.1 < np.abs(without.omega[rows]).max()


def test_rest_begins_again_after_a_motion():
    t = np.arange(round(25 * RATE)) / RATE
    up, rise = smooth_step(t, 2, 4)
    down, fall = smooth_step(t, 8, 10)
    motion = Motion(
        t,
        np.outer(6 * (up - down), [0, 0, 1]),
        np.outer(6 * (rise - fall), [0, 0, 1]),
        np.tile([0, 0, GRAVITY], (len(t), 1)),
    )
    found = filter_rate(ARRAY, t, measure(ARRAY, motion, np.random.default_rng(0)), sensor_errors(ARRAY, RATE))
    assert not found.rest[(t > 3) & (t < 10)].any()
    assert found.rest[t > 17].mean() > 0.9
    assert np.abs(found.omega[t > 18]).max() < 0.06


def test_steady_turning_about_the_vertical_is_not_rest():
    """Its readings are as constant as those of rest."""
    motion = turntable(RATE, 2 * np.pi * 0.3, duration=12.0)
    values = measure(ARRAY, motion, np.random.default_rng(1))
    steady = (motion.t > 6) & (motion.t < 11.5)
    assert constant_readings(ARRAY, values, total_noise_std(ARRAY, RATE), 1 / RATE)[steady].all()
    found = filter_rate(ARRAY, motion.t, values, sensor_errors(ARRAY, RATE))
    assert not found.rest[steady].any()


def test_a_start_at_rest_that_is_none_leaves_the_sign_in_doubt():
    motion = turntable(RATE, 2 * np.pi, duration=10.0)
    late = Motion(*(column[350:] for column in (motion.t, motion.omega, motion.alpha, motion.p)))
    found = filter_rate(ARRAY, late.t, measure(ARRAY, late, np.random.default_rng(0)), sensor_errors(ARRAY, RATE))
    assert found.sign.state == "undecided"


@pytest.mark.parametrize("field", ["false_alarm", "window_s", "rate_std", "entry_s"])
def test_settings_are_checked(field):
    with pytest.raises(InputError, match=field):
        replace(RestTest(), **{field: -1.0})
