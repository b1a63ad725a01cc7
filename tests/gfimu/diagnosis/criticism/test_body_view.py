"""A run of a free body as reports show it: errors before and after, speed, attitude, and the noise to expect."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_bodies import TWIN, hand_motion, hand_stretch

from gfimu.diagnosis.criticism.views.body_view import body_noise_floor, body_view
from gfimu.diagnosis.terms.hand.drive import HandDrive
from gfimu.diagnosis.terms.hand.learning import first_noise
from gfimu.diagnosis.terms.hand.noise import BodyNoise
from gfimu.diagnosis.terms.hand.posterior import condition_hand
from gfimu.motion import to_rotation
from sim.effects import make_effect

BIAS = ("bias", {"b2_m_s2": 0.5})
REST = 2.5  # s
UP = TWIN.gravity * np.array([0.6, 0.0, 0.8])  # the body lies on an edge
MOTION = hand_motion(8.0, rest=REST, up=UP)


@pytest.fixture(scope="module")
def stretch():
    return hand_stretch(MOTION, BIAS)


@pytest.fixture(scope="module")
def view(stretch):
    levels = replace(first_noise(stretch), acceleration=0.0)  # so that no angular acceleration takes part of the bias
    drive = HandDrive.of(stretch)
    return body_view(
        condition_hand(stretch, drive, [], levels),
        condition_hand(stretch, drive, [make_effect(*BIAS, TWIN.array)], levels),
    )


def test_what_a_cause_explains_is_in_the_error_before_and_not_after(view):
    before, after = (np.where(view.valid, view.measured - one, 0.0) for one in (view.before, view.after))
    biased = TWIN.array.channels.index("b2")
    # Of the bias of one of three parallel channels the specific force takes a third.
    assert before[view.valid[:, biased], biased].mean() == pytest.approx(0.5 * 2 / 3, abs=0.02)
    floor = np.sqrt(np.mean(view.white**2) * (1.0 - 3.0 / 9.0))
    assert np.sqrt(np.mean(after[view.valid] ** 2)) == pytest.approx(floor, rel=0.1)


def test_the_motion_is_that_of_the_gyro(view):
    inner = slice(20, -20)
    assert view.rate[inner] == pytest.approx(np.linalg.norm(MOTION.rate, axis=1)[inner], abs=0.02)
    assert view.reference[inner] == pytest.approx(view.rate[inner], abs=0.02)
    assert np.isnan(view.angle).all()


def test_gravity_is_along_z_while_the_body_rests(view):
    resting = MOTION.t < REST - 0.5
    up = to_rotation(view.attitude[resting]).apply(UP / TWIN.gravity)
    assert up == pytest.approx(np.tile([0.0, 0.0, 1.0], (resting.sum(), 1)), abs=0.01)


def test_the_attitude_turns_as_fast_as_the_gyro_says(view):
    turned = to_rotation(view.attitude)
    rate = (turned[:-1].inv() * turned[1:]).as_rotvec() / np.diff(view.t)[:, None]
    middle = 0.5 * (MOTION.rate[1:] + MOTION.rate[:-1])
    assert rate[20:-20] == pytest.approx(middle[20:-20], abs=0.03)


def test_the_noise_floor_is_what_a_fitted_force_leaves(stretch):
    sigma = 0.04
    noise = sigma * np.random.default_rng(2).normal(size=(20_000, 9))
    left = noise - noise @ np.linalg.pinv(TWIN.array.axes).T @ TWIN.array.axes.T
    levels = BodyNoise.of(np.full(9, sigma), 0.0)
    assert body_noise_floor(stretch, levels) == pytest.approx(np.sqrt(np.mean(left**2)), rel=0.01)
    slow = body_noise_floor(stretch, levels.with_instability(sigma))
    assert body_noise_floor(stretch, levels) < slow < np.sqrt(2.0) * body_noise_floor(stretch, levels)


def test_a_channel_without_data_is_no_part_of_the_noise_floor():
    def dead(readings):
        readings[:, 4] = np.nan

    stretch = hand_stretch(MOTION, change=dead)
    levels = first_noise(stretch)
    white = levels.white[:-1][stretch.alive]
    expected = np.sqrt((np.mean(white**2) + 0.6 * levels.instability**2) * (1.0 - 3.0 / 8.0))
    assert body_noise_floor(stretch, levels) == pytest.approx(expected)
