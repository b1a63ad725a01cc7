"""The sign of the rate as a probability: none from steady turning, right from a manoeuvre, given up at a slow zero."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rate_worlds import GRAVITY, TURN_ON_BIAS, Motion, cube, measure, sensor_errors, tumble, turntable

from gfimu import estimate_rate
from gfimu.rate import FilterSettings
from gfimu.rate.sign_chain import SignChain, SignSteps, sign_probabilities

RATE = 100.0
DARK = FilterSettings(start_omega=None)


def steady(speed, direction):
    t = np.arange(2000) / RATE
    omega = np.tile(2 * np.pi * speed * np.array(direction) / np.linalg.norm(direction), (len(t), 1))
    return Motion(t, omega, np.zeros_like(omega), np.tile([0.0, 0.0, GRAVITY], (len(t), 1)))


@pytest.mark.parametrize("bias", [0.001 * GRAVITY, TURN_ON_BIAS])
@pytest.mark.parametrize("direction", [(0, 0, 1), (0, 0, -1), (1, 1, 1)])
@pytest.mark.parametrize("speed", [0.3, 3.0])
def test_steady_turning_has_no_sign(bias, direction, speed):
    motion = steady(speed, direction)
    errors = replace(sensor_errors(cube(), RATE), bias_std=np.full(12, bias))
    for seed in range(3):
        values = measure(cube(), motion, np.random.default_rng(seed), bias=bias)
        found = estimate_rate(cube(), motion.t, values, errors, method="ml", settings=DARK)
        if found.start.kind == "rest":  # too slow to be told from biases: that much is stated
            assert found.start.least_spin > 2 * np.pi * speed
            continue
        assert found.sign_probability.max() < 0.9
        assert found.sign.state == "undecided"


@pytest.mark.parametrize("method", ["ml", "algebraic"])
@pytest.mark.parametrize("settings", [FilterSettings(), DARK])
def test_a_tumble_shows_its_sign(method, settings):
    motion = tumble(RATE, 2 * np.pi, duration=16.0)
    if settings is DARK:
        motion = Motion(*(column[600:] for column in (motion.t, motion.omega, motion.alpha, motion.p)))
    errors = replace(sensor_errors(cube(), RATE), bias_std=np.full(12, 0.01))
    values = measure(cube(), motion, np.random.default_rng(0), bias=0.01)
    found = estimate_rate(cube(), motion.t, values, errors, method=method, settings=settings)
    rows = np.linalg.norm(motion.omega, axis=1) > 2.0
    assert np.mean(found.sign_probability[rows] > 0.99) > 0.95
    assert np.all(np.sum(found.omega * motion.omega, axis=1)[rows & (found.sign_probability > 0.99)] > 0)
    assert found.sign.state in {"known", "decided", "partly"}


def test_a_crossing_of_zero_turns_the_sign():
    motion = turntable(RATE, 2 * np.pi)
    found = estimate_rate(
        cube(), motion.t, measure(cube(), motion, np.random.default_rng(1)), sensor_errors(cube(), RATE), method="ml"
    )
    for middle in (10.0, 20.0):
        rows = np.abs(motion.t - middle) < 1.5
        assert np.all(found.omega[rows, 2] * motion.omega[rows, 2] > 0)
        assert np.all(found.sign_probability[rows] > 0.99)


def steps(t, alpha, omega, std, **others):
    n = len(t)
    fields = {"scale": np.ones(n), "alpha_bias_std": 0.0, "rest": np.zeros(n, dtype=bool), "rest_std": 0.1}
    fields |= {"start": None, "start_std": 1.0} | others
    return SignSteps(t, alpha, omega, np.tile(std**2 * np.eye(3), (n, 1, 1)), 1e-4 * np.eye(3), **fields)


def swing(signs=None):
    t = np.arange(1000) / RATE
    omega = np.zeros((1000, 3))
    alpha = np.zeros((1000, 3))
    omega[:, 0], alpha[:, 0] = 5 * np.sin(2 * t + 1), 10 * np.cos(2 * t + 1)
    noisy = omega + 0.2 * np.random.default_rng(2).standard_normal(omega.shape)
    sides = np.ones(1000) if signs is None else signs
    return t, alpha, noisy * sides[:, None]


def test_the_signs_of_the_single_estimates_do_not_matter():
    sides = np.random.default_rng(3).choice([-1.0, 1.0], 1000)
    one = sign_probabilities(steps(*swing(), 0.2))
    other = sign_probabilities(steps(*swing(sides), 0.2))
    np.testing.assert_allclose(np.where(sides > 0, other, 1 - other), one, atol=1e-9)
    fast = np.abs(5 * np.sin(2 * swing()[0] + 1)) > 1.5
    assert np.mean(one[fast] > 0.99) > 0.95


def test_a_chain_while_samples_arrive_gives_the_same_in_pieces_of_any_size():
    t, alpha, omega = swing()
    whole = SignChain(1 / RATE).push(steps(t, alpha, omega, 0.2))
    for size in (1, 7, 400):
        chain = SignChain(1 / RATE)
        parts = [
            chain.push(steps(t[k : k + size], alpha[k : k + size], omega[k : k + size], 0.2))
            for k in range(0, len(t), size)
        ]
        np.testing.assert_allclose(np.concatenate(parts), whole, atol=1e-6)
    fast = np.abs(5 * np.sin(2 * t + 1)) > 1.5
    assert np.mean(whole[fast] > 0.99) > 0.9


def test_decided_signs_are_right_as_often_as_stated():
    """Over noise of every size: of the samples with a probability near p, a share of p is right."""
    right, stated = [], []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        t = np.arange(400) / RATE
        rate, phase, size = rng.uniform(1, 6), rng.uniform(0, 6), rng.uniform(1, 8)
        omega, alpha = np.zeros((400, 3)), np.zeros((400, 3))
        omega[:, 1], alpha[:, 1] = size * np.sin(rate * t + phase), size * rate * np.cos(rate * t + phase)
        std = rng.uniform(0.3, 3.0)
        noisy = omega + std * rng.standard_normal(omega.shape)
        measured = alpha + 0.01 * rng.standard_normal(alpha.shape)
        plus = sign_probabilities(steps(t, measured, noisy, std))
        alike = np.sum(omega * noisy, axis=1) > 0
        stated.append(np.maximum(plus, 1 - plus))
        right.append(np.where(plus > 0.5, alike, ~alike))
    stated, right = np.concatenate(stated), np.concatenate(right)
    sure = stated > 0.99
    assert sure.mean() > 0.2
    assert np.mean(~right[sure]) < 0.01
    assert right[(stated > 0.6) & (stated < 0.9)].mean() > 0.5
