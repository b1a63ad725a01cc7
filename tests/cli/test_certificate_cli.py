"""`gfimu certificate` from calibrations of every method to its folder, and what it refuses."""

import json

import numpy as np
import pytest

import gfimu
from gfimu import Calibration

METHODS = (
    ("six-position", 12),
    ("six-position", 9),
    ("recursive", 12),
    ("multi-position", 9),
    ("multi-position", 12),
    ("twelve-position", 12),
    ("twelve-position", 9),
    ("array", None),
)


@pytest.fixture(scope="module")
def poses():
    return gfimu.simulate("calibration_poses", seed=5)


@pytest.fixture(scope="module")
def calibration(poses):
    return gfimu.calibrate("multi-position", poses)


@pytest.fixture(scope="module")
def reference(poses):
    return gfimu.calibrate("array", poses)


@pytest.fixture
def file(calibration, tmp_path):
    calibration.save(tmp_path / "cal.json")
    return tmp_path / "cal.json"


@pytest.mark.parametrize(("method", "count"), METHODS)
def test_calibrations_of_every_method_become_certificates(poses, reference, method, count, tmp_path):
    """The intrinsic parameters by the methods that fit these chips agree: all |E_n| of the same poses are below 2."""
    found = gfimu.certificate(gfimu.calibrate(method, poses, parameters=count), out=tmp_path / "made")
    stated = [term for chip in found.chips for term in chip.intrinsic]
    assert len(found.chips) == 4
    assert len(stated) == 36
    assert all(term.value is not None and term.std > 0.0 for term in stated)
    if method == "multi-position" or count == 12:  # the others take M to be triangular on the fixture: here it is not
        rows = gfimu.certificate(reference, compare=found).comparison.rows
        assert max(abs(row.e_n) for row in rows) < 2.0


def test_the_command_prints_and_writes(gfimu_command, file, tmp_path):
    result = gfimu_command("certificate", file, "--out", tmp_path / "made", "--item", "cube 7", "--date", "2026-11-27")
    assert result.code == 0
    for word in ("a11_K0", "U (95 %)", "not determined: a11_K3", "wrote certificate", "wrote page"):
        assert word in result.stdout
    data = json.loads((tmp_path / "made" / "certificate.json").read_text(encoding="utf-8"))
    assert (data["format"], data["item"], data["date"]) == ("gfimu-certificate", "cube 7", "2026-11-27")
    assert "cube 7" in (tmp_path / "made" / "certificate.html").read_text(encoding="utf-8")


def test_json_on_standard_output_is_the_file(gfimu_command, file, tmp_path):
    printed = json.loads(gfimu_command("certificate", file, "--out", tmp_path / "made", "--json").stdout)
    files = printed.pop("files")
    assert printed == json.loads((tmp_path / "made" / "certificate.json").read_text(encoding="utf-8"))
    assert files["certificate"].endswith("certificate.json")


def test_a_calibration_is_compared_with_a_calibration_or_a_certificate(gfimu_command, file, tmp_path):
    gfimu_command("certificate", file, "--out", tmp_path / "theirs")
    for other in (file, tmp_path / "theirs" / "certificate.json"):
        result = gfimu_command("certificate", file, "--compare", other)
        assert result.code == 0
        assert "a11_sensitivity" in result.stdout
        assert "E_n" in result.stdout
    printed = json.loads(gfimu_command("certificate", file, "--compare", other, "--json").stdout)
    assert {row["e_n"] for row in printed["comparison"]["rows"]} == {0.0}


def gyro():
    free = ("M_xx", "M_yx", "M_yy", "M_zx", "M_zy", "M_zz", "b_x", "b_y", "b_z")
    names = tuple(f"gyro_{name}" for name in free)
    channels = ("gyro_x", "gyro_y", "gyro_z")
    values = np.array([1.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    return Calibration("gyro", "rad_s", channels, "x_axis", 7.3e-5, names, values, 1e-8 * np.eye(9))


def changed(data, **changes):
    return json.dumps(json.loads(json.dumps(data)) | changes)


def bad_calibrations(data):
    nan = [parameter | {"value": float("nan")} for parameter in data["parameters"]]
    return {
        "text": ("hello", "not a calibration file"),
        "other json": ("{}", "not a calibration file"),
        "gyro": (json.dumps(gyro().to_dict()), "is of a gyro"),
        "without covariance": (
            changed(data, covariance=np.zeros_like(data["covariance"]).tolist()),
            "covariance is zero",
        ),
        "nan": (changed(data, parameters=nan), "is nan"),
        "cut off": (json.dumps(data)[:200], "not a calibration file"),
    }


@pytest.mark.parametrize("kind", ["text", "other json", "gyro", "without covariance", "nan", "cut off"])
@pytest.mark.parametrize("place", ["calibration", "--compare"])
def test_bad_input_is_one_line_and_writes_nothing(gfimu_command, calibration, file, tmp_path, kind, place):
    text, words = bad_calibrations(calibration.to_dict())[kind]
    (tmp_path / "bad.json").write_text(text)
    arguments = [tmp_path / "bad.json"] if place == "calibration" else [file, "--compare", tmp_path / "bad.json"]
    result = gfimu_command("certificate", *arguments, "--out", tmp_path / "made")
    assert (result.code, result.stdout, result.stderr.count("\n")) == (2, "", 1), result
    assert "bad.json" in result.stderr
    assert words in result.stderr or (place == "--compare" and "neither a calibration nor" in result.stderr)
    assert not (tmp_path / "made").exists()


def test_another_unit_or_chip_is_refused(gfimu_command, calibration, file, tmp_path):
    data = calibration.to_dict()
    others = {
        "unit": (changed(data, unit="lsb"), "is in lsb, not in m_s2"),
        "chip": (json.dumps(data).replace('"a1', '"b1'), "is of b1, a2, a3, a4, not of a1, a2, a3, a4"),
    }
    for text, words in others.values():
        (tmp_path / "other.json").write_text(text)
        result = gfimu_command("certificate", file, "--compare", tmp_path / "other.json", "--out", tmp_path / "made")
        assert (result.code, result.stderr.count("\n")) == (2, 1)
        assert words in result.stderr
        assert not (tmp_path / "made").exists()


def test_no_file(gfimu_command, file, tmp_path):
    for arguments in (["no.json"], [file, "--compare", "no.json"], [file, "--compare", tmp_path]):
        result = gfimu_command("certificate", *arguments)
        assert (result.code, result.stderr.count("\n")) == (2, 1)
