"""Recordings made ready: what is taken out of them, and what is kept of each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from core_cases import lively, small_twin

from gfimu.diagnosis import PreparedRuns
from sim.effects import make_effect
from sim.trials import Measurement, measure

TWIN = small_twin("cube12")


def recording(*effects, seed=1):
    return measure(np.random.default_rng(seed), TWIN, effects, Measurement(8.0, 50.0), motion=lively())


def predict(model, run):
    return model.predict(lively(), run.t, mounting=run.mounting)[0]


def test_spikes_of_the_reference_and_of_a_channel_are_left_out_and_counted():
    one = recording()
    readings, reference = one.readings.copy(), one.reference["tacho_rad_s"].copy()
    readings[100, 2] += 30.0
    reference[[50, 200]] += 4.0
    spoiled = replace(one, readings=readings, reference={**one.reference, "tacho_rad_s": reference})
    found = PreparedRuns.build([spoiled, one], TWIN, ["first", "second"], predict)
    assert [run.name for run in found.runs] == ["first", "second"]
    first, second = found.runs
    assert np.flatnonzero(~first.reference_valid).tolist() == [50, 200]
    assert not first.reference[[50, 200]].any()
    assert np.argwhere(~first.valid).tolist() == [[100, 2]]
    assert second.valid.all()
    assert second.reference_valid.all()
    assert found.spikes == 3
    assert not found.rounded
    assert found.effects == [[], []]


def test_faults_stay_with_their_run_and_are_explained_once():
    coarse = [make_effect("coarse_resolution", {"step_m_s2": step}) for step in (0.3, 0.6)]
    found = PreparedRuns.build([recording(), *(recording(one) for one in coarse)], TWIN, ["a", "b", "c"], predict)
    assert found.effects[0] == []
    steps = [effects[0].parameters["step_m_s2"] for effects in found.effects[1:]]
    assert steps == pytest.approx([0.3, 0.6])
    assert "0.3 m/s²" in found.why["coarse_resolution"]  # of the first run that has it
    assert found.rounded


def test_a_model_that_rounds_makes_every_run_rounded():
    twin = TWIN.extended([make_effect("saturation", {"limit_m_s2": 150.0})])
    assert PreparedRuns.build([recording()], twin, ["a"], predict).rounded
