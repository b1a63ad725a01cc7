"""Noise of the channels from a recording: each channel's own, whatever the body does, and a tone where it is one."""

from __future__ import annotations

import numpy as np
import pytest
from rate_worlds import cube, measure, sensor_errors, total_noise_std, tumble

from gfimu import AccelerometerArray
from gfimu.rate import ChannelSets
from gfimu.rate.measured_noise import NoisePolicy, measured_noise

RATE = 100.0


def any_motion(array, n, rng):
    """Readings (n, c) of a rigid body whose motion is noise itself, far louder than the sensors."""
    motion = rng.normal(size=(n, 12)) * np.repeat([50.0, 5.0, 50.0], [3, 3, 6])
    return motion @ np.hstack([array.regression_matrix, array.centripetal_matrix]).T


@pytest.mark.parametrize("stated", [0.5, 1.0, 2.0])
def test_parity_shows_the_noise_whatever_the_motion(stated):
    """The parity rows of this array see 21 of the 24 variances; the others are drawn to the common factor."""
    array = AccelerometerArray.load("corners8")
    rng = np.random.default_rng(5)
    truth = np.where(np.arange(24) == 5, 0.12, 0.04)
    readings = any_motion(array, 2000, rng) + truth * rng.standard_normal((2000, 24)) + 0.3
    found = measured_noise(ChannelSets(array, np.full(24, 0.04 * stated)), readings, 1 / RATE)
    assert found[5] == pytest.approx(0.12, rel=0.2)
    np.testing.assert_allclose(np.delete(found, 5) / 0.04, 1.0, atol=0.25)
    assert np.mean(np.delete(found, 5)) == pytest.approx(0.04, rel=0.05)


def test_few_samples_leave_the_data_sheet():
    array = AccelerometerArray.load("corners8")
    rng = np.random.default_rng(6)
    sets = ChannelSets(array, np.full(24, 0.04))
    few = 0.12 * rng.standard_normal((40, 24))
    assert np.all(measured_noise(sets, few[:20], 1 / RATE) == sets.noise_std)
    drawn = measured_noise(sets, few, 1 / RATE)
    assert 0.09 < np.sqrt(np.mean(drawn**2)) < 0.12  # 480 degrees of freedom against 20


def test_an_array_without_parity_by_its_differences():
    array, motion = cube(), tumble(RATE, 2 * np.pi, duration=30.0)
    values = measure(array, motion, np.random.default_rng(7))
    sets = ChannelSets(array, total_noise_std(array, RATE))
    np.testing.assert_allclose(measured_noise(sets, values, 1 / RATE) / sets.noise_std, 1.0, atol=0.15)


def test_a_motion_is_no_noise():
    """Half a radian per sample: third differences show the motion, so that the data sheet stays."""
    array, motion = cube(), tumble(RATE, 2 * np.pi * 8, duration=20.0)
    late = motion.t > 6.0
    values = measure(array, motion, np.random.default_rng(8))[late]
    sets = ChannelSets(array, total_noise_std(array, RATE))
    assert np.all(measured_noise(sets, values, 1 / RATE) <= sets.noise_std)


@pytest.mark.parametrize("name", ["cube12", "mimu4444"])
def test_a_tone_in_one_channel_counts_as_its_noise(name):
    array = AccelerometerArray.load(name)
    sets = ChannelSets(array, np.full(array.n_channels, 0.04))
    t = np.arange(1000) / 62.5
    readings = 0.04 * np.random.default_rng(9).standard_normal((1000, array.n_channels))
    readings[:, 4] += 0.16 * np.sin(2 * np.pi * 12.5 * t)
    found = measured_noise(sets, readings, 1 / 62.5)
    assert found[4] == pytest.approx(np.hypot(0.04, 0.16 / np.sqrt(2)), rel=0.25)
    np.testing.assert_allclose(np.delete(found, 4), 0.04, rtol=0.2)


def test_noise_of_a_part_of_the_run_is_not_that_of_the_run():
    array = AccelerometerArray.load("corners8")
    rng = np.random.default_rng(10)
    readings = 0.04 * rng.standard_normal((3000, 24))
    readings[1500:, 3] *= 20.0
    found = measured_noise(ChannelSets(array, np.full(24, 0.04)), readings, 1 / RATE)
    np.testing.assert_allclose(found, 0.04, rtol=0.15)
    assert NoisePolicy().calm > 1.0 + 4 * np.sqrt(2 / (12 * 99))  # a window at rest is never left out by chance


def test_errors_of_the_sensors_are_those_of_the_test():
    np.testing.assert_allclose(sensor_errors(cube(), RATE).noise_std, total_noise_std(cube(), RATE))
