"""Posterior bounds against closed forms and against a Riccati solver that knows nothing of this project."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg

from gfimu import AccelerometerArray, InputError, SensorErrors, posterior_rate_bound
from gfimu.rate import alpha_std, steady_rate_bound

CUBE = AccelerometerArray.load("cube12")
NOISE = 0.03
SIGMA = float(alpha_std(CUBE, NOISE)[0])


def along(omega, n, period, *, bias=0.0, **options):
    t = np.arange(n) * period
    rates = np.tile(omega, (n, 1))
    return t, posterior_rate_bound(CUBE, t, rates, SensorErrors.uniform(CUBE, NOISE, bias), **options)


def test_sigma_alpha():
    assert pytest.approx(NOISE / (np.sqrt(8) * 0.05)) == SIGMA


def test_dead_reckoning_at_rest():
    """With ω = 0 a sample tells nothing: the variance is what α integrates to, by the trapezoid."""
    period, n, bias = 0.01, 400, 0.1
    t, bound = along([0, 0, 0], n, period, bias=bias, start_std=0.02)
    spread = (bias / (np.sqrt(8) * 0.05)) ** 2
    white = SIGMA**2 * period**2 * (np.arange(n) - 0.5)
    np.testing.assert_allclose(bound[1:, 0, 0], (0.02**2 + spread * t**2 + white)[1:], rtol=1e-9)


@pytest.mark.parametrize("smoother", [False, True])
def test_steady_turning_in_the_limit_of_many_samples(smoother):
    period, speed = 1e-3, 3.0
    perpendicular, parallel = steady_rate_bound(SIGMA, period, speed, smoother=smoother)
    n = 8000
    _, bound = along([0, 0, speed], n, period, smoother=smoother)
    middle = np.sqrt(np.diagonal(bound[n // 2]))
    np.testing.assert_allclose(middle, [perpendicular, perpendicular, parallel], rtol=0.003)


@pytest.mark.parametrize("step", [0.02, 0.5])
def test_steady_turning_exactly(step):
    """Any turn per sample: the stationary solution of the two-state problem (ω, ε) by scipy's Riccati solver."""
    period, speed = 0.01, step / 0.01
    _, bound = along([0, 0, speed], 4000, period)
    for axis, information in ((0, speed**2), (2, 4 * speed**2)):
        move, enter = np.array([[1, period / 2], [0, 0]]), np.array([[period / 2], [1]])
        slope = np.array([[np.sqrt(information) / SIGMA, 0]])
        predicted = scipy.linalg.solve_discrete_are(move.T, slope.T, enter @ enter.T * SIGMA**2, np.eye(1))
        gain = predicted @ slope.T
        filtered = predicted - gain @ gain.T / (1 + slope @ gain)
        assert bound[-1, axis, axis] == pytest.approx(filtered[0, 0], rel=1e-6)


@pytest.mark.parametrize("noise", [NOISE, np.tile([0.02, 0.02, 0.05], 4)], ids=["equal", "unequal"])
def test_smoother_equals_the_inverse_of_the_whole_information(noise):
    """A short run in one matrix: states and noises of all samples at once.

    With unequal noise of the axes those of α and of the null space are correlated.
    """
    n, period, bias = 6, 0.02, 0.05
    rates = np.array([[0.3, 1.0, 2.0]]) * np.linspace(1, 1.5, n)[:, None]
    t = np.arange(n) * period
    errors = SensorErrors.uniform(CUBE, noise, bias)
    bound = posterior_rate_bound(CUBE, t, rates, errors, start_std=0.5, smoother=True)
    from gfimu.rate import ChannelSets, omega_products_jacobian

    full = ChannelSets(CUBE, errors.noise_std).full
    rows = np.vstack([full.alpha_rows, full.null_rows])
    # Unknowns: ω_0, b_α, b_z, ε_0 … ε_{n−1}; everything later is linear in them.
    size = 3 + 3 + 6 + 3 * n
    information = np.zeros((size, size))
    information[:3, :3] = np.eye(3) / 0.5**2
    information[3:12, 3:12] = np.linalg.inv(rows * errors.bias_std**2 @ rows.T)
    both = np.linalg.inv(rows * errors.noise_std**2 @ rows.T)
    maps = []
    current = np.zeros((3, size))
    current[:, :3] = np.eye(3)
    for k in range(n):
        if k:
            current = current.copy()
            current[:, 3:6] -= period * np.eye(3)
            for j in (k - 1, k):
                current[:, 12 + 3 * j : 15 + 3 * j] += period / 2 * np.eye(3)
        maps.append(current)
        h = full.null_sensitivity @ omega_products_jacobian(rates[k]) @ current
        h[:, 6:12] += np.eye(6)
        h = np.vstack([np.eye(3, size, 12 + 3 * k), h])  # the noise of α, −ε, and that of the null space
        information += h.T @ both @ h
    covariance = np.linalg.inv(information)
    for k in range(n):
        np.testing.assert_allclose(bound[k], maps[k] @ covariance @ maps[k].T, rtol=1e-6)


def test_rest_and_bad_input():
    t, free = along([0, 0, 0], 100, 0.01, bias=0.1)
    rest = np.zeros(100, dtype=bool)
    rest[49] = True
    held = posterior_rate_bound(CUBE, t, np.zeros((100, 3)), SensorErrors.uniform(CUBE, NOISE, 0.1), rest=rest)
    assert np.sqrt(held[49, 0, 0]) < 1e-3 < np.sqrt(free[49, 0, 0])
    assert held[99, 0, 0] < free[99, 0, 0] / 10
    with pytest.raises(InputError, match="one row of three per time"):
        posterior_rate_bound(CUBE, t, np.zeros((99, 3)), SensorErrors.uniform(CUBE, NOISE))
    with pytest.raises(InputError, match="period"):
        steady_rate_bound(SIGMA, 0.0, 1.0)
