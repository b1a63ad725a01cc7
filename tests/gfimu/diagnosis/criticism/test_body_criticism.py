"""What a free body leaves: noise that grows with the motion, a tone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_bodies import PERIOD, TWIN, hand_motion, hand_stretch

from gfimu.diagnosis import Policy
from gfimu.diagnosis.criticism.body import motion_noise, tone
from gfimu.diagnosis.terms.hand.drive import HandDrive
from gfimu.diagnosis.terms.hand.learning import first_noise
from gfimu.diagnosis.terms.hand.posterior import condition_hand

POLICY = Policy().of_body()
MOTION = hand_motion(12.0)


@pytest.fixture(scope="module")
def stretch():
    return hand_stretch(MOTION)


def at(stretch):
    return condition_hand(stretch, HandDrive.of(stretch), [], first_noise(stretch))


def ringing(channel, frequency, size):
    """Return a change of the readings: a tone on a channel."""

    def change(readings):
        readings[:, channel] += size * np.sin(2.0 * np.pi * frequency * PERIOD * np.arange(len(readings)))

    return change


def test_noise_that_does_not_grow_with_the_motion_is_not_told(stretch):
    quiet = replace(first_noise(stretch), agitation=1e-3, log_odds=0.9 * POLICY.lack_odds)
    found = motion_noise([stretch], [quiet], POLICY)
    assert (found.signature, found.log_odds) == ("", -np.inf)


def test_disagreement_of_the_channels_is_told_as_a_time(stretch):
    levels = replace(first_noise(stretch), agitation=3e-3, log_odds=50.0)
    found = motion_noise([stretch, stretch], [first_noise(stretch), levels], POLICY)  # the loudest run is told
    assert "an instant of its own, 3 ms rms apart" in found.signature
    assert "angular acceleration" not in found.signature
    assert (found.log_odds, found.noise_odds) == (-np.inf, 50.0)  # noise, and no lack of fit


def test_lost_angular_acceleration_is_told_as_its_size_in_motion(stretch):
    levels = replace(first_noise(stretch), acceleration_slope=0.2, log_odds=50.0)
    found = motion_noise([stretch], [levels], POLICY)
    size = 0.2 * np.sqrt(np.mean(stretch.change[stretch.use] ** 2))  # the body never rests
    assert f"by {size:.2g} rad/s² rms in motion" in found.signature
    assert "disagree" not in found.signature


def test_a_tone_is_told_by_channel_frequency_and_size():
    channel = TWIN.array.channels.index("c1")
    found = tone(at(hand_stretch(MOTION, change=ringing(channel, 13.0, 0.15))), POLICY)
    assert found.log_odds > POLICY.lack_odds
    assert found.signature.startswith("channel c1 has a tone at 13.0")
    amplitude = float(found.signature.split("about ")[1].split()[0])
    assert amplitude == pytest.approx(0.15 * 2 / 3, rel=0.2)  # the specific force takes a third


def test_noise_and_a_slow_oscillation_are_no_tone(stretch):
    assert tone(at(stretch), POLICY).log_odds < POLICY.lack_odds
    slow = hand_stretch(MOTION, change=ringing(4, 0.4, 0.1))
    assert tone(at(slow), POLICY).log_odds < POLICY.lack_odds
