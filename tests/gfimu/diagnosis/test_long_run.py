"""A long recording is searched in part and judged whole."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from gfimu.diagnosis import diagnose, long_run, stretches, surrogate
from gfimu.diagnosis.data.run import prepare_run
from gfimu.diagnosis.long_run import spread_over_runs
from gfimu.diagnosis.nuisances import settle_noise
from gfimu.geometry.array import AccelerometerArray
from gfimu.recording import Recording
from sim.campaign import Measurement, measure, random_profile
from sim.effects import make_effect
from sim.twin import Twin


@pytest.mark.parametrize(
    ("runs", "most", "chosen"),
    [
        ([0] * 5, 8, [0, 1, 2, 3, 4]),
        ([0] * 28, 8, [0, 4, 8, 12, 15, 19, 23, 27]),
        ([0] * 6 + [1], 4, [0, 2, 5, 6]),
        ([0, 1, 2], 1, [0, 1, 2]),
    ],
)
def test_stretches_are_spread_and_every_run_gives_one(runs, most, chosen):
    assert spread_over_runs(runs, most) == chosen


@pytest.fixture
def short_stretches(monkeypatch):
    monkeypatch.setattr(stretches, "SEGMENT_DURATION", 6.0)


def test_a_cause_found_in_part_is_measured_on_all(short_stretches, monkeypatch):
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    hidden = make_effect("table_tilt", {"x_rad": 2e-3, "y_rad": -1e-3})
    recording = measure(np.random.default_rng(11), twin, [hidden], Measurement(duration=30.0))
    whole = diagnose([recording], twin)
    searched = []
    explain = long_run.explain

    def counted(segments, *rest, **keywords):
        searched.append(len(segments))
        return explain(segments, *rest, **keywords)

    monkeypatch.setattr(long_run, "explain", counted)
    monkeypatch.setattr(long_run, "MOST_SEARCHED", 2)
    part = diagnose([recording], twin)
    assert searched == [2]
    for found in (whole, part):
        assert [cause.effect for cause in found.causes] == ["table_tilt"]
    one, other = whole.causes[0], part.causes[0]
    for key, std in one.std.items():
        assert other.std[key] == pytest.approx(std, rel=0.1)  # not that of two stretches in five
        assert other.parameters[key] == pytest.approx(one.parameters[key], abs=0.5 * std)


def test_nothing_is_found_in_a_long_quiet_recording(short_stretches, monkeypatch):
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    monkeypatch.setattr(long_run, "MOST_SEARCHED", 2)
    recording = measure(np.random.default_rng(12), twin, [], Measurement(duration=30.0))
    assert diagnose([recording], twin).verdict == "nothing_found"


def test_what_has_no_name_is_described_on_some_stretches_and_fitted_to_all(short_stretches, monkeypatch):
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    rng = np.random.default_rng(13)
    motion = random_profile(rng, 30.0)
    run = measure(rng, twin, [], Measurement(duration=30.0), motion=motion)
    readings = run.readings.copy()
    readings[:, 4] += 0.004 * motion.at(run.t_s).rate ** 3
    monkeypatch.setattr(long_run, "MOST_SEARCHED", 2)
    monkeypatch.setattr(surrogate, "MOST_SEARCHED", 2)
    found = diagnose([Recording.from_arrays(run.t_s, readings, twin.array, reference=run.reference)], twin)
    assert found.verdict == "unknown"
    assert any(effect.name == "unknown" for effect in found.twin.effects)
    assert found.gain.share_of_excess_removed > 0.9


def test_the_noise_of_a_long_recording_is_learnt_from_some_stretches_of_each_run(short_stretches, monkeypatch):
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    rng = np.random.default_rng(14)
    tachos = (0.02, 0.05)
    runs = [
        prepare_run(measure(rng, twin, [], Measurement(duration=30.0, tacho_noise=noise)), twin) for noise in tachos
    ]
    segments = stretches.make_segments(twin, runs)
    for segment in segments:
        segment.prepare_weights()
    fixed = [()] * len(segments)
    monkeypatch.setattr(long_run, "MOST_SEARCHED", 4)
    learnt = []
    monkeypatch.setattr(
        long_run, "settle_noise", lambda some, *rest: (learnt.append(len(some)), settle_noise(some, *rest))
    )
    long_run.settle_noise_of_any_length(segments, (), fixed)
    assert learnt == [4]
    for segment in segments:
        assert segment.levels.white[-1] == pytest.approx(tachos[segment.index], rel=0.1)
        assert_array_equal(segment.inverse_variance, 1.0 / segment.levels.white**2)
