"""The least detectable fault in closed form: published figures, and what the monitor achieves."""

import numpy as np
import pytest
from watched_world import CALIBRATED, CUBE, GRAVITY, readings

from gfimu.errors import InputError
from gfimu.geometry.array import AccelerometerArray
from gfimu.integrity import MonitorPolicy, detectable_faults, watch_channels
from gfimu.rate.sensing import SensorErrors

MG = 1e-3 * GRAVITY


def test_figures_of_the_cube():
    faults = detectable_faults(CUBE, CALIBRATED, 100.0)
    np.testing.assert_allclose(faults.detected / MG, [4.0, 4.0, 4.7] * 4, atol=0.06)
    np.testing.assert_allclose(faults.alpha_error * MG, 0.035, atol=5e-4)
    assert np.isinf(detectable_faults(CUBE, CALIBRATED, 100.0, unknown_rate=True).detected).all()


def test_eight_chips_protect_better_than_four_and_need_no_rate():
    array = AccelerometerArray.load("corners8")
    errors = SensorErrors.from_parts(array, 100.0)
    known = detectable_faults(array, errors, 100.0)
    single = detectable_faults(array, errors, 100.0, unknown_rate=True)
    assert known.detected.max() < detectable_faults(CUBE, CALIBRATED, 100.0).detected.max()
    assert np.isfinite(single.detected).all()
    assert (single.detected > known.detected).all()


def test_chips_with_two_axes_are_not_separated_from_their_partners():
    array = AccelerometerArray.load("nap_3_2_2_2")
    faults = detectable_faults(array, SensorErrors.from_parts(array, 100.0), 100.0)
    assert np.isfinite(faults.isolated[:3]).all()
    assert np.isinf(faults.isolated[3:]).all()
    assert np.isfinite(faults.detected).all()


def test_four_times_the_time_halves_the_fault():
    exact = MonitorPolicy(bias_std=1e-9, bias_walk=1e-18)
    one, four = (detectable_faults(CUBE, CALIBRATED, 100.0, duration=time, policy=exact) for time in (1.0, 4.0))
    np.testing.assert_allclose(one.detected, 2.0 * four.detected)


def test_the_monitor_is_not_far_from_the_formula():
    size = 1.5 * detectable_faults(CUBE, CALIBRATED, 100.0).isolated  # the bias before is not known exactly either
    found = 0
    for seed in range(12):
        t, y, _ = readings("rest", 50 + seed)
        y[t >= 15.0, seed] += size[seed]
        health = watch_channels(CUBE, t, y, CALIBRATED)
        found += any(f.channels == (CUBE.channels[seed],) and f.found_s < 18.0 for f in health.faults)
    assert found >= 11


def test_bad_figures_are_refused():
    with pytest.raises(InputError, match="positive"):
        detectable_faults(CUBE, CALIBRATED, 0.0)
