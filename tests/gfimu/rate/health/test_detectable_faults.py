"""The least detectable fault in closed form: published figures, and what the monitor achieves."""

import numpy as np
import pytest
from watched_world import CALIBRATED, CUBE, GRAVITY, readings

from gfimu import AccelerometerArray, InputError, SensorErrors
from gfimu.rate.health import MonitorPolicy, detectable_faults, fault_protection, watch_channels
from gfimu.rate.health.protection import protection_remark

MG = 1e-3 * GRAVITY


def test_figures_of_the_cube():
    faults = detectable_faults(CUBE, CALIBRATED, 100.0)
    np.testing.assert_allclose(faults.detected / MG, [4.64, 4.64, 5.27] * 4, atol=0.06)
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


def test_a_fault_of_that_size_is_seen_in_95_of_100_draws():
    """Drawn in numpy: the mean of 100 samples, with biases of all channels, as the null space sees it."""
    rng, policy, draws = np.random.default_rng(0), MonitorPolicy(), 20_000
    faults = detectable_faults(CUBE, CALIBRATED, 100.0)
    values, vectors = np.linalg.eigh(CUBE.regression_matrix @ CUBE.regression_matrix.T)
    unseen = vectors[:, values < 1e-9].T  # (6, 12)
    bias = policy.bias_std**2 + 0.5 * policy.bias_walk
    cover = unseen @ np.diag(CALIBRATED.noise_std**2 / 100 + bias) @ unseen.T
    weights = unseen.T @ np.linalg.inv(cover) @ unseen  # (12, 12)
    for channel in (0, 8):
        y = rng.normal(size=(draws, 12)) * np.sqrt(CALIBRATED.noise_std**2 / 100 + bias)
        y[:, channel] += faults.detected[channel]
        statistic = (y @ weights)[:, channel] ** 2 / weights[channel, channel]
        seen = np.mean(statistic > policy.threshold(12, 0.1))
        assert seen == pytest.approx(0.95, abs=4 * (0.95 * 0.05 / draws) ** 0.5)


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


def test_the_array_that_protects_best_is_named():
    arrays = {name: AccelerometerArray.load(name) for name in ("cube12", "corners8", "nap_3_2_2_2")}
    found = {name: fault_protection(array, noise_m_s2=0.03) for name, array in arrays.items()}
    assert protection_remark(found).startswith("corners8 protects best")
    assert protection_remark({"cube12": found["cube12"]}) == ""
    assert protection_remark(dict.fromkeys("ab", found["nap_3_2_2_2"])).startswith("None")
    small, large = found["corners8"], found["cube12"]
    unseen = large.followed.detected * np.linalg.norm(np.linalg.pinv(CUBE.regression_matrix)[:3], axis=0)
    np.testing.assert_allclose(large.unseen_alpha, unseen)
    assert small.unseen_alpha.max() < large.unseen_alpha.max()


def test_bad_figures_are_refused():
    with pytest.raises(InputError, match="fault time"):
        fault_protection(CUBE, noise_m_s2=0.03, duration_s=0.0)
    with pytest.raises(InputError, match="positive"):
        detectable_faults(CUBE, CALIBRATED, 0.0)
