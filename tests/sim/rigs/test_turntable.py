"""The MuJoCo rig against closed forms, finite differences of positions, and itself."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gfimu import AccelerometerArray, Chip, InputError, specific_force
from gfimu.base import STANDARD_GRAVITY
from sim import (
    Chirp,
    Hold,
    Ramp,
    SpinState,
    Tumble,
    drive,
    forward,
    free_spec,
    prescribed_readings,
    spin_profile,
    turntable_model,
)
from sim.effects import make_effect
from sim.truth import cube_state
from sim.world import Nod, World

TOLERANCE = 1e-9  # m/s²


@dataclass(frozen=True)
class Swing:
    """A spin whose angle is 5t + 2 sin 3t, so that every derivative is known."""

    def at(self, t):
        t = np.asarray(t, dtype=float)
        return SpinState(5 * t + 2 * np.sin(3 * t), 5 + 6 * np.cos(3 * t), -18 * np.sin(3 * t))


def profile():
    return spin_profile([Hold(0.5), Ramp(40.0, 2.0), Chirp(1.0, 0.5, 8.0, 4.0), Ramp(-30.0, 2.0), Hold(0.5)])


@pytest.fixture(scope="module")
def cube12():
    return AccelerometerArray.load("cube12")


def worlds(array):
    nominal = World(array)
    everything = nominal.changed(
        gravity=9.79,
        cube_offset=np.array([0.012, -0.02, 0.07]),
        mount_rotvec=np.array([0.3, 0.1, 2.0]),
        axis_rotvec=np.array([0.02, -0.05, 0.0]),
        nod=Nod.about(0.7, 0.01, 0.3),
    )
    return {
        "nominal": nominal,
        "everything": everything,
        "late chips": everything.changed(chip_delay=1e-3 * np.arange(4), clock_ratio=2e-3),
        "stretch": nominal.changed(stretch=1e-4, cube_offset=np.array([0.01, 0.02, 0.06])),
        "stretch and nod": everything.changed(stretch=1e-4),
        "bent chip": make_effect("misalignment", {"a2_x_rad": 0.02, "a2_z_rad": -0.01}).apply(
            make_effect("sensor_position", {"a3_y_m": 0.002}).apply(nominal)
        ),
    }


def analytic(world, motion, t):
    geometry = forward.table_geometry(world)
    readings = np.empty((len(t), world.array.n_channels))
    for chip, times in enumerate(world.chip_times(t).T):
        mine = world.array.chip_of_channel == chip
        readings[:, mine] = forward.rigid_readings(world, motion.at(times), geometry)[:, mine]
    return readings


@pytest.mark.parametrize("name", ["nominal", "everything", "late chips", "stretch", "stretch and nod", "bent chip"])
def test_prescribed_table_agrees_with_the_analytic_model(cube12, name):
    world, t = worlds(cube12)[name], np.arange(0.0, 9.0, 0.01)
    readings = prescribed_readings(world, profile(), t)
    assert np.abs(readings).max() > 50
    np.testing.assert_allclose(readings, analytic(world, profile(), t), rtol=0, atol=TOLERANCE)


@pytest.mark.parametrize("array", ["cube12_as_built", "corners8", "p1_face_diagonals", "nap_3_2_2_2", "mimu4444"])
def test_any_array_can_be_put_on_the_table(array):
    world, t = World(AccelerometerArray.load(array)), np.arange(0.0, 9.0, 0.05)
    readings = prescribed_readings(world, profile(), t)
    np.testing.assert_allclose(readings, analytic(world, profile(), t), rtol=0, atol=TOLERANCE)


# Second derivative by central differences of eighth order (Fornberg 1988, table 1).
_SECOND = np.array([-1 / 560, 8 / 315, -1 / 5, 8 / 5, -205 / 72, 8 / 5, -1 / 5, 8 / 315, -1 / 560])


def differenced(position_and_axis, t, gravity, h=2e-3):
    """Specific force from positions alone: (r̈ + g ẑ)·θ with r̈ by finite differences."""
    positions = np.stack([position_and_axis(t + k * h)[0] for k in range(-4, 5)])
    acceleration = np.tensordot(_SECOND, positions, 1) / h**2
    _, axes = position_and_axis(t)
    return np.einsum("nci,nci->nc", acceleration + np.array([0.0, 0.0, gravity]), axes)


@pytest.mark.parametrize("name", ["nominal", "everything", "bent chip"])
def test_prescribed_table_agrees_with_differenced_positions(cube12, name):
    world, t = worlds(cube12)[name], np.arange(0.0, 4.0, 0.013)

    def position_and_axis(times):
        theta = Swing().at(times).angle
        lean = np.outer(np.cos(theta), [*world.nod.cosine, 0.0]) + np.outer(np.sin(theta), [*world.nod.sine, 0.0])
        frames = (
            Rotation.from_rotvec(world.axis_rotvec).as_matrix()
            @ Rotation.from_rotvec(lean).as_matrix()
            @ Rotation.from_euler("z", theta[:, None]).as_matrix()
        )
        mount = Rotation.from_rotvec(world.mount_rotvec)
        placed = world.cube_offset + mount.apply(world.array.positions)
        return (
            np.einsum("nij,cj->nci", frames, placed),
            np.einsum("nij,cj->nci", frames, mount.apply(world.array.axes)),
        )

    expected = differenced(position_and_axis, t, world.gravity)
    # Rounding of positions of 0.1 m over h², and (ωh)⁸ of the peak acceleration: below 1e-8 m/s² together.
    np.testing.assert_allclose(prescribed_readings(world, Swing(), t), expected, rtol=0, atol=1e-8)


def test_tumble_agrees_with_the_analytic_form_and_with_differenced_positions(cube12):
    tumble = Tumble(rate=8.0, sway=(0.05, 0.04, 0.03))
    t = np.arange(6.0, 12.0, 0.013)  # past the start, where the motion is smooth in all its derivatives
    readings = prescribed_readings(World(cube12), tumble, t)

    body = tumble.at(t)
    p = np.einsum("nji,nj->ni", body.rotation, body.acceleration + np.array([0.0, 0.0, STANDARD_GRAVITY]))
    np.testing.assert_allclose(readings, specific_force(cube12, p, body.alpha, body.omega), rtol=0, atol=TOLERANCE)

    def position_and_axis(times):
        state = tumble.at(times)
        return (
            state.position[:, None] + np.einsum("nij,cj->nci", state.rotation, cube12.positions),
            np.einsum("nij,cj->nci", state.rotation, cube12.axes),
        )

    expected = differenced(position_and_axis, t, STANDARD_GRAVITY)
    np.testing.assert_allclose(readings, expected, rtol=0, atol=1e-8)


def test_gravity_at_rest(cube12):
    rest, t = spin_profile([Hold(1.0)]), np.array([0.0, 0.5])
    upright = prescribed_readings(World(cube12), rest, t)
    np.testing.assert_allclose(upright, np.tile([0.0, 0.0, STANDARD_GRAVITY], (2, 4)), atol=1e-12)
    on_side = prescribed_readings(World(cube12, mount_rotvec=np.array([np.pi / 2, 0.0, 0.0])), rest, t)
    np.testing.assert_allclose(on_side, np.tile([0.0, STANDARD_GRAVITY, 0.0], (2, 4)), atol=1e-12)
    body = prescribed_readings(World(cube12), Tumble(rest=2.0), t)
    np.testing.assert_allclose(body, upright, atol=1e-12)


def test_two_sensor_carousel():
    radius = 0.045
    hub = Chip("h", np.zeros(3), np.eye(3)[:2])
    rim = Chip("r", np.array([radius, 0.0, 0.0]), np.eye(3)[:2])
    world = World(AccelerometerArray("carousel", (hub, rim)), cube_offset=np.zeros(3))
    t = np.linspace(0.0, 3.0, 301)
    spin = Swing().at(t)
    readings = prescribed_readings(world, Swing(), t)
    np.testing.assert_allclose(readings[:, :2], 0.0, atol=1e-12)
    np.testing.assert_allclose(readings[:, 2], -(spin.rate**2) * radius, atol=1e-11)
    np.testing.assert_allclose(readings[:, 3], spin.acceleration * radius, atol=1e-11)


@pytest.mark.parametrize("name", ["nominal", "everything", "bent chip"])
def test_truth_of_the_cube_explains_its_readings(cube12, name):
    world, t = worlds(cube12)[name], np.arange(0.0, 3.0, 0.01)
    body = cube_state(world, Swing().at(t))
    p = np.einsum("nji,nj->ni", body.rotation, body.acceleration + np.array([0.0, 0.0, world.gravity]))
    expected = specific_force(world.array, p, body.alpha, body.omega)
    np.testing.assert_allclose(prescribed_readings(world, Swing(), t), expected, atol=TOLERANCE)


def test_truth_of_the_cube_is_consistent_in_time(cube12):
    world, h = worlds(cube12)["everything"], 1e-5
    t = np.arange(0.0, 2.0, 0.01)
    before, now, after = (cube_state(world, Swing().at(t + k * h)) for k in (-1, 0, 1))
    np.testing.assert_allclose((after.position - before.position) / (2 * h), now.velocity, atol=1e-7)
    np.testing.assert_allclose((after.velocity - before.velocity) / (2 * h), now.acceleration, atol=1e-5)
    np.testing.assert_allclose((after.omega - before.omega) / (2 * h), now.alpha, atol=1e-5)
    spin = np.swapaxes(now.rotation, 1, 2) @ (after.rotation - before.rotation) / (2 * h)
    np.testing.assert_allclose(spin[:, [2, 0, 1], [1, 2, 0]], now.omega, atol=1e-6)


@pytest.fixture(scope="module")
def driven(cube12):
    world = World(cube12, cube_offset=np.array([0.01, -0.005, 0.06]), axis_rotvec=np.array([0.004, -0.003, 0.0]))
    command = spin_profile([Hold(0.2), Ramp(6.0, 0.3), Hold(1.0), Ramp(-4.0, 0.4), Hold(0.6)])
    return world, command, drive(world, command, 2.5)


def test_driven_truth_belongs_to_the_state_of_the_sensors(driven):
    world, _, run = driven
    assert np.abs(run.state.acceleration).max() > 20
    np.testing.assert_allclose(run.readings, forward.rigid_readings(world, run.state), rtol=0, atol=TOLERANCE)
    np.testing.assert_array_equal(run.tacho, run.state.rate)
    # The state one step later belongs to other readings: the check above can tell the two apart.
    late = SpinState(run.state.angle[1:], run.state.rate[1:], run.state.acceleration[1:])
    assert np.abs(run.readings[:-1] - forward.rigid_readings(world, late)).max() > 1e-3


def test_driven_motion_passes_through_the_logged_states(driven):
    world, _, run = driven
    between = run.motion.at(run.t)
    np.testing.assert_allclose(between.angle, run.state.angle, rtol=0, atol=1e-10)
    np.testing.assert_allclose(between.rate, run.state.rate, rtol=0, atol=1e-10)
    np.testing.assert_allclose(between.acceleration, run.state.acceleration, rtol=0, atol=1e-10)
    readings = prescribed_readings(world, run.motion, run.t)
    np.testing.assert_allclose(readings, run.readings, rtol=0, atol=TOLERANCE)


def test_driven_states_are_consistent_with_each_other(driven):
    _, _, run = driven
    step = np.diff(run.t)
    # Trapezoids over one step. The command is held over a step: with kv/I = 42/s and up to 47 rad/s² that puts a
    # sawtooth of 2 rad/s² on the acceleration; half of it, and a quarter of it times the step, is what they can miss.
    mean = 0.5 * (run.state.acceleration[1:] + run.state.acceleration[:-1])
    np.testing.assert_allclose(np.diff(run.state.rate) / step, mean, atol=1.05)
    mean = 0.5 * (run.state.rate[1:] + run.state.rate[:-1])
    np.testing.assert_allclose(np.diff(run.state.angle) / step, mean, atol=5.3e-4)


def test_motor_follows_the_command_and_pays_for_friction(cube12):
    command = spin_profile([Hold(0.2), Ramp(5.0, 1.0), Hold(3.0)])
    run = drive(World(cube12), command, 4.0)
    assert abs(run.state.rate[-1] - 5.0) < 1e-3
    dry, viscous = 0.02, 0.002  # of turntable.xml
    assert run.torque[-1] == pytest.approx(dry + viscous * 5.0, rel=0.01)


def test_motor_torque_is_limited(cube12):
    run = drive(World(cube12), spin_profile([Hold(0.1), Ramp(60.0, 0.1), Hold(0.5)]), 0.6)
    assert np.abs(run.torque).max() == pytest.approx(2.0)
    assert run.state.rate.max() < 60.0


def test_physics_step_must_fit_the_run(cube12):
    with pytest.raises(InputError, match="physics step"):
        drive(World(cube12), spin_profile([Hold(1.0)]), 1.0, step=0.0)


def test_cube_is_hollow_aluminium(cube12):
    model = turntable_model(World(cube12))
    walls = 2700 * (0.1**3 - 0.09**3)
    board = 1850 * 8 * 0.027 * 0.013 * 0.0008
    assert model.body("cube").mass[0] == pytest.approx(walls + board, rel=1e-9)
    assert all(0 < model.body(chip.name).mass[0] < 1e-3 for chip in cube12.chips)
    assert free_spec(World(cube12)).compile().body("cube").mass[0] == pytest.approx(walls + board, rel=1e-9)


def test_the_rig_turns_about_one_hinge_and_carries_a_site_per_channel(cube12):
    model = turntable_model(World(cube12))
    assert (model.nv, model.nu, model.nsite) == (1, 2, 12)
    assert [model.site(i).name for i in range(12)] == list(cube12.channels)
