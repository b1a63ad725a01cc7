"""Readings from motion and motion from readings: the four inverse forms against each other and against truth."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.spatial.transform import Rotation

from gfimu import (
    AccelerometerArray,
    Chip,
    GeometryError,
    InputError,
    closed_form,
    joint_form,
    motion_from_readings,
    null_space,
    pseudo_inverse,
    specific_force,
)
from gfimu.array import (
    joint_covariance,
    omega_leakage,
    omega_products,
    require_all_motions,
    seeing_arrays,
    unseen_motions,
)

SHIPPED = seeing_arrays()
CUBES = ("cube12", "cube12_as_built")
JOINT = ("cube12", "cube12_as_built", "corners8", "p3_three_plus_one", "mimu4444", "nap_3_2_2_2")

vectors = hnp.arrays(float, (3,), elements=st.floats(-50.0, 50.0))


def triads(*positions):
    return AccelerometerArray(
        "test", tuple(Chip(f"a{i + 1}", np.array(place, float), np.eye(3)) for i, place in enumerate(positions)), 0.05
    )


def motion(n=200, seed=1):
    p, alpha, omega = np.random.default_rng(seed).normal(size=(3, n, 3)) * [[[20.0]], [[60.0]], [[12.0]]]
    return p, alpha, omega


@pytest.mark.parametrize("name", SHIPPED)
def test_forward_model_is_the_second_derivative_of_a_turning_body(name):
    # Truth made without the formula: positions of the proof masses on a trajectory, differentiated numerically.
    array = AccelerometerArray.load(name)
    gravity = np.array([0.0, 0.0, -9.80665])
    step = 1e-4
    t = np.arange(-2, 3) * step
    turn = Rotation.from_rotvec(np.outer(t, [3.0, -2.0, 4.0]) + np.outer(t**2, [10.0, 5.0, -8.0]))
    origin = np.outer(t**2, [1.0, 2.0, -3.0])
    places = origin[:, None] + np.array([rotation.apply(array.positions) for rotation in turn])
    weights = np.array([-1, 16, -30, 16, -1]) / (12 * step**2)
    body_axes = turn[2].as_matrix().T
    truth = np.einsum("ci,ci->c", array.axes, (np.tensordot(weights, places, 1) - gravity) @ body_axes.T)

    # Rotation vector a t + b t² at t = 0: ω = a, ω̇ = 2b (the commutator terms vanish to this order).
    p = body_axes @ (np.array([2.0, 4.0, -6.0]) - gravity)
    reading = specific_force(array, p, 2 * np.array([10.0, 5.0, -8.0]), [3.0, -2.0, 4.0])
    np.testing.assert_allclose(reading[0], truth, atol=2e-6)


@pytest.mark.parametrize("name", SHIPPED)
def test_left_inverse_with_given_rate_returns_the_motion(name):
    array = AccelerometerArray.load(name)
    p, alpha, omega = motion()
    estimate = motion_from_readings(array, specific_force(array, p, alpha, omega), omega)
    np.testing.assert_allclose(estimate.alpha, alpha, atol=1e-9)
    np.testing.assert_allclose(estimate.p, p, atol=1e-10)


@pytest.mark.parametrize("name", JOINT)
def test_joint_form_returns_the_motion_without_any_rate(name):
    array = AccelerometerArray.load(name)
    p, alpha, omega = motion()
    estimate = joint_form(array, specific_force(array, p, alpha, omega))
    np.testing.assert_allclose(estimate.alpha, alpha, atol=1e-9)
    np.testing.assert_allclose(estimate.p, p, atol=1e-10)
    seen = ~np.isnan(estimate.omega_products[0])
    assert seen.sum() == null_space(array).rank == (3 if name == "nap_3_2_2_2" else 6)
    np.testing.assert_allclose(estimate.omega_products[:, seen], omega_products(omega)[:, seen], atol=1e-8)


@given(p=vectors, alpha=vectors, omega=vectors, half_edge=st.floats(0.005, 2.0), as_built=st.booleans())
def test_closed_form_left_inverse_and_joint_form_agree(p, alpha, omega, half_edge, as_built):
    array = AccelerometerArray.load(CUBES[as_built])
    scaled = array.with_geometry(array.chip_positions * half_edge / 0.05, [chip.axes for chip in array.chips])
    readings = specific_force(scaled, p, alpha, omega)
    size = 1.0 + np.abs(readings).max()
    by_sums = closed_form(scaled, readings)
    by_inverse = motion_from_readings(scaled, readings)
    jointly = joint_form(scaled, readings)
    for other in (by_inverse, jointly):
        np.testing.assert_allclose(by_sums.alpha, other.alpha, atol=1e-12 * size / half_edge)
        np.testing.assert_allclose(by_sums.p, other.p, atol=1e-12 * size)
    np.testing.assert_allclose(by_sums.alpha[0], alpha, atol=1e-12 * size / half_edge)
    np.testing.assert_allclose(by_sums.p[0], p, atol=1e-12 * size)
    largest = by_sums.covariance.max()
    np.testing.assert_allclose(by_sums.covariance, by_inverse.covariance, rtol=1e-9, atol=1e-12 * largest)


def test_closed_form_of_the_cube_as_built_takes_the_paper_s_channels():
    # Eq. 28 takes p_x from a12…a42, p_y from a11…a41, p_z from a13…a43; eq. 29 takes α_x from axes 1 and 3,
    # α_y from axes 2 and 3. Each coefficient is ±1/4, or ±1/(4L) with L = 0.1 m.
    array = AccelerometerArray.load("cube12_as_built")
    estimate = closed_form(array, np.eye(12))
    by_channel = np.hstack([estimate.alpha, estimate.p]).T.reshape(6, 4, 3)  # (component, chip, axis)
    used = [set(np.flatnonzero(np.abs(row).max(axis=0)) + 1) for row in by_channel]
    assert used == [{1, 3}, {2, 3}, {1, 2}, {2}, {1}, {3}]
    np.testing.assert_allclose(np.abs(by_channel[:3][by_channel[:3] != 0]), 1 / (4 * 0.1))
    np.testing.assert_allclose(np.abs(by_channel[3:][by_channel[3:] != 0]), 1 / 4)
    assert [np.count_nonzero(row) for row in by_channel] == [8, 8, 8, 4, 4, 4]


def test_a_leaning_table_alone_makes_no_ripple_of_the_rate():
    """The GF-IMU paper explains its ripple by the lean; gravity is the same at all chips, so gains must differ too."""
    array = AccelerometerArray.load("cube12_as_built")
    angle, lean, gain = np.linspace(0.0, 2 * np.pi, 360, endpoint=False), 0.018, 0.01
    p = 9.80665 * np.column_stack([lean * np.cos(angle), lean * np.sin(angle), np.ones(360)])
    readings = specific_force(array, p, np.zeros((360, 3)), np.tile([0.0, 0.0, 4.0], (360, 1)))
    assert np.abs(closed_form(array, readings).alpha).max() < 1e-12
    rng, ripples = np.random.default_rng(3), []
    for _ in range(400):
        about_z = closed_form(array, readings * (1.0 + gain * rng.normal(size=12))).alpha[:, 2]
        ripples.append(2.0 * abs(np.mean(about_z * np.exp(-1j * angle))))
    # Four channels along x, four along y, each gain g lean / (4 L): √8 of that, 0.0125 rad/s² here.
    assert np.sqrt(np.mean(np.square(ripples))) == pytest.approx(np.sqrt(8.0) * gain * 9.80665 * lean / 0.4, rel=0.1)


@pytest.mark.parametrize("order", ["C", "F"])
def test_closed_form_reads_any_memory_order_and_writes_where_told(order):
    array = AccelerometerArray.load("cube12")
    p, alpha, omega = motion(n=5000)
    readings = np.asarray(specific_force(array, p, alpha, omega), order=order)
    readings.setflags(write=False)
    out = np.empty((5000, 6))
    estimate = closed_form(array, readings, out=out)
    assert np.shares_memory(estimate.p, out)
    np.testing.assert_allclose(out, np.hstack([alpha, p]), atol=1e-10)


@pytest.mark.parametrize("name", ["corners8", "p3_three_plus_one", "nap_3_2_2_2", "p1_face_diagonals"])
def test_closed_form_refuses_another_geometry(name):
    array = AccelerometerArray.load(name)
    with pytest.raises(GeometryError, match=f"{name}.*alternate corners; use motion_from_readings"):
        closed_form(array, np.zeros((1, array.n_channels)))


def test_closed_form_refuses_a_chip_out_of_place_or_turned():
    array = AccelerometerArray.load("cube12")
    places = array.chip_positions.copy()
    places[2, 1] += 1e-6
    with pytest.raises(GeometryError):
        closed_form(array.with_geometry(places, [chip.axes for chip in array.chips]), np.zeros((1, 12)))
    turned = Rotation.from_rotvec([0, 0, 1e-6]).as_matrix()
    axes = [np.eye(3), turned, np.eye(3), np.eye(3)]
    with pytest.raises(GeometryError):
        closed_form(array.with_geometry(array.chip_positions, axes), np.zeros((1, 12)))


def test_geometry_that_needs_the_rate_says_so():
    array = AccelerometerArray.load("p2_face_centres")
    with pytest.raises(GeometryError, match=r"p2_face_centres.*alpha_x, alpha_y, alpha_z; give omega"):
        motion_from_readings(array, np.zeros((1, 6)))
    with pytest.raises(GeometryError, match="can't separate alpha_x"):
        joint_form(array, np.zeros((1, 6)))


def test_missing_channels_are_solved_from_the_others_where_the_rate_is_given():
    array = AccelerometerArray.load("cube12")
    p, alpha, omega = motion(n=4)
    readings = specific_force(array, p, alpha, omega)
    readings[1, 4] = np.nan
    readings[2, :7] = np.nan
    estimate = motion_from_readings(array, readings, omega)
    np.testing.assert_allclose(estimate.alpha[[0, 1, 3]], alpha[[0, 1, 3]], atol=1e-10)
    np.testing.assert_allclose(estimate.p[[0, 1, 3]], p[[0, 1, 3]], atol=1e-10)
    assert np.isnan(estimate.alpha[2]).all()  # five channels can't give six motions
    # Without ω the centripetal terms of a broken cube don't cancel: only what stays clean is returned.
    blind = motion_from_readings(array, readings)
    found = ~np.isnan(blind.alpha[1])
    assert not found.all()
    np.testing.assert_allclose(blind.alpha[1][found], alpha[1][found], atol=1e-10)


@pytest.mark.parametrize("name", SHIPPED)
def test_null_space_is_white_blind_to_motion_and_sees_the_rate(name):
    array = AccelerometerArray.load(name)
    space = null_space(array)
    assert space.basis.shape == (array.n_channels - 6, array.n_channels)
    np.testing.assert_allclose(space.basis @ space.basis.T, np.eye(len(space.basis)), atol=1e-12)
    np.testing.assert_allclose(space.basis @ array.regression_matrix, 0.0, atol=1e-12)
    np.testing.assert_allclose(space.sensitivity, space.basis @ array.centripetal_matrix, atol=1e-12)
    assert np.count_nonzero(np.abs(space.sensitivity).max(axis=1, initial=0.0)) == space.rank


@pytest.mark.parametrize("name", SHIPPED)
def test_left_inverse_is_one_and_its_leakage_is_what_the_rate_leaves(name):
    array = AccelerometerArray.load(name)
    inverse = pseudo_inverse(array)
    np.testing.assert_allclose(inverse @ array.regression_matrix, np.eye(6), atol=1e-10)
    np.testing.assert_allclose(inverse @ array.centripetal_matrix, omega_leakage(array), atol=1e-9)


def test_covariance_of_the_joint_form_is_that_of_noisy_readings():
    array = AccelerometerArray.load("p3_three_plus_one")
    noise = np.random.default_rng(3).normal(size=(40_000, 12))
    estimate = joint_form(array, noise)
    stacked = np.hstack([estimate.alpha, estimate.p, estimate.omega_products])
    observed = stacked.std(axis=0)
    # The standard error of a standard deviation from 40 000 draws is 0.35 %; four of them.
    np.testing.assert_allclose(observed, np.sqrt(np.diag(estimate.covariance)), rtol=0.015)
    np.testing.assert_array_equal(estimate.covariance, joint_covariance(array))


@pytest.mark.parametrize(
    ("array", "rank", "words"),
    [
        (triads([0, 0, 0]), 3, ["about x", "about y", "about z"]),
        (triads([0.05, 0, 0], [-0.05, 0, 0]), 5, ["angular acceleration about x"]),
        (triads([0.05, 0.03, 0], [-0.05, 0.03, 0]), 5, ["about x through the point (0, 0.03, 0) m"]),
        (triads([0, 0, 0], [0.1, 0.1, 0], [0.2, 0.2, 0]), 5, ["about (0.7071, 0.7071, 0)"]),
    ],
)
def test_blind_geometry_names_the_motions_it_cannot_see(array, rank, words):
    with pytest.raises(GeometryError, match=f"rank {rank} of 6") as caught:
        pseudo_inverse(array)
    for word in words:
        assert word in str(caught.value)
    assert len(unseen_motions(array)) == 6 - rank


def test_flat_uniaxial_array_cannot_see_acceleration_in_its_plane():
    z = np.array([[0.0, 0.0, 1.0]])
    places = [[0.05, 0, 0], [-0.05, 0, 0], [0, 0.05, 0], [0, -0.05, 0]]
    array = AccelerometerArray("flat", tuple(Chip(f"a{i}", np.array(r), z) for i, r in enumerate(places)), 0.05)
    assert set(unseen_motions(array)) == {
        "acceleration along x",
        "acceleration along y",
        "angular acceleration about z",
    }


@pytest.mark.parametrize("name", SHIPPED)
def test_every_shipped_array_sees_all_motions(name):
    require_all_motions(AccelerometerArray.load(name))


def test_readings_and_rates_of_the_wrong_shape_are_refused():
    array = AccelerometerArray.load("cube12")
    with pytest.raises(InputError, match=r"cube12.*12 channels"):
        closed_form(array, np.zeros((5, 11)))
    with pytest.raises(InputError, match=r"5 samples.*\(5, 3\)"):
        motion_from_readings(array, np.zeros((5, 12)), np.zeros((4, 3)))
