"""Held-out data: nothing leaks into the fit, blocks keep their history, and noise is no excess."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gfimu.diagnosis.causes import Cause
from gfimu.diagnosis.coloured_noise import NoiseLevels
from gfimu.diagnosis.data.run import prepare_run
from gfimu.diagnosis.holdout import Holdout, held_out_gain, split_segments
from gfimu.diagnosis.refinement import refine
from gfimu.diagnosis.stretches import make_segments
from gfimu.geometry.array import AccelerometerArray
from gfimu.recording import Recording
from sim.campaign import Measurement, measure, random_profile
from sim.effects import make_effect
from sim.profiles import Hold, Ramp, spin_profile
from sim.twin import Twin

SETTING = Measurement(duration=32.0)


@pytest.fixture(scope="module")
def twin():
    return Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")


def segment_of(recording, twin, *, walk=0.0):
    """The whole run as one segment, its drive at its best without any cause."""
    [segment] = make_segments(twin, [prepare_run(recording, twin)])
    levels = segment.levels
    segment.set_levels(NoiseLevels(levels.white, levels.flicker, walk))
    segment.prepare_weights()
    segment.coefficients = refine([segment], (), [[]]).drives[0]
    return segment


def cause(twin, name, *shapes):
    """A cause whose sizes are still nothing."""
    family = twin.families()[name]
    count = len(family.sizes(twin.array))
    return Cause(family, "", np.eye(count), dict(shapes), 0.0, np.zeros(count))


def measured(twin, effects, motion, seed=3, setting=SETTING):
    return measure(np.random.default_rng(seed), twin, effects, setting, motion=motion)


TILT = {"x_rad": 0.02, "y_rad": -0.01}


@pytest.fixture(scope="module")
def alternating(twin):
    """A run whose table is tilted in every other held-out block alone: the pairs, those with the tilt fitted first."""
    motion = random_profile(np.random.default_rng(5), SETTING.duration)
    plain, tilted = (measured(twin, effects, motion) for effects in ([], [make_effect("table_tilt", TILT)]))
    blocks = split_segments([segment_of(plain, twin)], [[]])
    readings = plain.readings.copy()
    for block in blocks[0].train:
        rows = np.isin(plain.t_s, block.run.t)
        readings[rows] = tilted.readings[rows]
    mixed = Recording.from_arrays(plain.t_s, readings, twin.array, reference=plain.reference)
    return split_segments([segment_of(mixed, twin)], [[]])


def gain(twin, pair):
    return held_out_gain([cause(twin, "table_tilt")], [pair], [], label="the other blocks")


def leaking(pair):
    """The same with the held-out blocks among the fitted ones."""
    return replace(pair, train=[*pair.train, *pair.test], train_fixed=[*pair.train_fixed, *pair.test_fixed])


def test_what_only_the_fitted_blocks_have_shows_no_gain(twin, alternating):
    fitted = gain(twin, alternating[0])
    assert fitted.log_likelihood_per_sample < -10 * fitted.log_likelihood_std < 0
    assert not fitted.share_of_excess_removed > 0.0
    assert fitted.rms_after > 3 * fitted.rms_before
    # It is predicted in full where it is not: blocks let into the fit would halve it.
    half = gain(twin, leaking(alternating[0]))
    assert half.log_likelihood_per_sample > 0.5 * fitted.log_likelihood_per_sample


def test_what_only_the_held_out_blocks_have_is_not_predicted(twin, alternating):
    kept = gain(twin, alternating[1])
    assert kept.share_of_excess_removed == pytest.approx(0.0, abs=0.02)
    assert gain(twin, leaking(alternating[1])).share_of_excess_removed > 0.3


@pytest.mark.parametrize(
    ("name", "parameters"),
    [
        ("hysteresis", {"lost_m_s2": 0.3, "width_m_s2": 2.5}),
        ("resonance", {"gain": 0.8, "frequency_hz": 3.0, "damping_ratio": 0.01}),
        ("sensor_lag", {"time_constant_s": 0.5}),
    ],
)
def test_a_block_keeps_what_came_before_it(twin, name, parameters):
    motion = random_profile(np.random.default_rng(5), SETTING.duration)
    effect = make_effect(name, parameters, twin.array)
    segment = segment_of(measured(twin, [], motion), twin)
    whole = segment.predict([effect])
    for pair in split_segments([segment], [[]], [], duration=4.0):
        for block in pair.test:
            rows = np.searchsorted(segment.run.t, block.run.t)
            # The block's own spline follows the run's to this much.
            assert_allclose(block.predict([effect])[:, :-1], whole[rows, :-1], atol=0.02)


def test_a_size_that_the_fitted_part_leaves_open_is_not_extrapolated(twin):
    # What grows with the fourth power of the rate is not seen at a quarter of it.
    motion = spin_profile([Ramp(2.0, 3.0), Hold(12.0), Ramp(4.0, 12.0), Hold(12.0), Ramp(2.0, 3.0)])
    sizes = {f"{name}_m_s2_per_rad4_s4": 2e-6 for name in twin.array.channels[::2]}
    effect = make_effect("vibration_rectification", sizes, twin.array)
    segment = segment_of(measured(twin, [effect], motion), twin)
    first, _ = split_segments([segment], [[]], duration=np.inf)
    found = held_out_gain([cause(twin, "vibration_rectification")], [first], [], label="the faster half")
    assert found.rms_after < 1.02 * found.rms_before


def test_a_random_walk_is_no_excess(twin):
    motion = random_profile(np.random.default_rng(5), SETTING.duration)
    hidden = [make_effect("bias_random_walk", {"strength_m_s2_rts": 0.02}), make_effect("table_tilt", TILT)]
    segment = segment_of(measured(twin, hidden, motion), twin, walk=0.02)
    pairs = split_segments([segment], [[]])
    found = held_out_gain([cause(twin, "table_tilt")], pairs, [], label="blocks")
    assert found.share_of_excess_removed > 0.97
    assert found.share_std < 0.02
    assert found.share_in_any_recording == found.share_of_excess_removed
    assert found.rms_after < 1.05 * np.sqrt(np.mean(segment.levels.white[:-1] ** 2))


def test_noise_alone_has_no_share(twin):
    motion = random_profile(np.random.default_rng(5), SETTING.duration)
    pairs = split_segments([segment_of(measured(twin, [], motion), twin)], [[]])
    found = held_out_gain([cause(twin, "table_tilt")], pairs, [], label="blocks")
    assert np.isnan(found.share_of_excess_removed)
    assert abs(found.log_likelihood_per_sample) < 0.01


def test_a_tone_belongs_to_its_recording(twin):
    motion = random_profile(np.random.default_rng(5), SETTING.duration)
    tone = {"amplitude_m_s2": 0.05, "frequency_hz": 7.0, "phase_rad": 0.4}
    segment = segment_of(measured(twin, [make_effect("interference_tone", tone)], motion), twin)
    pairs = split_segments([segment], [[]])
    found = held_out_gain([cause(twin, "interference_tone", ("frequency_hz", 7.0))], pairs, [], label="blocks")
    assert found.share_of_excess_removed > 0.97
    assert found.share_in_any_recording == pytest.approx(0.0, abs=0.02)


def test_pairs_hold_every_block_once(twin, alternating):
    one, other = alternating
    assert isinstance(one, Holdout)
    times = [block.run.t for block in (*one.train, *one.test)]
    assert len(np.unique(np.concatenate(times))) == sum(map(len, times))
    assert [block.run.t[0] for block in one.test] == [block.run.t[0] for block in other.train]
