"""Every method against independent solutions, and its refusals."""

import numpy as np
import pytest
from calibration_cases import EDGES, FACES, GRAVITY, MULTI, TWELVE, simulate
from scipy.optimize import least_squares

from gfimu import InputError
from gfimu.calibration import ErrorModel, Observations
from gfimu.calibration.gauss_helmert import gauss_helmert
from gfimu.calibration.multi_position import magnitude_condition, multi_position
from gfimu.calibration.recursive import RecursiveCalibrator, recursive
from gfimu.calibration.six_position import six_position
from gfimu.calibration.twelve_position import coarse_solution, twelve_position


def rotation_directions(model):
    """Return the parameter changes that common rotations of the axes about x, y, z make, (12, 3), orthonormal columns.

    A rotation of the frame by δ changes M by −M [δ×] and no magnitude.
    """
    columns = [
        np.concatenate([(-model.sensitivity @ np.cross(np.eye(3), axis)).ravel(), np.zeros(3)]) for axis in np.eye(3)
    ]
    return np.asarray(np.linalg.qr(np.column_stack(columns))[0], dtype=np.float64)


def test_six_position_is_the_ferraris_solution(triad):
    """With one pose per face, half sums and half differences (Ferraris, Grimaldi & Parvis 1995, eqs 20-22)."""
    observations = simulate(triad, FACES, np.random.default_rng(1))
    up, down = observations.readings[:3], observations.readings[3:]
    result = six_position(observations, gravity=GRAVITY)
    model = result.models["a1"]
    np.testing.assert_allclose(model.sensitivity, (up - down).T / (2 * GRAVITY), rtol=1e-9)
    np.testing.assert_allclose(model.bias, observations.readings.mean(axis=0), rtol=1e-9)


def test_six_position_weights_poses_by_their_covariance(triad):
    rng = np.random.default_rng(2)
    good = simulate(triad, FACES, rng, sigma=1e-9)
    bad = good.readings + rng.normal(0, 0.1, (6, 3))
    both = Observations.from_means(
        np.concatenate([good.readings, bad]), np.repeat([1e-18 * np.eye(3), 1e-2 * np.eye(3)], 6, axis=0)
    )
    result = six_position(both, gravity=GRAVITY)
    np.testing.assert_allclose(result.values, triad.parameters("poses"), atol=1e-7)


def test_six_position_leaves_out_poses_that_are_no_face(triad):
    rng = np.random.default_rng(3)
    six = simulate(triad, FACES, rng)
    more = Observations.from_means(np.concatenate([six.readings, triad.read(GRAVITY * EDGES)]), six.covariance[0])
    np.testing.assert_allclose(
        six_position(more, gravity=GRAVITY).values, six_position(six, gravity=GRAVITY).values, rtol=1e-12
    )


def test_missing_face_is_named(triad):
    with pytest.raises(InputError, match="not all six faces; add: −y up"):
        six_position(simulate(triad, np.delete(MULTI, 4, axis=0), np.random.default_rng(1)), gravity=GRAVITY)


@pytest.mark.parametrize("gauge", ["poses", "x_axis"])
def test_recursive_equals_batch(triad, gauge):
    rng = np.random.default_rng(4)
    truth = triad if gauge == "poses" else triad.in_gauge(gauge)
    directions = np.tile(FACES, (20, 1))
    readings = truth.read(GRAVITY * directions) + rng.normal(0, 0.01, directions.shape)
    calibrator = RecursiveCalibrator(1.0, gauge=gauge)
    covariance = np.diag([1e-4, 2e-4, 3e-4])
    for reading, direction in zip(readings, directions, strict=True):
        calibrator.update(reading, GRAVITY * direction, covariance)
    weight = 1.0 / np.sqrt(np.diag(covariance))
    expected = []
    for axis in range(3):  # the axes are independent: batch least squares of a_i on (l, −1)
        used = readings if gauge == "poses" else readings[:, : axis + 1]
        design = np.column_stack([used, -np.ones(len(used))]) * weight[axis]
        expected.append(np.linalg.lstsq(design, GRAVITY * directions[:, axis] * weight[axis], rcond=None)[0])
    batch = np.concatenate([*(row[:-1] for row in expected), [row[-1] for row in expected]])
    np.testing.assert_allclose(calibrator.estimate, batch, rtol=1e-9, atol=1e-12)


def test_recursive_is_usable_while_data_arrive(triad):
    rng = np.random.default_rng(5)
    calibrator = RecursiveCalibrator(1.0)
    std = []
    for number in range(60):
        direction = FACES[number % 6]
        if number in {1, 3}:
            assert not calibrator.determined
            with pytest.raises(InputError, match="do not determine"):
                _ = calibrator.estimate
        calibrator.update(
            triad.read(GRAVITY * direction) + rng.normal(0, 0.01, 3), GRAVITY * direction, 1e-4 * np.eye(3)
        )
        if number >= 6:
            assert calibrator.determined
            result = calibrator.calibration(unit="m_s2", channels=("a11", "a12", "a13"), gravity=GRAVITY)
            std.append(result.std)
    assert np.all(std[-1] < 0.4 * std[0])  # from 7 to 60 readings: √(7/60) = 0.34
    np.testing.assert_array_less(np.abs(result.values - triad.parameters("poses")), 4.5 * std[-1])


def test_recursive_and_six_position_agree_to_first_order(triad):
    observations = simulate(triad, FACES, np.random.default_rng(6), sigma=1e-5)
    observations.covariance[:3] *= 4.0  # up and down weighted differently: bias and scale correlate
    one = six_position(observations, gravity=GRAVITY)
    other = recursive(observations, gravity=GRAVITY)
    np.testing.assert_allclose(one.values, other.values, atol=1e-7)
    np.testing.assert_allclose(one.std, other.std, rtol=0.05)
    assert one.correlation_of("a1_M_xx", "a1_b_x") > 0.3
    np.testing.assert_allclose(one.correlation, other.correlation, atol=0.05)


def test_uniform_multi_position_equals_scipy(triad):
    truth = triad.in_gauge("x_axis")
    observations = simulate(truth, MULTI, np.random.default_rng(7), sigma=0.02)
    result = multi_position(observations, gravity=GRAVITY, weighting="uniform")

    def residual(parameters):
        model = ErrorModel.from_parameters(parameters, "x_axis")
        return np.linalg.norm(model.correct(observations.readings), axis=1) - GRAVITY

    reference = least_squares(residual, ErrorModel.nominal().parameters("x_axis"), xtol=1e-15, ftol=1e-15, gtol=1e-15)
    np.testing.assert_allclose(result.values, reference.x, rtol=1e-7, atol=1e-8)
    factor = 2 * reference.cost / (len(MULTI) - 9)
    covariance = np.linalg.inv(reference.jac.T @ reference.jac) * factor
    np.testing.assert_allclose(result.covariance, covariance, rtol=1e-4, atol=1e-12)


def test_combined_adjustment_moves_the_readings_onto_the_sphere(triad):
    """The general solution: corrections of least weighted square, by brute force over directions."""
    truth = triad.in_gauge("x_axis")
    rng = np.random.default_rng(8)
    covariance = np.diag([1e-4, 4e-4, 9e-4])
    readings = truth.read(GRAVITY * MULTI) + rng.normal(size=(18, 3)) * np.sqrt(np.diag(covariance))
    result = multi_position(Observations.from_means(readings, covariance), gravity=GRAVITY)

    def residual(unknowns):  # parameters, and the direction of every pose
        model = ErrorModel.from_parameters(unknowns[:9], "x_axis")
        directions = unknowns[9:].reshape(-1, 3)
        directions = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        return ((readings - model.read(GRAVITY * directions)) / np.sqrt(np.diag(covariance))).ravel()

    start = np.concatenate([truth.parameters("x_axis"), MULTI.ravel()])
    reference = least_squares(residual, start, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    np.testing.assert_allclose(result.values, reference.x[:9], atol=1e-6)


def test_twelve_parameters_from_magnitudes_lack_three_rotations(mti):
    observations = simulate(mti, MULTI, np.random.default_rng(9), sigma=0.3, unit="lsb")
    result = twelve_position(observations, gravity=GRAVITY, levelling_std_rad=0.01)
    assert result.null_space.shape == (12, 3)
    expected = rotation_directions(result.models["a1"])
    # The two three-dimensional spaces are the same: all principal cosines are one.
    np.testing.assert_allclose(np.linalg.svd(expected.T @ result.null_space, compute_uv=False), 1.0, atol=1e-6)
    assert "3 directions" in result.statements[0]
    for pair in ("xy", "xz", "yz"):
        assert abs(result.correlation_of(f"a1_M_{pair}", f"a1_M_{pair[::-1]}")) > 0.99


def test_minimum_norm_stays_at_the_coarse_rotation(mti):
    observations = simulate(mti, TWELVE, np.random.default_rng(10), sigma=0.3, unit="lsb")
    coarse = coarse_solution(observations, GRAVITY)
    fine = twelve_position(observations, gravity=GRAVITY)
    step = fine.values - coarse.parameters("coarse")
    rotation = fine.null_space.T @ step
    assert np.linalg.norm(rotation) < 1e-3 * np.linalg.norm(step)


def test_mti_coefficients_are_recovered(mti):
    """The Chinese paper's table 1 as the truth."""
    observations = simulate(mti, TWELVE, np.random.default_rng(11), sigma=0.3, tilt=0.004, gravity=9.8, unit="lsb")
    result = twelve_position(observations, gravity=9.8, levelling_std_rad=0.004)
    np.testing.assert_array_less(np.abs(result.values - mti.parameters("coarse")), 3.0 * result.std)


def test_fine_beats_coarse_on_an_independent_pose(mti):
    """The Chinese paper's figure 1: |a| − g at an arbitrary pose, coarse and fine."""
    rng = np.random.default_rng(12)
    coarse_miss, fine_miss = [], []
    for _ in range(20):
        observations = simulate(mti, TWELVE, rng, sigma=0.3, tilt=0.01, gravity=9.8, unit="lsb")
        check = rng.normal(size=3)
        reading = mti.read(9.8 * check / np.linalg.norm(check))
        coarse = coarse_solution(observations, 9.8)
        fine = twelve_position(observations, gravity=9.8).models["a1"]
        coarse_miss.append(np.linalg.norm(coarse.correct(reading)) - 9.8)
        fine_miss.append(np.linalg.norm(fine.correct(reading)) - 9.8)
    assert np.std(fine_miss) < 0.1 * np.std(coarse_miss)


def bias_only(observations, coarse):
    """Fine stage that keeps the coarse sensitivity and frees the three biases: Newton on |a|² − g² = 0."""
    full = magnitude_condition(GRAVITY, "coarse", squared=True)
    kept = coarse.parameters("coarse")[:9]

    def condition(bias, readings):
        f, by_parameters, by_readings = full(np.concatenate([kept, bias]), readings)
        return f, by_parameters[:, :, 9:], by_readings

    start, covariance = coarse.bias, observations.row_covariance
    adjusted = gauss_helmert(condition, start, observations.readings, covariance, move_observations=False)
    return ErrorModel(coarse.sensitivity, adjusted.parameters)


def test_table_1_of_the_chinese_paper_is_a_fine_stage_of_the_biases_alone(mti):
    """Its fine stage moves B by (−8.0, −3.8, +7.4) counts and S and E in none of six decimals.

    Faces whose tilts are alike on opposite sides put the tilt into B only, so that the coarse column comes out too.
    """
    coarse_column = np.array([33094.647337, 33394.094447, 32641.239753])
    shift = np.linalg.solve(mti.sensitivity, coarse_column - mti.bias)  # m/s²; four of six faces lean along an axis
    faces = FACES + 1.5 * shift / GRAVITY * (FACES == 0)
    assert np.abs(1.5 * shift / GRAVITY).max() < np.deg2rad(0.18)
    directions = np.concatenate([faces / np.linalg.norm(faces, axis=1, keepdims=True), TWELVE[6:]])
    observations = Observations.from_means(mti.read(GRAVITY * directions), 0.09 * np.eye(3), unit="lsb")
    coarse = coarse_solution(observations, GRAVITY)
    np.testing.assert_allclose(coarse.bias, coarse_column, atol=1e-4)

    biases = bias_only(observations, coarse)
    np.testing.assert_allclose(biases.bias, mti.bias, atol=5e-3)
    np.testing.assert_allclose(biases.bias - coarse.bias, [-8.0, -3.8, 7.4], atol=0.05)

    twelve = twelve_position(observations, gravity=GRAVITY).models["a1"]
    np.testing.assert_allclose(twelve.bias, mti.bias, atol=1e-4)
    moved = np.abs(twelve.sensitivity - coarse.sensitivity)
    assert moved.max() == pytest.approx(2.9e-3, rel=0.05)  # counts per m/s²
    assert moved.min() > 5e-7  # six decimals would show each


def test_a_fine_stage_of_the_biases_alone_leaves_most_of_the_coarse_error(mti):
    """Faces level to 0.3°, each tilt its own: half of what they do is in E, which such a stage keeps."""
    rng = np.random.default_rng(0)
    check = rng.normal(size=(200, 3))
    readings = mti.read(GRAVITY * check / np.linalg.norm(check, axis=1, keepdims=True))
    misses, scatters = [], []
    held = mti.read([3.0, -5.0, 7.9]) + rng.normal(0.0, 3.0, (1000, 3))  # one pose, sample by sample
    for _ in range(40):
        observations = simulate(mti, TWELVE, rng, sigma=0.3, tilt=np.deg2rad(0.3), unit="lsb")
        coarse = coarse_solution(observations, GRAVITY)
        models = coarse, bias_only(observations, coarse), twelve_position(observations, gravity=GRAVITY).models["a1"]
        misses.append([np.sqrt(np.mean((np.linalg.norm(m.correct(readings), axis=1) - GRAVITY) ** 2)) for m in models])
        scatters.append([np.linalg.norm(m.correct(held), axis=1).std() for m in models])
    rms = np.median(misses, axis=0)  # m/s²
    np.testing.assert_allclose(rms, [0.026, 0.020, 0.0007], rtol=0.2)
    # The scatter of |a| is the sensor's noise: no stage makes it smaller, whatever the paper's figure 1 shows.
    scatters = np.array(scatters)
    np.testing.assert_allclose(scatters / scatters[:, :1], 1.0, atol=0.01)


def test_twelve_positions_are_needed(triad):
    directions = np.concatenate([FACES, EDGES[[0, 5, 11]], EDGES[[2]]])
    with pytest.raises(InputError, match="10 poses, 12 are needed"):
        twelve_position(simulate(triad, directions, np.random.default_rng(1)), gravity=GRAVITY)


def test_too_few_poses_name_the_poses_to_add(triad):
    with pytest.raises(InputError, match=r"6 distinct ones are too few for 9 parameters.*add: .*up"):
        multi_position(simulate(triad, FACES, np.random.default_rng(1)), gravity=GRAVITY)


def test_following_the_advice_suffices(triad):
    """Add what the refusal asks for, and the calibration goes through."""
    from gfimu.calibration.coverage import _poses_to_add

    directions = np.concatenate([FACES, _poses_to_add(FACES)])
    result = multi_position(simulate(triad.in_gauge("x_axis"), directions, np.random.default_rng(1)), gravity=GRAVITY)
    assert result.statistics["poses"] == len(directions) <= 12


def test_similar_poses_are_refused(triad):
    rng = np.random.default_rng(2)
    near = np.array([0.0, 0.0, 1.0]) + rng.normal(0, 0.05, (20, 3))
    near /= np.linalg.norm(near, axis=1, keepdims=True)
    with pytest.raises(InputError, match=r"too similar.*turn the sensor"):
        multi_position(simulate(triad, near, rng), gravity=GRAVITY)
    repeated = simulate(triad, np.repeat(FACES, 4, axis=0), rng)
    with pytest.raises(InputError, match="18 of them repeat another pose"):
        multi_position(repeated, gravity=GRAVITY)


def test_disagreeing_poses_widen_the_standard_deviations(triad):
    truth = triad.in_gauge("x_axis")
    rng = np.random.default_rng(13)
    readings = truth.read(GRAVITY * MULTI) + rng.normal(0, 0.02, MULTI.shape)
    claimed = Observations.from_means(readings, 0.002**2 * np.eye(3))
    honest = Observations.from_means(readings, 0.02**2 * np.eye(3))
    one, other = (multi_position(data, gravity=GRAVITY) for data in (claimed, honest))
    assert "disagree with the model" in one.warnings[0]
    # A factor learned from 9 degrees of freedom widens as Student's t does: by 9/7 of the misfit.
    ratio = (one.std / other.std) ** 2 * other.statistics["covariance_factor"] / other.statistics["variance_factor"]
    np.testing.assert_allclose(ratio, 9.0 / 7.0, rtol=0.02)
    assert not other.warnings
