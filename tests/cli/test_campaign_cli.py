"""`gfimu campaign`: a plan is run, gone on with, and summarised; what is wrong with it is one line."""

import json

import pytest

from gfimu import RecordingWarning

PLAN = """
repeats = 1
batch = 1
[factors]
scenario = ["paper_run"]
method = ["integrate", "filter"]
duration_s = [6.0]
"sensor.range_g" = [16, 3]
"""


def test_a_plan_is_run_and_gone_on_with(gfimu_command, tmp_path):
    plan, out = tmp_path / "plan.toml", tmp_path / "out"
    plan.write_text(PLAN)
    first = gfimu_command("campaign", plan, "--out", out, "--workers", 1, "--json")
    assert first.code == 0, first.stderr
    found = json.loads(first.stdout)
    assert (found["cases"], found["done"]) == (4, 4)
    assert found["failures"] == {"adxl345: unknown range_g 3; valid: 2, 4, 8, 16": 2}
    omega = {
        (group["values"]["method"], group["values"]["sensor.range_g"]): group["median"]
        for group in found["groups"]
        if group["result"] == "omega_rms_rad_s"
    }
    assert 0.0 < omega["filter", 16] < omega["integrate", 16]
    before = {file.name: file.stat().st_mtime_ns for file in out.iterdir()}
    again = gfimu_command("campaign", plan, "--out", out)
    assert again.code == 0
    assert {file.name: file.stat().st_mtime_ns for file in out.iterdir()} == before
    shown = gfimu_command("campaign", out, "--by", "method")
    assert shown.code == 0
    assert "4 of 4 cases" in " ".join(shown.stdout.split())
    assert "omega_rms_rad_s" in shown.stdout


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (PLAN.replace("integrate", "guess"), "unknown method 'guess'"),
        (PLAN.replace("sensor.range_g", "sensor.rnge_g"), "rnge_g"),
        ('kind = "dream"\n' + PLAN, "unknown kind 'dream'"),
        ('kind = "diagnose"\n[factors]\ncolour = ["red"]\n', "colour"),
        ('kind = "diagnose"\n[factors]\neffect = ["bais"]\n', "unknown effect 'bais'"),
        ('kind = "diagnose"\n[factors]\nduration_s = ["long"]\n', "duration_s: Expected `float`"),
    ],
)
def test_a_wrong_plan_is_one_line_and_writes_nothing(gfimu_command, tmp_path, text, message):
    plan = tmp_path / "plan.toml"
    plan.write_text(text)
    result = gfimu_command("campaign", plan, "--out", tmp_path / "out")
    assert result.code == 2
    assert message in result.stderr
    assert result.stderr.count("\n") == 1
    assert not (tmp_path / "out").exists()
    assert gfimu_command("campaign", plan).code == 2


def checked(folder, text):
    from sim.trials import Design, check_factors, load_plan

    (folder / "plan.toml").write_text(text)
    plan = load_plan(folder / "plan.toml")
    check_factors(plan, Design(plan)[0], "plan.toml")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('kind = "diagnose"\n[factors]\neffect = ["bias", "bais"]\n', "effect = 'bais' will fail: unknown effect"),
        ('[factors]\nscenario = ["rest", "papr_run"]\n', "scenario = 'papr_run' will fail: unknown scenario"),
        ('kind = "measure"\n[factors]\nduration_s = [6, -1]\n', "duration_s = -1 will fail"),
        ('[factors]\npart = ["adxl345", "adxl355"]\n"sensor.range_g" = [16, 32]\n', "sensor.range_g = 32 will fail"),
    ],
)
def test_values_of_which_every_case_will_fail_are_named_before_anything_runs(tmp_path, text, message):
    with pytest.warns(RecordingWarning, match=message):
        checked(tmp_path, text)


def test_a_value_that_goes_with_some_others_only_is_no_warning(tmp_path, recwarn):
    """An ADXL355 has no range of 16 g."""
    checked(tmp_path, '[factors]\npart = ["adxl345", "adxl355"]\n"sensor.range_g" = [16, 8]\n')
    assert not recwarn


def test_a_campaign_of_which_every_case_failed_is_code_1(gfimu_command, tmp_path):
    plan = tmp_path / "plan.toml"
    plan.write_text(
        'repeats = 1\n[factors]\nscenario = ["paper_run"]\nmethod = ["integrate"]\nduration_s = [0.1]\n'
        'calibration = ["rest"]\n'
    )
    result = gfimu_command("campaign", plan, "--out", tmp_path / "out", "--workers", 1, "--json")
    assert result.code == 1
    assert "every case failed" in result.stderr
    found = json.loads(result.stdout)
    assert sum(found["failures"].values()) == found["done"] == found["cases"] == 1
