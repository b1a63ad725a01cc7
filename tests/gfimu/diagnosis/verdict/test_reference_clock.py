"""What a verdict says of the clock of a reference that was aligned before."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from made_diagnoses import made_diagnosis

from gfimu import NamedCause
from gfimu.diagnosis import ReferenceClock, with_reference_clock
from sim.twin import Twin

TWIN = Twin.load("cube12_turntable")
CLOCK = ReferenceClock(offset_s=-3.05, offset_std_s=0.002, rate_error=0.003, rate_error_std=2e-5)


def test_a_rate_error_that_was_taken_off_is_a_cause():
    found = with_reference_clock(made_diagnosis("nothing_found"), CLOCK, ["clock_error"], TWIN)
    assert found.verdict == "explained"
    [cause] = found.causes
    assert (cause.effect, cause.parameters, cause.std) == ("clock_error", {"ratio": 0.003}, {"ratio": 2e-5})
    assert found.sentences[0] == (
        "By the alignment of the two the channels' clock was 3.05 ± 0.002 s behind the reference's at the first sample "
        "and is 0.3 ± 0.002 % fast against it. The extended twin does not hold this: it is of the aligned recording."
    )
    assert json.loads(found.to_json())["reference_clock"] == CLOCK.to_dict()


def test_a_displaced_reference_is_late_by_minus_the_offset():
    found = with_reference_clock(made_diagnosis("explained"), CLOCK, ["tacho_latency"], TWIN)
    assert [cause.effect for cause in found.causes][:1] == ["tacho_latency"]
    assert found.causes[0].parameters == {"delay_s": 3.05}
    assert found.verdict == "explained"


def test_an_offset_of_two_files_is_no_cause():
    before = made_diagnosis("nothing_found")
    found = with_reference_clock(before, CLOCK, [], TWIN)
    assert (found.verdict, found.causes) == ("nothing_found", ())
    assert found.sentences[: len(before.sentences)] == before.sentences
    assert json.loads(before.to_json())["reference_clock"] is None


def test_a_clock_error_that_was_diagnosed_is_no_surer_than_the_alignment():
    plain = made_diagnosis("nothing_found")
    named = NamedCause("clock_error", {"ratio": 0.0031}, {"ratio": 1e-6}, 0.99)
    found = with_reference_clock(replace(plain, verdict="explained", causes=(named,)), CLOCK, [], TWIN)
    assert found.causes[0].std["ratio"] == pytest.approx(2e-5, rel=0.01)


def test_what_the_alignment_leaves_uncertain_is_no_cause():
    lag = NamedCause("sensor_lag", {"time_constant_s": 0.004}, {"time_constant_s": 1e-4}, 0.9)
    late = NamedCause("clock_error", {"ratio": -3e-5}, {"ratio": 1e-6}, 0.6)
    ambiguous = replace(made_diagnosis("nothing_found"), verdict="ambiguous", causes=(lag, late), twin=None)
    found = with_reference_clock(ambiguous, CLOCK, [], TWIN)
    assert (found.verdict, found.causes, found.twin) == ("nothing_found", (), TWIN)
    assert "sensor_lag or clock_error would be within" in found.sentences[0]
    longer = replace(lag, parameters={"time_constant_s": 0.02})
    kept = with_reference_clock(replace(ambiguous, causes=(longer, late)), CLOCK, [], TWIN)
    assert kept.verdict == "ambiguous"
    assert [cause.effect for cause in kept.causes] == ["sensor_lag", "clock_error"]
