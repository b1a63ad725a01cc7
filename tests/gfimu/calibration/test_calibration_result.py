"""The result class: file round trip, units, apply and invert."""

import json
from dataclasses import replace

import numpy as np
import pytest

from gfimu import AccelerometerArray, Calibration, InputError, UnitError, load_calibration
from gfimu.calibration.combine import combine
from gfimu.calibration.parameter_names import parameter_names
from gfimu.calibration.run_file import open_calibrated_run
from gfimu.recording import Recording, array_difference


@pytest.fixture
def calibration(mti):
    rng = np.random.default_rng(5)
    root = rng.normal(size=(12, 12))
    return Calibration(
        "six-position",
        "lsb",
        ("a11", "a12", "a13"),
        "poses",
        9.81,
        parameter_names("a1", "poses"),
        mti.parameters("poses"),
        root @ root.T,
        statements=("a statement",),
        warnings=("a warning",),
        statistics={"poses": 6.0, "input": "averaged"},
    )


@pytest.fixture
def recording():
    rng = np.random.default_rng(6)
    return Recording(np.arange(5) / 100, 33000 + rng.normal(0, 4000, (5, 3)), ("a11", "a12", "a13"), unit="lsb")


def test_file_round_trip(calibration, tmp_path):
    calibration.save(tmp_path / "cal.json")
    again = load_calibration(tmp_path / "cal.json")
    np.testing.assert_array_equal(again.values, calibration.values)
    np.testing.assert_array_equal(again.covariance, calibration.covariance)
    for name in ("method", "unit", "channels", "gauge", "gravity", "names", "statements", "warnings", "statistics"):
        assert getattr(again, name) == getattr(calibration, name)
    content = json.loads((tmp_path / "cal.json").read_text())
    assert content["format_version"] == 1
    assert content["parameters"][0] == {
        "name": "a1_M_xx",
        "value": 409.675030,
        "std": pytest.approx(calibration.std_of("a1_M_xx")),
        "unit": "lsb per m_s2",
    }
    np.testing.assert_allclose(np.diag(content["correlation"]), 1.0)


def test_apply_and_invert(calibration, mti, recording):
    corrected = calibration.apply(recording)
    assert corrected.unit == "m_s2"
    np.testing.assert_allclose(corrected.readings, mti.correct(recording.readings))
    back = calibration.invert(corrected)
    assert back.unit == "lsb"
    np.testing.assert_allclose(back.readings, recording.readings, rtol=1e-12)


def test_wrong_unit_is_refused(calibration, recording):
    with pytest.raises(UnitError, match="readings are in m_s2, this calibration needs lsb"):
        calibration.apply(calibration.apply(recording))
    with pytest.raises(UnitError, match="readings are in lsb, this calibration needs m_s2"):
        calibration.invert(recording)


def test_missing_and_uncovered_channels(calibration, recording):
    other = Recording(recording.t_s, recording.readings, ("a11", "a12", "a23"), unit="lsb")
    with pytest.raises(InputError, match="lacks a13"):
        calibration.apply(other)
    four = Recording(recording.t_s, np.ones((5, 4)), ("a11", "a12", "a13", "a21"), unit="lsb")
    with pytest.raises(InputError, match="a21 would stay in lsb"):
        calibration.apply(four)


def test_combining_keeps_blocks(calibration):
    names = parameter_names("a2", "poses")
    other = Calibration(
        "six-position", "lsb", ("a21", "a22", "a23"), "poses", 9.81, names, calibration.values, np.eye(12)
    )
    both = combine([calibration, other])
    assert both.chips == ("a1", "a2")
    np.testing.assert_array_equal(both.covariance[:12, :12], calibration.covariance)
    np.testing.assert_array_equal(both.covariance[:12, 12:], 0.0)
    assert both.std_of("a2_M_xx") == 1.0
    with pytest.raises(InputError, match="can't be joined"):
        combine([calibration, Calibration("recursive", *other_fields(other))])


def other_fields(calibration):
    return (
        calibration.unit,
        calibration.channels,
        calibration.gauge,
        calibration.gravity,
        calibration.names,
        calibration.values,
        calibration.covariance,
    )


def moved_calibration(array):
    """A calibration that moves every chip by 1 mm along each axis and changes nothing else."""
    names = [name for chip in array.chips for name in parameter_names(chip.name, "array")]
    names += [f"{chip.name}_r_{axis}" for chip in array.chips for axis in "xyz"]
    moved = array.chip_positions + 0.001
    values = np.concatenate([np.tile(np.r_[np.eye(3).ravel(), np.zeros(3)], 4), moved.ravel()])
    return Calibration("array", "m_s2", array.channels, "array", 9.81, tuple(names), values, np.zeros((60, 60)))


def test_fitted_positions_reach_the_array():
    array = AccelerometerArray.load("cube12")
    found = moved_calibration(array).calibrated_array(array)
    np.testing.assert_allclose(found.chip_positions, array.chip_positions + 0.001)


@pytest.mark.parametrize("name", ["cube12", "cube12_as_built"])
def test_a_corrected_recording_carries_the_calibrated_array(tmp_path, name):
    array = AccelerometerArray.load("cube12")
    own = AccelerometerArray.load(name)
    Recording.from_arrays(np.arange(5) / 100, np.ones((5, 12)), own).write(tmp_path / "run.csv")
    corrected, calibrated = open_calibrated_run(tmp_path / "run.csv", moved_calibration(array), array)
    expected = calibrated if name == "cube12" else own  # the board's own array stays where it is another one
    assert array_difference(corrected.array, expected) == ""


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format": "other"}, "not a calibration file"),
        ({"format_version": 99}, "format version 99"),
        ({"covariance": [[1.0]]}, "covariance"),
        ({"parameters": []}, "needs that many values"),
        ({"unit": "furlong"}, "can't be in 'furlong'"),
        ({"gauge": "nothing"}, "nothing"),
    ],
)
def test_damaged_files(calibration, tmp_path, change, message):
    content = calibration.to_dict() | change
    (tmp_path / "cal.json").write_text(json.dumps(content))
    with pytest.raises(InputError, match=message):
        load_calibration(tmp_path / "cal.json")


def test_files_that_are_none(tmp_path):
    with pytest.raises(InputError, match="check the path"):
        load_calibration(tmp_path / "missing.json")
    (tmp_path / "text.json").write_text("hello")
    with pytest.raises(InputError, match="not a calibration file"):
        load_calibration(tmp_path / "text.json")


def test_a_statistic_that_is_not_defined_is_null_in_the_file(calibration, tmp_path):
    """Nine poses for nine parameters have no redundancy, so that the variance factor is NaN."""
    undefined = replace(calibration, statistics={"variance_factor": float("nan"), "poses": 9.0})
    undefined.save(tmp_path / "cal.json")
    content = json.loads((tmp_path / "cal.json").read_text())
    assert content["statistics"] == {"variance_factor": None, "poses": 9.0}
    assert np.isnan(load_calibration(tmp_path / "cal.json").statistics["variance_factor"])


def with_nan(matrix):
    matrix[2, 5] = matrix[5, 2] = np.nan


def with_infinity(matrix):
    matrix[0, 0] = np.inf


def lopsided(matrix):
    matrix[2, 5] += 0.01 * np.sqrt(matrix[2, 2] * matrix[5, 5])


def of_negative_variance(matrix):
    matrix[11, 11] = -1e-9


def indefinite(matrix):
    matrix[3, 4] = matrix[4, 3] = 1.5 * np.sqrt(matrix[3, 3] * matrix[4, 4])


def correlated_without_variance(matrix):
    matrix[6, :] = matrix[:, 6] = 0.0
    matrix[6, 0] = matrix[0, 6] = 1.0


NOT_COVARIANCES = [
    (with_nan, "the covariance of a1_M_xz and a1_M_yz is nan"),
    (with_infinity, "the covariance of a1_M_xx and a1_M_xx is inf"),
    (lopsided, "the covariance matrix is not symmetric at a1_M_xz and a1_M_yz"),
    (of_negative_variance, "the variance of a1_b_z is negative"),
    (indefinite, "the covariance matrix is not positive semi-definite"),
    (correlated_without_variance, "the covariance matrix is not positive semi-definite"),
]


@pytest.mark.parametrize(("spoil", "message"), NOT_COVARIANCES)
def test_a_matrix_that_is_no_covariance_is_refused(calibration, tmp_path, spoil, message):
    matrix = calibration.covariance.copy()
    spoil(matrix)
    with pytest.raises(InputError, match=message) as made:
        replace(calibration, covariance=matrix)
    (tmp_path / "cal.json").write_text(json.dumps(calibration.to_dict() | {"covariance": matrix.tolist()}))
    with pytest.raises(InputError, match=f"cal.json: .*{message}") as read:
        load_calibration(tmp_path / "cal.json")
    assert "calibrate again" in str(made.value)
    assert "\n" not in str(made.value) + str(read.value)


def test_a_singular_covariance_and_its_rounding_are_accepted(calibration):
    """Undetermined directions have no variance; products of matrices are symmetric to rounding only."""
    rng = np.random.default_rng(8)
    root = rng.normal(size=(12, 3)) * np.logspace(-6, 3, 12)[:, None]
    singular = root @ root.T
    singular *= 1.0 + 1e-13 * rng.standard_normal((12, 12))
    replace(calibration, covariance=singular)
    replace(calibration, covariance=np.zeros((12, 12)))


def test_a_value_that_is_not_finite_is_refused(calibration):
    values = calibration.values.copy()
    values[9] = np.inf
    with pytest.raises(InputError, match="parameter a1_b_x is inf"):
        replace(calibration, values=values)
