"""The Xsens MTi recording that comes with IMU-TK, against IMU-TK's solutions and the factory calibration."""

from dataclasses import replace

import numpy as np
import pytest
from calibration_cases import calibrate

from gfimu import InputError
from gfimu.calibration import averaged_poses, every_sample, read_text_triad
from gfimu.calibration.multi_position import multi_position
from gfimu.recording import detect_rest

GRAVITY = 9.81744
FACTORY_SCALE = [415.0, 413.0, 415.0]
FACTORY_BIAS = [33123.0, 33276.0, 32360.0]

# IMU-TK (BSD licence, A. Pretto), its shipped result for this file: counts per m/s², counts, T01 T02 T12.
SOLUTIONS = {
    "raw": (
        [414.458874, 412.010468, 414.648662],
        [33124.18256, 33275.17943, 32364.41565],
        [-0.00335930, -0.00890639, -0.02133412],
    ),
    "averaged": (
        [414.418739, 412.031931, 414.620680],
        [33123.83828, 33275.16301, 32364.49458],
        [-0.00339262, -0.00929641, -0.02136723],
    ),
}


@pytest.fixture
def recording(xsens_file):
    return read_text_triad(xsens_file)


@pytest.mark.parametrize("kind", SOLUTIONS)
def test_imu_tk_solutions(recording, kind):
    """IMU-TK's protocol: threshold = whole multiple (2 to 10) of the variance of the first 50 s, least cost wins.

    Its "all samples" variant takes the first hundred of each rest.
    """
    first = recording.between(recording.t_s[0], recording.t_s[0] + 50.0 + 1e-4)
    unit = float(np.linalg.norm(first.readings.var(axis=0, ddof=1)))
    best = None
    for multiple in range(2, 11):
        rest = detect_rest(recording, threshold=multiple * unit)
        if kind == "raw":
            observations = every_sample(recording, replace(rest, stop=rest.start + 100))
        else:
            observations = averaged_poses(recording, rest)
        result = multi_position(observations, gravity=GRAVITY, gauge="z_axis", weighting="uniform")
        miss = np.linalg.norm(result.models["a1"].correct(observations.readings), axis=1) - GRAVITY
        if best is None or miss @ miss < best[0]:
            best = miss @ miss, result
    T, K, bias = best[1].models["a1"].to_correction()
    scale, offset, alignment = SOLUTIONS[kind]
    np.testing.assert_allclose(1 / K, scale, rtol=1e-6)
    np.testing.assert_allclose(bias, offset, rtol=1e-6)
    np.testing.assert_allclose(T[[0, 0, 1], [1, 2, 2]], alignment, atol=1e-7)  # of a unit diagonal


def test_own_threshold_and_weights(recording):
    """Chosen by the data alone: near the factory values and IMU-TK's, and the rest found in about 40 poses."""
    result = calibrate("multi-position", recording, gravity=GRAVITY)
    _, K, bias = result.models["a1"].to_correction()
    np.testing.assert_allclose(1 / K, FACTORY_SCALE, rtol=0.003)
    np.testing.assert_allclose(bias, FACTORY_BIAS, atol=5.0)
    np.testing.assert_allclose(bias, SOLUTIONS["averaged"][1], atol=0.3)
    assert 33 <= result.statistics["poses_found"] <= 42
    assert result.statistics["rest_threshold_chosen_by"] == "data"
    assert result.statistics["magnitude_residual_rms_m_s2"] < 0.0015
    std = [result.std_of(f"a1_b_{axis}") for axis in "xyz"]
    assert np.all((np.array(std) > 0.1) & (np.array(std) < 0.35))  # published: 0.14 to 0.24 counts over 38 means


def test_correlations_of_the_twelve_parameter_problem(recording):
    result = calibrate("twelve-position", recording, gravity=GRAVITY)
    assert result.null_space.shape[1] == 3
    for pair in ("xy", "xz", "yz"):
        assert abs(result.correlation_of(f"a1_M_{pair}", f"a1_M_{pair[::-1]}")) > 0.99
    nine = calibrate("twelve-position", recording, gravity=GRAVITY, n_parameters=9)
    off = np.abs(nine.correlation[np.triu_indices(9, 1)])
    assert off.max() < 0.9


def test_inputs_agree(recording):
    results = [calibrate("multi-position", recording, gravity=GRAVITY, input_kind=kind) for kind in ("raw", "wavelet")]
    averaged = calibrate("multi-position", recording, gravity=GRAVITY)
    for result in results:
        np.testing.assert_array_less(np.abs(result.values - averaged.values), 2.0 * averaged.std)
        np.testing.assert_allclose(result.std, averaged.std, rtol=0.3)


def test_gravity_wrong_by_two_percent_is_only_a_common_scale(recording):
    right = calibrate("multi-position", recording, gravity=9.8)
    wrong = calibrate("multi-position", recording, gravity=9.65)
    assert "found nowhere on the Earth" in wrong.warnings[0]
    np.testing.assert_allclose(wrong.values[:6] / right.values[:6], 9.8 / 9.65, rtol=1e-6)


def test_reader_refuses_other_files(tmp_path):
    with pytest.raises(InputError, match="check the path"):
        read_text_triad(tmp_path / "none.txt")
    (tmp_path / "three.txt").write_text("0 1 2\n1 2 3\n")
    with pytest.raises(InputError, match="2 rows of 3 columns"):
        read_text_triad(tmp_path / "three.txt")
    (tmp_path / "words.txt").write_text("0 one 2 3\n")
    with pytest.raises(InputError, match="not rows of four numbers"):
        read_text_triad(tmp_path / "words.txt")
    (tmp_path / "back.txt").write_text("1 1 2 3\n0 1 2 3\n")
    with pytest.raises(InputError, match="time does not increase at row 2"):
        read_text_triad(tmp_path / "back.txt")
    (tmp_path / "bad.txt.gz").write_bytes(b"no gzip")
    with pytest.raises(InputError, match=r"bad\.txt\.gz"):
        read_text_triad(tmp_path / "bad.txt.gz")
