"""Rest: its stated false-alarm rate, what it is not taken for, and its use."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rate_worlds import GRAVITY, Motion, cube, measure, sensor_errors, smooth_step, total_noise_std, turntable

from gfimu import InputError, LiveRateFilter
from gfimu.rate import (
    ChannelSets,
    FilterSettings,
    RestTest,
    constant_readings,
    filter_rate,
    joined_estimates,
    smooth_rate,
)

ARRAY = cube(0.1)
RATE = 100.0
FULL = ChannelSets(ARRAY, total_noise_std(ARRAY, RATE)).full


def still(duration):
    t = np.arange(round(duration * RATE)) / RATE
    return Motion(t, np.zeros((len(t), 3)), np.zeros((len(t), 3)), np.tile([0, 0, GRAVITY], (len(t), 1)))


def test_blocks_at_rest_are_recognised_at_the_stated_rate():
    motion = still(200.0)
    missed = 0
    for seed in range(10):
        values = measure(ARRAY, motion, np.random.default_rng(seed), quantise=False)
        noise = total_noise_std(ARRAY, RATE)
        passed = constant_readings(ARRAY, values, np.sqrt(noise**2 - (0.0039 * GRAVITY) ** 2 / 12), 1 / RATE)
        missed += np.count_nonzero(~passed.reshape(-1, 50)[:, 0])
    assert missed <= 4000 * RestTest().false_alarm * 2  # scatter and halves, each with a margin


def test_a_rest_is_not_lost_to_blocks_that_fail_by_chance():
    """They cost at most the stated share of blocks; a rest is lost, for 2.5 s or more, about once in 1e4 blocks."""
    motion = still(200.0)
    doubted = lost = 0
    for seed in range(10):
        values = measure(ARRAY, motion, np.random.default_rng([31, seed]))
        recognised = filter_rate(ARRAY, motion.t, values, sensor_errors(ARRAY, RATE)).rest.reshape(-1, 50)[:, 0]
        doubted += np.count_nonzero(~recognised)
        lost += not np.convolve(recognised, np.ones(5), "valid").all()  # five in a row that are none
    assert 0 < doubted < 4000 * 2 * RestTest().alpha_false_alarm
    assert lost <= 3


def accelerated(blocks, deviations):
    """A rest, with a mean α in ``blocks`` of so many of its standard deviations."""
    motion = still(15.0)
    values = measure(ARRAY, motion, np.random.default_rng(8))
    size = deviations * np.sqrt(FULL.alpha_noise[2, 2] / 50)
    alpha = np.zeros((len(motion.t), 3))
    for block in blocks:
        rows = slice(50 * block, 50 * (block + 1))
        alpha[rows, 2] = size - (values[rows] - values[:500].mean(axis=0)).mean(axis=0) @ FULL.alpha_rows[2]
    for number, chip in enumerate(ARRAY.chips):
        values[:, 3 * number : 3 * number + 3] += np.cross(alpha, chip.position) @ chip.axes.T
    return filter_rate(ARRAY, motion.t, values, sensor_errors(ARRAY, RATE)).rest.reshape(-1, 50)[:, 0]


def test_one_failed_block_is_a_doubt_and_two_in_a_row_doubt_the_ones_before():
    assert accelerated([20], 0.0).all()
    doubted = accelerated([20], 3.8)
    assert not doubted[20]
    assert doubted[[18, 19, 21, 22]].all()
    assert not accelerated([20, 21], 3.8)[19:22].any()


def test_a_significant_failure_ends_a_rest_and_takes_two_blocks_before_with_it():
    found = accelerated([20], 6.5)
    assert found[:18].all()
    assert not found[18:23].any()


def test_rest_holds_the_rate_and_ends_with_the_motion():
    motion = turntable(RATE, 2 * np.pi)
    found = filter_rate(ARRAY, motion.t, measure(ARRAY, motion, np.random.default_rng(0)), sensor_errors(ARRAY, RATE))
    assert found.rest[motion.t < 1.0].all()
    assert not found.rest[np.linalg.norm(motion.omega, axis=1) > 0.1].any()
    without = filter_rate(
        ARRAY, motion.t, measure(ARRAY, motion, np.random.default_rng(0)), sensor_errors(ARRAY, RATE),
        FilterSettings(rest=None),
    )  # fmt: skip
    rows = slice(100, 200)
    assert without.std[rows].max() > 1.5 * found.std[rows].max()


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


def test_a_departure_too_slow_for_one_block_is_no_rest():
    """0.1 rev/s reached within 3 s: a second after the start the rate is 0.12 rad/s and its α not yet significant."""
    array = cube()
    motion = turntable(RATE, 2 * np.pi * 0.1, duration=6.0)
    errors = sensor_errors(array, RATE)
    moving = (motion.t > 2.6) & (motion.t < 2.99)
    squares = []
    for seed in range(20):
        values = measure(array, motion, np.random.default_rng([5, seed]))
        for solve in (filter_rate, smooth_rate):
            found = solve(array, motion.t, values, errors)
            assert not found.rest[moving].any()
            squares.append(((found.omega - motion.omega) / found.std)[350:])
    # 20 runs with 3 axes, each about one independent error: three standard deviations of the mean square.
    assert np.mean(np.square(squares)) < 1 + 3 * np.sqrt(2 / 60)


def test_rest_is_the_same_live_and_in_blocks():
    array = cube()
    motion = turntable(RATE, 2 * np.pi * 0.1, duration=6.0)
    values = measure(array, motion, np.random.default_rng([5, 0]))
    whole, live = (LiveRateFilter(array, sensor_errors(array, RATE), 1 / RATE) for _ in range(2))
    block = joined_estimates([whole.push(motion.t, values), whole.finish()])
    each = [live.push(time, row) for time, row in zip(motion.t, values, strict=True)] + [live.finish()]
    single = joined_estimates([part for part in each if len(part)])
    for name in ("t_s", "omega", "covariance"):
        np.testing.assert_allclose(getattr(single, name), getattr(block, name), rtol=0, atol=1e-7)  # of a fit


def test_rest_resumes_after_a_single_block_that_was_none():
    motion = still(15.0)
    values = measure(ARRAY, motion, np.random.default_rng(3))
    values[500:550] += 0.2 * np.sin(np.arange(50.0))[:, None]  # a knock on the table: no turning
    found = filter_rate(ARRAY, motion.t, values, sensor_errors(ARRAY, RATE))
    assert found.rest[350:400].all()
    assert not found.rest[500:550].any()
    assert found.rest[1000:].mean() > 0.9  # four seconds later


def test_steady_turning_about_the_vertical_is_not_rest():
    """Its readings are as constant as those of rest."""
    motion = turntable(RATE, 2 * np.pi * 0.3, duration=12.0)
    values = measure(ARRAY, motion, np.random.default_rng(1))
    steady = (motion.t > 6) & (motion.t < 11.5)
    assert constant_readings(ARRAY, values, total_noise_std(ARRAY, RATE), 1 / RATE)[steady].all()
    found = filter_rate(ARRAY, motion.t, values, sensor_errors(ARRAY, RATE))
    assert not found.rest[steady].any()


def test_a_start_in_motion_is_known_for_one():
    motion = turntable(RATE, 2 * np.pi, duration=10.0)
    late = Motion(*(column[350:] for column in (motion.t, motion.omega, motion.alpha, motion.p)))
    found = filter_rate(ARRAY, late.t, measure(ARRAY, late, np.random.default_rng(0)), sensor_errors(ARRAY, RATE))
    assert found.start.kind == "motion"
    assert found.start.rest_probability == 0.0


@pytest.mark.parametrize("field", ["false_alarm", "window_s", "rate_std", "entry_s"])
def test_settings_are_checked(field):
    with pytest.raises(InputError, match=field):
        replace(RestTest(), **{field: -1.0})
