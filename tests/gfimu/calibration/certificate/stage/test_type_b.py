"""Type B by simulation, against closed forms and against what the methods cannot see."""

from dataclasses import replace

import numpy as np
import pytest

from gfimu import AccelerometerArray
from gfimu.base import STANDARD_GRAVITY
from gfimu.calibration import ErrorModel, Stage, type_b
from gfimu.calibration.array_static import array_static
from gfimu.calibration.certificate.stage.simulated_calibration import calibrate_under, poses_of
from gfimu.calibration.certificate.stage.stage_errors import axis_angles, draw_errors
from gfimu.calibration.certificate.stage.type_b import FORMULA_GRAVITY_STD, STANDARD_GRAVITY_STD
from tests.gfimu.calibration.calibration_cases import FACES, GRAVITY, MULTI, chips_in_gauge
from tests.gfimu.calibration.calibration_cases import poses_of as array_poses
from tests.gfimu.calibration.certificate.stage.stage_cases import METHODS, PERFECT, calibration_of, intrinsic, values

OFF_DIAGONAL = ~np.eye(3, dtype=bool).ravel()


def stage(**keys):
    return Stage(stage="s", **{"gravity_std_m_s2": 0.0} | keys)


def share(found, start):
    (one,) = (share for share in found.shares if share.source.startswith(start))
    return one


def test_one_tilted_face_moves_the_parameters_as_least_squares_says():
    """Readings off by g ε across and −g ε²/2 along: of six faces, b takes a sixth and M a half of a face's error."""
    calibration, tilt = calibration_of("six-position", PERFECT), 1e-3
    errors = draw_errors(stage(), FACES, 1, np.random.default_rng(0), ())
    errors.tilt[0, 2] = [0.0, tilt]  # the face +z; about y
    found = calibrate_under(calibration, FACES, errors)[0].calibration.models["a1"]
    across, along = -np.sin(tilt), np.cos(tilt) - 1.0
    expected = np.eye(3) + 0.5 * np.outer([across, 0.0, along], [0.0, 0.0, 1.0])
    np.testing.assert_allclose(found.sensitivity, expected, atol=1e-10)
    np.testing.assert_allclose(found.bias, GRAVITY / 6.0 * np.array([across, 0.0, along]), atol=1e-10)


def test_levelling_of_each_face_spreads_the_six_position_parameters_as_theory_says(rng):
    """M off the diagonal: half the difference of two faces, σ/√2; b: a sixth of the sum of four, g σ/3."""
    std, runs = 1e-3, 400
    found = type_b(calibration_of("six-position", PERFECT), stage(pose_tilt_std_rad=std), values, rng=rng, runs=runs)
    standard = share(found, "levelling, each pose").standard
    allowed = 4.0 / np.sqrt(2.0 * runs)
    np.testing.assert_allclose(standard[:9][OFF_DIAGONAL], std / np.sqrt(2.0), rtol=allowed)
    np.testing.assert_allclose(standard[9:], GRAVITY * std / 3.0, rtol=allowed)
    # K1 of an axis: half the sum of 1 − t²/2 over its two faces and two tilts each, −Σt²/4; E (Σt²)² = (2·4 + 4²) σ⁴.
    np.testing.assert_allclose(standard[:9][~OFF_DIAGONAL], np.sqrt(24.0) / 4.0 * std**2, rtol=2.0 * allowed)


# Largest over the axes, per unit of the stage error: δ, b over g, angle between sensing axes; docs/how_to/stage.md.
SIX_FACES = {
    "pose_tilt": (np.sqrt(0.5), 1.0 / 3.0, 1.0),
    "base_tilt": (1.0, 2.0 / 3.0, 1.0),
    "orthogonality": (0.0, 1.0 / 3.0, 0.0),
    "angle_setting": (np.sqrt(0.5), 1.0 / 3.0, 1.0),
    "angle_zero": (1.0, 2.0 / 3.0, 0.0),
    "angle_step": (1.0, 2.0 / 3.0, 1.0),
    "mounting": (1.0, 0.0, 0.0),
}


@pytest.mark.parametrize("source", SIX_FACES)
def test_what_an_error_of_the_stage_makes_of_a_perfect_triad_on_six_faces(source):
    """Derivatives by every independent error of a source, root of the sum of squares."""
    size, angles = 1e-6, axis_angles(FACES)
    cells, both = np.eye(12).reshape(12, 6, 2), np.eye(2)[:, None, :]
    field, units = {
        "pose_tilt": ("tilt", cells),
        "base_tilt": ("tilt", both * np.ones((6, 1))),
        "orthogonality": ("orthogonality", np.ones(1)),
        "angle_setting": ("angles", cells),
        "angle_zero": ("angles", both * np.ones((6, 1))),
        "angle_step": ("angles", both * angles / (np.pi / 2.0)),
        "mounting": ("mounting", np.eye(3)),
    }[source]
    calibration = calibration_of("six-position", PERFECT)
    errors = draw_errors(stage(), FACES, len(units), np.random.default_rng(0), ())
    found = calibrate_under(calibration, FACES, replace(errors, **{field: size * units}))
    moved = np.array([np.concatenate([one.calibration.values, intrinsic(one.calibration)[3:6]]) for one in found])
    wanted = np.concatenate([calibration.values, intrinsic(calibration)[3:6]])
    slope = np.sqrt(np.sum(((moved - wanted) / size) ** 2, axis=0))
    largest = slope[:9][OFF_DIAGONAL].max(), slope[9:12].max() / GRAVITY, slope[12:].max()
    np.testing.assert_allclose(largest, SIX_FACES[source], atol=1e-4)


@pytest.mark.parametrize("name", METHODS)
def test_an_error_of_gravity_scales_the_sensitivities_by_it_and_leaves_the_angles(name, rng):
    calibration = calibration_of(name)
    errors = draw_errors(stage(gravity_std_m_s2=0.05), poses_of(calibration), 1, rng)
    found = calibrate_under(calibration, poses_of(calibration), errors)[0].calibration
    ratio = 1.0 + errors.gravity[0] / GRAVITY
    before, after = intrinsic(calibration), intrinsic(found)
    np.testing.assert_allclose(after[:3] / before[:3], ratio, rtol=1e-9)
    np.testing.assert_allclose(after[3:], before[3:], atol=1e-9)


@pytest.mark.parametrize("name", ["multi-position", "twelve-position"])
@pytest.mark.parametrize("key", ["pose_tilt_std_rad", "base_tilt_std_rad", "orthogonality_std_rad"])
def test_magnitudes_are_free_of_levelling_and_of_the_axes_of_a_stage(name, key, rng):
    found = type_b(calibration_of(name), stage(**{key: 1e-4}), intrinsic, rng=rng, runs=5)
    assert len(found.shares) >= 1
    assert all(one.standard.max() < 1e-9 for one in found.shares)


def test_levelling_that_the_fit_was_given_is_not_counted_again(rng):
    calibration = calibration_of("six-position", levelling_std_rad=1e-3)
    found = share(type_b(calibration, stage(pose_tilt_std_rad=8e-4), values, rng=rng, runs=5), "levelling, each")
    assert not found.standard.any()
    assert found.source.endswith("0.001 rad is in the covariance of the fit")
    both = np.hypot(1e-3, 7e-4)
    runs = 300
    rest = share(type_b(calibration, stage(pose_tilt_std_rad=both), values, rng=rng, runs=runs), "levelling, each")
    expected, allowed = 7e-4 / np.sqrt(2.0), 0.02 + 4.0 / np.sqrt(2.0 * runs)  # 2 %: the triad is not perfect
    np.testing.assert_allclose(rest.standard[:9][OFF_DIAGONAL], expected, rtol=allowed)
    assert rest.standard[9:].max() < 0.1 * GRAVITY * 7e-4 / 3.0  # the fit takes b from the faces that tilts don't move
    assert "of 0.0012 rad" in rest.source


def test_levelling_in_the_fit_is_said_where_the_stage_states_none(rng):
    calibration = calibration_of("six-position", levelling_std_rad=1e-3)
    found = type_b(calibration, stage(), values, rng=rng, runs=2)
    assert "in the covariance" in share(found, "levelling, each").source


def test_gravity_without_a_statement_is_that_of_a_formula_or_of_the_whole_earth(rng):
    calibration = calibration_of("six-position", PERFECT)
    unstated = Stage(stage="s")
    scale = share(type_b(calibration, unstated, values, rng=rng), "local gravity").standard[0]
    np.testing.assert_allclose(scale, FORMULA_GRAVITY_STD / GRAVITY)
    standard = replace(calibration, gravity=STANDARD_GRAVITY)
    source = share(type_b(standard, unstated, values, rng=rng), "local gravity").source
    assert f"{STANDARD_GRAVITY_STD:g} m/s²" in source


@pytest.mark.parametrize("counts", [1.0, 25.0])
def test_rounding_that_noise_does_not_average_out(counts, rng):
    """A step of 0.04 m/s² in each of six poses, in the unit of the readings."""
    runs, triad = 300, ErrorModel(counts * np.eye(3), np.zeros(3))
    found = type_b(calibration_of("six-position", triad), stage(resolution_m_s2=0.04), values, rng=rng, runs=runs)
    expected = counts * 0.04 / np.sqrt(12.0 * 6.0)
    np.testing.assert_allclose(share(found, "resolution").standard[9:], expected, rtol=4.0 / np.sqrt(2.0 * runs))


def test_the_misfit_that_the_stage_explains(rng):
    """Tilts of σ g in each of two axes per face, of which 6 of 12 directions are left after 12 parameters of 18."""
    std, noise = 1e-3, 2e-3
    calibration = calibration_of("six-position", PERFECT)
    assert type_b(calibration, stage(pose_tilt_std_rad=std), values, rng=rng, runs=3).misfit == 0.0  # noise not stated
    calibration = replace(calibration, statistics={**calibration.statistics, "a1_mean_noise_m_s2": noise})
    found = type_b(calibration, stage(pose_tilt_std_rad=std), values, rng=rng, runs=400)
    # Residual of an axis: 2 degrees of freedom, shared by the tilts of four faces and no error of two: 2 · (4/6) / 2.
    assert abs(found.misfit / ((GRAVITY * std / noise) ** 2 * 2.0 / 3.0) - 1.0) < 0.15


@pytest.fixture(scope="module")
def array_calibration():
    array, rng = AccelerometerArray.load("cube12"), np.random.default_rng(7)
    models = chips_in_gauge(array, rng)
    return (
        array,
        models,
        array_static(array_poses(array, models, MULTI, np.random.default_rng(8), 1e-6), array, gravity=GRAVITY),
    )


@pytest.mark.parametrize("name", METHODS)
def test_the_closed_form_of_gravity_is_that_of_the_fit(name, rng):
    calibration = calibration_of(name)
    errors = draw_errors(stage(), poses_of(calibration), 1, rng, ())
    again = calibrate_under(calibration, poses_of(calibration), replace(errors, gravity=np.full(1, 0.02)))[
        0
    ].calibration
    found = share(type_b(calibration, stage(gravity_std_m_s2=0.02), intrinsic, rng=rng), "local gravity").standard
    np.testing.assert_allclose(found, np.abs(intrinsic(again) - intrinsic(calibration)), atol=1e-9)


def test_the_closed_form_of_a_whole_array_is_that_of_its_fit(array_calibration, rng):
    array, models, calibration = array_calibration
    off = 0.02
    truer = [ErrorModel(model.sensitivity * (1.0 + off / GRAVITY), model.bias) for model in models]
    again = array_static(array_poses(array, truer, MULTI, np.random.default_rng(8), 1e-6), array, gravity=GRAVITY)
    found = share(type_b(calibration, stage(gravity_std_m_s2=off), values, rng=rng), "local gravity").standard
    np.testing.assert_allclose(found, np.abs(again.values - calibration.values), atol=1e-7)


def with_position(calibration):
    return replace(
        calibration,
        names=(*calibration.names, "a1_r_x"),
        values=np.append(calibration.values, 0.05),
        covariance=np.pad(calibration.covariance, (0, 1)),
        null_space=np.empty((0, 0)),
    )


def test_an_error_of_the_rate_of_the_table_goes_into_the_positions_twice(array_calibration, rng):
    one = with_position(array_calibration[2])
    found = share(type_b(one, stage(table_rate_std=1e-3), values, rng=rng), "rate of the table").standard
    np.testing.assert_allclose(found[-1], 0.05 * (1.001**2 - 1.0))
    assert not found[:-1].any()


def test_gravity_makes_positions_smaller_by_what_it_makes_sensitivities_larger(array_calibration, rng):
    """A specific force a = M⁻¹ (l − b) is too small by the ratio, and so is r = a / ω²."""
    one = with_position(array_calibration[2])
    found = share(type_b(one, stage(gravity_std_m_s2=0.1), values, rng=rng), "local gravity").standard
    np.testing.assert_allclose(found[-1], 0.05 * (1.0 - GRAVITY / (GRAVITY + 0.1)))


def test_an_error_of_the_rate_in_a_spin_calibration_goes_into_the_sensitivities(rng):
    spun = replace(calibration_of("six-position"), method="spin")
    found = share(type_b(spun, stage(table_rate_std=1e-3), values, rng=rng), "rate of the table").standard
    np.testing.assert_allclose(found[:9], np.abs(spun.values[:9]) * (1.001**2 - 1.0))
    assert not found[9:].any()
