"""Integration of alpha to rate: exactness, convergence orders, gaps, NaN, noise, bad input."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gfimu import InputError, integrate_rate
from gfimu.array.integration import METHODS, integrate_samples
from gfimu.array.quadrature import STENCILS, even_weights, polynomial_weights
from gfimu.rate.settings import QUADRATURES

DEGREE = {"trapezoid": 1, "runge_kutta": 2, "adams_moulton4": 3, "centred4": 3, "centred6": 5}
ORDER = {"trapezoid": 2, "runge_kutta": 4, "adams_moulton4": 3, "centred4": 4, "centred6": 6}


def test_runge_kutta_is_simpson_over_two_periods():
    # The classical step with k1 = alpha0, k2 = k3 = alpha1, k4 = alpha2 over 2 h, written out.
    h = 0.01
    alpha = np.random.default_rng(1).standard_normal((9, 3))
    expected = np.zeros(3)
    rate = integrate_rate(np.arange(9) * h, alpha, [1.0, 2.0, 3.0])
    for k in range(0, 8, 2):
        expected = expected + 2 * h / 6 * (alpha[k] + 2 * alpha[k + 1] + 2 * alpha[k + 1] + alpha[k + 2])
        np.testing.assert_allclose(rate[k + 2] - [1.0, 2.0, 3.0], expected, atol=1e-15)


@pytest.mark.parametrize(
    ("method", "weights", "first"),
    [
        ("trapezoid", [1 / 2, 1 / 2], 0),
        ("adams_moulton4", [1 / 24, -5 / 24, 19 / 24, 9 / 24], -2),
        ("centred4", [-1 / 24, 13 / 24, 13 / 24, -1 / 24], -1),
        ("centred6", np.array([11, -93, 802, 802, -93, 11]) / 1440, -2),
    ],
)
def test_weights_are_the_textbook_ones(method, weights, first):
    interval = 5
    for sample in range(12):
        impulse = np.zeros((12, 1))
        impulse[sample] = 1.0
        place = sample - interval - first
        expected = weights[place] if 0 <= place < len(weights) else 0.0
        integral = integrate_samples(np.arange(12.0), impulse[:, 0], method=method)
        assert integral[interval + 1] - integral[interval] == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize("method", METHODS)
@settings(max_examples=25, deadline=None)
@given(data=st.data())
def test_exact_for_polynomials_on_jittered_times(method, data):
    # Steps within a factor of 1.5 of any median: none of them counts as a gap.
    steps = np.array(data.draw(st.lists(st.floats(0.85, 1.15), min_size=8, max_size=20)))
    degree = DEGREE[method]
    coefficients = np.array(data.draw(st.lists(st.floats(-1, 1), min_size=degree + 1, max_size=degree + 1)))
    t = np.concatenate([[0.0], np.cumsum(steps)])
    rate = np.polynomial.Polynomial(coefficients)
    result = integrate_samples(t, rate(t), 0.7, method=method)
    start = 2 if method == "adams_moulton4" else 0  # it starts with lower order
    truth = rate.integ()(t)
    expected = result[start] + truth[start:] - truth[start]
    np.testing.assert_allclose(result[start:], expected, rtol=1e-9, atol=1e-9 * (1 + np.abs(truth).max()))


@pytest.mark.parametrize("method", METHODS)
def test_order_of_convergence(method):
    def error(n):
        t = np.linspace(0.0, 1.0, n + 1)
        alpha = np.column_stack([np.cos(5 * t), np.exp(t), np.sin(3 * t + 1)])
        truth = np.column_stack([np.sin(5 * t) / 5, np.exp(t) - 1, (np.cos(1) - np.cos(3 * t + 1)) / 3])
        return np.abs(integrate_rate(t, alpha, method=method) - truth).max()

    order = np.log2(error(60) / error(120))
    assert order == pytest.approx(ORDER[method], abs=0.25)


def _tumble(rate_hz: float, spin: float, seconds: float):
    """Torque-free tumble of a body with inertia 1 : 2 : 3, by a high-order ODE solver."""
    from scipy.integrate import solve_ivp

    inertia = np.array([1.0, 2.0, 3.0])
    start = np.array([0.3, 1.0, 0.2])
    start *= spin / np.linalg.norm(start)
    t = np.arange(0.0, seconds, 1 / rate_hz)

    def derivative(_, omega):
        return -np.cross(omega, inertia * omega) / inertia

    omega = solve_ivp(derivative, (0, seconds), start, method="DOP853", rtol=1e-11, atol=1e-11, t_eval=t).y.T
    return t, omega, np.array([derivative(0, row) for row in omega])


def test_ranking_on_an_eight_turn_tumble():
    t, omega, alpha = _tumble(100.0, 16 * np.pi, 10.0)
    error = {m: np.abs(integrate_rate(t, alpha, omega[0], method=m) - omega).max() for m in METHODS}
    # The trapezoid's error is of the size of the noise of a whole run; the 6-point rule's is below 1e-2 rad/s.
    assert error["trapezoid"] > 0.1
    assert error["runge_kutta"] < error["trapezoid"] / 5
    assert error["adams_moulton4"] < error["trapezoid"] / 5
    assert error["centred4"] < error["trapezoid"] / 10
    assert error["centred6"] < 0.01


@pytest.mark.parametrize("method", METHODS)
def test_no_polynomial_crosses_a_gap(method):
    # A step of alpha hidden in a gap: the stretches before and after must each stay exactly constant.
    t = np.concatenate([np.arange(10), np.arange(25, 36)]) * 0.01
    alpha = np.where(t < 0.2, 1.0, -3.0)[:, None] * [[1.0, 0.0, 2.0]]
    rate = integrate_rate(t, alpha, method=method)
    np.testing.assert_allclose(np.diff(rate[:10, 0]), 0.01, rtol=1e-10)
    np.testing.assert_allclose(np.diff(rate[10:, 0]), -0.03, rtol=1e-10)
    # The gap is bridged by the straight line between its ends, over its true length.
    np.testing.assert_allclose(rate[10] - rate[9], 0.16 * np.array([-1.0, 0.0, -2.0]), atol=1e-13)


@pytest.mark.parametrize("method", METHODS)
def test_nan_rows_are_lost_samples(method):
    t = np.arange(40) * 0.01
    alpha = np.column_stack([np.full(40, 2.0), 3.0 * t, np.zeros(40)])
    alpha[[0, 7, 8, 20], [0, 1, 2, 0]] = np.nan
    rate = integrate_rate(t, alpha, [1.0, 0.0, 0.0], method=method)
    assert np.isnan(rate[[0, 7, 8, 20]]).all()
    kept = np.setdiff1d(np.arange(40), [0, 7, 8, 20])
    np.testing.assert_allclose(rate[kept, 0], 1.0 + 2.0 * (t[kept] - t[1]), rtol=1e-12)
    np.testing.assert_allclose(rate[kept, 1], 1.5 * (t[kept] ** 2 - t[1] ** 2), atol=1e-12)


def test_short_inputs():
    for method in METHODS:
        for n in range(1, 8):
            t = np.arange(n) * 0.5
            np.testing.assert_allclose(integrate_rate(t, np.ones((n, 3)), method=method)[:, 0], t, atol=1e-14)
    assert integrate_rate([], np.zeros((0, 3))).shape == (0, 3)
    assert np.isnan(integrate_rate([0, 1], np.full((2, 3), np.nan))).all()


def test_noise_gain_of_the_methods():
    # Integrated white noise has variance σ² h t; Simpson's weights 2/3, 4/3 raise it by the mean of their squares.
    n, h = 2001, 0.01
    t = np.arange(n) * h
    for method in METHODS:
        impulse_response = np.array(
            [integrate_samples(t[:41], row, method=method)[-1] for row in np.eye(41)]
        )  # gain of each sample in the last value
        gain = np.mean((impulse_response[10:30] / h) ** 2)
        assert gain == pytest.approx(10 / 9 if method == "runge_kutta" else 1.0, abs=1e-9)


@pytest.mark.parametrize(
    ("t", "alpha", "method", "words"),
    [
        ([0, 1, 1], np.zeros((3, 3)), "trapezoid", "strictly increasing"),
        ([0, 2, 1], np.zeros((3, 3)), "trapezoid", "strictly increasing"),
        ([0, np.nan, 1], np.zeros((3, 3)), "trapezoid", "finite"),
        ([0, 1], np.zeros((3, 3)), "trapezoid", "one row per time"),
        ([0, 1], np.zeros((2, 2)), "trapezoid", "one row of three"),
        ([0, 1], np.zeros((2, 3)), "euler", "valid: .*runge_kutta"),
    ],
)
def test_bad_input(t, alpha, method, words):
    with pytest.raises(InputError, match=words):
        integrate_rate(t, alpha, method=method)


def weights_by_moments(nodes, left):
    """Weights that integrate the monomials exactly, from Vandermonde's system: another way to the same numbers."""
    step = nodes[left + 1] - nodes[left]
    places = (nodes - nodes[left]) / step
    powers = np.arange(len(nodes))
    return np.linalg.solve(places ** powers[:, None], 1.0 / (powers + 1.0)) * step


@pytest.mark.parametrize("points", [2, 3, 4, 5, 6])
def test_weights_on_uneven_samples_agree_with_the_moments(points):
    rng = np.random.default_rng(points)
    for left in range(points - 1):
        nodes = 3.0 + np.cumsum(rng.uniform(0.7, 1.4, points)) * 0.01
        weights = np.full(points + 1, np.nan)
        polynomial_weights(nodes, 0, points, left, weights)
        np.testing.assert_allclose(weights[:points], weights_by_moments(nodes, left), rtol=1e-9, atol=1e-15)
        assert np.isnan(weights[points])
        np.testing.assert_allclose(
            even_weights(points)[left], weights_by_moments(np.arange(points), left), rtol=1e-11, atol=1e-14
        )


@pytest.mark.parametrize("method", METHODS)
def test_jittered_run_is_the_sum_of_the_stencils_by_moments(method):
    """The former way, interval by interval, to rounding."""
    rng = np.random.default_rng(5)
    t = np.cumsum(rng.uniform(0.9, 1.1, 60)) * 0.01
    values = rng.standard_normal((60, 2))
    stencil = STENCILS[method]
    expected = np.zeros((60, 2))
    for left in range(59):
        first = max(left + stencil.before[left % 2], 0)
        points = left + 2 - first if stencil.causal else stencil.points
        first = min(first, 60 - points)
        rows = slice(first, first + points)
        expected[left + 1] = expected[left] + weights_by_moments(t[rows], left - first) @ values[rows]
    np.testing.assert_allclose(integrate_samples(t, values, method=method), expected, rtol=1e-10, atol=1e-14)


def test_the_filter_takes_its_stencils_from_the_same_table():
    filtered = {name: (stencil.points, -stencil.before[0]) for name, stencil in QUADRATURES.items()}
    assert filtered == {"centred6": (6, 2), "centred4": (4, 1), "adams_moulton4": (4, 2), "trapezoid": (2, 0)}
    for name, (points, position) in filtered.items():
        impulses = np.eye(12)
        integrals = np.diff(integrate_samples(np.arange(12.0), impulses, method=name), axis=0)  # (interval, sample)
        first = 5 - position
        np.testing.assert_allclose(integrals[5, first : first + points], even_weights(points)[position], atol=1e-14)
