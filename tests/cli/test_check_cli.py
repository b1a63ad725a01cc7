"""A look at a recording before its diagnosis, by command."""

import json

import pytest


@pytest.fixture
def run(gfimu_command, tmp_path):
    assert gfimu_command("simulate", "paper_run", "--out", tmp_path / "run.parquet").code == 0
    return tmp_path / "run.parquet"


def test_both_commands_say_the_same(gfimu_command, run):
    looked = gfimu_command("check", run, "--twin", "cube12_turntable", "--json")
    same = gfimu_command("diagnose", run, "--twin", "cube12_turntable", "--check", "--json")
    assert looked.code == same.code == 0
    assert json.loads(looked.stdout) == json.loads(same.stdout)
    shown = gfimu_command("check", run, "--twin", "cube12_turntable")
    assert "nothing odd" in shown.stdout
    assert "table_tilt" in shown.stdout


def test_a_diagnosis_needs_its_folder(gfimu_command, run):
    refused = gfimu_command("diagnose", run, "--twin", "cube12_turntable")
    assert refused.code == 2
    assert "--out is missing" in refused.stderr
