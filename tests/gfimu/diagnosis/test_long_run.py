"""A long recording is searched in part and judged whole."""

from __future__ import annotations

import numpy as np
import pytest

from gfimu import AccelerometerArray
from gfimu.diagnosis import Policy, diagnose, prepare_run, spread_over_runs, understand_any_length
from gfimu.diagnosis.data import stretch
from gfimu.diagnosis.search import long_run
from gfimu.recording import Recording
from sim.effects import make_effect
from sim.trials import Measurement, measure, random_profile
from sim.twin import Twin

FEW = Policy(most_searched=2)


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
    monkeypatch.setattr(stretch, "_DURATION", 6.0)


def counting(monkeypatch):
    """Return a list that takes the number of stretches of every search."""
    searched = []
    understand = long_run.understand

    def counted(some, *rest, **options):
        searched.append(len(some))
        return understand(some, *rest, **options)

    monkeypatch.setattr(long_run, "understand", counted)
    return searched


@pytest.mark.study
def test_a_cause_found_in_part_is_measured_on_all(short_stretches, monkeypatch):
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    hidden = make_effect("table_tilt", {"x_rad": 2e-3, "y_rad": -1e-3})
    recording = measure(np.random.default_rng(11), twin, [hidden], Measurement(duration=30.0))
    whole = diagnose([recording], twin)
    searched = counting(monkeypatch)
    part = diagnose([recording], twin, policy=FEW)
    assert searched == [2]
    for found in (whole, part):
        assert [cause.effect for cause in found.causes] == ["table_tilt"]
    one, other = whole.causes[0], part.causes[0]
    for key, std in one.std.items():
        assert other.std[key] == pytest.approx(std, rel=0.1)  # not that of two stretches in five
        assert other.parameters[key] == pytest.approx(one.parameters[key], abs=0.5 * std)


@pytest.mark.study
def test_nothing_is_found_in_a_long_quiet_recording(short_stretches):
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    recording = measure(np.random.default_rng(12), twin, [], Measurement(duration=30.0))
    assert diagnose([recording], twin, policy=FEW).verdict == "nothing_found"


@pytest.mark.study
def test_what_has_no_name_is_described_on_some_stretches_and_fitted_to_all(short_stretches):
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    rng = np.random.default_rng(13)
    motion = random_profile(rng, 30.0)
    run = measure(rng, twin, [], Measurement(duration=30.0), motion=motion)
    readings = run.readings.copy()
    readings[:, 4] += 0.004 * motion.at(run.t_s).rate ** 3
    recording = Recording.from_arrays(run.t_s, readings, twin.array, reference=run.reference)
    found = diagnose([recording], twin, policy=FEW)
    assert found.verdict == "unknown"
    assert any(effect.name == "unlisted" for effect in found.twin.effects)
    assert found.gain.share_of_excess_removed > 0.9


@pytest.mark.study
def test_every_run_of_a_long_recording_has_the_noise_of_its_own_reference(short_stretches, monkeypatch):
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    rng = np.random.default_rng(14)
    tachos = (0.02, 0.05)
    runs = [
        prepare_run(measure(rng, twin, [], Measurement(duration=30.0, tacho_noise=noise)), twin) for noise in tachos
    ]
    stretches = stretch.make_stretches(twin, runs, [[], []])
    searched = counting(monkeypatch)
    found = understand_any_length(stretches, Policy(most_searched=4), lambda share, text: None)
    assert searched == [4]
    for one, levels in zip(stretches, found.explanation.best.point.levels, strict=True):
        assert levels.white[-1] == pytest.approx(tachos[one.index], rel=0.1)
