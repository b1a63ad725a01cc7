"""Wiring faults seen in the samples: exchanged and inverted channels, alone and together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from gfimu import AccelerometerArray
from gfimu.diagnosis import check_integrity, diagnose, frozen_stretches, prepare_run
from sim import SplineSpin
from sim.effects import make_effect
from sim.trials import Measurement, measure
from sim.twin import Twin

FASTEST = 20.0  # rad/s: the highest readings are centripetal
SWAP_Z = ("axis_swap", {"channels": ["a13", "a21"]})


@pytest.mark.study(but=["flip", "swap"])
@pytest.mark.parametrize(
    "faults",
    [
        [("sign_flip", {"channel": "a13"})],  # every other z channel reads the same: no exchange need be flagged
        [("axis_swap", {"channels": ["a11", "a12"]})],
        [SWAP_Z, ("sign_flip", {"channel": "a21"})],
        [("axis_swap", {"channels": ["a11", "a12"]}), ("sign_flip", {"channel": "a12"})],
        [SWAP_Z, ("sign_flip", {"channel": ["a13", "a21"]})],
    ],
    ids=["flip", "swap", "swap and flip", "swap and flip in a chip", "swap and two flips"],
)
def test_exchanged_and_inverted_channels_are_told_together(faults):
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    effects = [make_effect(name, parameters, twin.array) for name, parameters in faults]
    diagnosis = diagnose([measure(np.random.default_rng(11), twin, effects, Measurement(duration=12.0))], twin)
    assert diagnosis.verdict == "explained"
    told = {cause.effect: cause.parameters for cause in diagnosis.causes}
    assert set(told) == {name for name, _ in faults}
    for name, parameters in faults:
        for key, value in parameters.items():
            assert sorted(np.atleast_1d(told[name][key])) == sorted(np.atleast_1d(value))


def slow_table(*hidden, swing):
    """A recording of a table that turns so slowly that readings hardly leave the noise."""
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    t = np.arange(-2.0, 22.0, 5e-3)
    rate = gaussian_filter1d(np.clip(t - 1.0, 0.0, 1.0) * (1.1 + swing * np.sin(0.7 * t)), 40.0)
    motion = SplineSpin.through(t, rate)
    rng = np.random.default_rng(4)
    effects = [make_effect(name, values, twin.array) for name, values in hidden]
    return twin, measure(rng, twin, effects, Measurement(duration=20.0), motion=motion)


@pytest.mark.study
def test_an_inverted_channel_shows_on_a_slow_table():
    twin, recording = slow_table(("sign_flip", {"channel": "a11"}), swing=0.6)
    diagnosis = diagnose([recording], twin)
    assert [(cause.effect, cause.parameters["channel"]) for cause in diagnosis.causes] == [("sign_flip", "a11")]


@pytest.mark.study
def test_an_offset_at_one_slow_speed_is_no_inversion():
    """It lowers what is read as far as an inversion would, but not what varies."""
    twin, still = slow_table(swing=0.0)
    read = float(np.median(still.for_array(twin.array)[-1000:, 0]))
    _, recording = slow_table(("bias", {"a11_m_s2": -2.0 * read}), swing=0.0)
    assert "sign_flip" not in {cause.effect for cause in diagnose([recording], twin).causes}


@pytest.mark.study(but=["0.3"])
@pytest.mark.parametrize("below", [0.3, 1.0, 2.0])
def test_a_plateau_just_below_the_limit_hides_no_clipping(below):
    """Readings pile up one step below the limit too, where a slower plateau comes so close to it."""
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    limit = 269.23 * 3.9e-3 * 9.80665
    arm = 0.05
    step = 3.9e-3 * 9.80665
    fast, slow = np.sqrt(np.array([limit + 0.5, limit - below * step]) / arm)
    t = np.arange(-2.0, 27.0, 5e-3)
    rate = np.interp(t, [3.0, 4.0, 6.0, 7.0, 9.0, 10.0, 20.0, 21.0], [0.0, fast, fast, 0.0, 0.0, slow, slow, 0.0])
    motion = SplineSpin.through(t, gaussian_filter1d(rate, 20.0))
    hidden = [make_effect("saturation", {"limit_m_s2": limit})]
    recording = measure(np.random.default_rng(11), twin, hidden, Measurement(duration=25.0), motion=motion)
    found = diagnose([recording], twin)
    assert {cause.effect for cause in found.causes} == {"saturation"}
    assert found.causes[0].parameters["limit_m_s2"] == pytest.approx(limit, abs=1.1 * step)


def _checked(seed, effects):
    """Return the faults told of a run that nears its highest readings slowly."""
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    t = np.arange(-2.0, 27.0, 5e-3)
    rate = np.interp(t, [3.0, 7.0, 20.0, 24.0], [0.0, FASTEST - 0.1, FASTEST, 0.0])
    motion = SplineSpin.through(t, gaussian_filter1d(rate, 20.0))
    recording = measure(np.random.default_rng(seed), twin, effects, Measurement(duration=25.0), motion=motion)
    run = prepare_run(recording, twin)
    prediction = twin.predict(motion, run.t)[0]
    return check_integrity(twin, run, prediction).effects, float(np.abs(prediction).max())


@pytest.mark.parametrize("above", [-1.0, -0.5, 0.0])
def test_clipping_at_the_very_peak_of_the_motion_is_told(above):
    """Noise would be read above the level where the motion alone hardly reaches it."""
    step = 3.9e-3 * 9.80665
    (_, peak) = _checked(1, [])
    limit = (round(peak / step) + above) * step
    effects, _ = _checked(2, [make_effect("saturation", {"limit_m_s2": limit})])
    assert [effect.name for effect in effects] == ["saturation"]
    assert effects[0].parameters["limit_m_s2"] == pytest.approx(limit, abs=1.1 * step)


@pytest.mark.parametrize("seed", range(5))
def test_a_plateau_whose_noise_is_read_is_no_clipping(seed):
    assert not _checked(seed, [])[0]


def test_loud_readings_just_below_a_limit_are_left_out_as_far_as_their_noise_reaches():
    """Of those only the ones whose noise points down are whole, and their mean is off."""
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    t = np.arange(-2.0, 62.0, 5e-3)
    motion = SplineSpin.through(t, gaussian_filter1d(np.interp(t, [3.0, 57.0], [0.0, FASTEST]), 20.0))
    limit, factor = 15.0, 6.0
    hidden = [make_effect("noise", {"factor": factor}), make_effect("saturation", {"limit_m_s2": limit})]
    run = prepare_run(measure(np.random.default_rng(11), twin, hidden, Measurement(duration=60.0), motion=motion), twin)
    prediction = twin.predict(motion, run.t)[0]
    valid = check_integrity(twin, run, prediction).run.valid
    noise = factor * float(np.median(twin.expected_noise(100.0).white))
    below = limit - np.abs(prediction)
    assert not (valid & (below < 2.0 * noise)).any()
    assert (valid & (below > 5.0 * noise)).any(axis=0).all()


@pytest.mark.parametrize("channels", [1, 12])
def test_a_limit_that_most_channels_read_beyond_is_none(channels):
    """One channel that wandering biases hold a coarse step below its prediction looks clipped."""
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    step = 80 * 3.9e-3 * 9.80665
    t = np.arange(-2.0, 27.0, 5e-3)
    rate = np.interp(t, [3.0, 4.0, 20.0, 24.0], [0.0, FASTEST, FASTEST, 0.0])
    motion = SplineSpin.through(t, gaussian_filter1d(rate, 20.0))
    hidden = [make_effect("coarse_resolution", {"step_m_s2": step}, twin.array)]
    run = prepare_run(measure(np.random.default_rng(11), twin, hidden, Measurement(duration=25.0), motion=motion), twin)
    readings, prediction = run.readings.copy(), twin.predict(motion, run.t)[0]
    held = np.argsort(-np.abs(prediction).max(axis=0))[:channels]
    level = (np.round(np.abs(prediction[:, held]).max() / step) - 2.0) * step
    readings[:, held] = np.clip(readings[:, held], -level, level)
    effects = check_integrity(twin, replace(run, readings=readings), prediction).effects
    assert ("saturation" in {effect.name for effect in effects}) == (channels == 12)


def test_a_dead_chip_is_told_with_all_its_channels():
    """All channels that stop together are one fault, in the extended twin too; others are told in the sentence."""
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    chip = {"channel": ["a21", "a22", "a23"], "start_s": 3.0, "stop_s": 9.0}
    later = {"channel": "a31", "start_s": 6.0, "stop_s": 7.5}
    effects = [make_effect("stuck_channel", one, twin.array) for one in (chip, later)]
    found = diagnose([measure(np.random.default_rng(11), twin, effects, Measurement(duration=12.0))], twin)
    (cause,) = found.causes
    assert cause.effect == "stuck_channel"
    assert cause.parameters["channel"] == chip["channel"]
    assert cause.parameters["start_s"] == pytest.approx(3.0, abs=0.3)
    assert cause.parameters["stop_s"] == pytest.approx(9.0, abs=0.3)
    assert "a21, a22, a23" in cause.why
    assert "a31" in cause.why
    assert found.twin.effects[-1].parameters["channel"] == chip["channel"]


def test_a_chip_that_was_never_read_is_told():
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    recording = measure(np.random.default_rng(11), twin, [], Measurement(duration=12.0))
    readings = recording.readings.copy()
    readings[:, 3:6] = 0.0
    found = diagnose([replace(recording, readings=readings)], twin)
    assert [cause.effect for cause in found.causes] == ["stuck_channel"]
    assert found.causes[0].parameters["channel"] == ["a21", "a22", "a23"]


def test_a_channel_in_the_middle_of_a_coarse_step_is_not_frozen():
    """Readings that repeat by chance are told from a channel that stops."""
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    rng = np.random.default_rng(12)
    run = prepare_run(measure(rng, twin, [], Measurement(duration=40.0)), twin)
    noise = twin.expected_noise(100.0).analogue
    step = 2.6 * float(noise[0])
    t = run.t[:, None]
    # Most readings differ from the one before, but not at rest.
    moving = 300.0 * step * np.maximum(np.sin(0.5 * t), 0.0) ** 2 + rng.uniform(-step, step, 12)
    longest, flagged = 0, 0
    for _ in range(30):
        readings = np.round((moving + noise * rng.standard_normal(moving.shape)) / step) * step
        for column in readings.T:
            changed = np.flatnonzero(np.diff(column) != 0.0)
            longest = max(longest, int(np.diff(changed).max()))
        flagged += len(frozen_stretches(replace(run, readings=readings), moving, step, noise))
    assert longest > 40
    assert flagged == 0
    readings[800:950, 7] = readings[800, 7]
    ((channel, start, stop),) = frozen_stretches(replace(run, readings=readings), moving, step, noise)
    assert (channel, start) == (7, pytest.approx(800, abs=5))
    assert stop == pytest.approx(950, abs=5)


@pytest.mark.parametrize(("coarse", "share"), [(1.3, 0.3), (2.6, 0.3), (2.6, 0.6), (4.0, 0.6)])
def test_chips_quieter_than_their_data_sheet_are_not_frozen_at_rest(coarse, share):
    """Where all chips are at rest between coarse steps none has stopped; one that holds while the others move has."""
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    rng = np.random.default_rng(12)
    run = prepare_run(measure(rng, twin, [], Measurement(duration=40.0)), twin)
    noise = twin.expected_noise(100.0).analogue
    step = coarse * float(noise[0])
    t = run.t[:, None]
    moving = 300.0 * step * np.maximum(np.sin(0.5 * t), 0.0) ** 2 + rng.uniform(-step, step, 12)
    readings = np.round((moving + share * noise * rng.standard_normal(moving.shape)) / step) * step
    longest = max(int(np.diff(np.flatnonzero(np.diff(column) != 0.0)).max()) for column in readings.T)
    assert longest > 100
    assert frozen_stretches(replace(run, readings=readings), moving, step, noise) == []
    readings[200:350, 7] = readings[200, 7]
    ((channel, start, stop),) = frozen_stretches(replace(run, readings=readings), moving, step, noise)
    assert (channel, start) == (7, 200)
    assert 350 <= stop < 355
