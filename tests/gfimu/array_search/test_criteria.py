"""Criteria: gradients, updates against fresh evaluations, and figures against those of other modules."""

import itertools

import numpy as np
import pytest
from scipy.optimize import approx_fprime

from gfimu import AccelerometerArray, SensorErrors, drift_budget, rate_bound
from gfimu.array_search.criteria import Goal
from gfimu.array_search.exchange import drawn_rows, log_figure
from gfimu.array_search.objectives import OBJECTIVES, Conditions, objective
from gfimu.array_search.polish import _objective, _Variables, alpha_leakage, leakage_and_slope
from gfimu.array_search.problem import Design, Problem, ToleranceTable, rows_of, slopes_by_design
from gfimu.array_search.scoring import score
from gfimu.array_search.shapes import box, frames_across
from gfimu.rate import alpha_std
from gfimu.rate.health import detectable_faults

CUBE = box((0.1, 0.1, 0.1))


def random_design(n, k, seed=0):
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(n, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    axes = {1: directions[:, None], 2: frames_across(directions), 3: np.broadcast_to(np.eye(3), (n, 3, 3))}[k]
    return Design(rng.uniform(-1, 1, (n, 3)), axes, np.full(n, -1))


def test_rows_are_those_of_the_regression_and_centripetal_matrices():
    cube = AccelerometerArray.load("p3_three_plus_one")
    rows = rows_of(cube.positions, cube.axes)
    np.testing.assert_allclose(rows, np.hstack([cube.regression_matrix, cube.centripetal_matrix]), atol=1e-15)


def test_slopes_by_design_are_derivatives():
    rng = np.random.default_rng(0)
    position, axis, weight = rng.normal(size=3), rng.normal(size=3), rng.normal(size=12)
    by_position, by_axis = slopes_by_design(weight, position, axis)
    np.testing.assert_allclose(by_position, approx_fprime(position, lambda p: rows_of(p, axis) @ weight), atol=1e-6)
    np.testing.assert_allclose(by_axis, approx_fprime(axis, lambda a: rows_of(position, a) @ weight), atol=1e-6)


@pytest.mark.parametrize("name", OBJECTIVES)
@pytest.mark.parametrize("k", [1, 2, 3])
@pytest.mark.parametrize("tolerance", [None, ToleranceTable(0.001, 0.02, 4)])
def test_the_polish_sees_the_gradient_of_every_objective(name, k, tolerance):
    problem = Problem({1: 14, 2: 8, 3: 5}[k], k, CUBE, tolerance=tolerance)
    goal = Goal(((1.0, objective(name, problem, Conditions()).criterion, tolerance is not None),))
    variables = _Variables(problem, random_design(problem.n_chips, k, seed=k))
    numbers = variables.pack()
    function = _objective(variables, goal, 20.0, 0.0)
    value, slope = function(numbers)
    assert np.isfinite(value)
    numeric = approx_fprime(numbers, lambda one: function(one)[0], 1e-7)
    np.testing.assert_allclose(slope, numeric, atol=1e-4 * np.abs(slope).max())


def test_the_gradient_of_the_leakage_is_its_derivative():
    rows = random_design(5, 3).rows
    value, slope = leakage_and_slope(rows)
    assert value == pytest.approx(np.sum(alpha_leakage(rows) ** 2))
    numeric = approx_fprime(rows.ravel(), lambda one: leakage_and_slope(one.reshape(-1, 12))[0], 1e-7)
    np.testing.assert_allclose(slope.ravel(), numeric, atol=1e-5 * np.abs(slope).max())


@pytest.mark.parametrize("name", OBJECTIVES)
@pytest.mark.parametrize("k", [1, 2, 3])
def test_an_update_for_an_exchange_is_a_fresh_evaluation(name, k):
    problem = Problem({1: 15, 2: 8, 3: 6}[k], k, CUBE, tolerance=ToleranceTable(0.001, 0.02, 3))
    criterion = objective(name, problem, Conditions()).criterion
    design = random_design(problem.n_chips, k)
    rows = drawn_rows(problem, design.positions, design.axes, np.arange(problem.n_chips))  # (s, n, k, 12)
    candidates = np.swapaxes(rows[:, :3], 0, 0)
    found = criterion.exchanged(rows[:, 3:].reshape(4, -1, 12), candidates)
    for draw, chip in itertools.product(range(4), range(3)):
        whole = np.concatenate([rows[draw, 3:].reshape(-1, 12), candidates[draw, chip]])
        assert found[draw, chip] == pytest.approx(float(criterion.exact(whole)), abs=3e-5)  # the ridge of the update


def test_the_best_direction_beats_every_other_one():
    problem = Problem(8, 1, CUBE)
    criterion = objective("gdop", problem, Conditions()).criterion
    design = random_design(8, 1)
    others, place = design.rows[1:], design.positions[:1]
    values, directions = criterion.steered(others, rows_of(place[:, None], np.eye(3)[None]))
    tried = np.random.default_rng(1).normal(size=(2000, 3))
    tried /= np.linalg.norm(tried, axis=1, keepdims=True)
    every = criterion.exchanged(others[None], rows_of(place[0], tried)[None, :, None])[0]
    assert values[0] <= every.min() + 1e-9
    own = criterion.exact(np.concatenate([rows_of(place, directions), others]))
    assert values[0] == pytest.approx(float(own), abs=1e-7)


@pytest.fixture(scope="module")
def random_array():
    problem = Problem(6, 3, CUBE)
    design = random_design(6, 3, seed=3)
    return problem, design, problem.array(design, "random", "adxl345", "")


def of(name, random_array, **conditions):
    problem, design, array = random_array
    conditions = Conditions(noise_m_s2=0.02, bias_m_s2=0.05, **conditions)
    return np.exp(log_figure(problem, objective(name, problem, conditions).goal, design)), array


def test_gdop_and_kappa_are_those_of_score(random_array):
    for name, field in (("gdop", "gdop"), ("gdop_joint", "gdop_joint"), ("kappa", "condition_number")):
        value, array = of(name, random_array)
        assert value == pytest.approx(getattr(score(array)[0], field), rel=1e-6)


def test_sigma_and_the_rate_bound_are_those_of_other_modules(random_array):
    value, array = of("sigma_alpha", random_array)
    assert value == pytest.approx(np.sqrt(np.mean(alpha_std(array, 0.02) ** 2)), rel=1e-9)
    value, _ = of("sigma_p", random_array)
    assert value == pytest.approx(0.02 * np.sqrt(np.mean(score(array)[0].sigma_p ** 2)), rel=1e-9)
    value, _ = of("rate", random_array, speed_rad_s=5.0, spin_axis="y")
    assert value == pytest.approx(np.sqrt(np.mean(rate_bound(array, (0.0, 5.0, 0.0), 0.02) ** 2)), rel=1e-6)
    each = [of("rate", random_array, speed_rad_s=5.0, spin_axis=axis)[0] for axis in "xyz"]
    value, _ = of("rate", random_array, speed_rad_s=5.0, spin_axis="any")
    assert value == pytest.approx(np.sqrt(np.mean(np.square(each))), rel=1e-9)


def test_the_least_fault_is_that_of_the_monitor(random_array):
    value, array = of("fault", random_array, fault_time_s=2.0, sample_rate_hz=200.0)
    found = detectable_faults(array, SensorErrors.uniform(array, 0.02), 200.0, duration=2.0)
    assert value == pytest.approx(found.detected.max(), rel=1e-6)


def test_drift_is_the_budget_without_the_mean_fall(random_array):
    value, array = of("drift", random_array, time_s=3.0)
    sources = Conditions(noise_m_s2=0.02, bias_m_s2=0.05).sources
    budget = drift_budget(array, 3.0, sources)
    assert value == pytest.approx(np.sqrt(np.trace(budget.covariance) - budget.fall**2), rel=1e-9)


def test_noise_of_the_part_is_that_at_the_sample_rate():
    """The density of the noise does not depend on the rate, so neither does the drift."""
    at_100, at_1600 = Conditions(), Conditions(sample_rate_hz=1600.0)
    assert at_1600.noise == pytest.approx(4.0 * at_100.noise)
    assert at_1600.sources.noise_density == pytest.approx(at_100.sources.noise_density)


def test_the_worst_draw_counts_and_the_nominal_array_is_one_of_them(random_array):
    problem, design, _ = random_array
    loose = Problem(6, 3, CUBE, tolerance=ToleranceTable(0.002, 0.05, 16))
    goal = objective("gdop_worst", loose, Conditions()).goal
    rows = drawn_rows(loose, design.positions, design.axes, np.arange(6)).reshape(17, -1, 12)
    each = np.exp(0.5 * np.log([np.trace(np.linalg.inv(one[:, :6].T @ one[:, :6])) for one in rows]))
    assert np.exp(log_figure(loose, goal, design)) == pytest.approx(each.max())
    assert each[0] == pytest.approx(np.exp(log_figure(problem, objective("gdop", problem, Conditions()).goal, design)))
    moved, turned = loose.draws
    assert np.abs(moved).max() <= 0.002 / loose.unit
    assert np.ptp(moved[1:], axis=0).min() > 0
    np.testing.assert_allclose(
        turned @ np.swapaxes(turned, -1, -2), np.broadcast_to(np.eye(3), turned.shape), atol=1e-12
    )
