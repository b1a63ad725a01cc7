"""The Earth's rotation in simulated readings, against derivatives in a frame that does not turn."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import gfimu
from gfimu import AccelerometerArray, EarthRotation, local_gravity
from gfimu.array import EARTH_RATE
from sim import BodyState
from sim.earth import earth_readings
from sim.scenarios import Scenario
from sim.simulation import simulate

LATITUDE = 35.7
STILL = {
    "array": "cube12",
    "duration_s": 30.0,
    "sample_rate_hz": 50.0,
    "latitude_deg": LATITUDE,
    "north_rad": 0.4,
    "sensor": {"perfect": True},
    "motion": {"kind": "profile", "segment": [{"kind": "hold", "duration_s": 30.0}]},
}


def turning_body(t):
    """Place and attitude of a body that goes round and turns about two axes, in the world."""
    place = np.stack([np.cos(1.3 * t), np.sin(0.7 * t), 0.2 * t], axis=-1)
    turn = Rotation.from_rotvec(np.outer(2.0 * t, [0.0, 0.0, 1.0])) * Rotation.from_rotvec(
        np.outer(np.sin(1.1 * t), [1.0, 0.0, 0.0])
    )
    return place, turn


def derivative(function, t, order, h=1e-3):
    """Central differences of sixth order."""
    first = {1: 45.0, 2: -9.0, 3: 1.0}
    second = {0: -490.0, 1: 270.0, 2: -27.0, 3: 2.0}
    if order == 1:
        return sum(w * (function(t + k * h) - function(t - k * h)) for k, w in first.items()) / (60.0 * h)
    total = second[0] * function(t) + sum(second[k] * (function(t + k * h) + function(t - k * h)) for k in (1, 2, 3))
    return total / (180.0 * h**2)


def test_readings_on_a_turning_earth_are_second_derivatives_in_a_frame_at_rest():
    """With an Earth that turns at 0.2 rad/s, so that each term shows; the pull of the place counts as its gravity."""
    array = AccelerometerArray.load("cube12")
    earth = np.array([0.1, -0.05, 0.17])
    t = np.linspace(0.3, 2.0, 7)
    place, turn = turning_body(t)
    rotation = turn.as_matrix()

    def of_a_point(point):
        def path(when):
            where, how = turning_body(when)
            return Rotation.from_rotvec(np.outer(when, earth)).apply(where + how.apply(point))

        acceleration = derivative(path, t, 2)  # against the stars
        return Rotation.from_rotvec(np.outer(t, earth)).inv().apply(acceleration)  # in world axes

    pull = np.cross(earth, np.cross(earth, place))  # of the body origin's place: in its gravity
    readings = np.empty((len(t), array.n_channels))
    for channel, (point, axis) in enumerate(zip(array.positions, array.axes, strict=True)):
        readings[:, channel] = np.einsum("nij,ni,j->n", rotation, of_a_point(point) - pull, axis)

    without = np.empty_like(readings)
    for channel, (point, axis) in enumerate(zip(array.positions, array.axes, strict=True)):
        path = lambda when, point=point: turning_body(when)[0] + turning_body(when)[1].apply(point)  # noqa: E731
        without[:, channel] = np.einsum("nij,ni,j->n", rotation, derivative(path, t, 2), axis)

    # rate and angular acceleration in body axes, by differences of the attitude
    spin = derivative(lambda when: turning_body(when)[1].as_matrix(), t, 1)
    twist = np.swapaxes(rotation, 1, 2) @ spin
    omega = np.stack([twist[:, 2, 1], twist[:, 0, 2], twist[:, 1, 0]], axis=-1)
    body = BodyState(
        place, rotation, derivative(lambda when: turning_body(when)[0], t, 1), np.zeros((7, 3)), omega, omega
    )
    added = earth_readings(array, earth, body)
    assert np.abs(added).max() > 0.3
    np.testing.assert_allclose(added, readings - without, atol=1e-6)


def test_a_unit_at_rest_drifts_by_the_earths_horizontal_rate_unless_the_latitude_is_given():
    """δr = g Ω_h t³/6 (GF-IMU paper, eq. 30 with the Earth's rate as the drift)."""
    recording = simulate(Scenario.from_dict(STILL))
    assert recording.metadata["latitude_deg"] == LATITUDE
    array = AccelerometerArray.load("cube12")
    taken_off = gfimu.estimate(recording, position=True)
    # With the rate known to be the Earth's and taken for that against the ground:
    start = EarthRotation(LATITUDE, 0.4).rate
    ignored = gfimu.motion.estimation.estimate(
        recording, array, omega0=start, with_position=True, gravity=local_gravity(LATITUDE)
    )
    level = EARTH_RATE * np.cos(np.radians(LATITUDE))
    drift = local_gravity(LATITUDE) * level * recording.duration**3 / 6
    assert np.hypot(*ignored.position[-1, :2]) == pytest.approx(drift, rel=1e-3)
    assert drift == pytest.approx(2.61, abs=0.01)  # of the paper's 6.42 m
    assert np.linalg.norm(taken_off.position[-1]) < 1e-3 * drift
    np.testing.assert_allclose(taken_off.omega[0], start, rtol=1e-6)
    assert abs(taken_off.angle[-1]) < 1e-6


def test_coriolis_is_taken_off_a_body_that_moves():
    """On a straight line at constant speed the array measures 2 Ω × v, and the line stays one."""
    earth = EarthRotation(60.0, 0.0)
    t = np.arange(0.0, 100.0, 0.5)
    velocity = np.array([10.0, -3.0, 0.5])
    force = np.tile(2.0 * np.cross(earth.rate, velocity) + [0.0, 0.0, 9.8], (len(t), 1))
    upright = np.tile([1.0, 0.0, 0.0, 0.0], (len(t), 1))
    found = gfimu.navigate(t, force, upright, gravity=9.8, velocity0=velocity, earth=earth)
    np.testing.assert_allclose(found.position, np.outer(t, velocity), atol=0.01 * 99.5 * 7.3e-5 * 1000)
    unaware = gfimu.navigate(t, force, upright, gravity=9.8, velocity0=velocity)
    assert np.linalg.norm(unaware.position[-1] - found.position[-1]) > 5.0


def test_the_gyro_of_a_simulated_unit_at_rest_measures_the_earths_rate():
    still = STILL | {"reference": {"gyro_noise_std_rad_s": 0.0}}
    recording = simulate(Scenario.from_dict(still))
    gyro = [recording.reference[f"gyro_{axis}_rad_s"][10] for axis in "xyz"]
    np.testing.assert_allclose(gyro, EarthRotation(LATITUDE, 0.4).rate, rtol=1e-9)
    assert np.linalg.norm(gyro) == pytest.approx(EARTH_RATE)


def test_gravity_is_that_of_the_latitude_unless_given():
    assert Scenario.from_dict(STILL).gravity == pytest.approx(local_gravity(LATITUDE))
    assert Scenario.from_dict(STILL | {"gravity_m_s2": 9.81}).gravity == 9.81
    assert Scenario.from_dict({k: v for k, v in STILL.items() if k != "latitude_deg"}).gravity == 9.80665
