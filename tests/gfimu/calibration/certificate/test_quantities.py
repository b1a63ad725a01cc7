"""Terms of the model and intrinsic parameters: their definitions, their invariance, their covariance."""

from dataclasses import replace

import numpy as np
import pytest
from certification_cases import calibration_of, random_covariance, random_model, random_rotation
from scipy.linalg import block_diag
from scipy.spatial.transform import Rotation

from gfimu.calibration import ErrorModel, Observations
from gfimu.calibration.certificate.chip_parameters import chip_parameters
from gfimu.calibration.certificate.quantities import intrinsic_quantities, stated_quantities
from gfimu.calibration.multi_position import multi_position

GAUGES = ("poses", "x_axis", "z_axis", "coarse", "array")


def values_of(quantities):
    return dict(zip(quantities.names, quantities.values, strict=True))


def intrinsic_of(calibration):
    (chip,) = chip_parameters(calibration)
    return intrinsic_quantities(chip)


def std_of(quantities, calibration):
    return np.sqrt(np.diag(quantities.covariance(calibration.covariance)))


def with_cubic(calibration, cubic):
    """Return the calibration with cubic coefficients."""
    return replace(
        calibration,
        names=(*calibration.names, "a1_c_x", "a1_c_y", "a1_c_z"),
        values=np.concatenate([calibration.values, cubic]),
        covariance=block_diag(calibration.covariance, np.diag(1e-6 * cubic**2)),
        null_space=np.empty((0, 0)),
    )


def test_the_model_equation_gives_the_readings(rng):
    """E = K1 (K0 + a_i + δ_o a_p − δ_p a_o) with i, p, o right-handed is M a + b, to rounding."""
    model = replace(random_model(rng), quadratic=np.zeros(3))
    stated = values_of(stated_quantities(calibration_of(model, random_covariance(rng))))
    for a in rng.normal(0.0, 9.8, (20, 3)):
        for i, channel in enumerate(("a11", "a12", "a13")):
            k0, k1, delta_o, delta_p = (stated[f"{channel}_{key}"] for key in ("K0", "K1", "delta_o", "delta_p"))
            p, o = (i + 1) % 3, (i + 2) % 3
            reading = k1 * (k0 + a[i] + delta_o * a[p] - delta_p * a[o])
            assert reading == pytest.approx(model.read(a)[i], abs=1e-9)


@pytest.mark.parametrize("i", range(3))
def test_misalignments_are_right_handed_rotations_about_o_and_p(rng, i):
    """A sensing axis turned by a small vector δ has δ_o along axis o and δ_p along axis p."""
    p, o = (i + 1) % 3, (i + 2) % 3
    vector = np.zeros(3)
    vector[p], vector[o] = 2e-4, -3e-4
    sensitivity = np.eye(3)
    sensitivity[i] = Rotation.from_rotvec(vector).apply(np.eye(3)[i])
    stated = values_of(stated_quantities(calibration_of(ErrorModel(sensitivity, np.zeros(3)), random_covariance(rng))))
    assert stated[f"a1{i + 1}_delta_o"] == pytest.approx(vector[o], rel=1e-6)
    assert stated[f"a1{i + 1}_delta_p"] == pytest.approx(vector[p], rel=1e-6)


def test_second_and_third_order_follow_from_the_curvature_of_the_readings(rng):
    """K2 and K3 by differences of l = b + y + q y² + c y³, y = M a, along the reference axis."""
    model = random_model(rng, scale=256.0)
    cubic = 1e-9 * rng.standard_normal(3)
    stated = values_of(stated_quantities(with_cubic(calibration_of(model, random_covariance(rng, 256.0)), cubic)))
    step = 0.05
    for i in range(3):

        def reading(a, i=i):
            y = model.sensitivity[i, i] * a
            return model.bias[i] + y + model.quadratic[i] * y**2 + cubic[i] * y**3

        k1 = stated[f"a1{i + 1}_K1"]
        second = (reading(step) - 2.0 * reading(0.0) + reading(-step)) / step**2 / 2.0
        third = (reading(2 * step) - 2 * reading(step) + 2 * reading(-step) - reading(-2 * step)) / (12.0 * step**3)
        assert second / k1 == pytest.approx(stated[f"a1{i + 1}_K2"], rel=1e-6)
        assert third / k1 == pytest.approx(stated[f"a1{i + 1}_K3"], rel=1e-3)


def test_intrinsic_parameters_are_norms_offsets_and_angles_of_the_sensing_axes(rng):
    """A triad built from known lengths and angles, in any orientation, gives them back."""
    xy, xz, yz = np.deg2rad([89.2, 90.7, 91.1])
    third = np.array([np.cos(xz), (np.cos(yz) - np.cos(xy) * np.cos(xz)) / np.sin(xy), 0.0])
    third[2] = np.sqrt(1.0 - third @ third)
    axes = np.array([[1.0, 0.0, 0.0], [np.cos(xy), np.sin(xy), 0.0], third]) @ random_rotation(rng)
    model = ErrorModel(np.array([250.0, 256.0, 261.0])[:, None] * axes, np.array([3.0, -7.0, 11.0]))
    stated = intrinsic_of(calibration_of(model, random_covariance(rng, 256.0), unit="lsb"))
    np.testing.assert_allclose(stated.values, [250.0, 256.0, 261.0, 3.0, -7.0, 11.0, xy, xz, yz], rtol=1e-12)


@pytest.mark.parametrize("gauge", GAUGES)
@pytest.mark.parametrize("seed", range(8))
def test_intrinsic_parameters_and_their_deviations_are_the_same_in_every_gauge_and_on_every_fixture(gauge, seed):
    rng = np.random.default_rng(seed)
    model, covariance = random_model(rng), random_covariance(rng)
    reference, other = (
        calibration_of(model, covariance),
        calibration_of(model, covariance, gauge, rotation=random_rotation(rng)),
    )
    ours, theirs = intrinsic_of(reference), intrinsic_of(other)
    np.testing.assert_allclose(theirs.values, ours.values, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(
        theirs.covariance(other.covariance),
        ours.covariance(reference.covariance),
        rtol=1e-6,
        atol=1e-6 * np.max(np.diag(ours.covariance(reference.covariance))),
    )


def differences(calibration, names):
    """Jacobian of the stated quantities by central differences."""
    columns = []
    for k, value in enumerate(calibration.values):
        step = 1e-6 * max(abs(value), 1e-3)
        ends = []
        for sign in (1.0, -1.0):
            moved = calibration.values.copy()
            moved[k] += sign * step
            ends.append(values_of(stated_quantities(replace(calibration, values=moved))))
        columns.append([(ends[0][name] - ends[1][name]) / (2.0 * step) for name in names])
    return np.array(columns).T


def open_rotation(calibration):
    """Return the calibration as magnitudes alone give it: its three rotations in the null space, without variance."""
    m = calibration.values[:9].reshape(3, 3)
    turns = np.zeros((len(calibration.values), 3))
    for k, axis in enumerate(np.eye(3)):
        turns[:9, k] = (m @ np.cross(np.eye(3), axis)).ravel()
    null_space = np.linalg.qr(turns)[0]
    project = np.eye(len(turns)) - null_space @ null_space.T
    return replace(calibration, null_space=null_space, covariance=project @ calibration.covariance @ project)


@pytest.mark.parametrize("gauge", ["poses", "x_axis", "z_axis", "open", "cubic"])
def test_the_jacobian_is_that_of_finite_differences(rng, gauge):
    written = {"open": "coarse", "cubic": "poses"}.get(gauge, gauge)
    calibration = calibration_of(random_model(rng), random_covariance(rng), written)
    if gauge == "open":
        calibration = open_rotation(calibration)
    if gauge == "cubic":
        calibration = with_cubic(calibration, 1e-4 * rng.standard_normal(3))
    stated = stated_quantities(calibration)
    by_differences = differences(calibration, stated.names)
    np.testing.assert_allclose(stated.jacobian, by_differences, rtol=1e-5, atol=1e-6 * np.abs(by_differences).max())


def test_the_covariance_is_that_of_a_monte_carlo(rng):
    """1500 draws of the parameters: standard deviations within 4.5/√(2n) of the stated ones, correlations 5/√n."""
    calibration = calibration_of(random_model(rng), random_covariance(rng), "x_axis")
    stated, count = stated_quantities(calibration), 1500
    draws = rng.multivariate_normal(calibration.values, calibration.covariance, count)
    found = np.array([stated_quantities(replace(calibration, values=draw)).values for draw in draws])
    free = std_of(stated, calibration) > 0.0
    ratio = found.std(axis=0, ddof=1)[free] / std_of(stated, calibration)[free]
    assert np.abs(ratio - 1.0).max() < 4.5 / np.sqrt(2.0 * count)
    covariance = stated.covariance(calibration.covariance)[np.ix_(free, free)]
    size = np.sqrt(np.diag(covariance))
    assert np.abs(np.corrcoef(found[:, free].T) - covariance / np.outer(size, size)).max() < 5.0 / np.sqrt(count)


def test_an_open_rotation_is_no_misalignment(rng):
    """Magnitudes alone show no rotation: the terms are those of the sensing axes' own frame, from every start."""
    model, covariance = random_model(rng), random_covariance(rng)
    triangular = calibration_of(model, covariance, "x_axis")
    expected = stated_quantities(triangular)
    for _ in range(5):
        full = open_rotation(calibration_of(model, covariance, "coarse", rotation=random_rotation(rng)))
        (chip,) = chip_parameters(full)
        assert chip.frame == "x_axis"
        np.testing.assert_allclose(stated_quantities(full).values, expected.values, rtol=1e-9, atol=1e-12)
    levelled = replace(full, statistics={"levelling_std_rad": 1e-4})
    (chip,) = chip_parameters(levelled)
    assert chip.frame == "coarse"


@pytest.mark.parametrize(
    ("parameter", "lost"),
    [
        ("a1_q_x", {"a11_K2"}),
        ("a1_b_y", {"a12_K0", "a12_offset"}),
        ("a1_M_zy", {"a13_delta_p", "a13_sensitivity", "a1_angle_xz", "a1_angle_yz"}),
    ],
)
def test_what_changes_along_the_null_space_is_not_stated(rng, parameter, lost):
    calibration = calibration_of(random_model(rng), random_covariance(rng))
    place = calibration.names.index(parameter)
    kept = np.delete(np.eye(len(calibration.names)), place, axis=1)
    blind = replace(
        calibration,
        null_space=np.eye(len(kept))[:, [place]],
        covariance=kept @ kept.T @ calibration.covariance @ kept @ kept.T,
    )
    assert set(stated_quantities(calibration).names) - set(stated_quantities(blind).names) == lost


def test_a_common_rotation_of_an_array_only_chooses_the_frame(rng):
    """Two chips, whose common rotation is in the null space: all terms of both are stated in the array's frame."""
    chips = [calibration_of(random_model(rng), random_covariance(rng), "array") for _ in range(2)]
    turns = [open_rotation(chip).null_space for chip in chips]
    second = tuple(name.replace("a1_", "b1_") for name in chips[1].names)
    array = replace(
        chips[0],
        channels=("a11", "a12", "a13", "b11", "b12", "b13"),
        names=(*chips[0].names, *second),
        values=np.concatenate([chip.values for chip in chips]),
        covariance=block_diag(*(chip.covariance for chip in chips)),
        null_space=np.concatenate(turns) / np.sqrt(2.0),
    )
    assert {chip.frame for chip in chip_parameters(array)} == {"array"}
    assert len(stated_quantities(array).names) == 2 * (15 + 9)


def test_nine_and_twelve_parameters_of_the_same_poses_state_the_same(rng):
    """A real adjustment in both gauges: values to 1e-9, standard deviations to 1e-6."""
    model = replace(random_model(rng), quadratic=np.zeros(3))
    directions = rng.standard_normal((30, 3))
    a = 9.81 * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    observations = Observations.from_means(model.read(a) + 1e-3 * rng.standard_normal((30, 3)), 1e-6 * np.eye(3))
    nine = multi_position(observations, gravity=9.81, gauge="x_axis")
    twelve = multi_position(observations, gravity=9.81, gauge="coarse")
    ours, theirs = stated_quantities(nine), stated_quantities(twelve)
    np.testing.assert_allclose(theirs.values, ours.values, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(std_of(theirs, twelve), std_of(ours, nine), rtol=1e-6, atol=1e-12)
