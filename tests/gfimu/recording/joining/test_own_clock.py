"""A reference seconds away from its channels is found and moved; one that is near stays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gfimu import AccelerometerArray
from gfimu.recording import displaced_reference
from sim.effects import make_effect
from sim.scenarios import Scenario
from sim.simulation import simulate
from sim.trials import Measurement, measure
from sim.twin import Twin

TWIN = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")


def run_with(shift: int, ratio: float = 0.0, seed: int = 3):
    """A table's run whose tachometer stands so many rows later."""
    effects = [make_effect("clock_error", {"ratio": ratio})] if ratio else []
    run = measure(np.random.default_rng(seed), TWIN, effects, Measurement(duration=30.0))
    tacho = np.full(len(run), np.nan)
    rows = np.arange(max(shift, 0), len(run) + min(shift, 0))
    tacho[rows] = run.reference["tacho_rad_s"][rows - shift]
    return replace(run, reference={"tacho_rad_s": tacho})


def test_a_reference_near_its_channels_stays():
    assert displaced_reference(run_with(0)) is None
    assert displaced_reference(run_with(20)) is None
    assert displaced_reference(run_with(0, ratio=0.01)) is None  # `clock_error` of the diagnosis


@pytest.mark.parametrize("shift", [305, -240])
def test_a_displaced_reference_is_moved_and_keeps_its_rate(shift):
    found = displaced_reference(run_with(shift, ratio=0.004))
    assert found is not None
    late, std = found.offset_at_start
    assert -late == pytest.approx(0.01 * shift, abs=4.0 * std)
    assert found.clock["rate_error"] == pytest.approx(0.004, abs=4.0 * found.clock["rate_error_std"])
    assert found.is_far
    assert found.has_rate_error
    # Of the recording with the rate error left in, only that is left: it begins as it would without a shift.
    moved, near = found.by_own_rate.reference["tacho_rad_s"], run_with(0, ratio=0.004).reference["tacho_rad_s"]
    both = np.isfinite(moved) & np.isfinite(near)
    assert both.sum() > 2000
    assert np.sqrt(np.mean((moved - near)[both] ** 2)) < 0.08


def test_the_clock_of_a_wheels_tachometer_shows_beside_a_shaking_hub():
    scenario = Scenario.load("wheel", changes=["sensor.errors=false"])
    fast = replace(scenario, effects=(make_effect("clock_error", {"ratio": 0.003}),))
    found = displaced_reference(simulate(fast, seed=3), rates=True)
    assert found is not None
    assert found.clock["rate_error"] == pytest.approx(0.003, abs=5.0 * found.clock["rate_error_std"])
    assert found.clock["rate_error_std"] < 1e-4
    assert displaced_reference(simulate(scenario, seed=3), rates=True) is None
