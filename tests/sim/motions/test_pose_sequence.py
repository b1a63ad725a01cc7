"""Motion of a calibration by hand: rests that are still, turns that are smooth, directions as named."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gfimu import InputError
from sim import POSE_SETS, PoseSequence
from sim.scenarios import Scenario
from sim.simulation import simulate


@pytest.mark.parametrize("poses", POSE_SETS)
def test_each_direction_is_up_once(poses):
    motion = PoseSequence(poses, rest=2.0, turn=1.0)
    middle = np.arange(POSE_SETS[poses]) * 3.0 + 1.0
    state = motion.at(middle)
    up = state.rotation.transpose(0, 2, 1) @ [0.0, 0.0, 1.0]
    assert len(np.unique(np.round(up, 6), axis=0)) == POSE_SETS[poses]
    np.testing.assert_allclose(np.abs(state.omega).max(), 0.0, atol=1e-15)
    assert middle[-1] + 1.0 == motion.duration


def test_rates_are_derivatives_of_the_attitude():
    motion = PoseSequence("faces", rest=1.0, turn=1.0)
    t = np.linspace(0.01, motion.duration - 0.01, 400)
    step = 1e-5
    before, after = motion.at(t - step), motion.at(t + step)
    turned = Rotation.from_matrix(before.rotation.transpose(0, 2, 1) @ after.rotation).as_rotvec()
    np.testing.assert_allclose(turned / (2 * step), motion.at(t).omega, atol=1e-4)
    np.testing.assert_allclose((after.omega - before.omega) / (2 * step), motion.at(t).alpha, atol=1e-3)


def test_scenario():
    recording = simulate(Scenario.load("calibration_poses", changes=["motion.poses=faces", "motion.rest_s=2"]), seed=3)
    assert recording.duration == pytest.approx(6 * 2 + 5 * 2, abs=0.02)
    with pytest.raises(InputError, match="rest_s and turn_s must be positive"):
        PoseSequence(rest=-1.0)
    with pytest.raises(InputError, match="unknown set of poses 'all'; valid: faces"):
        PoseSequence("all")
