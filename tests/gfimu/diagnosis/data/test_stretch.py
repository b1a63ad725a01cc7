"""Stretches: what counts, how runs are cut, and what a prediction remembers."""

from __future__ import annotations

from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest
from core_cases import lively, small_twin, stretches_of
from numpy.testing import assert_allclose

from gfimu.diagnosis import Drive, RunUp, make_stretches, prepare_run, starting_point
from sim.effects import make_effect
from sim.trials import Measurement, measure


@pytest.fixture(scope="module")
def twin():
    return small_twin()


@pytest.fixture(scope="module")
def stretch(twin):
    return stretches_of(twin, duration=8.0, motion=lively())[0]


def test_what_counts(stretch):
    valid = stretch.run.valid.copy()
    valid[3, 1] = False
    reference_valid = np.arange(len(stretch.run.t)) % 2 == 0
    readings = stretch.run.readings.copy()
    readings[3, 1] = np.nan
    one = replace(stretch, run=replace(stretch.run, readings=readings, valid=valid, reference_valid=reference_valid))
    assert one.mask.shape == (400, 7)
    assert not one.mask[3, 1]
    assert one.observations == 400 * 6 - 1 + 200
    assert one.measured[3, 1] == 0.0
    assert_allclose(one.measured[::2, -1], stretch.run.reference[::2])
    assert not one.measured[1::2, -1].any()
    assert one.of_reference().observations == 200


def test_nothing_of_it_changes(stretch):
    with pytest.raises(FrozenInstanceError):
        stretch.index = 3


def test_predictions_hold_the_known_faults(stretch):
    usual = stretch.predict([], lively())
    swap = make_effect("sign_flip", {"channel": stretch.model.array.channels[0]}, stretch.model.array)
    flipped = replace(stretch, known=(swap,))
    assert_allclose(flipped.predict([], lively())[:, 0], -usual[:, 0])
    assert_allclose(flipped.predict([], lively())[:, 1:], usual[:, 1:])


def test_the_motion_is_the_drive_over_the_gain_of_the_reference(stretch):
    t = stretch.run.t
    bare = stretch.motion([], lively()).at(t)
    assert_allclose(bare.rate, lively().at(t).rate)
    scaled = [make_effect("tacho_scale", {"ratio": 0.25})]
    assert_allclose(stretch.motion(scaled, lively()).at(t).rate, lively().at(t).rate / 1.25)
    # The reference then reads the drive itself.
    assert_allclose(stretch.predict(scaled, lively())[:, -1], lively().at(t).rate)
    nearly_none = [make_effect("tacho_scale", {"ratio": -1.0})]
    assert np.isfinite(stretch.predict(nearly_none, lively())).all()


def test_a_block_predicts_what_the_whole_run_does_there(twin, stretch):
    # A lag remembers the samples before the block.
    lag = [make_effect("sensor_lag", {"time_constant_s": 0.3})]
    whole = stretch.predict(lag, lively())
    before, after = stretch.run.rows(0, 200), stretch.run.rows(200, 400)
    block = replace(stretch, run=after)
    assert np.abs(block.predict(lag, lively())[:5] - whole[200:205]).max() > 0.05
    block = replace(block, run_up=RunUp(before.t, before.temperature, lively()))
    assert_allclose(block.predict(lag, lively()), whole[200:], atol=1e-9)
    # And what it remembers is the drive of before, whatever the block's own is: the state of the lag, which decays.
    still = Drive.still(after.t, float(after.t[0]), 0.1, 0.0, 1e-3).spin
    remembered = block.predict(lag, still) - replace(block, run_up=None).predict(lag, still)
    decay = np.exp(-stretch.run.sample_period / 0.3)
    state = whole[199] - block.predict(lag, still)[-1]  # beyond what the table at rest reads
    step = np.abs(stretch.predict([], lively())[199] - block.predict(lag, still)[-1])[:-1].max()
    assert np.abs(state[:-1]).max() > 0.02
    # How the readings pass from the last sample of before to rest, no sample shows: by at most the whole step.
    assert_allclose(remembered[0, :-1], decay * state[:-1], atol=step * (1.0 - decay))
    # The cubic through the samples rings after that step, by a factor √3 − 2 from sample to sample.
    assert_allclose(remembered[11:40], decay * remembered[10:39], atol=step * (2.0 - np.sqrt(3.0)) ** 10)


def test_noise_to_begin_with(twin, stretch):
    levels = stretch.first_levels
    expected = twin.expected_noise(50.0)
    assert_allclose(levels.white[:-1], expected.white)
    assert levels.white[-1] == pytest.approx(0.02, rel=0.15)  # of the tachometer, by its third differences
    assert levels.flicker[-1] == 0.0
    assert levels.walk == 0.0
    walking = replace(stretch, model=twin.extended([make_effect("bias_random_walk", {"strength_m_s2_rts": 0.02})]))
    assert walking.first_levels.walk == pytest.approx(0.02)


def test_rest_and_motion_are_told_apart(twin, stretch):
    assert not stretch.at_rest
    rest = replace(stretch, run=replace(stretch.run, reference=0.02 * np.random.default_rng(1).standard_normal(400)))
    assert rest.at_rest


def test_long_runs_are_cut_and_their_angles_go_on(twin):
    stretches = stretches_of(twin, duration=150.0, motion=lively(160.0))
    assert len(stretches) == 2
    assert [one.stretches for one in stretches] == [2, 2]
    assert sum(len(one.run.t) for one in stretches) == 7500
    assert stretches[1].run.t[0] == pytest.approx(stretches[0].run.t[-1] + 0.02)
    truth = lively(160.0).at(np.array([stretches[1].run.t[0]])).angle[0]
    assert stretches[1].start_angle == pytest.approx(truth, abs=5.0 * stretches[1].start_angle_std)
    assert stretches[0].start == stretches[1].start == 0.0
    assert stretches[1].start_angle_std > stretches[0].start_angle_std


def test_runs_keep_their_numbers_and_faults(twin):
    rng = np.random.default_rng(3)
    runs = [prepare_run(measure(rng, twin, [], Measurement(6.0, 50.0)), twin) for _ in range(2)]
    flip = make_effect("sign_flip", {"channel": twin.array.channels[0]}, twin.array)
    coarse = make_effect("coarse_resolution", {"step_m_s2": 0.3})
    first, second = make_stretches(twin, runs, [[flip], [coarse]])
    assert (first.index, second.index) == (0, 1)
    assert first.known == (flip,)
    assert second.known == ()  # a resolution changes no prediction; it rounds the readings
    assert (first.steps.channels, second.steps.channels) == (0.0, 0.3)


def test_after_a_gap_of_the_reference_the_angle_is_lost(twin):
    rng = np.random.default_rng(3)
    run = prepare_run(measure(rng, twin, [], Measurement(12.0, 50.0), motion=lively()), twin)
    first, second = make_stretches(twin, [replace(run, resumed=(300,))], [[]])
    assert (len(first.run.t), len(second.run.t)) == (300, 300)
    assert second.start_angle_std > 1.0 > first.start_angle_std


def test_what_comes_before_the_reference_is_no_stretch_of_its_own(twin):
    rng = np.random.default_rng(3)
    run = prepare_run(measure(rng, twin, [], Measurement(12.0, 50.0), motion=lively()), twin)
    late = np.arange(len(run.t)) >= 200
    run = replace(run, valid=run.valid & late[:, None], reference_valid=run.reference_valid & late, resumed=(200,))
    [only] = make_stretches(twin, [run], [[]])
    assert len(only.run.t) == 600
    assert only.since == run.t[200]
    assert only.counted_times().min() >= run.t[200]
    assert only.start_angle_std > 1.0
    assert only.parts(2) == [0, 400, 600]
    [drive] = starting_point([only], 0.1).drives
    assert drive.spline.start > run.t[100]


def test_true_times_of_readings(twin, stretch):
    skewed = stretch.times(
        [make_effect("channel_skew", {"per_chip_s": 0.01}), make_effect("tacho_latency", {"delay_s": 0.2})]
    )
    assert_allclose(skewed[:, 2] - stretch.run.t, 0.02)
    assert_allclose(stretch.run.t - skewed[:, -1], 0.2)
