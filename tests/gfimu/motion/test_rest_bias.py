"""Biases read off at rest: exact without noise, within their own standard deviation with it."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from gfimu import AccelerometerArray, InputError, Recording, estimate_from_rest, specific_force
from gfimu.motion.rest_bias import force_at_rest, rest_bias

ARRAY = AccelerometerArray.load("cube12")
BIAS = np.linspace(-0.5, 0.4, 12)
MILLI_G = 9.80665e-3


def recording(noise: float, *, mounting=(0.0, 0.0, 0.0), seed: int = 0, still: bool = True) -> Recording:
    t = np.arange(1000) * 0.01
    rate = np.where(t > 4.0, 3.0 * np.sin(3.0 * (t - 4.0)), 0.0) if still else 3.0 * np.sin(3.0 * t)
    acceleration = np.gradient(rate, t)
    up = Rotation.from_rotvec(mounting).inv().apply([0.0, 0.0, 1.0])
    readings = specific_force(ARRAY, np.tile(9.80665 * up, (len(t), 1)), np.outer(acceleration, up), np.outer(rate, up))
    rng = np.random.default_rng(seed)
    readings = readings + BIAS + noise * rng.standard_normal(readings.shape)
    return Recording.from_arrays(
        t, readings, ARRAY, reference={"tacho_rad_s": rate}, metadata={"mounting_rotvec_rad": list(mounting)}
    )


@pytest.mark.parametrize("mounting", [(0.0, 0.0, 0.0), (np.pi / 2, 0.0, 0.0)])
def test_exact_without_noise_however_the_cube_lies(mounting):
    found = rest_bias(recording(1e-9, mounting=mounting), ARRAY)
    assert_allclose(found.bias, BIAS, atol=1e-8)
    assert 0.0 <= found.start_s < found.stop_s <= 4.0


def test_the_error_is_as_large_as_it_says():
    scores = []
    for seed in range(40):
        found = rest_bias(recording(0.03, seed=seed), ARRAY)
        scores.append((found.bias - BIAS) / found.std)
    # 480 standard normal scores: their variance is within 4 standard deviations, 4 √(2/480), of 1.
    assert np.var(scores) == pytest.approx(1.0, abs=4 * np.sqrt(2 / 480))


def test_removing_leaves_the_ideal_readings():
    run = recording(1e-9)
    clean = rest_bias(run, ARRAY).remove(run)
    assert_allclose(clean.readings, run.readings - BIAS, atol=1e-8)


def test_no_rest_is_refused():
    with pytest.raises(InputError, match="no rest"):
        rest_bias(recording(0.03, still=False), ARRAY)


def test_a_dead_channel_is_named():
    run = recording(0.03)
    run.readings[:, 4] = np.nan
    with pytest.raises(InputError, match="a22"):
        rest_bias(run, ARRAY)


def test_the_rate_stays_within_the_band_it_gives():
    scores = []
    for seed in range(40):
        run = recording(0.03, seed=seed)
        found = estimate_from_rest(run, ARRAY, noise_std=0.03)
        error = found.omega[-1, 2] - run.reference["tacho_rad_s"][-1]
        scores.append(error / found.omega_std[-1, 2])
    # The mean square of 40 standard normal scores is within 4 standard deviations, 4 √(2/40), of 1.
    assert np.mean(np.square(scores)) == pytest.approx(1.0, abs=4 * np.sqrt(2 / 40))
    assert found.metadata["rest_bias_m_s2"]["a11"] == pytest.approx(BIAS[0], abs=0.02)


def of_p(bias):
    """Equivalent biases of p by the closed form of the cube: a quarter of the sum of four channels, mg."""
    return np.asarray(bias).reshape(4, 3).mean(axis=0) / MILLI_G


@pytest.mark.parametrize("mounting", [(0.0, 0.0, 0.0), (np.pi / 2, 0.0, 0.0)])
def test_equivalent_biases_of_p_are_the_mean_over_the_chips(mounting):
    found = force_at_rest(recording(1e-9, mounting=mounting), ARRAY)
    assert_allclose(found.bias_mg, of_p(BIAS), atol=1e-5)
    up = Rotation.from_rotvec(mounting).inv().apply([0.0, 0.0, 1000.0])  # mg
    assert found.magnitude_mg == pytest.approx(np.linalg.norm(up + of_p(BIAS)) - 1000.0, abs=1e-5)


def test_equivalent_biases_of_p_are_as_sure_as_they_say():
    found = [force_at_rest(recording(0.03, seed=seed), ARRAY) for seed in range(40)]
    scores = [(one.bias_mg - of_p(BIAS)) / one.std_mg for one in found]
    # 120 standard normal scores: their variance is within 4 standard deviations, 4 √(2/120), of 1.
    assert np.var(scores) == pytest.approx(1.0, abs=4 * np.sqrt(2 / 120))
    # Noise of 0.03 m/s² in four channels, over the 351 samples of the rest.
    samples = round((found[0].stop_s - found[0].start_s) / 0.01) + 1
    assert_allclose(found[0].std_mg, 0.03 / 2.0 / np.sqrt(samples) / MILLI_G, rtol=4 / np.sqrt(2 * samples))


def test_a_lean_reads_as_a_bias_and_is_stated_as_one():
    lean = 0.005
    run = recording(1e-9, mounting=(lean, 0.0, 0.0))
    level = Recording(run.t_s, run.readings - BIAS, run.channels, run.reference)
    found = force_at_rest(level, ARRAY)
    assert_allclose(found.bias_mg[:2], [0.0, 1000.0 * np.sin(lean)], atol=1e-4)
    assert found.lean_rad == pytest.approx(lean, rel=1e-5)
    assert abs(found.magnitude_mg) < 1e-5


def test_local_gravity_is_taken_off():
    found = force_at_rest(recording(1e-9), ARRAY, gravity=9.80665 + 0.01)
    assert found.bias_mg[2] == pytest.approx(of_p(BIAS)[2] - 0.01 / MILLI_G, abs=1e-5)


def test_without_rest_or_sight_there_are_no_equivalent_biases():
    assert force_at_rest(recording(0.03, still=False), ARRAY) is None
    assert force_at_rest(recording(0.03), ARRAY, without=ARRAY.channels[:7]) is None


def test_a_channel_left_out_has_no_part_in_p():
    run = recording(1e-9)
    hurt = run.readings.copy()
    hurt[:, 4] = np.nan
    found = force_at_rest(Recording(run.t_s, hurt, run.channels, run.reference), ARRAY, without=["a22"])
    kept = np.arange(12) != 4
    left_inverse = np.linalg.pinv(ARRAY.regression_matrix[kept])
    assert_allclose(found.bias_mg, left_inverse[3:] @ BIAS[kept] / MILLI_G, atol=1e-5)
