"""`gfimu certificate --stage`: the errors of a stage in the budget, from a file that `gfimu new stage` begins."""

import json

import pytest

from tests.gfimu.calibration.certificate.stage.stage_cases import calibration_of


@pytest.fixture
def calibration(tmp_path):
    file = tmp_path / "calibration.json"
    calibration_of("six-position").save(file)
    return file


def budget(result, quantity):
    assert result.code == 0, result.stderr
    lines = [one for one in json.loads(result.stdout)["budget"] if one["quantity"] == quantity]
    return {one["source"].partition(":")[0]: one for one in lines if one["kind"] == "B"}


def test_the_stage_of_the_template_is_in_the_budget_of_every_quantity(gfimu_command, calibration, tmp_path):
    stage = tmp_path / "stage.toml"
    assert gfimu_command("new", "stage", "--out", stage).code == 0
    result = gfimu_command("certificate", calibration, "--stage", stage, "--json")
    found = budget(result, "a11_delta_o")
    assert set(found) == {"levelling, each pose by itself", "local gravity"}
    assert abs(found["levelling, each pose by itself"]["std"] / (1e-4 / 2**0.5) - 1.0) < 0.25
    assert any(text.startswith("stage: granite plate") for text in json.loads(result.stdout)["statements"])


def test_without_a_stage_gravity_alone_is_of_type_b_and_that_is_said(gfimu_command, calibration):
    result = gfimu_command("certificate", calibration, "--json")
    assert set(budget(result, "a11_K1")) == {"local gravity"}
    assert any("no stage file" in text for text in json.loads(result.stdout)["statements"])


def test_a_certificate_comes_out_the_same_again(gfimu_command, calibration):
    first, second = (gfimu_command("certificate", calibration, "--json").stdout for _ in range(2))
    assert first == second


@pytest.mark.parametrize(
    ("text", "message"),
    [("", "'stage' is missing"), ('stage = "s"\npose_tilt_rad = 1e-4', "pose_tilt_std_rad")],
)
def test_a_wrong_stage_file_ends_the_command_in_one_line(gfimu_command, calibration, tmp_path, text, message):
    stage = tmp_path / "stage.toml"
    stage.write_text(text, encoding="utf-8")
    out = tmp_path / "certificate"
    result = gfimu_command("certificate", calibration, "--stage", stage, "--out", out)
    assert result.code == 2
    assert message in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1
    assert not out.exists()
