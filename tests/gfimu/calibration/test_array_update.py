"""A calibration carried over to a later run: what the biases did at power-on is found, and no more is claimed."""

from dataclasses import replace

import numpy as np
import pytest
from calibration_cases import CORNERS, EDGES, FACES, GRAVITY, MULTI, assert_honest, chips_in_gauge, poses_of
from recordings import pose_recording

from gfimu import AccelerometerArray, InputError, UnitError, calibrate_array, update_array_calibration
from gfimu.calibration import ErrorModel, Observations
from gfimu.calibration.array_static import apparent_alpha, array_static, body_specific_force
from gfimu.calibration.array_update import array_update

CUBE = AccelerometerArray.load("cube12")
TURN_ON = 0.03
SIGMA = 0.001
BIAS = np.arange(48) % 12 > 8


def moved(models, shift):
    return [
        ErrorModel(model.sensitivity, model.bias + by)
        for model, by in zip(models, np.reshape(shift, (-1, 3)), strict=True)
    ]


def later_poses(models, directions, rng, walk):
    """Poses a second apart, the biases of which wander, and the models at the last of them."""
    poses = []
    for place, direction in enumerate(directions):
        if place:
            models = moved(models, rng.normal(0, walk, 12))
        poses.append(poses_of(CUBE, models, direction[None], rng, SIGMA).readings[0])
    return Observations.from_means(poses, SIGMA**2 * np.eye(12), channels=CUBE.channels), models


def alpha_rms(result, models, rng):
    check = poses_of(CUBE, models, CORNERS, rng, 1e-9)
    return np.sqrt(np.mean(apparent_alpha(CUBE, body_specific_force(result, CUBE, check.means)) ** 2))


@pytest.mark.parametrize("walk", [0.0, 0.005])
def test_standard_deviations_are_honest(walk):
    rng = np.random.default_rng(1)
    errors, std = [], []
    for _ in range(200):
        models = chips_in_gauge(CUBE, rng)
        before = array_static(poses_of(CUBE, models, MULTI, rng, SIGMA), CUBE, gravity=GRAVITY)
        models = moved(models, rng.normal(0, TURN_ON, 12))
        poses, models = later_poses(models, [*FACES[:3], EDGES[0]], rng, walk)
        after = array_update(before, poses, CUBE, turn_on_std_m_s2=TURN_ON, bias_walk_m_s2_rt_s=walk)
        errors.append(after.values - np.concatenate([model.parameters("array") for model in models]))
        std.append(after.std)
    assert_honest(np.array(errors), np.array(std))


def test_one_pose_takes_the_apparent_alpha_away():
    """What a power-on adds to α is seen in any one pose; the part of the biases common to all chips is not."""
    rng = np.random.default_rng(2)
    models = chips_in_gauge(CUBE, rng)
    before = array_static(poses_of(CUBE, models, MULTI, rng, 1e-6), CUBE, gravity=GRAVITY)
    models = moved(models, rng.normal(0, TURN_ON, 12))
    one = poses_of(CUBE, models, EDGES[:1], rng, 1e-6)
    after = array_update(before, one, CUBE, turn_on_std_m_s2=TURN_ON)
    assert alpha_rms(after, models, rng) < 0.01 * alpha_rms(before, models, rng)
    assert after.std[BIAS].min() > 0.2 * TURN_ON
    assert after.method == "array-update"
    assert "updated with 1 poses" in after.statements[-1]
    assert after.warnings == ()
    shown = after.statistics
    assert shown["apparent_alpha_x_rms_after_rad_s2"] < 0.01 * shown["apparent_alpha_x_rms_before_rad_s2"]
    assert shown["disagreement_rms_after_m_s2"] < 0.01 * shown["disagreement_rms_before_m_s2"]


def test_recordings_in_counts_and_positions_carried_over():
    """Counts: the change of a bias is stated in m/s², whatever the unit of the readings."""
    rng = np.random.default_rng(3)
    scale = 25.0  # counts per m/s²
    models = chips_in_gauge(CUBE, rng, scale=scale)
    axes = [ErrorModel(m.sensitivity @ chip.axes, m.bias) for m, chip in zip(models, CUBE.chips, strict=True)]
    before = calibrate_array(pose_recording(axes, MULTI, rng, sigma=0.7, unit="lsb"), CUBE, gravity=GRAVITY)
    count, offsets = len(before.names), rng.normal(0, 1e-3, 12)
    whole = np.zeros((count + 12, count + 12))
    whole[:count, :count] = before.covariance
    whole[count:, count:] = 1e-8 * np.eye(12)
    with_positions = replace(
        before,
        names=(*before.names, *(f"{chip.name}_r_{axis}" for chip in CUBE.chips for axis in "xyz")),
        values=np.concatenate([before.values, CUBE.chip_positions.ravel() + offsets]),
        covariance=whole,
        null_space=np.vstack([before.null_space, np.zeros((12, 3))]),
    )
    shift = scale * rng.normal(0, TURN_ON, 12)
    later = pose_recording(moved(axes, shift), MULTI[[0, 7, 11]], rng, sigma=0.7, unit="lsb")
    after = update_array_calibration(with_positions, later, CUBE, turn_on_std_m_s2=TURN_ON)
    error = after.values[:48][BIAS] - before.values[:48][BIAS] - shift
    assert np.abs(error / after.std[:48][BIAS]).max() < 4.0
    assert after.std[:48][BIAS].max() < 0.5 * scale * TURN_ON
    np.testing.assert_array_equal(after.values[count:], with_positions.values[count:])
    np.testing.assert_array_equal(after.covariance[count:, count:], whole[count:, count:])


def test_biases_that_moved_too_far_are_told():
    rng = np.random.default_rng(4)
    models = chips_in_gauge(CUBE, rng)
    before = array_static(poses_of(CUBE, models, MULTI, rng, SIGMA), CUBE, gravity=GRAVITY)
    poses = poses_of(CUBE, moved(models, rng.normal(0, 10 * TURN_ON, 12)), FACES[:3], rng, SIGMA)
    result = array_update(before, poses, CUBE, turn_on_std_m_s2=TURN_ON)
    assert any("times more than expected; the biases change more than stated" in text for text in result.warnings)
    assert array_update(before, poses, CUBE, turn_on_std_m_s2=10 * TURN_ON).warnings == ()


def test_refusals():
    rng = np.random.default_rng(5)
    poses = poses_of(CUBE, chips_in_gauge(CUBE, rng), MULTI, rng, SIGMA)
    before = array_static(poses, CUBE, gravity=GRAVITY)
    with pytest.raises(InputError, match="six-position calibration can't be updated as an array"):
        array_update(replace(before, gauge="poses", method="six-position"), poses, CUBE)
    with pytest.raises(InputError, match="the readings are of b0"):
        array_update(before, replace(poses, channels=tuple(f"b{i}" for i in range(12))), CUBE)
    with pytest.raises(UnitError, match="the readings are in lsb, the calibration in m_s2"):
        array_update(before, replace(poses, unit="lsb"), CUBE)
