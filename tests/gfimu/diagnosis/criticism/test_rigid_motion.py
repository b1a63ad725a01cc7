"""Whether a residual is of single chips, a motion of the whole array or a spin, and in which frame it is simple."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gfimu import AccelerometerArray
from gfimu.diagnosis import make_stretches, motion_columns, prepare, rigid_motion
from sim.effects import make_effect
from sim.trials import Measurement, measure
from sim.twin import Twin

SETTING = Measurement(duration=30.0)


def twin_of(name):
    return Twin(array=AccelerometerArray.load(name), array_name=name)


def seen(recording, twin):
    prepared = prepare([recording], twin, ["run"])
    return rigid_motion(make_stretches(twin, prepared.runs, prepared.effects))


def hidden(name, parameters, array="cube12", seed=3):
    twin = twin_of(array)
    return seen(measure(np.random.default_rng(seed), twin, [make_effect(name, parameters)], SETTING), twin)


def specific_force(array, mounting, rate, spin, acceleration):
    """Readings (c,) of an array that turns at ``rate`` (3,), from rigid-body kinematics."""
    axes, places = array.axes @ mounting.T, array.positions @ mounting.T
    of_place = acceleration + np.cross(spin, places) + np.cross(rate, np.cross(rate, places))
    return np.sum(axes * of_place, axis=1)


def test_the_columns_are_derivatives_of_the_kinematics():
    rng = np.random.default_rng(1)
    array = AccelerometerArray.load("nap_3_2_2_2")
    mounting = Rotation.from_rotvec([0.3, -0.2, 0.5]).as_matrix()
    turning, step = 7.0, 1e-6
    for _ in range(5):
        turn, spin, force = rng.standard_normal((3, 3))
        moved, still = (
            specific_force(array, mounting, np.array([0.0, 0.0, turning]) + s * turn, s * spin, s * force)
            for s in (step, 0.0)
        )
        columns = motion_columns(array, mounting)
        told = columns @ np.concatenate([force, spin, turning * turn[[2, 0, 1]]])
        np.testing.assert_allclose((moved - still) / step, told, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("seed", range(6))
def test_noise_is_neither_of_chips_nor_of_the_array(seed):
    twin = twin_of("cube12")
    found = seen(measure(np.random.default_rng(50 + seed), twin, [], SETTING), twin)
    assert found.place == "spin"
    assert max(abs(value) for value in (found.chips, found.chips_slow, found.array, found.array_slow)) < 4.0
    fast = found.power.frequency > 5.0
    assert np.mean(found.power.chips[fast]) == pytest.approx(1.0, abs=0.1)
    assert np.mean(found.power.array[fast]) == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize(
    ("name", "parameters", "place", "frame"),
    [
        ("bias", {"a22_m_s2": 0.1}, "chips", ""),
        ("scale_factor", {"a31": 0.03}, "chips", ""),
        ("sensor_position", {"a1_x_m": 1e-3, "a1_y_m": -5e-4}, "chips", ""),
        ("mount_tilt", {"x_rad": 0.02, "y_rad": -0.01}, "array", "body"),
        ("table_tilt", {"x_rad": 0.02, "y_rad": -0.01}, "array", "laboratory"),
        ("eccentricity", {"x_m": 2e-3, "y_m": 1e-3}, "array", "body"),
        ("tacho_latency", {"delay_s": 0.02}, "spin", ""),
        ("tacho_scale", {"scale": 0.02}, "spin", ""),
        ("sensor_lag", {"time_constant_s": 0.01}, "spin", ""),
    ],
)
def test_each_place_is_found(name, parameters, place, frame):
    found = hidden(name, parameters)
    assert (found.place, found.frame) == (place, frame)


def test_a_large_tilt_is_not_of_chips_by_its_second_order():
    found = hidden("mount_tilt", {"x_rad": 0.12, "y_rad": 0.05})
    assert found.chips_slow > 4.0
    assert found.place == "array"


def test_an_array_without_spare_combinations_says_nothing():
    found = hidden("bias", {"a1_m_s2": 0.3}, array="p2_face_centres")
    assert found.combinations == 0
    assert found.place == ""
    assert found.sentence == ""
    assert np.isnan(found.power.chips).all()


def test_more_combinations_see_more():
    assert hidden("bias", {"a11_m_s2": 0.1}, array="corners8").combinations == 15
