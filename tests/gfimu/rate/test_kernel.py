"""The Kalman kernel against matrices: prediction, scalar measurements, considered constants, smoothing."""

from __future__ import annotations

import numpy as np
import pytest

from gfimu.base.compiled import compiled
from gfimu.rate.kernel import Record, measure, predict, step_back


@compiled
def run_forward(x, p, transitions, added, noises, slopes, readings, variance, solved, record, rates, spreads):  # type: ignore[no-untyped-def]
    r, n = transitions.shape[1:]
    work, gain = np.zeros((r, n + 1)), np.zeros(n)
    for k in range(len(transitions)):
        predict(x, p, transitions[k], added[k], noises[k], work)
        for j in range(n):
            record.predicted[k, j] = x[j]
            for a in range(r):
                record.rows[k, a, j] = p[a, j]
                record.transition[k, a, j] = transitions[k, a, j]
        record.used[k] = slopes.shape[1]
        for i in range(slopes.shape[1]):
            innovation = readings[k, i]
            for j in range(n):
                innovation -= slopes[k, i, j] * x[j]
            record.inverse[k, i] = measure(x, p, slopes[k, i], innovation, variance, solved, gain)
            record.innovation[k, i] = innovation
            for j in range(n):
                record.slope[k, i, j] = slopes[k, i, j]
                record.gain[k, i, j] = gain[j]
        for a in range(r):
            rates[k, a] = x[a]
            for b in range(r):
                spreads[k, a, b] = p[a, b]


@compiled
def run_back(record, adjoint, curvature, rates, spreads):  # type: ignore[no-untyped-def]
    for k in range(len(record.used) - 1, -1, -1):
        step_back(record, k, adjoint, curvature, rates[k], spreads[k])


def problem(rng, length=12, r=3, n=8, count=2):
    """A random linear model with r states that change and n − r constants, and readings of it."""
    root = rng.normal(size=(n, n))
    p0 = root @ root.T
    transitions = np.zeros((length, r, n))
    transitions[:, :, :] = 0.3 * rng.normal(size=(length, r, n))
    transitions[:, range(r), range(r)] += 1.0
    noises = np.tile(0.2 * np.eye(r), (length, 1, 1))
    slopes, added = rng.normal(size=(length, count, n)), rng.normal(size=(length, r))
    return p0, transitions, added, noises, slopes, rng.normal(size=(length, count))


def forward(p0, transitions, added, noises, slopes, readings, variance, solved):
    length, r, n = transitions.shape
    record = Record.empty(length, r, n, slopes.shape[1])
    x, p = np.zeros(n), p0.copy()
    rates, spreads = np.zeros((length, r)), np.zeros((length, r, r))
    run_forward(x, p, transitions, added, noises, slopes, readings, variance, solved, record, rates, spreads)
    return x, p, rates, spreads, record


def in_one_system(p0, transitions, added, noises, slopes, readings, variance):
    """Mean and covariance of all states by one weighted least-squares problem over the whole run."""
    length, r, n = transitions.shape
    size = n + length * r  # first state, then the dynamic part after each step
    information, right = np.zeros((size, size)), np.zeros(size)
    information[:n, :n] = np.linalg.inv(p0)
    for k in range(length):
        now = slice(n + k * r, n + (k + 1) * r)
        before = np.zeros((n, size))
        before[:r, (slice(0, r) if k == 0 else slice(n + (k - 1) * r, n + k * r))] = np.eye(r)
        before[r:, r:n] = np.eye(n - r)
        step = -transitions[k] @ before
        step[:, now] += np.eye(r)
        weight = np.linalg.inv(noises[k])
        information += step.T @ weight @ step
        right += step.T @ weight @ added[k]
        after = np.zeros((n, size))
        after[:r, now] = np.eye(r)
        after[r:, r:n] = np.eye(n - r)
        seen = slopes[k] @ after
        information += seen.T @ seen / variance
        right += seen.T @ readings[k] / variance
    covariance = np.linalg.inv(information)
    return covariance @ right, covariance


def test_filter_and_smoother_are_least_squares_over_the_run():
    rng = np.random.default_rng(1)
    p0, transitions, added, noises, slopes, readings = problem(rng)
    x, p, rates, spreads, record = forward(p0, transitions, added, noises, slopes, readings, 0.5, 8)
    mean, covariance = in_one_system(p0, transitions, added, noises, slopes, readings, 0.5)
    np.testing.assert_allclose(rates[-1], mean[-3:], rtol=1e-7)
    np.testing.assert_allclose(p[3:, 3:], covariance[3:8, 3:8], rtol=1e-7, atol=1e-10)
    np.testing.assert_allclose(x[3:], mean[3:8], rtol=1e-7)
    assert np.array_equal(p, p.T)
    smoothed, spread = np.zeros_like(rates), np.zeros_like(spreads)
    run_back(record, np.zeros(8), np.zeros((8, 8)), smoothed, spread)
    for k in range(len(rates)):
        rows = slice(8 + 3 * k, 11 + 3 * k)
        np.testing.assert_allclose(smoothed[k], mean[rows], rtol=1e-6, atol=1e-9)
        np.testing.assert_allclose(spread[k], covariance[rows, rows], rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("solved", [8, 6, 3])
def test_the_stated_covariance_of_considered_constants_is_that_of_the_error(solved):
    """Monte Carlo: constants from ``solved`` on are not estimated, and the errors have the stated covariance."""
    rng = np.random.default_rng(2)
    p0, transitions, added, noises, slopes, _ = problem(rng)
    errors, runs = [], 4000
    for _ in range(runs):
        truth = np.linalg.cholesky(p0) @ rng.standard_normal(8)
        readings = np.zeros(slopes.shape[:2])
        for k in range(len(transitions)):
            truth[:3] = transitions[k] @ truth + added[k] + np.sqrt(0.2) * rng.standard_normal(3)
            readings[k] = slopes[k] @ truth + np.sqrt(0.5) * rng.standard_normal(2)
        x, p, *_ = forward(p0, transitions, added, noises, slopes, readings, 0.5, solved)
        errors.append((x - truth)[:3])
        assert np.array_equal(x[solved:], np.zeros(8 - solved))
    np.testing.assert_allclose(p[solved:, solved:], p0[solved:, solved:], rtol=1e-12)
    scatter = np.cov(np.array(errors).T, bias=True)
    spread = np.linalg.solve(np.linalg.cholesky(p[:3, :3]), np.linalg.solve(np.linalg.cholesky(p[:3, :3]), scatter).T)
    np.testing.assert_allclose(spread, np.eye(3), atol=4 * np.sqrt(2 / runs))
