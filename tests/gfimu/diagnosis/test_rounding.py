"""Likelihood of coarsely rounded readings: derivatives by finite differences, and recovery of a mean and a noise."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.stats import norm

from gfimu.diagnosis import diagnose
from gfimu.diagnosis.coloured_noise import CosineBasis, estimate_flicker
from gfimu.diagnosis.rounding import Steps, common_step, mean_information, rounded_likelihood, rounding_noise
from sim.campaign import bias_instability
from sim.study.cases import study_cases
from sim.study.outcome import draw_world


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


@pytest.mark.parametrize("position", [0.0, 0.1, 0.37, 0.5])
def test_a_working_residual_of_one_weight_has_the_variance_of_the_noise(position):
    step, sigma, n = 0.153, np.array([0.041]), 200_000
    before = position * step + sigma * np.random.default_rng(4).standard_normal((n, 1))
    error = step * np.round(before / step) - position * step
    information = mean_information(error, step, sigma, np.ones((n, 1), dtype=bool))
    found = rounded_likelihood(error, step, sigma).evenly(information)
    # Fisher's information is the variance of the score.
    assert_allclose(np.mean((found.residual / sigma) ** 2), 1.0, rtol=0.02)
    assert abs(found.residual.mean() / sigma[0]) < 4 / np.sqrt(n)
    assert np.ptp(found.weight[found.beyond < 3.0]) == 0.0


@pytest.mark.parametrize("moving", [False, True])
def test_bias_instability_is_seen_through_coarse_steps(moving):
    rng = np.random.default_rng(5)
    step, sigma, flicker, n = 0.153, 0.027, 0.005, 12_000
    truth = 0.3 * step + (2.0 * np.sin(np.arange(n) / 170.0) if moving else np.zeros(n))
    slow = flicker * bias_instability(rng, n, 12, 1.0)
    readings = step * np.round((truth[:, None] + slow + sigma * rng.standard_normal((n, 12))) / step)
    noise, valid = np.full(13, sigma), np.ones((n, 13), dtype=bool)
    error = np.column_stack([readings - truth[:, None], np.zeros(n)])
    working, weight, _ = Steps(channels=step).weigh(error, noise, valid)
    basis = CosineBasis(n, 0.01)
    found = estimate_flicker(basis.transform(working[:, :-1]), noise[:-1], basis) / np.median(weight[:, :-1], axis=0)
    # Ten correlation times or so in each of twelve channels: to a fifth.
    assert np.sqrt(np.mean(found**2)) == pytest.approx(flicker, rel=0.2)


def test_coarse_steps_at_rest_are_no_jumps():
    """Steps of eleven standard deviations: at rest some channels are near an edge, others far from both."""
    world = draw_world(next(case for case in study_cases("singles") if case.seed == 10323))
    found = diagnose([world.recording], world.twin)
    assert found.verdict == "explained"
    assert [cause.effect for cause in found.causes] == ["coarse_resolution"]
