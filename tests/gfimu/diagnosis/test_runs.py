"""Recordings as diagnosis takes them: slower references, stretches of a long run, held-out blocks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gfimu import AccelerometerArray
from gfimu.base import STANDARD_GRAVITY
from gfimu.diagnosis import (
    Policy,
    check_integrity,
    diagnose,
    make_stretches,
    predicted_by_reference,
    prepare_run,
    starting_point,
)
from gfimu.diagnosis.criticism.holdout import split
from gfimu.diagnosis.fit.gauss_newton import fit
from gfimu.recording import Recording
from sim import Hold, Ramp, spin_profile
from sim.effects import make_effect
from sim.trials import Measurement, hidden_effect, measure, random_profile
from sim.twin import Twin

SETTING = Measurement(duration=24.0)


@pytest.fixture(scope="module")
def twin():
    return Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")


@pytest.fixture(scope="module")
def quiet(twin):
    return measure(np.random.default_rng(7), twin, [], SETTING)


def with_tacho(recording, array, tacho):
    return Recording.from_arrays(
        recording.t_s, recording.readings, array, reference={**recording.reference, "tacho_rad_s": tacho}
    )


@pytest.mark.study
@pytest.mark.parametrize("held", [False, True], ids=["left out", "held"])
def test_a_tachometer_at_a_quarter_of_the_rate_is_no_discrepancy(twin, quiet, held):
    tacho = quiet.reference["tacho_rad_s"]
    place = np.arange(len(tacho))
    slow = tacho[place // 4 * 4] if held else np.where(place % 4 == 0, tacho, np.nan)
    run = prepare_run(with_tacho(quiet, twin.array, slow), twin)
    assert_allclose(run.reference_valid, place % 4 == 0)
    found = diagnose([with_tacho(quiet, twin.array, slow)], twin)
    assert found.verdict == "nothing_found"
    assert found.noise.reference_white == pytest.approx(0.02, rel=0.2)


def test_a_coarse_tachometer_keeps_its_equal_values(twin, quiet):
    coarse = np.round(quiet.reference["tacho_rad_s"] / 0.5) * 0.5
    assert prepare_run(with_tacho(quiet, twin.array, coarse), twin).reference_valid.all()


TIMED = {
    "warm_up": {"a11_m_s2": 0.3, "time_constant_s": 9.0},
    "gain_drift": {"slope_1_s": 1e-3},
    "clock_error": {"ratio": 2e-3},
}


@pytest.mark.parametrize("name", TIMED)
def test_a_stretch_keeps_the_time_origin_of_its_run(twin, quiet, name):
    [stretch] = stretches = make_stretches(twin, [prepare_run(quiet, twin)], [[]])
    effect = make_effect(name, TIMED[name], twin.array)
    nothing = fit(stretches, starting_point(stretches, Policy().knots), Policy())
    whole = stretch.predict([effect], nothing.point.drives[0].spin)
    for pair in split(stretches, nothing, Policy()):
        for block, drive in zip(pair.test.stretches, pair.test.drives, strict=True):
            rows = np.searchsorted(stretch.run.t, block.run.t)
            # The block's own spline follows the run's to this much; a lost origin would show tens of times more.
            assert_allclose(block.predict([effect], drive.spin), whole[rows], atol=0.01)


@pytest.mark.study
def test_held_out_blocks_are_predicted_to_the_noise(twin):
    effect = make_effect("channel_skew", {"per_chip_s": -0.04}, twin.array)
    found = diagnose([measure(np.random.default_rng(8), twin, [effect], SETTING)], twin)
    assert [cause.effect for cause in found.causes] == ["channel_skew"]
    assert found.gain.share_of_excess_removed > 0.99


def test_a_chip_at_twice_its_gain_is_not_taken_for_clipping(twin):
    rng = np.random.default_rng(9)
    motion = random_profile(rng, SETTING.duration)
    effect = make_effect("wrong_range", {"chip": "a3", "factor": 2.0}, twin.array)
    run = prepare_run(measure(rng, twin, [effect], SETTING, motion=motion), twin)
    checked = check_integrity(twin, run, predicted_by_reference(twin, run))
    assert [found.name for found in checked.effects] == ["wrong_range"]


@pytest.mark.study
@pytest.mark.parametrize(
    ("name", "key", "value"), [("channel_skew", "per_chip_s", -0.15), ("clock_error", "ratio", -0.05)]
)
def test_a_large_fault_of_timing_is_found_though_far_from_linear(twin, name, key, value):
    effect = make_effect(name, {key: value}, twin.array)
    found = diagnose([measure(np.random.default_rng(10), twin, [effect], SETTING)], twin)
    assert [cause.effect for cause in found.causes] == [name]
    [cause] = found.causes
    assert abs(cause.parameters[key] - value) < 4 * cause.std[key]


@pytest.mark.study
def test_a_slow_clock_asks_for_the_motion_beyond_the_end(twin):
    # The last readings are of 0.9 s after the last of the reference, while the table turns ever faster.
    effect = make_effect("clock_error", {"ratio": -0.03}, twin.array)
    motion = spin_profile([Ramp(3.0, 10.0), Hold(6.0), Ramp(9.0, 20.0)])
    recording, other = (
        measure(np.random.default_rng(seed), twin, [effect], Measurement(duration=30.0), motion=motion)
        for seed in (4, 5)
    )
    found = diagnose([recording], twin, held_out=[other])
    assert found.gain.share_of_excess_removed > 0.999
    assert [cause.effect for cause in found.causes] == ["clock_error"]
    assert abs(found.causes[0].parameters["ratio"] + 0.03) < 4 * found.causes[0].std["ratio"]
    assert diagnose([recording], replace(twin, effects=(effect,))).verdict == "nothing_found"


@pytest.mark.study
@pytest.mark.parametrize("name", ["eccentricity", "bias"])
def test_a_recording_kept_for_the_gate_confirms_the_cause(twin, name):
    rng = np.random.default_rng(11)
    motion = random_profile(rng, SETTING.duration)
    effect = hidden_effect(rng, twin, name, motion, 300.0, SETTING)
    first = measure(rng, twin, [effect], SETTING, motion=motion)
    found = diagnose([first], twin, held_out=[measure(rng, twin, [effect], SETTING)])
    assert name in {cause.effect for cause in found.causes}
    assert found.gain.held_out == "another recording"
    assert found.gain.share_of_excess_removed > 0.97


@pytest.mark.study
def test_a_large_bias_under_strong_slow_noise_passes_the_gate(twin):
    # Bias instability of 0.5 mg: every short block alone would count the slow noise as its own repetition of the bias.
    rng = np.random.default_rng(12)
    noisy = Measurement(duration=40.0, bias_instability=0.5e-3 * STANDARD_GRAVITY)
    effect = make_effect("bias", {"a11_m_s2": 0.1}, twin.array)
    found = diagnose([measure(rng, twin, [effect], noisy)], twin)
    assert "bias" in {cause.effect for cause in found.causes}


def test_clipping_is_seen_where_a_steady_signal_just_reaches_it(twin):
    spin = spin_profile([Hold(20.0)], start_rate=9.0)
    steady = measure(np.random.default_rng(9), twin, [], Measurement(duration=10.0), motion=spin)
    level = float(np.quantile(np.abs(steady.readings[:, 0]), 0.15))
    clipped = Recording.from_arrays(
        steady.t_s, np.clip(steady.readings, -level, level), twin.array, reference=steady.reference
    )
    for recording, names in ((steady, []), (clipped, ["saturation"])):
        run = prepare_run(recording, twin)
        checked = check_integrity(twin, run, predicted_by_reference(twin, run))
        assert [effect.name for effect in checked.effects] == names
