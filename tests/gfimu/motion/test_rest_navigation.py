"""Navigation that uses rest: tilt, bias and velocity are put right at each rest."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gfimu import InputError, navigate
from gfimu.motion import from_rotation, navigate_with_rest, to_rotation

G = 9.80665
T = np.arange(0, 20, 0.01)
REST = (T < 2) | (T > 12)


def world():
    """Level, moved 1 m along x between 4 and 6 s; the attitude tilts by 0.02 rad/s between 3 and 8 s, p is biased."""
    acceleration = np.where((T > 4) & (T < 5), 1.0, 0.0) - np.where((T > 5) & (T < 6), 1.0, 0.0)
    p = np.column_stack([acceleration, np.zeros_like(T), np.full_like(T, G)])
    p += np.array([0.02, -0.01, 0.03])
    tilt = 0.02 * np.clip(T - 3, 0, 5)
    attitude = from_rotation(Rotation.from_rotvec(np.outer(tilt, [0, 1, 0])))
    return p, attitude


def test_rest_levels_and_stops():
    p, attitude = world()
    found = navigate_with_rest(T, p, attitude, REST)
    plain = navigate(T, p, attitude)
    late = T > 13
    tilt = to_rotation(found.quaternion[late]).apply([0, 0, 1])[:, :2]
    # Levelled to what the bias of p feigns: the bias is known from the first rest.
    assert np.abs(tilt).max() < 1e-6 + 2 * np.hypot(0.02, 0.01) / G
    assert np.all(found.velocity[REST] == 0)
    assert np.ptp(found.position[late], axis=0).max() < 1e-12
    assert np.linalg.norm(found.position[-1] - [1, 0, 0]) < 0.3 * np.linalg.norm(plain.position[-1] - [1, 0, 0])


def test_without_rest_it_is_plain_navigation():
    p, attitude = world()
    found = navigate_with_rest(T, p, attitude, np.zeros(len(T), dtype=bool))
    plain = navigate(T, p, attitude)
    np.testing.assert_array_equal(found.position, plain.position)
    np.testing.assert_array_equal(found.quaternion, plain.quaternion)


def test_first_rest_takes_the_bias_of_p_off():
    p = np.tile([0.02, 0.0, G + 0.03], (len(T), 1))
    attitude = np.tile([1.0, 0, 0, 0], (len(T), 1))
    found = navigate_with_rest(T, p, attitude, T < 2)
    assert np.abs(found.position[-1]).max() < 1e-9


def test_samples_of_a_rest_without_attitude_are_left_out():
    p, attitude = world()
    whole = navigate_with_rest(T, p, attitude, REST)
    attitude[50:53] = np.nan
    found = navigate_with_rest(T, p, attitude, REST)
    np.testing.assert_allclose(found.quaternion[-1], whole.quaternion[-1], atol=1e-12)
    np.testing.assert_allclose(found.velocity[-1], whole.velocity[-1], atol=1e-12)


def test_bad_shapes():
    p, attitude = world()
    with pytest.raises(InputError, match="one row per time"):
        navigate_with_rest(T, p, attitude, REST[:-1])
