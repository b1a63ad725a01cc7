"""The reference of a run: its column by the twin's drive, repeats left out, gaps too long to bridge, its noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gfimu import InputError
from gfimu.base.difference_noise import difference_noise
from gfimu.diagnosis import time_grid
from gfimu.diagnosis.data.reference import (
    BRIDGED_GAP,
    REFERENCE_COLUMNS,
    driving_reference,
    reference_on_grid,
    unreferenced,
)
from gfimu.recording import Recording
from sim.twin import Twin

TWIN = Twin.load("cube12_turntable")
T = np.arange(1000) / 100.0


def recorded(**reference):
    return Recording.from_arrays(T, np.zeros((len(T), TWIN.array.n_channels)), TWIN.array, reference=reference)


def test_the_noise_of_a_smooth_reference_is_that_of_its_third_differences():
    noise = 0.02 * np.random.default_rng(1).standard_normal(len(T))
    assert difference_noise(1.0 + 3.0 * T - 0.2 * T**2 + noise) == pytest.approx(0.02, rel=0.1)


def test_values_that_a_slower_reference_repeats_are_left_out():
    slow = np.repeat(np.random.default_rng(2).standard_normal(len(T) // 5), 5)
    column, drive = driving_reference(recorded(tacho_rad_s=slow), TWIN, "run")
    assert column == REFERENCE_COLUMNS["tacho"]
    assert np.isfinite(drive).reshape(-1, 5).sum(axis=1).tolist() == [1] * (len(T) // 5)
    values, valid, late = reference_on_grid(recorded(tacho_rad_s=slow), column, drive, time_grid(T))
    np.testing.assert_array_equal(values[valid], slow[::5])
    assert late is None


def test_a_twin_driven_by_another_column_names_it():
    other = replace(TWIN, drive_source="angle")
    with pytest.raises(InputError, match=r"run: column angle_rad is missing.*set source = 'tacho'"):
        driving_reference(recorded(tacho_rad_s=T), other, "run")


def test_short_gaps_are_bridged_and_long_ones_are_not():
    valid = np.ones(len(T), dtype=bool)
    valid[300 : 300 + int(0.8 * BRIDGED_GAP * 100)] = False
    valid[600 : 600 + int(2.0 * BRIDGED_GAP * 100)] = False
    assert np.flatnonzero(unreferenced(valid, 0.01)).tolist() == list(range(600, 600 + int(2.0 * BRIDGED_GAP * 100)))
