"""The derivative by the drive against central differences, for every effect of the library."""

from __future__ import annotations

import numpy as np
import pytest
from core_cases import cause_of, lively, small_twin, stretches_of
from numpy.testing import assert_allclose

from gfimu.diagnosis import starting_point
from gfimu.diagnosis.fit.posterior import condition
from gfimu.diagnosis.terms.jacobian import Jacobian, Reach, differentiate, measured_reach
from gfimu.diagnosis.terms.spline import DEGREE, AngleSpline
from sim.effects import EFFECTS, make_effect

WIRING = {
    "axis_swap": {"channels": ["a11", "a22"]},
    "sign_flip": {"channel": "a12"},
    "wrong_range": {"chip": "a2", "factor": 2.0},
    "saturation": {"limit_m_s2": 100.0},
}
"""Effects without sizes that change a prediction (a limit that is not reached, as clipped samples do not count)."""
NO_PREDICTION = {"noise", "bias_random_walk", "coarse_resolution", "stuck_channel", "dropped_frames"}
USUAL = 2e-6
"""Error of the derivative relative to its norm: the step of the difference times the curvature."""
TOLERANCES = {
    # What is below three thousandths of a response's peak counts as over (`_FORGOTTEN`); for a time shift that is the
    # outermost interval of the support.
    "channel_skew": 1e-4,
    "tacho_latency": 1e-4,
    "clock_error": 1e-3,
    "sensor_lag": 3e-3,
    "cogging": 1e-2,
    "resonance": 5e-3,
    "hysteresis": 5e-2,  # a play jumps from held to moving within the step of a difference
}
SHAPES = {"resonance": {"frequency_hz": 8.0, "damping_ratio": 0.05}, "hysteresis": {"width_m_s2": 0.5}}


@pytest.fixture(scope="module")
def twin():
    return small_twin("cube12")


@pytest.fixture(scope="module")
def stretch(twin):
    return stretches_of(twin, duration=6.0, motion=lively())[0]


@pytest.fixture(scope="module")
def drive(stretch):
    return starting_point([stretch], 0.05).drives[0]


def typical(name, array, seed=2):
    """An effect of the library at sizes that would surprise nobody."""
    if name in WIRING:
        return make_effect(name, WIRING[name], array)
    rng = np.random.default_rng(seed)
    cause = cause_of(name, array, **SHAPES.get(name, {}))
    return cause.at(0.2 + np.abs(rng.standard_normal(len(cause.coordinates)))).effect(array, 0)


def by_central_differences(stretch, drive, effects, numbers, step=1e-5):
    """Derivative by some coefficients, (n, c + 1, len(numbers))."""
    found = []
    for number in numbers:
        unit = step * np.eye(drive.spline.size)[number]
        up, down = (stretch.predict(effects, drive.moved(sign * unit).spin) for sign in (1.0, -1.0))
        found.append((up - down) / (2.0 * step))
    return np.stack(found, axis=2)


def error_of(stretch, drive, effects, *, exact):
    jacobian = condition(stretch, drive, effects, stretch.first_levels, exact=exact).jacobian
    numbers = np.arange(3, drive.spline.size, 7)
    truth = by_central_differences(stretch, drive, effects, numbers)
    mine = np.stack([jacobian.times(np.eye(drive.spline.size)[number]) for number in numbers], axis=2)
    return float(np.linalg.norm(mine - truth) / np.linalg.norm(truth)), jacobian


@pytest.mark.parametrize("name", sorted(set(EFFECTS) - NO_PREDICTION))
def test_derivative_of_every_effect(twin, stretch, drive, name):
    error, _ = error_of(stretch, drive, [typical(name, twin.array)], exact=name == "resonance")
    assert error < TOLERANCES.get(name, USUAL)


@pytest.mark.parametrize("ratio", [-0.09, 0.09])
def test_derivative_where_a_clock_is_far_off(twin, stretch, drive, ratio):
    effect = make_effect("clock_error", {"ratio": ratio})
    error, _ = error_of(stretch, drive.covering(stretch.times([effect])), [effect], exact=False)
    assert error < USUAL


def test_effects_without_a_noise_free_form_change_no_prediction(twin, stretch, drive):
    bare = stretch.predict([], drive.spin)
    for name in ("noise", "bias_random_walk"):
        assert_allclose(stretch.predict([make_effect(name, {})], drive.spin), bare)


def reach_of(stretch, drive, effects):
    base = stretch.predict(effects, drive.spin)

    def predict(coefficients):
        return stretch.predict(effects, drive.spline.spin(coefficients))

    times = stretch.times(effects)[:, [*stretch.model.array.chip_of_channel, -1]]
    return measured_reach(predict, drive.spline, drive.coefficients, base, stretch.run.t, times)


@pytest.mark.parametrize(
    ("name", "parameters", "least"),
    [
        ("sensor_lag", {"time_constant_s": 0.05}, (4, 0)),  # a three-hundredth after 0.29 s
        ("channel_skew", {"per_chip_s": 0.06}, (0, 3)),  # the last chip 0.18 s after the stamp
        ("tacho_latency", {"delay_s": 0.15}, (3, 0)),
        ("clock_error", {"ratio": 0.05}, (5, 0)),  # 0.29 s behind at the end
        ("clock_error", {"ratio": -0.09}, (0, 9)),  # 0.59 s ahead at the end
        ("cogging", {"amplitude_rad_s2": 3.0, "order": 4.0, "phase_rad": 0.3}, (8, 0)),  # a servo of 1 Hz
    ],
)
def test_memory_is_measured(twin, stretch, drive, name, parameters, least):
    reach = reach_of(stretch, drive, [make_effect(name, parameters, twin.array)])
    assert reach.before >= least[0]
    assert reach.after >= least[1]
    assert reach.width < drive.spline.size


def test_nothing_is_remembered_without_effects(stretch, drive):
    assert reach_of(stretch, drive, []) == Reach(0, 0)
    assert Reach(2, 3).width == DEGREE + 6


def test_a_reach_that_is_too_short_is_wrong(twin, stretch, drive):
    # The measured memory is needed: with the spline's support alone the derivative of a lag is far off.
    effects = [make_effect("sensor_lag", {"time_constant_s": 0.05})]
    base = stretch.predict(effects, drive.spin)

    def predict(coefficients):
        return stretch.predict(effects, drive.spline.spin(coefficients))

    numbers = np.arange(3, drive.spline.size, 7)
    truth = by_central_differences(stretch, drive, effects, numbers)
    errors = []
    for reach in (Reach(), reach_of(stretch, drive, effects)):
        found = differentiate(
            predict, drive.spline, drive.coefficients, base, np.ones(base.shape), stretch.run.t, reach
        )
        mine = np.stack([found.times(np.eye(drive.spline.size)[number]) for number in numbers], axis=2)
        errors.append(np.linalg.norm(mine - truth) / np.linalg.norm(truth))
    assert errors[0] > 0.02
    assert errors[1] < TOLERANCES["sensor_lag"]


def test_a_long_memory_is_followed_where_it_is_asked_for(twin, stretch, drive):
    mode = make_effect("resonance", {"gain": 0.5, "frequency_hz": 6.0, "damping_ratio": 0.1})
    assert mode.memory_s > 0.5
    short, narrow = error_of(stretch, drive, [mode], exact=False)
    long, wide = error_of(stretch, drive, [mode], exact=True)
    assert wide.predictions > narrow.predictions
    assert long < TOLERANCES["resonance"] < short


# -- algebra of the factored, banded derivative ----------------------------------------------------------------------


@pytest.fixture(scope="module")
def random_jacobian():
    """A linear world with a memory of two intervals before and one after, and its dense derivative (n, c, m)."""
    rng = np.random.default_rng(7)
    spline = AngleSpline(0.0, 0.1, 30)
    t = np.linspace(0.05, 2.95, 120)
    first = spline.interval(t)[0]
    dense = np.zeros((len(t), 3, spline.size))
    shapes, loading = rng.standard_normal((len(t), spline.size, 2)), rng.standard_normal((2, 3))
    for row, place in enumerate(first):
        low, high = max(place - 2, 0), min(place + DEGREE + 2, spline.size)
        dense[row, :, low:high] = (shapes[row, low:high] @ loading).T
    weight = rng.uniform(0.2, 1.0, (len(t), 3))
    x = rng.standard_normal(spline.size)
    found = differentiate(lambda c: dense @ c, spline, x, dense @ x, weight, t, Reach(2, 1))
    return found, dense * weight[:, :, None]


def test_coloured_differences_of_a_linear_world(random_jacobian):
    found, dense = random_jacobian
    assert isinstance(found, Jacobian)
    assert found.predictions == DEGREE + 1 + 2 + 1 + 1
    for k in range(found.size):
        assert_allclose(found.times(np.eye(found.size)[k]), dense[:, :, k], atol=1e-6)


def test_products_equal_dense_ones(random_jacobian):
    found, dense = random_jacobian
    rng = np.random.default_rng(8)
    weights, values = rng.uniform(0.5, 2.0, 3), rng.standard_normal((120, 3, 2))
    expected = np.einsum("c,nci,ncj->ij", weights, dense, dense)
    assert_allclose(found.information(weights), expected, atol=1e-4 * expected.max())
    combined = np.einsum("rc,ncp->rnp", found.loading, values)
    assert_allclose(found.correlate(combined), np.einsum("nci,ncp->ip", dense, values), atol=1e-4)
    back = np.tensordot(found.loading.T, found.transposed(values[:, 0]), axes=1)  # (c, m, P)
    assert_allclose(back, np.einsum("nci,np->cip", dense, values[:, 0]), atol=1e-4)
