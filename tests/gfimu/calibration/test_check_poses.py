"""A calibration on poses that it has not seen."""

import numpy as np
import pytest

import gfimu
from gfimu import InputError
from gfimu.calibration import ErrorModel, check_on_poses
from gfimu.recording import Recording

GRAVITY = 9.80665
RATE, SECONDS, NOISE = 100.0, 4.0, 0.03


def poses(truth: ErrorModel, count: int, seed: int) -> Recording:
    """Poses in all directions, with a short tumble between two, so that rests end."""
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(count, 3))
    directions *= GRAVITY / np.linalg.norm(directions, axis=1, keepdims=True)
    still, moving = int(RATE * SECONDS), int(RATE)
    forces = np.concatenate([np.vstack([np.repeat(one[None], still, axis=0), 5.0 * rng.normal(size=(moving, 3))])
                             for one in directions])  # fmt: skip
    readings = truth.read(forces) + rng.normal(0.0, NOISE, forces.shape)
    return Recording(np.arange(len(readings)) / RATE, readings, ("a11", "a12", "a13"))


def truth(seed: int) -> ErrorModel:
    rng = np.random.default_rng(seed)
    return ErrorModel(np.tril(np.eye(3) + rng.normal(0, 0.01, (3, 3))), rng.normal(0, 0.3, 3))


@pytest.fixture(scope="module")
def calibrated():
    return [gfimu.calibrate("multi-position", poses(truth(seed), 18, 100 + seed), parameters=9) for seed in range(12)]


def test_the_magnitudes_are_as_far_off_as_the_calibration_states(calibrated):
    found = [check_on_poses(one, poses(truth(seed), 20, 200 + seed)) for seed, one in enumerate(calibrated)]
    assert all(one["check_poses"] == 20 for one in found)
    normalised = np.sqrt(np.mean([one["check_rms_by_std"] ** 2 for one in found]))
    assert normalised == pytest.approx(1.0, abs=0.2)  # 12 calibrations of 9 parameters, 240 poses
    for one in found:
        assert one["check_rms_m_s2"] < 0.01
        assert one["check_rms_before_m_s2"] > 0.1
        assert one["check_rms_m_s2"] < one["check_largest_m_s2"]


def test_a_bias_that_moved_after_the_calibration_shows(calibrated):
    moved = truth(0)
    moved = ErrorModel(moved.sensitivity, moved.bias + np.array([0.05, 0.0, 0.0]))
    found = check_on_poses(calibrated[0], poses(moved, 20, 300))
    assert found["check_rms_by_std"] > 5.0
    assert found["check_rms_m_s2"] == pytest.approx(0.05 / np.sqrt(3.0), rel=0.35)  # on 20 directions


def test_the_command_states_the_check_and_refuses_the_fitted_recording():
    run, others = poses(truth(1), 18, 1), poses(truth(1), 12, 2)
    found = gfimu.calibrate("multi-position", run, parameters=9, check=others)
    assert found.statistics["check_poses"] == 12
    with pytest.raises(InputError, match="needs other poses"):
        gfimu.calibrate("multi-position", run, parameters=9, check=run)
