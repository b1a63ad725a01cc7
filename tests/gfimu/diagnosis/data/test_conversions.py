"""Readings at the times of their conversions, and clocks of chips that the marks leave open."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from gfimu.diagnosis import Run, predicted_by_reference, prepare_run
from gfimu.diagnosis.data.conversions import Conversions
from gfimu.diagnosis.data.run import smooth_rate
from gfimu.diagnosis.data.table.settling import settled
from gfimu.model.located.operators import moved
from gfimu.recording import Recording
from sim import SpinState
from sim.twin import Twin

TWIN = Twin.load("cube12_turntable")
CHIP = TWIN.array.chip_of_channel
T = np.arange(2000) / 100.0


class Swing:
    """A table that swings."""

    def at(self, t: NDArray[np.float64]) -> SpinState:
        w = 2.0 * np.pi * 0.8
        return SpinState(-6.0 / w * np.cos(w * t), 6.0 * np.sin(w * t), 6.0 * w * np.cos(w * t))


def recording(after: NDArray[np.float64], *, noise: float = 0.03, **metadata: object) -> Recording:
    """Return what chips read that convert so long after the rows (n, 4), s."""
    readings = np.empty((len(T), 12))
    for chip in range(4):
        mine, _ = TWIN.predict(Swing(), T + after[:, chip], start=0.0)
        readings[:, chip == CHIP] = mine[:, chip == CHIP]
    chance = np.random.default_rng(3)
    readings += noise * chance.standard_normal(readings.shape)
    tacho = Swing().at(T).rate + 0.005 * chance.standard_normal(len(T))
    return Recording(T, readings, TWIN.array.channels, {"tacho_rad_s": tacho}, metadata)


def excess(run: Run) -> float:
    """Rms of what the prediction by the reference misses, m/s²."""
    return float(np.std(run.readings - predicted_by_reference(TWIN, run)))


def test_readings_are_predicted_at_the_times_of_their_conversions():
    late = np.tile([-9e-3, 0.0, -4e-3, 13e-3], (len(T), 1))
    run = prepare_run(recording(late), TWIN)
    placed = replace(run, conversions=Conversions(late, np.zeros((2, *late.shape))))
    assert excess(run) > 0.06
    assert excess(placed) < 0.035


def test_a_recording_says_when_its_chips_convert_and_how_noisy_they_are():
    late = np.tile(-1.25e-3 + 16e-6 * np.arange(4), (len(T), 1))
    run = prepare_run(recording(late, output_data_rate_hz=400.0, read_spacing_s=16e-6), TWIN)
    np.testing.assert_allclose(run.conversions.after, late, atol=1e-9)
    assert run.output_data_rate == 400.0
    assert run.rows(10, 30).output_data_rate == 400.0
    assert run.rows(10, 30).conversions.after.shape == (20, 4)
    assert prepare_run(recording(late), TWIN).output_data_rate == pytest.approx(100.0)


def test_a_clock_that_the_marks_leave_open_is_found_beside_a_lag_of_all_and_a_wrong_calibration():
    ramp = np.linspace(-1.0, 1.0, len(T))
    late = np.full((len(T), 4), 1.5e-3)
    late[:, 1] += 2e-3 + 1e-3 * ramp
    seen = recording(late)
    seen = replace(seen, readings=1.01 * seen.readings + 0.3)
    unknown = np.zeros((2, len(T), 4))
    unknown[0, :, 1], unknown[1, :, 1] = 3e-3, 3e-3 * ramp
    run = replace(prepare_run(seen, TWIN), conversions=Conversions(np.zeros((len(T), 4)), unknown))
    found = settled(run, predicted_by_reference(TWIN, run), CHIP, smooth_rate(run, is_angle=False)).conversions
    np.testing.assert_allclose(found.after[:, 1], 2e-3 + 1e-3 * ramp, atol=4e-4)
    assert not found.after[:, [0, 2, 3]].any()
    assert not found.unknown.any()


def test_a_run_that_leaves_nothing_open_stays_as_it_is():
    run = prepare_run(recording(np.zeros((len(T), 4)), output_data_rate_hz=400.0), TWIN)
    assert settled(run, run.readings, CHIP, run.reference) is run


def test_smooth_values_are_moved_by_a_cubic():
    share = np.random.default_rng(3).uniform(-0.5, 0.5, len(T))
    values = np.sin(2 * np.pi * T)
    np.testing.assert_allclose(moved(values, share), np.sin(2 * np.pi * (T + 0.01 * share)), atol=2e-6)
