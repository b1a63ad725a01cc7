"""From a recording to a calibration, and every fault of calibration data named."""

from dataclasses import replace

import numpy as np
import pytest
from calibration_cases import FACES, GRAVITY, MULTI, calibrate
from recordings import pose_recording

from gfimu import InputError
from gfimu.calibration import METHODS, averaged_poses, every_sample
from gfimu.calibration.observations import denoised_samples, observations_from
from gfimu.recording import Recording, detect_rest

TRIAD_METHODS = [name for name, method in METHODS.items() if method.gauges]


@pytest.mark.parametrize("method", TRIAD_METHODS)
@pytest.mark.parametrize("kind", ["averaged", "raw", "wavelet"])
def test_two_chips_from_a_recording(triad, mti, method, kind):
    rng = np.random.default_rng(1)
    second = triad.in_gauge("x_axis")
    recording = pose_recording([triad, second], MULTI, rng, still_s=4.0, sigma=0.01)
    result = calibrate(method, recording, gravity=GRAVITY, input_kind=kind, levelling_std_rad=1e-5)
    assert result.chips == ("a1", "a2")
    for chip, truth in zip(result.chips, (triad, second), strict=True):
        expected = truth if result.gauge in {"poses", "coarse"} else truth.in_gauge("x_axis")
        names = [name for name in result.names if name.startswith(chip)]
        errors = np.array([result.value(name) for name in names]) - expected.parameters(result.gauge)
        np.testing.assert_array_less(np.abs(errors), 5.0 * np.array([result.std_of(name) for name in names]))
    corrected = result.apply(recording)
    still = detect_rest(corrected)
    means = averaged_poses(corrected, still).means
    np.testing.assert_allclose(np.linalg.norm(means[:, :3], axis=1), GRAVITY, atol=0.002)


def test_the_statistics_state_what_the_weights_were_made_from(triad):
    recording = pose_recording([triad], MULTI, np.random.default_rng(1), still_s=4.0, sigma=0.01)
    recording = replace(recording, metadata={"part": "adxl345"})
    found = calibrate("six-position", recording, gravity=GRAVITY, levelling_std_rad=2e-3).statistics
    assert found["levelling_std_rad"] == 2e-3
    assert found["a1_mean_noise_m_s2"] == pytest.approx(0.01 / np.sqrt(400), rel=0.2)  # rests are cut a little short
    assert found["a1_quadratic_prior_std_per_m_s2"] == pytest.approx(0.005 / 156.9064)


def test_raw_counts(mti):
    recording = pose_recording([mti], MULTI, np.random.default_rng(2), sigma=3.0, unit="lsb")
    result = calibrate("multi-position", recording, gravity=GRAVITY)
    errors = result.values - mti.in_gauge("x_axis").parameters("x_axis")
    np.testing.assert_array_less(np.abs(errors), 4.0 * result.std)
    assert result.units[0] == "lsb per m_s2"


def test_means_and_their_covariance():
    rng = np.random.default_rng(3)
    readings = rng.multivariate_normal([1, 2, 3], [[4, 1, 0], [1, 3, 0], [0, 0, 1]], 5000)
    recording = Recording(np.arange(5000) / 100, readings, ("a11", "a12", "a13"))
    rest = detect_rest(recording, threshold=1e6)
    inside = readings[rest.start[0] : rest.stop[0]]
    averaged, raw = averaged_poses(recording, rest), every_sample(recording, rest)
    np.testing.assert_allclose(averaged.readings[0], inside.mean(axis=0))
    np.testing.assert_allclose(averaged.covariance[0], np.cov(inside, rowvar=False) / len(inside))
    np.testing.assert_allclose(raw.covariance[0], np.cov(inside, rowvar=False))
    np.testing.assert_array_equal(raw.readings, inside)


def test_correlated_noise_widens_the_mean():
    """First-order autoregressive noise: the variance of the mean is (1 + φ)/(1 − φ) times that of white noise."""
    from scipy.signal import lfilter

    rng = np.random.default_rng(4)
    phi = 0.8
    readings = lfilter([1], [1, -phi], rng.normal(size=(60000, 3)), axis=0)
    observations = averaged_poses(
        Recording(np.arange(60000) / 100, readings, ("a11", "a12", "a13")), detect_rest_everywhere(60000)
    )
    assert observations.correlation_factor == pytest.approx((1 + phi) / (1 - phi), rel=0.15)


def detect_rest_everywhere(n, length=2000):
    from gfimu.recording.rest import Rest

    start = np.arange(0, n, length)
    return Rest(start, start + length, 1.0, False, 101, "m_s2")


def test_wavelet_takes_noise_off_and_keeps_the_mean():
    rng = np.random.default_rng(5)
    recording = Recording(np.arange(4096) / 100, 5 + rng.normal(size=(4096, 3)), ("a11", "a12", "a13"))
    rest = detect_rest_everywhere(4096, 4096)
    smooth = denoised_samples(recording, rest)
    assert smooth.readings.std() == pytest.approx(0.25, rel=0.1)  # 2^(−4/2) of the noise is left at level 4
    np.testing.assert_allclose(smooth.readings.mean(axis=0), recording.readings.mean(axis=0), atol=0.01)
    with pytest.raises(InputError, match="unknown wavelet 'nothing'"):
        denoised_samples(recording, rest, wavelet="nothing")


def test_stuck_channel(triad):
    recording = pose_recording([triad], MULTI, np.random.default_rng(6))
    recording.readings[:, 1] = 0.3
    with pytest.raises(InputError, match="channel a12 reads the same in all 18 poses: stuck"):
        calibrate("multi-position", recording)


def test_saturated_channel(triad):
    recording = pose_recording([triad], MULTI, np.random.default_rng(7))
    recording.readings[:] = np.minimum(recording.readings, 9.5)
    result = calibrate("multi-position", recording)
    assert any("a11 is saturated in pose 1" in text for text in result.warnings)
    fine = calibrate("multi-position", pose_recording([triad], MULTI, np.random.default_rng(7)))
    assert not any("saturated" in text for text in fine.warnings)


def test_coarse_counts_are_not_saturation(triad):
    from gfimu.calibration import ErrorModel

    counts = ErrorModel(triad.sensitivity * 25.0, triad.bias * 25.0)
    recording = pose_recording([counts], MULTI, np.random.default_rng(8), sigma=0.4, unit="lsb")
    assert not any("saturated" in text for text in calibrate("multi-position", recording).warnings)


def test_moved_pose_is_left_out_and_named(triad):
    recording = pose_recording([triad], MULTI, np.random.default_rng(9))
    recording.readings[1600:2200, 2] += np.linspace(0, 0.1, 600)  # pose 3: 16 s to 22 s
    result = calibrate("multi-position", recording, gravity=GRAVITY)
    assert any("moved while recorded, left out: 3 (16" in text for text in result.warnings)
    assert result.statistics["poses"] == 17
    errors = result.values - triad.in_gauge("x_axis").parameters("x_axis")
    np.testing.assert_array_less(np.abs(errors), 4.5 * result.std)


def test_repeated_poses(triad):
    directions = np.concatenate([MULTI, MULTI[:2]])
    result = calibrate("multi-position", pose_recording([triad], directions, np.random.default_rng(10)))
    assert any("1, 19 (+x up); 2, 20 (+y up)" in text for text in result.warnings)
    with pytest.raises(InputError, match="6 of them repeat another pose"):
        calibrate("multi-position", pose_recording([triad], np.tile(FACES, (2, 1)), np.random.default_rng(10)))


def test_wrong_gravity(triad):
    recording = pose_recording([triad], MULTI, np.random.default_rng(11))
    with pytest.raises(InputError, match="gravity 1 is not one in m/s²"):
        calibrate("multi-position", recording, gravity=1.0)
    assert any("nowhere on the Earth" in t for t in calibrate("multi-position", recording, gravity=9.7).warnings)
    scaled = Recording(recording.t_s, recording.readings * 1.2, recording.channels)
    assert any("three scale factors of a1" in text for text in calibrate("multi-position", scaled).warnings)


def test_no_rest_no_triads_no_method(triad):
    rng = np.random.default_rng(12)
    recording = pose_recording([triad], MULTI, rng)
    with pytest.raises(InputError, match="no rest found"):
        calibrate("multi-position", recording, rest_threshold=1e-12)
    four = Recording(recording.t_s, np.repeat(recording.readings[:, :1], 4, axis=1), ("a11", "a12", "a13", "a21"))
    with pytest.raises(InputError, match="not three per chip"):
        observations_from(four, detect_rest(four), "averaged")
    with pytest.raises(InputError, match=r"unknown calibration method 'seven'; valid: .*six-position"):
        calibrate("seven", recording)
    with pytest.raises(InputError, match="choose 12"):
        calibrate("multi-position", recording, n_parameters=10)
    with pytest.raises(InputError, match="unknown input 'cooked'"):
        calibrate("multi-position", recording, input_kind="cooked")
    with pytest.raises(InputError, match="lacks gyro_x_rad_s"):
        calibrate("gyro", recording)
