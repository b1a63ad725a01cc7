"""Levelling and strapdown navigation against analytic motion."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from gfimu import InputError, integrate_attitude, level, navigate
from gfimu.motion import from_rotation, to_rotation

G = 9.80665


@settings(max_examples=50, deadline=None)
@given(heading=st.floats(-3.1, 3.1), pitch=st.floats(-1.5, 1.5), roll=st.floats(-3.1, 3.1), gravity=st.floats(9.7, 9.9))
def test_levelling_recovers_attitude(heading, pitch, roll, gravity):
    truth = Rotation.from_euler("ZYX", [heading, pitch, roll])
    q = level(truth.inv().apply([0, 0, gravity]), heading=heading)
    assert (to_rotation(q).inv() * truth).magnitude() < 1e-7


def test_levelling_averages_and_skips_nan():
    p = np.array([[0.1, 0, G], [-0.1, 0, G], [np.nan, 0, 0], [0.0, 0.0, G]])
    np.testing.assert_allclose(level(p), [1, 0, 0, 0], atol=1e-15)


def test_at_rest_nothing_moves():
    t = np.arange(0, 30, 0.01)
    truth = Rotation.from_euler("ZYX", [0.4, 0.2, -0.3])
    p = np.tile(truth.inv().apply([0, 0, G]), (len(t), 1))
    q = np.tile(level(p, heading=0.4), (len(t), 1))
    result = navigate(t, p, q)
    rounding = 1e-13 * G  # of the levelled attitude
    assert np.abs(result.velocity).max() < rounding * 30
    assert np.abs(result.position).max() < rounding * 30**2 / 2


def _moving(rate_hz):
    """Body on a rising spiral, its attitude that of a cone; everything analytic."""
    t = np.arange(0, 5, 1 / rate_hz)
    a = 3.0 * t
    attitude = Rotation.from_euler("zyz", np.column_stack([-a, np.full_like(t, 0.4), a]))  # extrinsic
    position = np.column_stack([np.cos(2 * t), np.sin(3 * t), 0.5 * t**2])
    velocity = np.column_stack([-2 * np.sin(2 * t), 3 * np.cos(3 * t), t])
    acceleration = np.column_stack([-4 * np.cos(2 * t), -9 * np.sin(3 * t), np.ones_like(t)])
    p = attitude.inv().apply(acceleration + np.array([0, 0, G]))
    return t, p, attitude, velocity, position


@pytest.mark.parametrize("method", ["trapezoid", "runge_kutta", "centred6"])
def test_follows_analytic_motion(method):
    t, p, attitude, velocity, position = _moving(100.0)
    result = navigate(t, p, from_rotation(attitude), velocity0=velocity[0], position0=position[0], method=method)
    # h²/12 of the third derivative of the velocity, twice, bounds the trapezoid; the others are far below.
    bound = {"trapezoid": 2e-3, "runge_kutta": 1e-6, "centred6": 1e-9}[method]
    assert np.abs(result.velocity - velocity).max() < bound
    assert np.abs(result.position - position).max() < bound * 5
    np.testing.assert_array_equal(result.t_s, t)


def test_whole_chain_from_rates():
    t, p, attitude, velocity, position = _moving(200.0)
    s, c = np.sin(0.4), 1 - np.cos(0.4)
    omega = 3.0 * np.column_stack([-s * np.cos(3 * t), -s * np.sin(3 * t), np.full_like(t, -c)])
    alpha = 9.0 * np.column_stack([s * np.sin(3 * t), -s * np.cos(3 * t), np.zeros_like(t)])
    q = integrate_attitude(t, omega, alpha, from_rotation(attitude[0]))
    result = navigate(t, p, q, velocity0=velocity[0], position0=position[0])
    assert np.abs(result.position - position).max() < 1e-6


def test_lost_samples_stay_lost():
    t, p, attitude, velocity, position = _moving(100.0)
    p[50:53] = np.nan
    q = from_rotation(attitude)
    q[200] = np.nan
    result = navigate(t, p, q, velocity0=velocity[0], position0=position[0])
    lost = np.isnan(result.position).any(axis=1)
    assert set(np.flatnonzero(lost)) == {50, 51, 52, 200}
    # Bridging 40 ms by its ends costs at most T³/12 of the second derivative of the acceleration (< 81 m/s⁴).
    assert np.abs(result.velocity - velocity)[~lost].max() < 2 * 0.04**3 / 12 * 100


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: level(np.full((3, 3), np.nan)), "no complete sample"),
        (lambda: level([[1.0, 0, 0], [-1.0, 0, 0]]), "no up"),
        (lambda: navigate([0, 1], np.zeros((3, 3)), np.zeros((2, 4))), "three and the quaternion four"),
        (lambda: navigate([0, 1], np.zeros((2, 3)), np.zeros((2, 3))), "three and the quaternion four"),
        (lambda: navigate([1, 0], np.zeros((2, 3)), np.tile([1.0, 0, 0, 0], (2, 1))), "strictly increasing"),
    ],
)
def test_bad_input(call, words):
    with pytest.raises(InputError, match=words):
        call()
