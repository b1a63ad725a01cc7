"""Attitude: constant rotation, coning, convergence orders, tumble figures, scipy, norm, bad input."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from gfimu import InputError, integrate_attitude
from gfimu.motion import ATTITUDE_METHODS, from_rotation, table_angle, to_rotation


def twist_angle(quaternion):
    """Return the turns about the world's z, rad, that attitudes (w, x, y, z) hold beside a tilt."""
    return np.unwrap(2.0 * np.arctan2(quaternion[:, 3], quaternion[:, 0]))


vectors = st.lists(st.floats(-20, 20), min_size=3, max_size=3).map(np.array)


def angle_between(q, rotation):
    return (to_rotation(q).inv() * rotation).magnitude()


def coning(t, cone, spin):
    """Body whose z-axis describes a cone of half-angle ``cone`` at ``spin`` rad/s while it does not roll.

    Attitude R = Rz(a) Ry(cone) Rz(−a) with a = spin·t; rate and acceleration follow by differentiation by hand.
    """
    a = spin * t
    rotation = Rotation.from_euler("zyz", np.column_stack([-a, np.full_like(t, cone), a]))  # extrinsic
    s, c = np.sin(cone), 1 - np.cos(cone)
    omega = spin * np.column_stack([-s * np.cos(a), -s * np.sin(a), np.full_like(t, -c)])
    alpha = spin**2 * np.column_stack([s * np.sin(a), -s * np.cos(a), np.zeros_like(t)])
    return rotation, omega, alpha


def test_coning_motion_is_what_it_says():
    # The analytic rate against the numerical derivative of the analytic attitude.
    t = np.array([0.3, 0.3 + 1e-6])
    rotation, omega, _ = coning(t, 0.2, 7.0)
    np.testing.assert_allclose((rotation[0].inv() * rotation[1]).as_rotvec() / 1e-6, omega[0], atol=1e-4)


@pytest.mark.parametrize("method", ATTITUDE_METHODS)
@settings(max_examples=20, deadline=None)
@given(omega=vectors, q0=st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda q: np.linalg.norm(q) > 0.1))
def test_constant_rate_is_scipys_rotation_vector(method, omega, q0):
    t = np.arange(0, 51) * 0.01
    q = integrate_attitude(t, np.tile(omega, (51, 1)), np.zeros((51, 3)), q0, method=method)
    truth = to_rotation(np.array(q0)) * Rotation.from_rotvec(t[:, None] * omega)
    step = 0.01 * np.linalg.norm(omega)
    tolerance = 1e-7 + (0.5 * step**5 if method == "runge_kutta" else 0)  # RK4's local error (θ/2)⁵/5!·2 per step
    assert angle_between(q, truth).max() < tolerance
    np.testing.assert_allclose(np.linalg.norm(q, axis=1), 1.0, atol=4e-16)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-3, 0.1, 0.4, 0.4999, 0.5001, 1.0, 3.0, 6.0])
def test_one_step_is_exact_to_the_last_digits(angle):
    # Across the seam between series and closed form of sin(θ/2)/θ and cos(θ/2).
    rotation_vector = angle * np.array([0.6, 0.0, -0.8])
    q = integrate_attitude([0.0, 1.0], [rotation_vector, rotation_vector])[1]
    expected = [np.cos(angle / 2), 0.6 * np.sin(angle / 2), 0.0, -0.8 * np.sin(angle / 2)]
    np.testing.assert_allclose(q, expected, rtol=0, atol=4e-16)


@pytest.mark.parametrize(
    ("method", "order"), [("exponential", 2), ("coning", 2), ("runge_kutta", 2), ("fourth_order", 4)]
)
def test_order_of_convergence_on_coning(method, order):
    def error(n):
        t = np.linspace(0.0, 2.0, n + 1)
        rotation, omega, alpha = coning(t, 0.5, 11.0)
        return angle_between(integrate_attitude(t, omega, alpha, from_rotation(rotation[0]), method=method), rotation)[
            -1
        ]

    assert np.log2(error(200) / error(400)) == pytest.approx(order, abs=0.15)


def test_coning_drift_of_the_mean_rate_is_the_polygon_against_the_circle():
    # Coning of 10 Hz sampled at 100 Hz. Heading gained per step is the area swept by the body's axis: cone² β/2 for
    # the circle; steps along chords of the sampled rate close a polygon of radius β cos(β/2)/(2 sin(β/2)) · cone.
    cone, beta, steps = 0.05, 0.2 * np.pi, 1000
    t = np.arange(steps + 1) * 0.01
    rotation, omega, alpha = coning(t, cone, 20 * np.pi)

    def heading_error(method):
        q = integrate_attitude(t, omega, alpha, from_rotation(rotation[0]), method=method)
        return twist_angle(from_rotation(to_rotation(q) * rotation.inv()))[-1]

    radius = beta * np.cos(beta / 2) / (2 * np.sin(beta / 2))
    expected = 0.5 * cone**2 * (beta - radius**2 * np.sin(beta)) * steps
    assert abs(heading_error("exponential")) == pytest.approx(expected, rel=0.01)
    assert abs(heading_error("fourth_order")) < expected / 20


def _tumble(rate_hz):
    """8 turns per second of a body with inertia 1 : 2 : 3, torque-free, 10 s, by a high-order ODE solver."""
    inertia = np.array([1.0, 2.0, 3.0])
    start = np.array([0.3, 1.0, 0.2])
    start *= 16 * np.pi / np.linalg.norm(start)

    def derivative(_, state):
        (wx, wy, wz), (w, x, y, z) = state[:3], state[3:]
        dq = [-x * wx - y * wy - z * wz, w * wx + y * wz - z * wy, w * wy - x * wz + z * wx, w * wz + x * wy - y * wx]
        omega = state[:3]
        return np.concatenate([-np.cross(omega, inertia * omega) / inertia, 0.5 * np.array(dq)])

    t = np.arange(0, 10, 1 / rate_hz)
    state = solve_ivp(derivative, (0, 10), [*start, 1, 0, 0, 0], method="DOP853", rtol=1e-12, atol=1e-12, t_eval=t).y.T
    omega = state[:, :3]
    return t, omega, -np.cross(omega, inertia * omega) / inertia, to_rotation(state[:, 3:])


def test_eight_turn_tumble():
    t, omega, alpha, truth = _tumble(100.0)
    error = {m: angle_between(integrate_attitude(t, omega, alpha, method=m), truth).max() for m in ATTITUDE_METHODS}
    assert error["fourth_order"] < 3e-3
    assert error["coning"] > 0.3
    assert error["exponential"] > error["coning"]
    assert error["runge_kutta"] > 0.3


def test_runge_kutta_against_exponential_map_at_ten_turns_per_second():
    # Spin about one axis that swings between ±10 turns per second, where the exponential of the exact mean rate is
    # exact and the fourth-order step of the quaternion is not.
    t = np.arange(0, 10, 0.01)
    rate = 20 * np.pi * np.ones_like(t)
    omega = np.column_stack([np.zeros_like(t), np.zeros_like(t), rate])
    truth = Rotation.from_rotvec(np.column_stack([0 * t, 0 * t, rate * t]))
    assert angle_between(integrate_attitude(t, omega, method="exponential"), truth).max() < 1e-7
    # RK4 turns short by (Ωh/2)⁵/120·2 per step: 4.8e-5 rad × 1000 steps.
    expected = 2 * (0.1 * np.pi) ** 5 / 120 * 999
    error = angle_between(integrate_attitude(t, omega, method="runge_kutta"), truth).max()
    assert error == pytest.approx(expected, rel=0.15)


def test_default_method_uses_alpha_when_given():
    t = np.arange(0, 1, 0.01)
    _, omega, alpha = coning(t, 0.5, 11.0)
    np.testing.assert_array_equal(
        integrate_attitude(t, omega, alpha), integrate_attitude(t, omega, alpha, method="fourth_order")
    )
    np.testing.assert_array_equal(integrate_attitude(t, omega), integrate_attitude(t, omega, method="coning"))


def test_body_to_world_sign():
    # A quarter turn about z carries the body's x-axis onto the world's y-axis.
    t = np.linspace(0, 1, 101)
    q = integrate_attitude(t, np.tile([0, 0, np.pi / 2], (101, 1)))
    np.testing.assert_allclose(to_rotation(q[-1]).apply([1.0, 0.0, 0.0]), [0.0, 1.0, 0.0], atol=1e-12)


def test_lost_samples_are_bridged_and_marked():
    t = np.arange(0, 1, 0.01)
    omega = np.tile([0.3, -0.2, 1.0], (100, 1))
    omega[40:45] = np.nan
    q = integrate_attitude(t, omega)
    assert np.isnan(q[40:45]).all()
    assert angle_between(q[-1], Rotation.from_rotvec([0.3 * t[-1], -0.2 * t[-1], t[-1]])) < 1e-9


@pytest.mark.parametrize("method", ATTITUDE_METHODS)
@pytest.mark.parametrize("lost", [0, 5, 19])
def test_a_lost_first_or_last_sample_is_no_trouble(method, lost):
    t = np.arange(20) * 0.01
    omega = np.tile([0.3, -0.2, 1.0], (20, 1))
    omega[lost, 1] = np.nan
    q = integrate_attitude(t, omega, np.zeros((20, 3)), method=method)
    kept = np.delete(np.arange(20), lost)
    assert np.isnan(q[lost]).all()
    truth = Rotation.from_rotvec((t[kept] - t[kept[0]])[:, None] * [0.3, -0.2, 1.0])
    assert angle_between(q[kept], truth).max() < 1e-7


def test_nan_in_alpha_matters_only_where_alpha_is_used():
    t = np.arange(20) * 0.01
    omega, alpha = np.ones((20, 3)), np.zeros((20, 3))
    alpha[7] = np.nan
    assert np.isfinite(integrate_attitude(t, omega, alpha, method="coning")).all()
    assert np.isnan(integrate_attitude(t, omega, alpha)).any(axis=1).tolist() == [i == 7 for i in range(20)]


def test_table_angle_counts_turns():
    t = np.arange(0, 10, 0.01)
    omega = np.column_stack([np.zeros_like(t), np.zeros_like(t), 4 * np.cos(t)])
    np.testing.assert_allclose(table_angle(t, omega, angle0=0.5), 0.5 + 4 * np.sin(t), atol=1e-8)
    turning = np.tile([0.0, 0.0, 7.0], (len(t), 1))
    np.testing.assert_allclose(twist_angle(integrate_attitude(t, turning)), 7 * t, atol=1e-9)
    np.testing.assert_allclose(table_angle(t, turning, axis=[0, 0, -2.0]), -7 * t, atol=1e-9)


def test_twist_ignores_tilt():
    tilted = Rotation.from_rotvec([0.0, 0.0, 0.7]) * Rotation.from_rotvec([0.3, -0.2, 0.0])
    assert twist_angle(np.atleast_2d(from_rotation(tilted)))[0] == pytest.approx(0.7)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"method": "euler"}, "valid: coning"),
        ({"method": "fourth_order"}, "needs alpha"),
        ({"q0": [0, 0, 0, 0]}, "q0"),
        ({"q0": [1, 0, 0]}, "q0"),
        ({"alpha": np.zeros((2, 3))}, "one row of three"),
        ({"t": [0, 1, 0.5]}, "strictly increasing"),
    ],
)
def test_bad_input(arguments, words):
    with pytest.raises(InputError, match=words):
        integrate_attitude(**({"t": [0, 1, 2], "omega": np.zeros((3, 3))} | arguments))
