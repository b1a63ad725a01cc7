"""Standard deviations of every method are honest: Monte Carlo with a known truth."""

import numpy as np
import pytest
from calibration_cases import FACES, GRAVITY, MULTI, TWELVE, assert_honest, simulate

from gfimu.array import EARTH_RATE
from gfimu.calibration import METHODS, ErrorModel, Observations, multi_position_gyro

RUNS = 300

six_position, recursive, multi_position, twelve_position = (
    METHODS[name].fit for name in ("six-position", "recursive", "multi-position", "twelve-position")
)

CASES = {
    "six-position, 12": (six_position, FACES, "poses", {}),
    "six-position, 9": (six_position, FACES, "x_axis", {}),
    "recursive, 12": (recursive, FACES, "poses", {}),
    "recursive, 9": (recursive, FACES, "x_axis", {}),
    "multi-position, lower": (multi_position, MULTI, "x_axis", {}),
    "multi-position, upper": (multi_position, MULTI, "z_axis", {}),
    "multi-position, uniform": (multi_position, MULTI, "x_axis", {"weighting": "uniform"}),
    "twelve-position, 12": (twelve_position, TWELVE, "coarse", {"levelling_std_rad": 0.0}),
    "twelve-position, 9": (twelve_position, TWELVE, "x_axis", {}),
}


@pytest.mark.parametrize("case", CASES)
def test_noise_only(case, triad):
    method, directions, gauge, options = CASES[case]
    truth = triad if gauge in {"poses", "coarse"} else triad.in_gauge(gauge)
    rng = np.random.default_rng(list(CASES).index(case))
    results = [method(simulate(truth, directions, rng), gravity=GRAVITY, gauge=gauge, **options) for _ in range(RUNS)]
    errors = np.array([result.values for result in results]) - truth.parameters(gauge)
    std = np.array([result.std for result in results])
    if options.get("weighting") == "uniform":
        # Its covariance is scaled by a variance factor of 9 degrees of freedom: Student's t, variance 9/7.
        std = std * np.sqrt(9.0 / 7.0)
    assert_honest(errors, std)


@pytest.mark.parametrize("method", [six_position, twelve_position])
def test_levelling_error_is_in_the_standard_deviations(method, triad):
    directions, gauge = (FACES, "poses") if method is six_position else (TWELVE, "coarse")
    rng = np.random.default_rng(31)
    results = [
        method(simulate(triad, directions, rng, tilt=0.003), gravity=GRAVITY, gauge=gauge, levelling_std_rad=0.003)
        for _ in range(RUNS)
    ]
    errors = np.array([result.values for result in results]) - triad.parameters(gauge)
    assert_honest(errors, np.array([result.std for result in results]))


def test_levelling_estimated_from_the_faces(triad):
    rng = np.random.default_rng(32)
    results = [twelve_position(simulate(triad, TWELVE, rng, tilt=0.003), gravity=GRAVITY) for _ in range(RUNS)]
    errors = np.array([result.values for result in results]) - triad.parameters("coarse")
    coverage = np.mean(np.abs(errors / [result.std for result in results]) < 1.96)
    assert 0.92 < coverage < 0.98


def test_gyro_bias(triad):
    """MEMS gyro: only the bias shows against the Earth's rate, and the rate itself is part of its uncertainty."""
    rng = np.random.default_rng(33)
    bias, sigma = np.array([0.01, -0.02, 0.005]), 3e-5
    errors, std = [], []
    for _ in range(RUNS):
        directions = rng.normal(size=(20, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        rates = EARTH_RATE * directions + bias + rng.normal(0, sigma, (20, 3))
        result = multi_position_gyro(Observations.from_means(rates, sigma**2 * np.eye(3), unit="rad_s"))
        errors.append(result.values[6:] - bias)
        std.append(result.std[6:])
    assert_honest(np.array(errors), np.array(std))
    assert "not observable" in result.statements[0]
    np.testing.assert_array_equal(result.null_space, np.eye(9)[:, :6])


def test_navigation_grade_gyro_shows_scale_factors():
    rng = np.random.default_rng(34)
    truth = ErrorModel(np.diag([1.01, 0.99, 1.02]), np.array([1e-5, -2e-5, 3e-6]))
    sigma = 1e-8
    readings = truth.read(EARTH_RATE * MULTI) + rng.normal(0, sigma, MULTI.shape)
    result = multi_position_gyro(Observations.from_means(readings, sigma**2 * np.eye(3), unit="rad_s"))
    assert result.null_space.shape[1] == 0
    np.testing.assert_array_less(np.abs(result.values - truth.parameters("x_axis")) / result.std, 4.0)
