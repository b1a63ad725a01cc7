"""Steps that are coarse beside the noise: channels read the same at rest for long, and none is stuck."""

import numpy as np
import pytest

import gfimu
from gfimu import AccelerometerArray, SensorErrors

ARRAY = AccelerometerArray.load("cube12")
LSB = 0.0039 * 9.80665


def test_equal_readings_prove_nothing_where_the_step_is_coarse():
    fine, coarse = (SensorErrors.from_parts(ARRAY, 100.0, step=step) for step in (0.0, 8.0 * LSB))
    assert fine.stuck_after == SensorErrors.from_parts(ARRAY, 100.0, step=0.5 * LSB).stuck_after > 0
    assert coarse.stuck_after == 0
    assert np.sqrt(coarse.noise_std**2 - fine.noise_std**2) == pytest.approx(LSB * np.sqrt((64.0 - 1.0) / 12.0))


def test_a_recording_of_coarse_steps_is_estimated_from_all_its_channels():
    run = gfimu.simulate("paper_run", seed=3, changes=["sensor.full_resolution=false"])
    at_rest = run.readings[:300]
    assert sum(len(np.unique(column)) == 1 for column in at_rest.T) >= 4
    found = gfimu.estimate(run, method="filter", rest_bias=True)
    assert found.metadata["channels"]["stuck"] == {}
    assert np.sqrt(np.nanmean((found.omega[:, 2] - run.reference["tacho_rad_s"]) ** 2)) < 0.3
