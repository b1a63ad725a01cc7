"""Recordings of free bodies made ready: what is refused, what is marked, and a force that most channels agree on."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from made_bodies import TWIN, hand_motion, hand_recording, hand_stretch

from gfimu import InputError
from gfimu.diagnosis import prepare_bodies, robust_prediction

MOTION = hand_motion()
WHITE = TWIN.expected_noise(100.0).white
SPIKES = ([100, 220, 340], [0, 4, 7])


def spiked(readings):
    readings[SPIKES] += 30.0


def prepared(*hidden, change=None, spike_share=1.0):
    return prepare_bodies([hand_recording(MOTION, *hidden, change=change)], TWIN, ["hand"], spike_share=spike_share)


def test_a_sound_recording_keeps_all_its_samples():
    found = prepared()
    (run,) = found.runs
    assert run.name == "hand"
    assert run.valid.all()
    assert (found.effects, found.why, found.rounded) == ([[]], {}, False)


def test_isolated_bad_samples_are_marked_and_no_others():
    (run,) = prepared(change=spiked).runs
    assert sorted(zip(*np.nonzero(~run.valid), strict=True)) == sorted(zip(*SPIKES, strict=True))


def test_more_of_them_than_the_share_are_no_faults_but_a_frozen_stretch_stays_one():
    def frozen_too(readings):
        spiked(readings)
        readings[400:460, 2] = readings[400, 2]

    (run,) = prepared(change=frozen_too, spike_share=0.0).runs
    assert run.valid[SPIKES].all()
    assert not run.valid[405:455, 2].any()


def test_an_inverted_channel_is_found_before_any_search():
    found = prepared(("sign_flip", {"channel": "b2"}))
    assert [(one.name, one.parameters["channel"]) for one in found.effects[0]] == [("sign_flip", "b2")]
    assert set(found.why) == {"sign_flip"}


def test_a_model_that_predicts_no_free_body_is_refused():
    with pytest.raises(InputError, match="predicts no free body"):
        prepare_bodies([], SimpleNamespace(), [], spike_share=1.0)


def test_channels_that_any_force_explains_are_refused():
    def dead(readings):
        readings[:, 3:] = np.nan

    with pytest.raises(InputError, match="hand: 3 channels with values leave nothing to compare"):
        prepared(change=dead)


def test_too_few_samples_with_every_channel_are_refused():
    def gaps(readings):
        readings[:270, 0] = np.nan
        readings[-270:, 5] = np.nan

    with pytest.raises(InputError, match=r"hand: \d+ samples have a value of every channel; a free body needs 80"):
        prepared(change=gaps)


def test_one_exchanged_pair_does_not_draw_the_force_its_way():
    stretch = hand_stretch(MOTION, ("axis_swap", {"channels": ["a1", "a3"]}))
    truth = TWIN.predict_body(MOTION, MOTION.t)
    off = robust_prediction(stretch) - truth
    assert np.sqrt(np.mean(off[5:-5] ** 2)) < 1.5 * WHITE.mean()
    plain = stretch.run.readings @ np.linalg.pinv(TWIN.array.axes).T @ TWIN.array.axes.T
    assert np.sqrt(np.mean((plain - truth) ** 2)) > 20.0 * WHITE.mean()  # which least squares alone can't do
