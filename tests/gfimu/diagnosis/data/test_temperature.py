"""Temperature in steps: what it does to a diagnosis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gfimu import AccelerometerArray
from gfimu.diagnosis import diagnose
from sim.effects import make_effect
from sim.trials import Measurement, measure
from sim.twin import Twin


def rounded(values, step=1 / 16):
    return np.round(values / step) * step


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
