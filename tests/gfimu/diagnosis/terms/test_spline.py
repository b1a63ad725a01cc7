"""The spline of the table's angle against SciPy's."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.interpolate import BSpline

from gfimu.diagnosis import State
from gfimu.diagnosis.data.table.spins import JoinedSpin, ScaledSpin
from gfimu.diagnosis.terms.spline import DEGREE, AngleSpline

SPLINE = AngleSpline(-0.3, 0.07, 40)
UNEVEN = SPLINE.cut(np.arange(40) % 5 == 2).cut(np.arange(48) % 4 == 3)


def reference(spline, coefficients):
    beyond = np.arange(1, DEGREE + 1)
    before, after = spline.start - spline.widths[0] * beyond[::-1], spline.stop + spline.widths[-1] * beyond
    return BSpline(np.concatenate([before, spline.knots, after]), coefficients, DEGREE)


@pytest.fixture
def coefficients():
    return np.cumsum(np.random.default_rng(3).standard_normal(SPLINE.size))


def test_cut_intervals_are_halved():
    spline = AngleSpline(1.0, 0.2, 10).cut(np.arange(10) == 4)
    assert (spline.intervals, spline.size, spline.finest) == (11, 15, 0.1)
    assert_allclose(spline.widths, [0.2] * 4 + [0.1] * 2 + [0.2] * 5)
    assert spline.stop == pytest.approx(3.0)
    place, passed = spline.interval(np.array([0.0, 1.85, 1.95, 2.1, 9.0]))
    assert place.tolist() == [0, 4, 5, 6, 10]
    assert_allclose(passed, [0.0, 0.5, 0.5, 0.5, 1.0])
    assert AngleSpline(1.0, 0.2, 10).cut(np.zeros(10, dtype=bool)) == AngleSpline(1.0, 0.2, 10)


def test_uneven_knots_are_those_of_the_b_spline():
    coefficients = np.cumsum(np.random.default_rng(4).standard_normal(UNEVEN.size))
    t = np.random.default_rng(1).uniform(UNEVEN.start, UNEVEN.stop, 300)
    state, truth = UNEVEN.spin(coefficients).at(t), reference(UNEVEN, coefficients)
    assert_allclose(state.angle, truth(t), atol=1e-12)
    assert_allclose(state.rate, truth.derivative(1)(t), atol=1e-10)
    assert_allclose(state.acceleration, truth.derivative(2)(t), atol=1e-7)
    assert_allclose(UNEVEN.bend(coefficients), truth.derivative(DEGREE)(UNEVEN.centres), rtol=1e-9)
    for order in range(3):
        first, rows = UNEVEN.rows(t, order)
        expected = truth.derivative(order)(t) if order else truth(t)
        found = np.einsum("nf,nf->n", rows, coefficients[first[:, None] + np.arange(DEGREE + 1)])
        assert_allclose(found, expected, atol=1e-7)
    assert_allclose(UNEVEN.through(UNEVEN.spin(coefficients)), coefficients, atol=1e-6)


def test_angle_rate_and_acceleration_are_those_of_the_b_spline(coefficients):
    t = np.random.default_rng(1).uniform(SPLINE.start, SPLINE.stop, 300)
    state, truth = SPLINE.spin(coefficients).at(t), reference(SPLINE, coefficients)
    assert_allclose(state.angle, truth(t), atol=1e-12)
    assert_allclose(state.rate, truth.derivative(1)(t), atol=1e-10)
    assert_allclose(state.acceleration, truth.derivative(2)(t), atol=1e-8)


def test_bend_is_the_fourth_derivative_between_the_knots(coefficients):
    middles = SPLINE.start + SPLINE.spacing * (np.arange(SPLINE.intervals) + 0.5)
    truth = reference(SPLINE, coefficients).derivative(DEGREE)(middles)
    assert_allclose(SPLINE.bend(coefficients), truth, rtol=1e-9)
    both = np.column_stack([coefficients, -2.0 * coefficients])
    assert_allclose(SPLINE.bend(both), np.column_stack([truth, -2.0 * truth]), rtol=1e-9)


@pytest.mark.parametrize("t", [SPLINE.start, 0.0, 1.234, SPLINE.stop])
def test_row_of_the_angle(coefficients, t):
    assert SPLINE.angle_row(t) @ coefficients == pytest.approx(float(reference(SPLINE, coefficients)(t)), abs=1e-12)


def test_the_rate_is_constant_beyond_both_ends(coefficients):
    spin = SPLINE.spin(coefficients)
    for end, beyond in ((SPLINE.start, np.array([-0.5, -2.0])), (SPLINE.stop, np.array([0.5, 2.0]))):
        at, off = spin.at(np.array([end])), spin.at(end + beyond)
        assert_allclose(off.rate, at.rate[0])
        assert_allclose(off.angle, at.angle[0] + at.rate[0] * beyond)


def test_covers_the_span_it_is_asked_for():
    spline = AngleSpline.over(-1.0, 2.06, 0.1)
    assert spline.start == -1.0
    assert 2.06 <= spline.stop < 2.16
    assert spline.size == spline.intervals + DEGREE
    assert AngleSpline.over(0.0, 0.1, 0.1).intervals == 2 * DEGREE


def test_through_gives_back_a_spline_on_the_same_knots(coefficients):
    found = SPLINE.through(SPLINE.spin(coefficients))
    t = np.linspace(SPLINE.start, SPLINE.stop, 500)
    off = np.abs(SPLINE.spin(found).at(t).angle - SPLINE.spin(coefficients).at(t).angle)
    assert off.max() < 1e-4  # the outermost coefficients are hardly determined
    assert off[100:-100].max() < 1e-7


def test_through_comes_close_to_a_smooth_motion():
    class Swing:
        def at(self, t):
            return State(np.sin(2.0 * t), 2.0 * np.cos(2.0 * t), -4.0 * np.sin(2.0 * t))

    t = np.linspace(SPLINE.start + 0.3, SPLINE.stop - 0.3, 400)
    fine = SPLINE.spin(SPLINE.through(Swing())).at(t)
    # A quartic spline is off by some (2h)⁵/800 of the angle.
    assert_allclose(fine.angle, np.sin(2.0 * t), atol=1e-6)
    assert_allclose(fine.rate, 2.0 * np.cos(2.0 * t), atol=1e-5)


def test_states_are_not_mistaken_for_those_of_other_times_with_the_same_ends(coefficients):
    spin, even = SPLINE.spin(coefficients), np.linspace(0.0, 2.0, 9)
    uneven = even.copy()
    uneven[4] += 0.1
    first = spin.at(even)
    assert spin.at(uneven).angle[4] == pytest.approx(float(reference(SPLINE, coefficients)(uneven[4])))
    assert_allclose(spin.at(even).angle, first.angle)
    assert spin.at(np.zeros(0)).angle.shape == (0,)


def test_a_motion_over_the_gain_of_its_reference(coefficients):
    spin, t = SPLINE.spin(coefficients), np.linspace(0.0, 2.0, 5)
    scaled = ScaledSpin(spin, -2.0).at(t)
    for key in ("angle", "rate", "acceleration"):
        assert_allclose(getattr(scaled, key), -0.5 * getattr(spin.at(t), key))


def test_joined_motions_change_at_the_time_they_name(coefficients):
    one, other, t = SPLINE.spin(coefficients), SPLINE.spin(coefficients[::-1]), np.linspace(0.0, 2.0, 21)
    both = JoinedSpin(one, other, 1.0).at(t)
    for key in ("angle", "rate", "acceleration"):
        expected = np.where(t > 1.0, getattr(other.at(t), key), getattr(one.at(t), key))
        assert_allclose(getattr(both, key), expected)


@pytest.mark.parametrize("spline", [SPLINE, UNEVEN])
def test_places_that_are_asked_for_again_are_those_of_their_own_times(spline):
    inner = np.linspace(0.0, 1.0, 50)
    for times in (inner, inner.copy(), np.concatenate([inner[:1], inner[:-2] ** 2, inner[-1:]]), inner[:0]):
        for told, right in zip(spline.places(times), spline.interval(times), strict=True):
            assert_allclose(told, right)
    assert spline.places(inner)[0] is spline.places(inner.copy())[0]
