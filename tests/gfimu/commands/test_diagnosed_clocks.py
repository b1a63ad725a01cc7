"""What `gfimu diagnose` hands to the diagnosis where the reference has a clock of its own, and what it adds after."""

from __future__ import annotations

import importlib
from dataclasses import replace

import numpy as np
import pytest

import gfimu
from gfimu import NamedCause
from gfimu.recording import ReferenceSeries
from sim.trials import Measurement, measure
from sim.twin import Twin
from tests.gfimu.diagnosis.made_diagnoses import made_diagnosis

TWIN = Twin.load("cube12_turntable")
NOTHING = replace(made_diagnosis("nothing_found"), twin=TWIN, runs=())
CLOCK_ERROR = NamedCause("clock_error", {"ratio": 0.0035}, {"ratio": 1e-6}, 0.99)


@pytest.fixture
def explained(monkeypatch):
    """Recordings that were diagnosed, one list per call; each call returns the next of ``results``."""
    calls, results = [], [NOTHING]

    def explain(recordings, model, **options):
        calls.append(list(recordings))
        return results[min(len(calls), len(results)) - 1]

    monkeypatch.setattr(importlib.import_module("gfimu.diagnosis.diagnose"), "diagnose", explain)
    return calls, results


def two_files():
    run = measure(np.random.default_rng(2), TWIN, (), Measurement(duration=25.0))
    times = np.arange(0.003, 24.0, 0.05)
    tacho = np.interp(times, run.t_s, run.reference["tacho_rad_s"])
    series = ReferenceSeries("tacho.csv", (times - 3.05) / 1.0035, {"tacho_rad_s": tacho})
    return run, replace(run, reference={}), series


def test_a_rate_error_that_the_diagnosis_names_is_left_in(explained):
    calls, results = explained
    results[0] = replace(NOTHING, verdict="explained", causes=(CLOCK_ERROR,))
    _, channels, series = two_files()
    found = gfimu.diagnose(channels, TWIN, reference=series)
    [[used]] = calls
    np.testing.assert_array_equal(used.t_s, channels.t_s)
    # At the reference's own rate from the first sample on: 20 s later it is 70 ms behind.
    read_at = used.reference["tacho_t_s"]
    later = np.nanargmin(np.abs(read_at - 20.0))
    value = used.reference["tacho_rad_s"][later]
    place = int(np.flatnonzero(series.columns["tacho_rad_s"] == value)[0])
    assert read_at[later] == pytest.approx((1.0035 * series.t_s[place] + 3.05) / 1.0035, abs=5e-3)
    assert found.reference_clock.rate_error == pytest.approx(0.0035, abs=3e-4)
    assert [cause.effect for cause in found.causes] == ["clock_error"]
    assert found.causes[0].std["ratio"] >= found.reference_clock.rate_error_std


def test_one_that_it_does_not_name_is_taken_off_and_a_cause(explained):
    calls, _ = explained
    _, channels, series = two_files()
    found = gfimu.diagnose(channels, TWIN, reference=series)
    [_, [used]] = calls
    assert np.ptp(used.t_s) == pytest.approx(np.ptp(channels.t_s) / 1.0035, abs=0.01)
    assert found.verdict == "explained"
    [cause] = found.causes
    assert cause.effect == "clock_error"
    assert cause.parameters["ratio"] == pytest.approx(0.0035, abs=3e-4)


def test_a_recording_with_its_reference_in_place_is_diagnosed_as_it_is(explained):
    calls, _ = explained
    run, _, _ = two_files()
    found = gfimu.diagnose(run, TWIN)
    assert calls == [[run]] or calls[0][0] is run
    assert found is NOTHING
