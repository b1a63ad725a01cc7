"""Held-out data: nothing leaks into the fit, blocks keep their history, and noise is no excess."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gfimu import AccelerometerArray
from gfimu.diagnosis import Cause, NoiseLevels, Policy, make_stretches, prepare_run, starting_point
from gfimu.diagnosis.criticism.holdout import gate_gains, held_out_gain, other_recordings, split
from gfimu.diagnosis.fit.gauss_newton import fit
from gfimu.diagnosis.fit.learn import learn_roughness
from gfimu.diagnosis.fit.linear import with_residue
from gfimu.recording import Recording
from sim import Hold, Ramp, spin_profile
from sim.effects import make_effect
from sim.trials import Measurement, measure, random_profile
from sim.twin import Twin

POLICY = Policy()
SETTING = Measurement(duration=32.0)
TILT = {"x_rad": 0.02, "y_rad": -0.01}


@pytest.fixture(scope="module")
def twin():
    return Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")


@pytest.fixture(scope="module")
def motion():
    return random_profile(np.random.default_rng(5), SETTING.duration)


def measured(twin, effects, motion, seed=3, setting=SETTING):
    return measure(np.random.default_rng(seed), twin, effects, setting, motion=motion)


def whole_run(recording, twin, *, known=(), walk=0.0):
    """The run as one stretch, and its fit without any cause."""
    stretches = make_stretches(twin, [prepare_run(recording, twin)], [known])
    start = starting_point(stretches, POLICY.knots)
    [levels] = start.levels
    start = replace(start, levels=(NoiseLevels(levels.white, levels.flicker, walk),))
    nothing = fit(stretches, start, POLICY)
    return stretches, fit(stretches, learn_roughness(stretches, nothing.point), POLICY)


def cause(twin, name, *shapes):
    """A cause whose sizes are still nothing."""
    family = twin.families()[name]
    count = len(family.sizes(twin.array))
    return Cause(family, "", np.eye(count), dict(shapes), np.zeros(count))


def blocks_of(recording, twin, *, walk=0.0, duration=None):
    return split(*whole_run(recording, twin, walk=walk), POLICY, duration=duration)


def gain(twin, *pairs, name="table_tilt"):
    return held_out_gain([cause(twin, name)], pairs, POLICY, label="the other blocks")


@pytest.fixture(scope="module")
def plain(twin, motion):
    """A run in which nothing is wrong."""
    return whole_run(measured(twin, [], motion), twin)


@pytest.fixture(scope="module")
def tilted(twin, motion):
    """A run on a tilted table: its stretches, the fit with the tilt, and that without."""
    stretches, nothing = whole_run(measured(twin, [make_effect("table_tilt", TILT)], motion), twin)
    return stretches, fit(stretches, replace(nothing.point, causes=(cause(twin, "table_tilt"),)), POLICY), nothing


@pytest.fixture(scope="module")
def alternating(twin, motion, plain):
    """A run whose table is tilted in every other held-out block alone: the pairs, those with the tilt fitted first."""
    without, tilted = (measured(twin, effects, motion) for effects in ([], [make_effect("table_tilt", TILT)]))
    readings = without.readings.copy()
    for block in split(*plain, POLICY)[0].train.stretches:
        rows = np.isin(without.t_s, block.run.t)
        readings[rows] = tilted.readings[rows]
    return blocks_of(Recording.from_arrays(without.t_s, readings, twin.array, reference=without.reference), twin)


def leaking(pair):
    """The same with the held-out blocks among the fitted ones."""
    return replace(pair, train=pair.train + pair.test)


def test_an_effect_of_the_fitted_blocks_alone_shows_no_gain(twin, alternating):
    fitted = gain(twin, alternating[0])
    assert fitted.log_likelihood_per_sample < -10 * fitted.log_likelihood_std < 0
    assert not fitted.share_of_excess_removed > 0.0
    assert fitted.rms_after > 3 * fitted.rms_before
    # It is predicted in full where it is not: blocks let into the fit would halve it.
    half = gain(twin, leaking(alternating[0]))
    assert half.log_likelihood_per_sample > 0.5 * fitted.log_likelihood_per_sample


def test_an_effect_of_the_held_out_blocks_alone_is_not_predicted(twin, alternating):
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
def test_a_block_keeps_its_drive_and_what_came_before_it(twin, plain, name, parameters):
    [stretch], nothing = plain
    effect = make_effect(name, parameters, twin.array)
    whole = stretch.predict([effect], nothing.point.drives[0].spin)
    for pair in split(*plain, POLICY, duration=4.0):
        for block, drive in zip(pair.test.stretches, pair.test.drives, strict=True):
            rows = np.searchsorted(stretch.run.t, block.run.t)
            assert_allclose(block.predict([effect], drive.spin), whole[rows], atol=2e-3)


def test_the_drive_of_a_block_reaches_as_far_as_a_slow_clock_asks_for(twin, plain):
    stretches, nothing = plain
    family = twin.families()["clock_error"]
    slow = Cause(family, "", np.eye(1), {}, np.array([0.03 / family.sizes(twin.array)[0].prior_std]))
    late = replace(nothing, point=replace(nothing.point, causes=(slow,)))
    ends = {
        name: split(stretches, found, POLICY)[0].test.drives[0].spline
        for name, found in (("usual", nothing), ("slow", late))
    }
    edge = stretches[0].run.t[int(len(stretches[0].run.t) / 4)]
    assert abs(ends["slow"].start - ends["usual"].start) > 0.02 * edge / 2


def test_pairs_hold_every_sample_once(plain):
    one, other = split(*plain, POLICY)
    times = [block.run.t for block in (*one.train.stretches, *one.test.stretches)]
    assert len(times) == 4
    assert_allclose(np.sort(np.concatenate(times)), plain[0][0].run.t)
    assert [block.run.t[0] for block in one.test.stretches] == [block.run.t[0] for block in other.train.stretches]
    halves = split(*plain, POLICY, duration=np.inf)
    assert [len(pair.test.stretches) for pair in halves] == [1, 1]


def test_a_size_that_the_fitted_part_leaves_open_is_not_extrapolated(twin):
    # What grows with the fourth power of the rate is not seen at a quarter of it.
    motion = spin_profile([Ramp(2.0, 3.0), Hold(12.0), Ramp(4.0, 12.0), Hold(12.0), Ramp(2.0, 3.0)])
    sizes = {f"{name}_m_s2_per_rad4_s4": 2e-6 for name in twin.array.channels[::2]}
    effect = make_effect("vibration_rectification", sizes, twin.array)
    first, _ = blocks_of(measured(twin, [effect], motion), twin, duration=np.inf)
    found = gain(twin, first, name="vibration_rectification")
    assert found.rms_after < 1.02 * found.rms_before


def test_a_random_walk_is_no_excess(twin, motion):
    hidden = [make_effect("bias_random_walk", {"strength_m_s2_rts": 0.02}), make_effect("table_tilt", TILT)]
    pairs = blocks_of(measured(twin, hidden, motion), twin, walk=0.02)
    found = gain(twin, *pairs)
    assert found.share_of_excess_removed > 0.97
    assert found.share_std < 0.02
    assert found.share_in_any_recording == found.share_of_excess_removed
    assert found.rms_after < 1.05 * np.sqrt(np.mean(pairs[0].test.levels[0].white[:-1] ** 2))


def test_noise_alone_has_no_share(twin, plain):
    found = gain(twin, *split(*plain, POLICY))
    assert np.isnan(found.share_of_excess_removed)
    assert abs(found.log_likelihood_per_sample) < 0.01


def test_a_tone_belongs_to_its_recording(twin, motion):
    tone = {"amplitude_m_s2": 0.05, "frequency_hz": 7.0, "phase_rad": 0.4}
    pairs = blocks_of(measured(twin, [make_effect("interference_tone", tone)], motion), twin)
    found = held_out_gain([cause(twin, "interference_tone", ("frequency_hz", 7.0))], pairs, POLICY, label="blocks")
    assert found.share_of_excess_removed > 0.97
    assert found.share_in_any_recording == pytest.approx(0.0, abs=0.02)


def test_a_fault_of_the_data_is_part_of_what_was_found(twin, motion):
    swap = make_effect("axis_swap", {"channels": ["a11", "a12"]}, twin.array)
    stretches, nothing = whole_run(measured(twin, [swap], motion), twin, known=(swap,))
    pairs = split(stretches, nothing, POLICY)
    found = held_out_gain((), pairs, POLICY, label="blocks")
    assert found.share_of_excess_removed > 0.99
    assert found.rms_after < 0.1 * found.rms_before


# -- the gate --------------------------------------------------------------------------------------------------------


def test_the_gate_confirms_what_is_there_and_no_more(twin, tilted):
    stretches, found, nothing = tilted
    halves = split(stretches, found, POLICY, duration=np.inf)
    assert gate_gains(found, {"table_tilt": nothing}, halves, POLICY)["table_tilt"] > 100.0
    both = fit(stretches, replace(found.point, causes=(*found.causes, cause(twin, "quadratic"))), POLICY)
    gains = gate_gains(both, {"quadratic": found}, halves, POLICY)
    assert gains["quadratic"] < 2.0
    assert gate_gains(found, {}, halves, POLICY) == {}


def test_the_gate_refuses_what_one_half_alone_has(twin, motion, plain):
    """A tilt that ends half-way is in the whole run's favour, but no half predicts it in the other."""
    without, tilted = (measured(twin, effects, motion) for effects in ([], [make_effect("table_tilt", TILT)]))
    readings = np.where(without.t_s[:, None] < 16.0, tilted.readings, without.readings)
    mixed = Recording.from_arrays(without.t_s, readings, twin.array, reference=without.reference)
    stretches, nothing = whole_run(mixed, twin)
    found = fit(stretches, replace(nothing.point, causes=(cause(twin, "table_tilt"),)), POLICY)
    assert found.log_evidence > nothing.log_evidence + 100.0
    halves = split(stretches, found, POLICY, duration=np.inf)
    assert gate_gains(found, {"table_tilt": nothing}, halves, POLICY)["table_tilt"] < -100.0


# -- other recordings ------------------------------------------------------------------------------------------------


@pytest.mark.study
def test_another_recording_confirms_or_refutes(twin, tilted):
    stretches, found, nothing = tilted
    turning = random_profile(np.random.default_rng(8), SETTING.duration)

    def judged(*there):
        run = prepare_run(measured(twin, there, turning, seed=9), twin)
        pairs = other_recordings(stretches, found, make_stretches(twin, [run], [()]), POLICY)
        gated = gate_gains(found, {"table_tilt": nothing}, pairs, POLICY, other_recording=True)
        return held_out_gain(found.causes, pairs, POLICY, label="another recording"), gated["table_tilt"]

    worth, gate = judged(make_effect("table_tilt", TILT))
    assert worth.share_of_excess_removed == pytest.approx(1.0, abs=0.01)
    assert worth.held_out == "another recording"
    assert gate > 100.0
    worth, gate = judged()
    assert np.isnan(worth.share_of_excess_removed)
    assert worth.log_likelihood_per_sample < -10 * worth.log_likelihood_std < 0
    assert gate < -100.0


# -- a residue of the calibration ------------------------------------------------------------------------------------


def test_a_residue_is_learnt_from_the_fitted_part_alone(twin, motion):
    rng = np.random.default_rng(4)
    biases = {
        f"{name}_m_s2": size for name, size in zip(twin.array.channels, 0.02 * rng.standard_normal(12), strict=True)
    }
    hidden = [make_effect("bias", biases, twin.array), make_effect("table_tilt", TILT)]
    stretches, nothing = whole_run(measured(twin, hidden, motion), twin)
    beside = with_residue(stretches, replace(nothing.point, causes=(cause(twin, "table_tilt"),)), 3.0)
    found = fit(stretches, beside, POLICY)
    [pair, _] = split(stretches, found, POLICY)
    assert pair.residue == 3.0
    with_it = held_out_gain(found.causes, [pair], POLICY, label="blocks")
    without = held_out_gain(found.causes, [replace(pair, residue=0.0)], POLICY, label="blocks")
    assert with_it.share_of_excess_removed > 0.99
    assert with_it.log_likelihood_per_sample > without.log_likelihood_per_sample + 0.1
    # Where the biases end with the fitted blocks, those of the fit make the others worse.
    centred = [
        replace(block, run=replace(block.run, readings=block.run.readings - np.array(list(biases.values()))))
        for block in pair.test.stretches
    ]
    ended = replace(pair, test=replace(pair.test, stretches=tuple(centred)))
    worse, better = (
        held_out_gain(found.causes, [one], POLICY, label="blocks") for one in (ended, replace(ended, residue=0.0))
    )
    assert worse.log_likelihood_per_sample < better.log_likelihood_per_sample
