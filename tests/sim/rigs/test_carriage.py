"""A linear axis: MuJoCo and the closed form agree, and files of it hold what a rig of that kind can have."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import gfimu
from gfimu import InputError
from gfimu.recording import Recording
from sim import Carriage, Chirp, Hold, Ramp, forward, prescribed_readings, spin_profile
from sim.effects import CARRIAGE_EFFECTS, NOT_OF_A_CARRIAGE, TABLE_EFFECTS, make_effect
from sim.scenarios import Scenario
from sim.twin import Twin

COURSE = spin_profile([Hold(0.2), Ramp(0.3, 0.2), Chirp(0.1, 2.0, 9.0, 2.0), Ramp(0.0, 0.1)])
T = np.linspace(0.0, 2.5, 200)


def a_world(*hidden, axis=(0.6, -0.2, 0.3)):
    run = Scenario.load("linear_axis", changes=['array="cube12"', f"motion.axis={list(axis)}"])
    twin = Twin.load("linear_axis").with_array(run.array)
    effects = [make_effect(name, parameters, run.array) for name, parameters in hidden]
    return Twin(**{**vars(twin), "carriage_axis": axis}).world(effects)


@pytest.mark.parametrize(
    "hidden",
    [
        [],
        [("mount_turn", {"x_rad": 0.1, "y_rad": -0.3, "z_rad": 0.2})],
        [("table_tilt", {"x_rad": 0.05, "y_rad": 0.02}), ("misalignment", {"a1_z_rad": 0.2})],
        [("clock_error", {"ratio": 0.01}), ("resonance", {"frequency_hz": 20.0, "damping_ratio": 0.1, "gain": 0.5})],
    ],
    ids=["as drawn", "turned", "out of level", "clock and mode"],
)
def test_mujoco_gives_what_the_closed_form_gives(hidden):
    world = a_world(*hidden)
    motion = COURSE
    for step in world.mount_steps:
        motion = step(motion, T)
    closed = forward.channels(world, COURSE, T)
    np.testing.assert_allclose(prescribed_readings(world, motion, T), closed, atol=1e-9)


def test_a_chip_reads_gravity_and_the_acceleration_along_the_axis():
    axis = np.array([0.6, -0.2, 0.3])
    readings = forward.channels(a_world(), COURSE, T)
    push = np.outer(COURSE.at(T).acceleration, axis / np.linalg.norm(axis))
    push[:, 2] += 9.80665
    np.testing.assert_allclose(readings, np.tile(push, 4), atol=1e-12)


def test_a_recording_holds_the_command_and_a_truth_that_does_not_turn():
    run = gfimu.simulate(Scenario.load("linear_axis", changes=["sensor.perfect=true", "duration_s=6"]), seed=1)
    assert {"carriage_m", "carriage_speed_m_s", "carriage_acceleration_m_s2"} < set(run.reference)
    assert not {"tacho_rad_s", "angle_rad", "command_rad_s"} & set(run.reference)
    np.testing.assert_allclose(run.extra["truth_position_x_m"], run.reference["carriage_m"], atol=1e-12)
    np.testing.assert_allclose(run.readings[:, 0], run.reference["carriage_acceleration_m_s2"], atol=0.03)
    assert not np.any(run.extra["truth_omega_z_rad_s"])


def test_a_file_may_give_the_command_in_millimetres(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("t_s,a11_g,carriage_mm,carriage_speed_mm_s\n0.0,0.1,20,100\n0.1,0.1,30,100\n", encoding="utf-8")
    run = Recording.read(path)
    np.testing.assert_allclose(run.reference["carriage_m"], [0.02, 0.03])
    np.testing.assert_allclose(run.reference["carriage_speed_m_s"], [0.1, 0.1])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ('effect=[{name="eccentricity", parameters={x_m=0.01}}]', "reads the same at every place"),
        ('effect=[{name="mount_tilt", parameters={x_rad=0.01}}]', "mount_turn"),
        ('drive.mode="driven"', "moves as commanded"),
        ("motion.axis=[0, 0, 0]", "give a direction"),
    ],
)
def test_what_a_linear_axis_can_not_have_is_refused(change, message):
    with pytest.raises(InputError, match=message):
        Scenario.load("linear_axis", changes=[change])


def test_every_effect_is_one_of_a_carriage_or_says_why_not():
    assert set(TABLE_EFFECTS) <= set(CARRIAGE_EFFECTS) | set(NOT_OF_A_CARRIAGE) | {
        "chip_delay",
        "chip_lag",
        "cold_start",
    }
    assert not set(CARRIAGE_EFFECTS) & set(NOT_OF_A_CARRIAGE)


def test_a_single_chip_has_no_misalignment_beside_its_mounting():
    one = Twin.load("linear_axis")
    assert "misalignment" not in one.families()
    two = one.with_array(gfimu.AccelerometerArray.load("toolhead_pair"))
    assert {"misalignment", "mount_turn"} < set(two.families())


def test_a_twin_file_keeps_the_axis_and_is_a_scenario_too(tmp_path):
    twin = Twin.from_dict({**Twin.load("linear_axis").to_dict(), "carriage_axis": [0.0, 1.0, 0.0]})
    path = tmp_path / "mine.toml"
    path.write_text(twin.to_toml(), encoding="utf-8")
    assert Twin.load(path).carriage_axis == (0.0, 1.0, 0.0)
    motion = Scenario.load(path).motion
    assert isinstance(motion, Carriage)
    assert list(motion.axis) == [0.0, 1.0, 0.0]


def test_a_mounting_with_an_axis_that_turns_is_refused():
    data = Twin.load("linear_axis").to_dict()
    with pytest.raises(InputError, match="carriage_axis"):
        Twin.from_dict({**data, "mounting": {"axis": [0, 0, 1]}})


def test_the_turn_of_a_mounting_turns_what_is_read():
    plain, turned = (forward.channels(a_world(*hidden), COURSE, T) for hidden in ([], [("mount_turn", {"z_rad": 0.1})]))
    back = Rotation.from_rotvec([0.0, 0.0, 0.1]).inv()
    np.testing.assert_allclose(turned[:, :3], back.apply(plain[:, :3]), atol=1e-12)
