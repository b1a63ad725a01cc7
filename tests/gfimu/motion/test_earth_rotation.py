"""The Earth's rotation: attitudes in a world that turns, against the turning of vectors by hand."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from gfimu import EarthRotation, InputError
from gfimu.array import EARTH_RATE
from gfimu.motion import from_rotation, to_rotation

EARTH = EarthRotation(35.0, 0.7)


def test_a_body_at_rest_among_the_stars_turns_backwards_in_the_world():
    """Its axes obey dv/dt = −Ω × v; the attitude is tilted, so that the order of the two turns matters."""
    t = np.linspace(0.0, 6 * 3600.0, 7)
    start = Rotation.from_rotvec([0.9, -1.3, 0.4])
    fixed = np.tile(from_rotation(start), (len(t), 1))
    found = to_rotation(EARTH.attitude_in_world(t, fixed))
    for axis in np.eye(3):
        moved = solve_ivp(
            lambda _, v: -np.cross(EARTH.rate, v), t[[0, -1]], start.apply(axis), t_eval=t, rtol=1e-10, atol=1e-12
        )
        np.testing.assert_allclose(found.apply(axis), moved.y.T, atol=1e-7)


def test_the_rate_of_a_body_at_rest_is_the_earths_in_its_own_axes():
    attitude = Rotation.from_rotvec([0.2, 0.5, -1.1])
    np.testing.assert_allclose(attitude.apply(EARTH.in_body(from_rotation(attitude))), EARTH.rate, rtol=1e-12)


def test_north_and_up():
    """At the pole the Earth turns about up; at the equator about north, which lies at its angle from the x-axis."""
    np.testing.assert_allclose(EarthRotation(90.0).rate, [0.0, 0.0, EARTH_RATE], atol=1e-19)
    np.testing.assert_allclose(EarthRotation(0.0, np.pi / 2).rate, [0.0, EARTH_RATE, 0.0], atol=1e-19)
    assert EarthRotation(-90.0).rate[2] == -EARTH_RATE
    assert EarthRotation(60.0).horizontal_rate == pytest.approx(0.5 * EARTH_RATE)


def test_what_moves_north_is_carried_east_on_the_northern_half():
    """North is x and west y, so that east is −y."""
    drift = EarthRotation(50.0).coriolis([[1000.0, 0.0, 0.0]])
    assert drift[0, 1] < 0.0
    np.testing.assert_allclose(drift[0], [0.0, -2.0 * EARTH_RATE * np.sin(np.radians(50.0)) * 1000.0, 0.0], atol=1e-12)


def test_unknown_rows_stay_unknown_and_a_latitude_has_its_range():
    q = np.array([[1.0, 0.0, 0.0, 0.0], [np.nan] * 4, [1.0, 0.0, 0.0, 0.0]])
    assert np.isnan(EARTH.attitude_in_world([0.0, 1.0, 2.0], q)[1]).all()
    assert np.isnan(EARTH.in_body(q)[1]).all()
    for latitude in (90.0, -90.0):
        EarthRotation(latitude)
    for latitude in (90.1, -90.1, np.nan):
        with pytest.raises(InputError, match="outside −90…90"):
            EarthRotation(latitude)
