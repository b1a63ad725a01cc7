"""The MJCF files as a reader sees them that has nothing but MuJoCo, and the models that are made for other arrays."""

import re

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gfimu import AccelerometerArray, Chip, specific_force
from gfimu.base.files.model_files import models_directory
from sim import array_from_mjcf
from sim.rigs.mjcf_export import RIGS, array_as_mjcf

ROUNDING = 1e-11  # m/s², of readings of some 10 m/s² through MuJoCo's tree

ODD = AccelerometerArray(
    "odd",
    (
        Chip("a1", np.array([1 / 30, -1 / 70, 1 / 110]), Rotation.from_rotvec([0.1, 0.2, 0.3]).as_matrix()),
        Chip("a2", np.array([-1 / 30, 1 / 60, 0.0]), Rotation.from_rotvec([0.4, 0.2, 0.3]).as_matrix()[:2]),
    ),
)  # places and axes that six digits don't hold; a chip of three axes and one of two


def opened(name):
    """Return model and data of a shipped file, and its twelve streams: the first twelve sensor values."""
    model = mujoco.MjModel.from_xml_path(str(models_directory() / "mjcf" / f"{name}.xml"))
    data = mujoco.MjData(model)
    return model, data, data.sensordata[:12]


def of_free_cube(data):
    """Specific force of cube12 from the state of the free joint, whose origin lies 60 mm below the cube's centre."""
    rotation, arm = data.xmat[data.model.body("carrier").id].reshape(3, 3), np.array([0.0, 0.0, 0.06])
    omega, alpha = data.qvel[3:], data.qacc[3:]
    p = (
        rotation.T @ (data.qacc[:3] + np.array([0, 0, 9.80665]))
        + np.cross(alpha, arm)
        + np.cross(omega, np.cross(omega, arm))
    )
    return specific_force(AccelerometerArray.load("cube12"), p[None], alpha[None], omega[None])[0]


@pytest.mark.parametrize("name", ["turntable", "motor_turntable", "free_cube"])
def test_a_shipped_file_carries_an_accelerometer_per_chip(name):
    model, _, _ = opened(name)
    first = [model.sensor(i) for i in range(4)]
    assert [sensor.name for sensor in first] == ["a1", "a2", "a3", "a4"]
    assert [int(sensor.adr[0]) for sensor in first] == [0, 3, 6, 9]
    assert all(sensor.type[0] == mujoco.mjtSensor.mjSENS_ACCELEROMETER for sensor in first)


@pytest.mark.parametrize(("name", "control"), [("turntable", [4.0, 4.0]), ("motor_turntable", [0.5, 4.0])])
def test_a_reader_of_a_table_alone_sees_twelve_streams(name, control):
    """Against ω × (ω × r) + α × r + g at the twelve places, with ω and α of the joint."""
    model, data, streams = opened(name)
    data.ctrl[:] = control
    peak = 0.0
    for _ in range(300):
        mujoco.mj_forward(model, data)
        rate, acceleration = np.array([[0, 0, data.qvel[0]]]), np.array([[0, 0, data.qacc[0]]])
        p = np.array([[0, 0, 9.80665]])  # the cube's centre is on the axis
        truth = specific_force(AccelerometerArray.load("cube12"), p, acceleration, rate)[0]
        np.testing.assert_allclose(streams, truth, rtol=0, atol=ROUNDING)
        peak = max(peak, np.abs(truth[:2]).max())
        mujoco.mj_step(model, data)
    assert peak > 0.5


def test_a_reader_of_the_free_cube_alone_sees_twelve_streams():
    model, data, streams = opened("free_cube")
    rng = np.random.default_rng(3)
    data.qpos[3:7] = rng.standard_normal(4)
    mujoco.mj_normalizeQuat(model, data.qpos)
    data.qvel[:] = 3.0 * rng.standard_normal(6)
    for _ in range(50):
        data.xfrc_applied[model.body("cube").id] = rng.standard_normal(6)
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(streams, of_free_cube(data), rtol=0, atol=ROUNDING)
        mujoco.mj_step(model, data)
    assert np.abs(streams).max() > 0.1


@pytest.mark.parametrize("rig", RIGS)
@pytest.mark.parametrize(
    "array", [ODD, *map(AccelerometerArray.load, ["cube12", "nap_3_2_2_2", "mimu4444"])], ids=lambda one: one.name
)
def test_an_array_of_ones_own_becomes_a_model(tmp_path, array, rig):
    """Its text says where the channels are; MuJoCo alone finds gravity there, and the array in the sites."""
    file = tmp_path / "rig.xml"
    file.write_text(array_as_mjcf(array, rig))
    model = mujoco.MjModel.from_xml_path(str(file))
    data = mujoco.MjData(model)
    gravity = np.array([3.0, -4.0, -8.0])
    model.opt.gravity[:] = gravity
    mujoco.mj_inverse(model, data)  # at rest
    said = dict(re.findall(r"^  (\w+): sensordata\[(\d+)\]$", file.read_text(), re.MULTILINE))
    assert tuple(said) == array.channels
    places = [int(place) for place in said.values()]
    np.testing.assert_allclose(data.sensordata[places], array.axes @ -gravity, rtol=0, atol=ROUNDING)
    found = array_from_mjcf(file, body="cube")
    assert found.channels == array.channels
    np.testing.assert_allclose(found.regression_matrix, array.regression_matrix, rtol=0, atol=1e-12)
