"""Drift: closed forms against matrix exponentials, published figures and the nonlinear Monte Carlo."""

import dataclasses

import numpy as np
import pytest
import scipy.integrate
import scipy.linalg
from hypothesis import given
from hypothesis import strategies as st

from gfimu import AccelerometerArray, ErrorSources, InputError, drift_budget, equivalent_rate_drift, monte_carlo_drift
from gfimu.budget import motion_covariance, position_error

G = 9.80665
MG = G / 1000
TURN = 2 * np.pi


@pytest.fixture(scope="module")
def cube():
    """Tetrahedral cube with half an edge of 0.03 m, for which the figures were published."""
    array = AccelerometerArray.load("cube12")
    return array.with_geometry(array.chip_positions * 0.6, [chip.axes for chip in array.chips])


def skew(v):
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def linear_system(rate, offset):
    """Error dynamics in the turning frame, written independently: state [δr, δv, θ, δω, b_alpha, b_p].

    d(δr) = δv − Ω×δr; d(δv) = −Ω×δv + θ × f + b_p; dθ = −Ω×θ + δω; dδω = b_alpha, f the true specific force.
    """
    spin = skew([0, 0, rate])
    force = np.array([-(rate**2) * offset[0], -(rate**2) * offset[1], G])
    a = np.zeros((18, 18))
    for block in range(3):
        a[3 * block : 3 * block + 3, 3 * block : 3 * block + 3] = -spin
    a[0:3, 3:6] = np.eye(3)
    a[3:6, 6:9] = -skew(force)
    a[3:6, 15:18] = np.eye(3)
    a[6:9, 9:12] = np.eye(3)
    a[9:12, 12:15] = np.eye(3)
    return a


finite = st.floats(-1, 1)
triple = st.lists(finite, min_size=3, max_size=3).map(np.array)


@given(
    rate=st.one_of(st.just(0.0), st.floats(-70, 70)),
    time=st.floats(0.01, 5),
    offset=st.tuples(finite, finite),
    p_bias=triple,
    drift=triple,
    alpha_bias=triple,
)
def test_closed_forms_are_the_matrix_exponential(rate, time, offset, p_bias, drift, alpha_bias):
    state = np.concatenate([np.zeros(9), drift, alpha_bias, p_bias])
    final = scipy.linalg.expm(linear_system(rate, offset) * time) @ state
    angle = rate * time
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    scale = 1 + time**2 + G * time**3 + G * time**4 + rate**2 * time**3 * (1 + time)
    result = position_error(time, p_bias=p_bias, rate_drift=drift, alpha_bias=alpha_bias, rate=rate, offset=offset)
    np.testing.assert_allclose(result, turn @ final[:3], atol=1e-9 * scale)


def test_laws_at_rest():
    t = np.array([0.5, 2.0, 20.0])
    np.testing.assert_allclose(position_error(t, p_bias=[1, 2, 3]), 0.5 * t[:, None] ** 2 * [1, 2, 3])
    # d × z: a turn about +y moves +x, one about +x moves −y (GF-IMU paper, eq. 30).
    np.testing.assert_allclose(position_error(t, rate_drift=[1, 2, 3]), G / 6 * t[:, None] ** 3 * [2, -1, 0])
    np.testing.assert_allclose(position_error(t, alpha_bias=[1, 2, 3]), G / 24 * t[:, None] ** 4 * [2, -1, 0])


@pytest.mark.parametrize(("cause", "suppression"), [("p_bias", 62.83), ("rate_drift", 41.88), ("alpha_bias", 1314.4)])
def test_turning_suppresses_horizontal_drift(cause, suppression):
    # Ratio to the drift at rest after 20 s at one turn per second: 63, 42 and 1314.
    error = {cause: [1.0, 0.0, 0.0]}
    ratio = np.linalg.norm(position_error(20.0, **error)) / np.linalg.norm(position_error(20.0, rate=TURN, **error))
    assert ratio == pytest.approx(suppression, rel=1e-4)
    # but not the vertical.
    error = {cause: [0.0, 0.0, 1.0]}
    assert position_error(20.0, rate=TURN, **error)[2] == position_error(20.0, **error)[2]


def test_slow_turning_goes_over_into_rest_without_losing_digits():
    causes = {"p_bias": [1, 2, 3], "rate_drift": [3, 1, 2], "alpha_bias": [2, 3, 1]}
    np.testing.assert_allclose(position_error(10.0, rate=1e-12, **causes), position_error(10.0, **causes), rtol=1e-9)


def test_sensor_errors_through_the_geometry(cube):
    covariance = motion_covariance(cube)  # σ_alpha = σ/(√8 h), σ_p = σ/2
    np.testing.assert_allclose(np.sqrt(covariance.diagonal()), [1 / (np.sqrt(8) * 0.03)] * 3 + [0.5] * 3)
    budget = drift_budget(cube, 0.4, ErrorSources(bias=35 * MG))
    sizes = {term.name: term.size for term in budget.terms}
    assert sizes["bias of alpha"] == pytest.approx(4.05, abs=0.01)
    # b of p and b of alpha are uncorrelated here, so their squares add: 44 mm after 0.4 s.
    p, alpha = 0.5 * 35 * MG, sizes["bias of alpha"]
    expected = np.hypot(p * 0.4**2 / 2, G * alpha * 0.4**4 / 24)
    np.testing.assert_allclose(budget.total_std[:2], expected, rtol=1e-12)
    assert budget.total_std[0] == pytest.approx(0.044, abs=0.001)


def test_alpha_overtakes_p(cube):
    assert drift_budget(cube, 1.0, ErrorSources(bias=1.0)).alpha_overtakes == pytest.approx(0.228, abs=5e-4)
    t = drift_budget(cube, 1.0, ErrorSources(bias=1.0)).alpha_overtakes
    by_name = {term.name: term.std[0] for term in drift_budget(cube, t, ErrorSources(bias=1.0)).terms}
    assert by_name["bias of p"] == pytest.approx(by_name["bias of alpha"])


def test_noise_and_walk_laws_at_rest(cube):
    t, h = 5.0, 0.03
    n, k = 290e-6 * G, 1e-3
    std = {
        term.name: term.std for term in drift_budget(cube, t, ErrorSources(noise_density=n, bias_random_walk=k)).terms
    }
    s_p, s_alpha = n**2 / 2 / 4, n**2 / 2 / (8 * h**2)
    np.testing.assert_allclose(std["noise of p"], np.sqrt(s_p * t**3 / 3))
    np.testing.assert_allclose(std["noise of alpha"], [G * np.sqrt(s_alpha * t**7 / 252)] * 2 + [0])
    k_p, k_alpha = k / 2, k / (np.sqrt(8) * h)
    np.testing.assert_allclose(std["bias random walk of p"], k_p * np.sqrt(t**5 / 20))
    np.testing.assert_allclose(std["bias random walk of alpha"], [G * k_alpha * np.sqrt(t**9 / 5184)] * 2 + [0])
    assert std["noise of alpha"][0] == pytest.approx(4.0, abs=0.15)


def test_noise_on_the_turning_table(cube):
    # g² S/Ω² ∫ |s²/2 + (e^{iΩs} − 1 − iΩs)/Ω²|² ds, for Ωt ≫ 1 g² S t⁵/(20 Ω²).
    n = 290e-6 * G
    s_alpha = n**2 / 2 / (8 * 0.03**2)
    for time, excess in ((1.0, 1.04), (100.0, 1.0)):
        std = drift_budget(cube, time, ErrorSources(noise_density=n), rate=TURN).terms[1].std

        def integrand(s):
            return abs(s**2 / 2 + (np.exp(1j * TURN * s) - 1 - 1j * TURN * s) / TURN**2) ** 2

        integral = scipy.integrate.quad(integrand, 0, time, limit=500)[0]
        np.testing.assert_allclose(std[:2], G * np.sqrt(s_alpha * integral) / TURN, rtol=1e-7)
        assert std[0] / (G * np.sqrt(s_alpha * time**5 / 20) / TURN) == pytest.approx(excess, abs=3e-3)


def test_random_covariance_accumulates_as_a_van_loan_integral():
    # White noise and walks through a skew geometry off the axis, against Van Loan's exponential of the 18 states.
    array = AccelerometerArray.load("p3_three_plus_one")
    rate, offset, time = 3.0, (0.3, -0.2), 2.0
    unit = motion_covariance(array)
    assert np.abs(unit[:3, 3:]).max() > 0.1  # alpha and p are correlated here
    sources = ErrorSources(noise_density=np.sqrt(2.0), bias_random_walk=0.7)
    drive = np.zeros((18, 18))
    white = [9, 10, 11, 3, 4, 5]  # noise of alpha drives the rate, noise of p the velocity
    walks = [12, 13, 14, 15, 16, 17]
    drive[np.ix_(white, white)] = unit
    drive[np.ix_(walks, walks)] += 0.49 * unit
    a = linear_system(rate, offset)
    block = scipy.linalg.expm(np.block([[-a, drive], [np.zeros((18, 18)), a.T]]) * time)
    transition = block[18:, 18:].T
    covariance = (transition @ block[:18, 18:])[:3, :3]
    angle = rate * time
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    budget = drift_budget(array, time, sources, rate=rate, offset=offset)
    first_order = budget.covariance - np.diag([0, 0, budget.fall**2])
    expected = turn @ covariance @ turn.T
    np.testing.assert_allclose(first_order, expected, atol=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize(
    ("time", "sources", "motion"),
    [
        (0.3, ErrorSources(bias=35 * MG), {}),
        (0.3, ErrorSources(bias=35 * MG), {"rate": TURN, "offset": (0.3, 0.1)}),
        (1.5, ErrorSources(bias=35 * MG), {"rate": 10 * TURN}),
        (5.0, ErrorSources(noise_density=290e-6 * G), {}),
        (10.0, ErrorSources(noise_density=290e-6 * G), {"rate": TURN}),
        (1.0, ErrorSources(rate_drift=0.05, bias_random_walk=0.05), {}),
        (2.0, ErrorSources(rate_drift=0.05), {"rate": TURN, "offset": (0.3, 0.1)}),
    ],
)
def test_monte_carlo_agrees_within_sampling_error(cube, time, sources, motion):
    budget = drift_budget(cube, time, sources, **motion)
    assert budget.valid
    sample = monte_carlo_drift(cube, time, sources, runs=300, rng=np.random.default_rng(7), **motion)
    # Four standard deviations of the sampling error plus 4 %: what second order leaves at the limit (measured < 3 %).
    tolerance = 4 * sample.relative_sampling_error + 0.04
    assert sample.relative_sampling_error == pytest.approx(1 / np.sqrt(2 * 299))
    np.testing.assert_allclose(sample.std[-1, :2] / budget.total_std[:2], 1.0, atol=tolerance)
    if sources.noise_density == 0:  # the scatter of the fall is exact for constant errors, an upper bound for noise
        assert sample.std[-1, 2] / budget.total_std[2] == pytest.approx(1.0, abs=tolerance)
    assert sample.mean[-1, 2] == pytest.approx(budget.fall, abs=4 * sample.std[-1, 2] / np.sqrt(300))
    np.testing.assert_allclose(np.std(sample.final, axis=0, ddof=1), sample.std[-1])


def test_beyond_the_limit_the_closed_form_fails_as_stated(cube):
    sources = ErrorSources(bias=35 * MG)
    limit = drift_budget(cube, 1.0, sources)
    assert not limit.valid
    assert limit.tilt_std == pytest.approx(2.02, abs=0.01)
    # ½ b t² = 0.25 rad
    sd_alpha = 35 * MG / (np.sqrt(8) * 0.03)
    assert limit.valid_until == pytest.approx(np.sqrt(2 * 0.25 / sd_alpha), rel=1e-3)
    sample = monte_carlo_drift(cube, 1.0, sources, runs=300, rng=np.random.default_rng(3))
    assert sample.std[-1, 0] / limit.total_std[0] == pytest.approx(0.63, abs=4 * sample.relative_sampling_error)


def test_one_run_is_the_first_order_form_for_small_errors(cube):
    # The nonlinear navigation with tiny drawn biases, without any statistics.
    sources = ErrorSources(bias=1e-6)
    rng = np.random.default_rng(5)
    errors = 1e-6 * np.random.default_rng(5).standard_normal(12)
    motion = np.linalg.pinv(cube.regression_matrix) @ errors
    sample = monte_carlo_drift(cube, 3.0, sources, runs=2, rng=rng, rate=TURN, offset=(0.2, 0.1), sample_rate=500.0)
    expected = position_error(3.0, alpha_bias=motion[:3], p_bias=motion[3:], rate=TURN, offset=(0.2, 0.1))
    np.testing.assert_allclose(sample.final[0], expected, atol=2e-4 * np.abs(expected).max())


def test_validity_off_the_axis_counts_heading(cube):
    sources = ErrorSources(bias=35 * MG)
    on_axis = drift_budget(cube, 1.0, sources, rate=10 * TURN)
    off_axis = drift_budget(cube, 1.0, sources, rate=10 * TURN, offset=(0.3, 0.0))
    assert on_axis.valid_until > 3.5  # tilt b t/Ω
    assert off_axis.valid_until == pytest.approx(0.352, abs=0.002)  # heading ½ b t²


def test_leaking_geometry_is_noted():
    array = AccelerometerArray.load("p3_three_plus_one")
    assert "ω²" in drift_budget(array, 1.0, ErrorSources(bias=1.0), rate=1.0).note
    assert drift_budget(array, 1.0, ErrorSources(bias=1.0)).note == ""


def test_papers_inversion():
    # A drift of 30 °/h at rest displaces by g d t³/6 in 30 s; back and forth with a bias in between.
    drift = np.radians(30 / 3600)
    error = position_error(30.0, rate_drift=[0.0, drift, 0.0], p_bias=[2.7 * MG, 0.0, 0.0])[0]
    assert equivalent_rate_drift(error, 30.0, p_bias=2.7 * MG) == pytest.approx(30.0)
    assert equivalent_rate_drift([6.42, -6.42], 30.0) == pytest.approx([30.0, -30.0], rel=1e-3)
    # The bias that the paper reads off would move the unit further than the drift.
    assert position_error(30.0, p_bias=[2.7 * MG, 0.0, 0.0])[0] == pytest.approx(11.9, abs=0.05)
    with pytest.raises(InputError, match="above zero"):
        equivalent_rate_drift(1.0, 0.0)


def test_budget_shares_and_dictionary(cube):
    budget = drift_budget(cube, 0.5, ErrorSources(bias=1 * MG, noise_density=1e-3, rate_drift=1e-3))
    assert sum(term.share for term in budget.terms) == pytest.approx(1.0)  # no correlation in the cube
    data = budget.to_dict()
    assert data["format_version"] == 1
    np.testing.assert_allclose(data["total_std_m"], budget.total_std)
    assert data["valid"] is True
    assert dataclasses.is_dataclass(budget)


@pytest.mark.parametrize("time", [0.0, -1.0, np.nan, np.inf])
def test_bad_time(cube, time):
    with pytest.raises(InputError, match="above zero"):
        drift_budget(cube, time, ErrorSources(bias=1.0))
    with pytest.raises(InputError, match="above zero"):
        monte_carlo_drift(cube, time, ErrorSources(bias=1.0), runs=10, rng=np.random.default_rng(0))


def test_other_bad_input(cube):
    with pytest.raises(InputError, match="bias is -1"):
        ErrorSources(bias=-1.0)
    with pytest.raises(InputError, match="finite"):
        drift_budget(cube, 1.0, ErrorSources(bias=1.0), rate=np.nan)
    with pytest.raises(InputError, match="2 or more"):
        monte_carlo_drift(cube, 1.0, ErrorSources(bias=1.0), runs=1, rng=np.random.default_rng(0))
