"""Likelihood of coarsely rounded readings, recovery of a mean and a noise, and what passes between steps."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.stats import norm

from gfimu.diagnosis.data.rounding import Steps, between_steps, common_step, rounded_likelihood, rounding_noise

STEP = 1 / 16


def warming(t):
    return 25.0 + 3.0 * (1.0 - np.exp(-t / 12.0)) + 0.3 * np.sin(0.3 * t)


def rounded(values, step=STEP):
    return np.round(values / step) * step


def rms(values):
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.parametrize("quantum", [0.5, 3.0, 10.0])
def test_deviance_and_derivatives(quantum):
    error = np.linspace(-2.5 * quantum, 2.5 * quantum, 41)[:, None] + 0.013
    sigma, step = 0.7, 1e-4
    found = rounded_likelihood(error, quantum, sigma)
    near = np.abs(error) < quantum / 2 + 4 * sigma
    likelihood = norm.cdf((error + quantum / 2) / sigma) - norm.cdf((error - quantum / 2) / sigma)
    assert_allclose(found.deviance[near], -2 * np.log(likelihood[near]), rtol=1e-9, atol=1e-12)
    up, down = (rounded_likelihood(error + sign * step, quantum, sigma).deviance for sign in (1, -1))
    # The prediction x falls as the error grows: d(−2 log p)/dx = −(up − down)/2h.
    slope = -(up - down) / (2 * step)
    assert_allclose(-2 * found.residual * found.weight / sigma**2, slope, atol=2e-5)
    curvature = (up - 2 * found.deviance + down) / step**2 / 2 * sigma**2
    steep = found.weight > 0.05
    assert_allclose(found.weight[steep] ** 2, curvature[steep], atol=1e-5)


def test_mean_and_noise_are_recovered_from_coarse_readings():
    # Steps of four standard deviations: the sample mean of the rounded readings is far off, the likelihood's is not.
    rng = np.random.default_rng(5)
    n, sigma, quantum, mean = 4000, 0.25, 1.0, 0.38
    readings = np.round((mean + sigma * rng.standard_normal((n, 1))) / quantum) * quantum
    x = np.full(1, 0.2)
    for _ in range(30):
        found = rounded_likelihood(readings - x, quantum, sigma)
        x = x + (found.weight * found.residual).sum(axis=0) / (found.weight**2).sum(axis=0)
    std = sigma / np.sqrt((found.weight**2).sum())
    assert abs(readings.mean() - mean) > 5 * std
    assert abs(x[0] - mean) < 4 * std
    assert_allclose(rounding_noise(readings - mean, quantum, np.array([0.4])), sigma, rtol=0.12)


def test_a_prediction_absurdly_far_off_keeps_a_finite_pull_towards_the_reading():
    error = np.array([3e2, 3e3, 3e6, -3e6])[:, None]
    far = rounded_likelihood(error, 0.3, np.array([0.03]))
    for part in (far.residual, far.weight, far.deviance):
        assert np.isfinite(part).all()
    assert_allclose(far.weight, 1.0, atol=0.01)
    assert_allclose(far.residual, error - np.sign(error) * 0.15, rtol=1e-3)
    assert_allclose(far.deviance, ((np.abs(error) - 0.15) / 0.03) ** 2, rtol=1e-3)


@pytest.mark.parametrize(("noise", "step", "coarse"), [(0.02, 0.01, False), (0.02, 0.05, True), (0.0, 0.05, True)])
def test_steps_of_a_reference(noise, step, coarse):
    rng = np.random.default_rng(2)
    values = np.round((np.linspace(0.0, 4.0, 3000) + noise * rng.standard_normal(3000)) / step) * step
    steps, before = Steps.of_reference(values, float(np.hypot(noise, step / np.sqrt(12.0))))
    assert steps.coarse == coarse
    assert steps.reference == pytest.approx(step if coarse else 0.0)
    assert steps.reference_noise(before) == pytest.approx(np.hypot(noise, step / np.sqrt(12.0)), rel=0.02)


def test_values_in_no_steps_have_none():
    assert common_step(np.random.default_rng(0).standard_normal(500)) is None
    assert common_step(np.full(50, 0.3)) is None
    assert common_step(3.0 * np.arange(40) * 0.7) == pytest.approx(2.1)


@pytest.mark.parametrize("quantum", [0.3, 3.0])
def test_readings_far_off_and_near_are_expanded_alike(quantum):
    error = np.linspace(-20.0, 20.0, 81)[:, None]
    near = rounded_likelihood(error, quantum, 1.0)
    # One reading beyond the range of probabilities has all of them expanded by their logarithms.
    far = rounded_likelihood(np.append(error, [[40.0]], axis=0), quantum, 1.0)
    for one, other in ((near.residual, far.residual), (near.weight, far.weight), (near.deviance, far.deviance)):
        assert_allclose(one, other[:-1], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("rate", [10.0, 400.0])
def test_what_passes_through_the_steps_is_close_to_the_truth(rate):
    t = np.arange(0.0, 40.0, 1.0 / rate)
    truth = warming(t)
    found = between_steps(t, rounded(truth))
    assert np.abs(found - truth).max() < 0.6 * STEP
    assert rms(found - truth) < 0.25 * rms(rounded(truth) - truth)


def test_a_little_noise_makes_it_better_than_the_steps_still():
    rng = np.random.default_rng(1)
    t = np.arange(0.0, 40.0, 0.01)
    truth = warming(t)
    readings = rounded(truth + 0.005 * rng.standard_normal(len(t)))
    assert rms(between_steps(t, readings) - truth) < 0.5 * rms(readings - truth)


@pytest.mark.parametrize(
    "values",
    [
        np.full(500, 25.0),
        rounded(25.0 + 0.001 * np.arange(50)),  # one step is none
        25.0 + 0.01 * np.random.default_rng(2).standard_normal(500),
        rounded(25.0 + 0.2 * np.random.default_rng(3).standard_normal(500)),
    ],
    ids=["constant", "one step", "no steps", "noise larger than the steps"],
)
def test_what_has_no_steps_to_see_is_left_as_it_is(values):
    assert_array_equal(between_steps(np.arange(len(values)) / 100.0, values), values)
