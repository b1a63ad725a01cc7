"""Motions of carried bodies: each rate and acceleration is the derivative of what it belongs to."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import gfimu
from gfimu import InputError
from gfimu.rate.axis.axis_gyro import with_axis_gyro
from sim import Hold, Ramp, spin_profile
from sim.motions.carried import HandTable, Wheel
from sim.scenarios import Scenario

SPIN = spin_profile([Hold(1.0), Ramp(6.0, 2.0), Hold(3.0), Ramp(-3.0, 2.0), Hold(2.0)], start_angle=0.4)
WHEEL = Wheel(SPIN, radius=0.3, axis=(0.2, -0.5, 0.8), shake=2.0, seed=4)
HAND = HandTable(duration_s=10.0, seed=3)
STEP = 1e-4


@pytest.mark.parametrize("motion", [WHEEL, HAND], ids=["wheel", "hand"])
def test_derivatives_agree_with_central_differences(motion):
    t = np.linspace(0.5, 9.5, 400)
    before, now, after = (motion.at(t + shift) for shift in (-STEP, 0.0, STEP))
    np.testing.assert_allclose((after.position - before.position) / (2 * STEP), now.velocity, atol=2e-5)
    np.testing.assert_allclose((after.velocity - before.velocity) / (2 * STEP), now.acceleration, atol=5e-3)
    np.testing.assert_allclose((after.omega - before.omega) / (2 * STEP), now.alpha, atol=2e-3)
    turn = Rotation.from_matrix(before.rotation).inv() * Rotation.from_matrix(after.rotation)
    np.testing.assert_allclose(turn.as_rotvec() / (2 * STEP), now.omega, atol=2e-5)


def test_a_wheel_rolls_about_its_axle():
    t = np.linspace(0.0, 10.0, 300)
    state, spin = WHEEL.at(t), SPIN.at(t)
    axis = np.array(WHEEL.axis) / np.linalg.norm(WHEEL.axis)
    np.testing.assert_allclose(state.rotation @ axis, np.tile([0.0, 1.0, 0.0], (300, 1)), atol=1e-9)
    np.testing.assert_allclose(state.omega, np.outer(spin.rate, axis))
    stand = Wheel(SPIN, radius=0.3).at(t)
    np.testing.assert_allclose(stand.velocity, np.outer(0.3 * spin.rate, [1.0, 0.0, 0.0]))


def test_the_hub_shakes_as_wanted():
    shaken = Wheel(SPIN, shake=2.0).at(np.linspace(0.0, 400.0, 40_000)).acceleration
    np.testing.assert_allclose(shaken[:, [0, 2]].std(axis=0), 2.0, rtol=0.1)  # 24 waves over 400 s
    assert not shaken[:, 1].any()


def test_a_hand_begins_and_ends_at_rest():
    for t in (0.0, 1.9, 8.1, 10.0):
        state = HAND.at(np.array([t]))
        assert not state.omega.any()
        assert not state.acceleration.any()
    assert np.linalg.norm(HAND.at(np.linspace(3.0, 7.0, 100)).omega, axis=1).max() > 2.0


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: HandTable(duration_s=4.0).motion(), "too short"),
        (lambda: HandTable(duration_s=100.0, pace_s=1e-6).motion(), "movements"),
        (lambda: HandTable(duration_s=100.0, turn_rad=1e308).motion(), "at most"),
        (lambda: Wheel(SPIN, axis=(1e308, 1e308, 0.0)), "give a direction"),
        (lambda: Wheel(SPIN, radius=-1.0), "must not be negative"),
        (lambda: Wheel(SPIN, axis=(0.0, 0.0, 0.0)), "give a direction"),
    ],
)
def test_wrong_numbers_are_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_scenarios_of_a_wheel_and_of_a_hand():
    wheel = gfimu.simulate(Scenario.load("wheel", changes=["duration_s=6"]), seed=1)
    assert "tacho_rad_s" in wheel.reference
    assert not {"gyro_x_rad_s", "angle_rad"} & set(wheel.reference)
    np.testing.assert_allclose(wheel.reference["tacho_rad_s"], wheel.extra["truth_omega_z_rad_s"], atol=0.05)
    hand = gfimu.simulate(Scenario.load("hand", changes=["motion.duration_s=8"]), seed=1)
    assert {"gyro_x_rad_s", "gyro_y_rad_s", "gyro_z_rad_s"} <= set(hand.reference)
    assert "tacho_rad_s" not in hand.reference


def test_the_tachometer_of_an_axle_is_a_gyro_along_it():
    run = gfimu.simulate(Scenario.load("wheel", changes=["duration_s=6"]), seed=1)
    array = run.array
    turned = with_axis_gyro(run, array)
    np.testing.assert_array_equal(turned.reference["gyro_z_rad_s"], run.reference["tacho_rad_s"])
    assert not turned.reference["gyro_x_rad_s"].any()
    assert with_axis_gyro(turned, array) is turned
    cube = gfimu.AccelerometerArray.load("cube12")
    assert with_axis_gyro(run, cube) is run
