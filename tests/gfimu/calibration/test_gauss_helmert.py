"""Gauss–Helmert adjustment against published and analytic solutions."""

import numpy as np
import pytest

from gfimu import InputError
from gfimu.calibration.gauss_helmert import gauss_helmert

# P. T. Boggs, R. H. Byrd, J. E. Rogers and R. B. Schnabel, "User's Reference Guide for ODRPACK Version 2.01", p. 49:
# pressure and volume are the two coordinates of points on an ellipse.
ELLIPSE = np.array(
    [
        [0.50, -0.12],
        [1.20, -0.60],
        [1.60, -1.00],
        [1.86, -1.40],
        [2.12, -2.54],
        [2.36, -3.36],
        [2.44, -4.00],
        [2.36, -4.75],
        [2.06, -5.25],
        [1.74, -5.64],
        [1.34, -5.97],
        [0.90, -6.32],
        [-0.28, -6.44],
        [-0.78, -6.44],
        [-1.36, -6.41],
        [-1.90, -6.25],
        [-2.50, -5.88],
        [-2.88, -5.50],
        [-3.18, -5.24],
        [-3.44, -4.86],
    ]
)


def ellipse(beta, points):
    dx, dy = points[:, 0] - beta[0], points[:, 1] - beta[1]
    f = beta[2] * dx**2 + 2 * beta[3] * dx * dy + beta[4] * dy**2 - 1
    along_x, along_y = 2 * (beta[2] * dx + beta[3] * dy), 2 * (beta[3] * dx + beta[4] * dy)
    a = np.column_stack([-along_x, -along_y, dx**2, 2 * dx * dy, dy**2])
    return f[:, None], a[:, None, :], np.column_stack([along_x, along_y])[:, None, :]


def test_ellipse_of_the_odrpack_guide():
    result = gauss_helmert(ellipse, [-1.0, -3.0, 0.09, 0.02, 0.08], ELLIPSE, np.eye(2))
    expected = [-0.9993809167, -2.9310484652, 0.0875730503, 0.0162299709, 0.0797537983]
    std = [0.11138404, 0.10976733, 0.00410607, 0.00275003, 0.00349625]
    np.testing.assert_allclose(result.parameters, expected, rtol=2e-5)
    np.testing.assert_allclose(np.sqrt(np.diag(result.covariance)), std, rtol=2e-5)
    assert result.redundancy == 15
    on_curve = ellipse(result.parameters, ELLIPSE + result.corrections)[0]
    np.testing.assert_allclose(on_curve, 0, atol=1e-9)


def line(parameters, observations):
    slope, offset = parameters
    x, y = observations.T
    a = np.column_stack([x, np.ones_like(x)])[:, None, :]
    b = np.column_stack([np.full_like(x, slope), -np.ones_like(x)])[:, None, :]
    return (slope * x + offset - y)[:, None], a, b


def test_exact_abscissae_give_the_linear_regression():
    rng = np.random.default_rng(1)
    x = np.linspace(0, 1, 20)
    y = 2 * x + 1 + rng.normal(0, 0.1, 20)
    result = gauss_helmert(line, [0.0, 0.0], np.column_stack([x, y]), np.diag([0.0, 0.01]))
    coefficients, covariance = np.polyfit(x, y, 1, cov="unscaled")
    np.testing.assert_allclose(result.parameters, coefficients, rtol=1e-9)
    np.testing.assert_allclose(result.cofactor, covariance * 0.01, rtol=1e-9)


def test_equal_errors_give_the_orthogonal_regression():
    rng = np.random.default_rng(2)
    x = np.linspace(0, 1, 30)
    points = np.column_stack([x, 0.5 * x - 1]) + rng.normal(0, 0.05, (30, 2))
    result = gauss_helmert(line, [0.4, -1.0], points, np.eye(2))
    centred = points - points.mean(axis=0)
    direction = np.linalg.svd(centred)[2][0]  # principal axis
    assert result.parameters[0] == pytest.approx(direction[1] / direction[0], rel=1e-8)


def test_undetermined_parameters_are_refused_or_resolved_on_purpose():
    def doubled(parameters, observations):  # only the sum of two offsets shows
        residual = parameters.sum() - observations
        return residual, np.ones((len(observations), 1, 2)), -np.ones((len(observations), 1, 1))

    data = np.array([[3.0], [3.2], [2.8]])
    with pytest.raises(InputError, match="1 of 2 parameters are not determined"):
        gauss_helmert(doubled, [0.0, 0.0], data, np.eye(1))
    result = gauss_helmert(doubled, [1.0, 0.0], data, np.eye(1), minimum_norm=True)
    np.testing.assert_allclose(result.parameters, [2.0, 1.0])  # equal shares of the missing 2
    np.testing.assert_allclose(np.abs(result.null_space[:, 0]), np.sqrt([0.5, 0.5]))


def test_constraint_by_a_basis():
    data = np.array([[3.0], [3.2], [2.8]])

    def total(parameters, observations):
        return (
            (parameters.sum() - observations),
            np.ones((len(observations), 1, 2)),
            -np.ones((len(observations), 1, 1)),
        )

    result = gauss_helmert(total, [1.0, 0.0], data, np.eye(1), basis=[[1.0], [0.0]])
    np.testing.assert_allclose(result.parameters, [3.0, 0.0])


def test_no_settling_is_an_error():
    with pytest.raises(InputError, match="did not settle in 2 iterations"):
        gauss_helmert(ellipse, [-1.0, -3.0, 0.09, 0.02, 0.08], ELLIPSE, np.eye(2), max_iterations=2)


def shifted(parameters, observations):
    """One offset for every reading, and a slope on known places."""
    places = np.linspace(-1.0, 1.0, len(observations))
    f = parameters[0] + parameters[1] * places - observations[:, 0]
    a = np.column_stack([np.ones_like(places), places])[:, None, :]
    return f[:, None], a, -np.ones((len(observations), 1, 1))


def test_a_prior_weighs_as_an_observation_of_zero_in_estimate_covariance_and_variance_factor():
    """A prior 0 ± s of the slope is one more observation, and so one more square and one more redundancy."""
    data = 0.3 + 0.8 * np.linspace(-1.0, 1.0, 12)[:, None] + np.random.default_rng(3).normal(0.0, 0.2, (12, 1))
    noise, prior = 0.1, 0.25
    result = gauss_helmert(shifted, [0.0, 0.0], data, [[noise**2]], prior_std=[np.inf, prior])
    design = np.vstack([np.column_stack([np.ones(12), np.linspace(-1.0, 1.0, 12)]) / noise, [0.0, 1.0 / prior]])
    right = np.append(data[:, 0] / noise, 0.0)
    expected, (square,), *_ = np.linalg.lstsq(design, right)
    np.testing.assert_allclose(result.parameters, expected, rtol=1e-9)
    np.testing.assert_allclose(result.cofactor, np.linalg.inv(design.T @ design), rtol=1e-9, atol=1e-15)
    assert result.redundancy == 12 + 1 - 2
    assert result.variance_factor == pytest.approx(square / 11, rel=1e-9)


def logarithm(beta, points):
    """ln β = l, which has no value beyond zero: a full step of Newton's from afar leads there."""
    return np.log(beta[0]) - points, np.full((len(points), 1, 1), 1.0 / beta[0]), -np.ones((len(points), 1, 1))


def square_root(beta, points):
    """√β = l by a triangular matrix, which has no root beyond zero."""
    root = np.linalg.cholesky(np.array([[beta[0]]]))[0, 0]
    return root - points, np.full((len(points), 1, 1), 0.5 / root), -np.ones((len(points), 1, 1))


@pytest.mark.parametrize(("condition", "measured", "start"), [(logarithm, 0.0, 10.0), (square_root, 0.01, 9.0)])
def test_a_step_to_where_the_conditions_have_no_value_is_shortened(condition, measured, start):
    observations = measured + np.array([[1e-3], [-1e-3]])
    found = gauss_helmert(condition, [start], observations, 1e-6 * np.eye(1))
    truth = np.exp(measured) if condition is logarithm else measured**2
    assert found.parameters[0] == pytest.approx(truth, rel=1e-2)


def test_conditions_without_a_value_at_the_start_are_refused():
    with pytest.raises(InputError, match="did not settle"):
        gauss_helmert(logarithm, [-1.0], np.zeros((2, 1)), np.eye(1))
