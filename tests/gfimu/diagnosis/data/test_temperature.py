"""Temperature in steps: what passes through them against the truth, and what it does to a diagnosis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from gfimu import AccelerometerArray
from gfimu.diagnosis import diagnose
from gfimu.diagnosis.data.rounding import between_steps
from sim.effects import make_effect
from sim.trials import Measurement, measure
from sim.twin import Twin

STEP = 1 / 16


def warming(t):
    return 25.0 + 3.0 * (1.0 - np.exp(-t / 12.0)) + 0.3 * np.sin(0.3 * t)


def rounded(values, step=STEP):
    return np.round(values / step) * step


def rms(values):
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.parametrize("rate", [10.0, 400.0])
def test_what_passes_through_the_steps_is_close_to_the_truth(rate):
    t = np.arange(0.0, 40.0, 1.0 / rate)
    truth = warming(t)
    found = between_steps(t, rounded(truth))
    assert np.abs(found - truth).max() < 0.6 * STEP
    assert rms(found - truth) < 0.25 * rms(rounded(truth) - truth)


def test_a_little_noise_makes_it_better_than_the_steps_still():
    rng = np.random.default_rng(1)
    t = np.arange(0.0, 40.0, 0.01)
    truth = warming(t)
    readings = rounded(truth + 0.005 * rng.standard_normal(len(t)))
    assert rms(between_steps(t, readings) - truth) < 0.5 * rms(readings - truth)


@pytest.mark.parametrize(
    "values",
    [
        np.full(500, 25.0),
        rounded(25.0 + 0.001 * np.arange(50)),  # one step is none
        25.0 + 0.01 * np.random.default_rng(2).standard_normal(500),
        rounded(25.0 + 0.2 * np.random.default_rng(3).standard_normal(500)),
    ],
    ids=["constant", "one step", "no steps", "noise larger than the steps"],
)
def test_what_has_no_steps_to_see_is_left_as_it_is(values):
    assert_array_equal(between_steps(np.arange(len(values)) / 100.0, values), values)


@pytest.mark.study
def test_a_strong_dependence_on_temperature_leaves_nothing_for_others():
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12", sample_rate=400.0)
    drawn = np.random.default_rng(21).standard_normal(12)
    sizes = {f"{name}_m_s2_K": float(size) for name, size in zip(twin.array.channels, drawn, strict=True)}
    hidden = make_effect("bias_temperature", sizes, twin.array)
    run = measure(np.random.default_rng(22), twin, [hidden], Measurement(duration=15.0, sample_rate=400.0))
    reference = {**run.reference, "temperature_degC": rounded(run.reference["temperature_degC"])}
    found = diagnose([replace(run, reference=reference)], twin)
    assert [cause.effect for cause in found.causes] == ["bias_temperature"]
