"""A real array thrown about by hand: the rate against its gyros, from a start in the dark.

The board's eight chips sample on clocks of their own at 62.5 Hz, and the hand moves faster than that can follow: the
readings of the chips disagree by 1.8 m/s² in combinations that no rigid motion can change, fifty times their noise at
rest, and the differences of α grow with their order. That, not noise, sets the error here.
"""

from __future__ import annotations

import numpy as np
import pytest

from gfimu import AccelerometerArray, SensorErrors, calibrate_array, estimate_rate, read_mimu4444
from gfimu.rate import FilterSettings, Reference, filter_rate, smooth_rate

DARK = FilterSettings(start_omega=None)
START_S = 550.0  # amid the motion of recording 2
DISAGREEMENT = 1.5e-3  # s, of the chips' sampling times: with it the innovations are as large as they should be


@pytest.fixture(scope="module")
def motion(shared_data):
    """Recording 2 in motion, calibrated on recording 1: array, times, readings, gyro."""
    folder = shared_data / "mimu4444"
    drawing = AccelerometerArray.load("mimu4444")
    calibration = calibrate_array(read_mimu4444(folder / "exp_1.bin.gz"), drawing, gravity=9.81)
    raw = read_mimu4444(folder / "exp_2.bin.gz")
    recording, array = calibration.apply(raw), calibration.calibrated_array(drawing)
    readings = recording.for_array(array).copy()
    readings[np.abs(raw.for_array(drawing)) > 156.5] = np.nan
    gyro = np.column_stack([recording.reference[f"gyro_{axis}_rad_s"] for axis in "xyz"])
    rows = recording.t_s > START_S
    return array, recording.t_s[rows], readings[rows], gyro[rows]


def sensors(array, **others):
    return SensorErrors.uniform(array, 0.04, 0.1, **others)


def compare(found, gyro):
    """Median |error| where the gyros don't saturate, the share of samples with the wrong sign, and the χ² of 3."""
    speed = np.linalg.norm(gyro, axis=1)
    rows = np.isfinite(speed) & (speed > 5)
    error = (found.omega - gyro)[rows]
    square = np.einsum("ni,ni->n", error, np.linalg.solve(found.covariance[rows], error[..., None])[..., 0])
    flipped = np.mean(np.sum(found.omega[rows] * gyro[rows], axis=1) < 0)
    return np.median(np.linalg.norm(error, axis=1)), flipped, np.median(square), np.nanmedian(speed[rows])


@pytest.mark.parametrize("solve", [filter_rate, smooth_rate])
def test_rate_against_the_gyros_from_a_cold_start(motion, solve):
    array, t, readings, gyro = motion
    found = solve(array, t, readings, sensors(array, timing_std=DISAGREEMENT), DARK)
    median, flipped, square, speed = compare(found, gyro)
    assert speed > 20
    assert median < 5.0
    assert flipped < 0.03
    assert found.sign.state == "decided"
    assert found.mean_nis == pytest.approx(1, abs=0.15)
    # The error is what undersampling and the chips' clocks explain: median of χ²(3) is 2.4.
    assert 0.8 < square < 5


@pytest.mark.parametrize("method", ["ml", "smoother"])
def test_stated_noise_of_rest_is_enlarged_to_what_the_channels_show(motion, method):
    """Normalised errors and signs with nothing stated but the noise of rest; the gyros are 1.5 ms ahead."""
    array, t, readings, gyro = motion
    found = estimate_rate(array, t, readings, sensors(array), method=method, settings=DARK)
    known = np.isfinite(gyro).all(axis=1)
    reference = np.column_stack([np.interp(t - 1.5e-3, t[known], axis[known]) for axis in gyro.T])
    rows = known & (np.linalg.norm(reference, axis=1) > np.radians(100)) & np.isfinite(found.omega).all(axis=1)
    each = np.abs((found.omega - reference) / found.std)[rows]
    typical = np.median(each, axis=0) / 0.6745
    assert np.all((typical > 0.5) & (typical < 1.3))
    assert np.mean(each < 3) > 0.96
    decided = found.sign_probability[rows] > 0.99
    wrong = np.sum(found.omega * reference, axis=1)[rows] < 0
    assert decided.mean() > 0.75
    assert wrong[decided].mean() < 0.005
    assert np.median(found.scale[rows]) > 8


def test_noise_alone_explains_next_to_nothing(motion):
    """Share of the mean-square error that the sensors' sampling explains, by the filter's own account."""
    array, t, readings, gyro = motion
    found = filter_rate(array, t, readings, sensors(array, timing_std=DISAGREEMENT), DARK)
    speed = np.linalg.norm(gyro, axis=1)
    rows = np.isfinite(speed) & (speed > 5)
    explained = np.median(np.trace(found.covariance[rows], axis1=1, axis2=2))
    noise_only = (0.04 / (np.sqrt(8) * 0.00945 * 20)) ** 2 * 3  # Cramér–Rao of one sample at 20 rad/s
    actual = np.median(np.sum((found.omega - gyro)[rows] ** 2, axis=1))
    assert noise_only < 0.01 * actual
    assert 0.5 < explained / actual < 3


def test_estimate_goes_on_through_gyro_saturation(motion):
    array, t, readings, gyro = motion
    holes = np.isnan(gyro).any(axis=1)
    assert holes.sum() > 50
    told = sensors(array, timing_std=DISAGREEMENT, gyro_noise_std=0.3)
    found = filter_rate(array, t, readings, told, DARK, references=[Reference.gyro(told).measured(gyro, len(gyro))])
    assert np.isfinite(found.omega).all()
    # Beyond the range of a gyro axis (35 rad/s) the estimate says so.
    assert np.median(np.abs(found.omega[holes]).max(axis=1)) > 28
    median, flipped, _, _ = compare(found, gyro)
    assert median < 1.2
    assert flipped < 0.005
