"""Clipping at rails: a few counts wide, of one side, of one channel or chip, in every turn; and channels that stop."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from gfimu import AccelerometerArray, Chip
from gfimu.diagnosis import check_integrity, diagnose, prepare_run
from gfimu.recording import rails_of
from sim import SplineSpin
from sim.effects import make_effect
from sim.trials import Measurement, measure
from sim.twin import Twin

STEP = 3.9e-3 * 9.80665  # m/s²
TWIN = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
NAMES = TWIN.array.channels


def none(rng, count):
    return np.zeros(count)


def rare(rng, count):
    """One in 45 up to ten counts beyond: 13 of 590 on a real rail."""
    return np.where(rng.random(count) < 1 / 45, rng.integers(1, 11, count), 0)


def noisy(rng, count):
    return rng.normal(0.0, 2.0, count)


@functools.cache
def swinging():
    """A table whose rate swings every 2.5 s, so that centripetal readings peak for a second each time."""
    t = np.arange(-2.0, 22.0, 5e-3)
    rate = np.clip(t - 1.5, 0.0, 1.0) * (9.0 + 3.0 * np.sin(2 * np.pi * t / 2.5))
    motion = SplineSpin.through(t, gaussian_filter1d(rate, 30.0))
    return measure(np.random.default_rng(11), TWIN, [], Measurement(duration=20.0), motion=motion), motion


def clipped(upper, lower, scatter):
    """Recording with the upper and lower sides of channels clipped, levels by channel in m/s², noise in counts."""
    recording, _ = swinging()
    rng, readings = np.random.default_rng(3), recording.readings.copy()
    for levels, sign in ((upper, 1), (lower, -1)):
        for channel, level in levels.items():
            column = readings[:, NAMES.index(channel)]
            rail = np.round(level / STEP) * STEP
            over = sign * column > sign * rail
            assert over.sum() > 100
            column[over] = rail + sign * np.round(scatter(rng, int(over.sum()))) * STEP
    return replace(recording, readings=readings)


def checked(recording):
    run = prepare_run(recording, TWIN)
    prediction = TWIN.predict(swinging()[1], run.t)[0]
    return check_integrity(TWIN, run, prediction), prediction


CHIP = {"a41": 4.0, "a42": 4.0, "a43": 4.0}
WORLDS = {
    "one channel, upper side": ({"a31": 4.5}, {}),
    "one channel, lower side": ({}, {"a11": -5.0}),
    "one chip, upper side": (CHIP, {}),
    "unlike above and below": ({"a31": 4.5, "a22": 4.5, "a41": 4.5, "a42": 4.5}, {"a11": -5.5, "a12": -5.5}),
    "each channel its own": ({"a31": 4.5, "a22": 5.5}, {"a11": -3.5}),
}


@pytest.mark.parametrize("scatter", [none, rare, noisy])
@pytest.mark.parametrize("world", WORLDS)
def test_a_rail_is_saturation_with_its_side_and_level_and_no_stuck_channel(world, scatter):
    upper, lower = WORLDS[world]
    report, prediction = checked(clipped(upper, lower, scatter))
    (effect,) = report.effects
    assert effect.name == "saturation"
    levels = {f"{name}_upper_m_s2": level for name, level in upper.items()}
    levels |= {f"{name}_lower_m_s2": level for name, level in lower.items()}
    limit = effect.parameters["limit_m_s2"]
    assert limit == pytest.approx(np.median(np.abs([*levels.values()])), abs=2 * STEP)
    found = {key: value for key, value in effect.parameters.items() if key != "limit_m_s2"}
    assert found == pytest.approx(levels, abs=2 * STEP)
    # What is on a rail is left out, what is below it is not.
    for sides, sign in ((upper, 1), (lower, -1)):
        for name, level in sides.items():
            valid, truth = report.run.valid[:, NAMES.index(name)], sign * prediction[:, NAMES.index(name)]
            assert not valid[truth > sign * level + 3 * STEP].any()
            below = truth < sign * level - 10 * STEP
            assert valid[below].mean() > 0.98 if below.any() else name == "a43"  # it reads gravity, always beyond


def test_rails_of_all_channels_at_one_level_are_one_limit():
    top = {name: 4.5 for name in NAMES if swinging()[0].readings[:, NAMES.index(name)].max() > 5.0}
    bottom = {name: -4.5 for name in NAMES if swinging()[0].readings[:, NAMES.index(name)].min() < -5.0}
    report, _ = checked(clipped(top, bottom, rare))
    (effect,) = report.effects
    assert effect.name == "saturation"
    assert effect.parameters == {"limit_m_s2": pytest.approx(4.5, abs=STEP)}


@pytest.mark.study
def test_the_extended_twin_clips_as_the_recording_does():
    recording = clipped({"a31": 4.5}, {}, rare)
    found = diagnose([recording], TWIN)
    assert (found.verdict, [cause.effect for cause in found.causes]) == ("explained", ["saturation"])
    assert "a31 at +4.5" in found.causes[0].why
    saved = Twin.from_dict(found.twin.to_dict())
    again = diagnose([recording], saved)
    assert (again.verdict, again.causes) == ("nothing_found", ())


@pytest.mark.parametrize("gain", [0.93, 1.07])
def test_a_rail_that_is_reached_once_is_no_stuck_channel(gain):
    """577 samples at one count and 13 up to ten counts beyond, below what the simulation predicts or above."""
    t = np.arange(-2.0, 32.0, 5e-3)
    rate = 10.0 * np.clip((t - 6.0) / 4.0, 0.0, 1.0) * np.clip((20.0 - t) / 4.0, 0.0, 1.0)
    motion = SplineSpin.through(t, gaussian_filter1d(rate, 40.0))
    recording = measure(np.random.default_rng(1), TWIN, [], Measurement(duration=24.0), motion=motion)
    readings, place = recording.readings.copy(), NAMES.index("a31")
    counts = np.round(gain * readings[:, place] / STEP)
    level = np.partition(counts, -590)[-590]
    over = np.flatnonzero(counts >= level)[:590]
    counts = np.minimum(counts, level)
    counts[over[30::45]] += np.arange(1, 11).repeat(2)[: len(over[30::45])]
    readings[:, place] = counts * STEP
    run = prepare_run(replace(recording, readings=readings), TWIN)
    report = check_integrity(TWIN, run, TWIN.predict(motion, run.t)[0])
    assert [effect.name for effect in report.effects] == ["saturation"]
    assert not report.run.valid[counts >= level, place].any()


@pytest.mark.parametrize("seed", range(3))
def test_a_channel_that_stops_at_an_ordinary_value_is_stuck(seed):
    recording, _ = swinging()
    start = float(np.random.default_rng(seed).uniform(3.0, 16.0))
    readings = recording.readings.copy()
    frozen = (recording.t_s >= start) & (recording.t_s < start + 1.3)
    readings[frozen, 6] = readings[np.argmax(frozen) - 1, 6]
    report, _ = checked(replace(recording, readings=readings))
    (effect,) = report.effects
    assert (effect.name, effect.parameters["channel"]) == ("stuck_channel", "a31")


def test_a_channel_that_stops_at_its_peak_is_stuck():
    """Once, at its largest value but one: the noise of other peaks is read above it."""
    recording, _ = swinging()
    readings = recording.readings.copy()
    peak = int(np.argmax(readings[:1500, 6]))
    readings[peak : peak + 120, 6] = readings[peak - 3, 6]
    report, _ = checked(replace(recording, readings=readings))
    assert [effect.name for effect in report.effects] == ["stuck_channel"]


LOWEST = float(np.min(swinging()[0].readings[:, 6]))
FREEZES = {
    "at its last value": (0.2, 0.5, None),
    "for most of the run": (0.25, 0.85, None),
    "from the start, at zero": (0.0, 0.7, 0.0),
    "to the end": (0.5, 1.0, None),
    "throughout": (0.0, 1.0, 1.0),
    "near its largest value": (0.3, 0.6, float(np.max(swinging()[0].readings[:, 6])) - 6 * STEP),
    "near its smallest value": (0.5, 0.7, LOWEST + 6 * STEP),
}


@pytest.mark.parametrize("freeze", FREEZES)
@pytest.mark.parametrize("chip", [False, True])
def test_a_channel_that_freezes_within_its_range_is_stuck_for_that_time(freeze, chip):
    """Alone, or with the two others of its chip; and no rail of the readings alone is found either."""
    begin, end, value = FREEZES[freeze]
    recording, _ = swinging()
    readings, n = recording.readings.copy(), len(recording)
    rows = slice(round(begin * n), round(end * n))
    places = [6, 7, 8] if chip else [6]
    for place in places:
        level = (
            readings[max(rows.start - 1, 0), place] if value is None or place != 6 else np.round(value / STEP) * STEP
        )
        readings[rows, place] = level
    report, _ = checked(replace(recording, readings=readings))
    (effect,) = report.effects
    assert effect.name == "stuck_channel"
    assert np.atleast_1d(effect.parameters["channel"]).tolist() == [NAMES[place] for place in places]
    assert effect.parameters["start_s"] == pytest.approx(recording.t_s[rows.start], abs=0.05)
    assert effect.parameters["stop_s"] == pytest.approx(recording.t_s[min(rows.stop, n - 1)], abs=0.05)
    assert not any(rails_of(readings[:, place]) for place in places)


def test_a_recording_that_repeats_its_last_frame_has_no_stuck_channel():
    recording, _ = swinging()
    readings = recording.readings.copy()
    readings[900:1000] = readings[900]
    report, _ = checked(replace(recording, readings=readings))
    assert "stuck_channel" not in {effect.name for effect in report.effects}


def test_saturation_of_single_sides_clips_only_those():
    effect = make_effect("saturation", {"limit_m_s2": 3.0, "a11_upper_m_s2": 3.0}, TWIN.array)
    (step,) = TWIN.world([effect]).data_steps
    readings = np.array([[9.0, 9.0] + [0.0] * 10, [-9.0, -9.0] + [0.0] * 10])
    clipped_now = step(np.arange(2.0), readings, np.random.default_rng(0))
    assert clipped_now[:, :2].tolist() == [[3.0, 9.0], [-9.0, -9.0]]


@pytest.mark.parametrize("scatter", [none, rare, noisy])
def test_a_rig_of_one_chip_that_clips_in_every_turn_on_one_side(scatter):
    """No other channel reaches a limit; and the chip is 7 % further out than its twin has it."""
    one, true = (
        Twin(array=AccelerometerArray("one", (Chip("a", np.array([arm, 0.0, 0.0]), np.eye(3)),)), array_name="one")
        for arm in (0.05, 0.0535)
    )
    motion = swinging()[1]
    recording = measure(np.random.default_rng(2), true, [], Measurement(duration=20.0), motion=motion)
    readings, rail = recording.readings.copy(), round(-5.0 / STEP) * STEP
    over = readings[:, 0] < rail
    readings[over, 0] = rail - np.round(scatter(np.random.default_rng(3), int(over.sum()))) * STEP
    run = prepare_run(replace(recording, readings=readings), one)
    report = check_integrity(one, run, one.predict(motion, run.t)[0])
    (effect,) = report.effects
    assert effect.name == "saturation"
    assert effect.parameters["a1_lower_m_s2"] == pytest.approx(-5.0, abs=2 * STEP)
    assert report.run.valid[over, 0].mean() < 0.01  # but for the tail of its noise
