"""The specific force on an erroneous stage, against rotation matrices written out here."""

import numpy as np
import pytest

from gfimu import InputError
from gfimu.calibration import Stage
from gfimu.calibration.certificate.stage.stage_errors import (
    SOURCES,
    StageErrors,
    axis_angles,
    draw_errors,
    specific_force,
)
from gfimu.calibration.coverage import FACES

GRAVITY = 9.81


def about(axis, angle):
    c, s = np.cos(angle), np.sin(angle)
    rows = {"x": [[1, 0, 0], [0, c, -s], [0, s, c]], "y": [[c, 0, s], [0, 1, 0], [-s, 0, c]]}
    return np.array(rows.get(axis, [[c, -s, 0], [s, c, 0], [0, 0, 1]]))


def errors(poses, **given):
    zero = {
        "tilt": np.zeros((1, poses, 2)),
        "angles": np.zeros((1, poses, 2)),
        "orthogonality": np.zeros(1),
        "mounting": np.zeros((1, 3)),
        "gravity": np.zeros(1),
        "reading": np.zeros((1, poses, 3)),
    }
    return StageErrors(**zero | given)


def directions(rng, count):
    found = np.concatenate([FACES, rng.standard_normal((count, 3))])
    return found / np.linalg.norm(found, axis=1, keepdims=True)


def test_without_errors_the_unit_sees_gravity_along_the_wanted_direction(rng):
    wanted = directions(rng, 20)
    np.testing.assert_allclose(specific_force(wanted, errors(26), GRAVITY)[0], GRAVITY * wanted, atol=1e-13)


def test_the_chain_is_base_outer_axis_inner_axis_unit(rng):
    wanted = directions(rng, 4)
    tilt, angles, skew = 0.1 * rng.standard_normal((1, 10, 2)), 0.1 * rng.standard_normal((1, 10, 2)), np.array([0.05])
    mounting = np.array([[0.0, 0.0, 0.07]])
    found = specific_force(
        wanted,
        errors(10, tilt=tilt, angles=angles, orthogonality=skew, mounting=mounting, gravity=np.array([0.02])),
        9.8,
    )[0]
    for pose, (theta, phi) in enumerate(axis_angles(wanted) + angles[0]):
        base = about("y", tilt[0, pose, 1]) @ about("x", tilt[0, pose, 0])
        whole = base @ about("x", theta) @ about("y", 0.05) @ about("z", phi) @ about("z", 0.07)
        np.testing.assert_allclose(found[pose], 9.82 * whole.T[:, 2], atol=1e-12)


def test_a_tilt_of_a_face_is_of_first_order_across_and_of_second_along_gravity():
    tilt = 1e-3
    error = specific_force(FACES, errors(6, tilt=np.full((1, 6, 2), [0.0, tilt])), GRAVITY)[0] - GRAVITY * FACES
    along = np.sum(error * FACES, axis=1)
    across = np.linalg.norm(error - along[:, None] * FACES, axis=1)
    np.testing.assert_allclose(across, GRAVITY * tilt, rtol=1e-6)
    np.testing.assert_allclose(along, -GRAVITY * tilt**2 / 2.0, rtol=1e-6)


def test_errors_of_the_base_are_equal_in_all_poses_and_those_of_settings_are_not(rng):
    stage = Stage(stage="s", base_tilt_std_rad=1e-3, angle_setting_std_rad=2e-3)
    drawn = draw_errors(stage, FACES, 4000, rng)
    assert np.ptp(drawn.tilt, axis=1).max() == 0.0
    for found, std in ((drawn.tilt[:, 0], 1e-3), (drawn.angles, 2e-3)):
        assert abs(found.std() / std - 1.0) < 4.0 / np.sqrt(2.0 * found.size)
    assert abs(np.corrcoef(drawn.angles[:, 0, 0], drawn.angles[:, 1, 0])[0, 1]) < 4.0 / np.sqrt(4000)
    assert not drawn.gravity.any()
    assert not drawn.reading.any()


def test_an_error_of_the_step_grows_with_the_angle(rng):
    drawn = draw_errors(Stage(stage="s", angle_step_std_rad=1e-3), FACES, 3, rng)
    theta, phi = axis_angles(FACES).T
    right_angle = drawn.angles[:, int(np.flatnonzero(np.isclose(theta, np.pi / 2.0))[0]), 0]
    np.testing.assert_allclose(drawn.angles[..., 0], right_angle[:, None] * theta / (np.pi / 2.0), atol=1e-15)
    assert not drawn.angles[:, phi == 0.0, 1].any()


def test_rounding_is_uniform_within_a_step(rng):
    drawn = draw_errors(Stage(stage="s", resolution_m_s2=0.04), FACES, 3000, rng)
    assert np.abs(drawn.reading).max() <= 0.02
    assert abs(drawn.reading.std() / (0.04 / np.sqrt(12.0)) - 1.0) < 0.02


def test_only_the_sources_asked_for_act(rng):
    stage = Stage(stage="s", **dict.fromkeys(SOURCES, 1e-3))
    drawn = draw_errors(stage, FACES, 5, rng, ("mounting_std_rad",))
    assert drawn.mounting.any()
    assert not any(value.any() for name, value in vars(drawn).items() if name != "mounting")


def test_every_source_is_a_key_of_the_stage_file():
    assert set(SOURCES) <= set(Stage.__struct_fields__)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('stage = "s"\nlevelling = 1.0', "levelling"),
        ("gravity_std_m_s2 = 1e-4", "'stage' is missing"),
        ('stage = "s"\npose_tilt_std_rad = -1.0', "pose_tilt_std_rad"),
        ('stage = "s"\nreliability = 1.0', "reliability"),
    ],
)
def test_a_wrong_stage_file_is_refused_by_key(tmp_path, text, message):
    file = tmp_path / "stage.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=message) as refused:
        Stage.load(file)
    assert str(file) in str(refused.value)
    assert "\n" not in str(refused.value)
