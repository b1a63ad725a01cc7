"""The smoother of a free body's gyro, against motions whose rate and angular acceleration are known."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from gfimu.diagnosis import smooth_gyro

T = 0.01
NOISE = 2e-3


def swinging(n=3000, frequency=0.5, seed=1):
    """Time, rate and its derivative, each axis a sine of its own, and a noisy gyro."""
    t = T * np.arange(n)
    turn = 2 * np.pi * frequency * np.array([1.0, 0.7, 0.4])
    rate, acceleration = 3.0 * np.sin(np.outer(t, turn)), 3.0 * turn * np.cos(np.outer(t, turn))
    return t, rate, acceleration, rate + np.random.default_rng(seed).normal(0, NOISE, rate.shape)


def derivative(t, values):
    return CubicSpline(t, values)(t, 1)


def test_noise_is_found_and_most_of_it_is_gone():
    t, rate, acceleration, gyro = swinging()
    smooth = smooth_gyro(gyro, np.zeros(len(t), dtype=bool), T)
    # The standard deviation of a standard deviation of n samples is σ/√(2n); four of them.
    assert smooth.noise == pytest.approx(NOISE, rel=4 / np.sqrt(2 * len(t)))
    assert np.std(smooth.rate - rate) < 0.4 * NOISE
    raw = np.std(derivative(t, gyro) - acceleration)
    error = np.std((derivative(t, smooth.rate) - acceleration)[20:-20])
    assert error < 0.1 * raw
    # As white noise of its greatest density it is at least as large as it is.
    assert error < smooth.acceleration_error < 0.5 * raw


def test_the_error_does_not_depend_on_the_estimate():
    t, _, acceleration, gyro = swinging(frequency=0.05)
    smooth = smooth_gyro(gyro, np.zeros(len(t), dtype=bool), T)
    for rate, dependent in ((gyro, True), (smooth.rate, False)):
        estimate = derivative(t, rate)[20:-20]
        slope = np.sum((estimate - acceleration[20:-20]) * estimate) / np.sum(estimate**2)
        assert (slope > 0.05) == dependent


def test_a_motion_as_fast_as_the_samples_is_left_as_the_gyro_reads_it():
    rng = np.random.default_rng(2)
    gyro = rng.normal(0, 5.0, (2000, 3))
    gyro = gyro[1:] + gyro[:-1]
    smooth = smooth_gyro(np.cumsum(gyro, axis=0), np.zeros(len(gyro), dtype=bool), T)
    assert np.std(smooth.rate - np.cumsum(gyro, axis=0)) < 0.1 * np.std(gyro)


def test_a_violent_part_of_a_quiet_run_is_not_smoothed_as_if_it_were_noise():
    rng = np.random.default_rng(3)
    gyro = rng.normal(0, NOISE, (4000, 3))
    gyro[3000:] += 5.0 * rng.normal(0, 1.0, (1000, 3))
    smooth = smooth_gyro(gyro, np.zeros(len(gyro), dtype=bool), T)
    # With a quarter loud the median is the quiet part's quantile 2/3 (0.967 σ, not 0.674 σ); the bound is 1.5 of that.
    assert smooth.noise.max() < 1.5 * 0.967 / 0.674 * NOISE * 1.05
    assert np.std((smooth.rate - gyro)[3000:]) < 0.1 * 5.0


def test_samples_filled_in_do_not_draw_the_rate():
    t, rate, _, gyro = swinging()
    missing = np.zeros(len(t), dtype=bool)
    missing[500:503] = missing[1500] = True
    spoilt = gyro.copy()
    spoilt[missing] += 0.5
    smooth = smooth_gyro(spoilt, missing, T)
    assert np.abs(smooth.rate - rate)[missing].max() < 4 * NOISE


def test_the_spectrum_of_its_error_is_no_smaller_than_the_error_where_that_is_passed():
    t, rate, _, gyro = swinging()
    smooth = smooth_gyro(gyro, np.zeros(len(t), dtype=bool), T)
    frequency = np.fft.rfftfreq(len(t), T)
    error = np.abs(np.fft.rfft(smooth.rate - rate, axis=0)) ** 2 / len(t)
    stated = smooth.error_power(np.pi * frequency * T)
    slow = (frequency > 0.1) & (frequency < 0.3)
    # Means over some twenty frequencies of an exponential distribution scatter by a fifth.
    assert error[slow].mean() == pytest.approx(stated[slow].mean(), rel=0.6)
    assert stated[frequency > 10.0].max() < 0.01 * NOISE**2
