"""`gfimu simulate` as a user calls it."""

import json

import numpy as np
import pytest

from gfimu.recording import Recording


def test_simulate_writes_a_recording_and_says_so(gfimu_command, tmp_path):
    out = tmp_path / "run.parquet"
    result = gfimu_command("simulate", "paper_run", "--out", out, "--seed", 3)
    assert result.code == 0
    assert "4.000 rad/s" in result.stdout
    assert {"3000", "100 Hz"} <= {line.split("│")[-2].strip() for line in result.stdout.splitlines() if "│" in line}
    recording = Recording.read(out)
    assert len(recording) == 3000
    assert recording.metadata["seed"] == 3


def test_json_names_files_and_figures(gfimu_command, tmp_path):
    out = tmp_path / "run.csv"
    result = gfimu_command("simulate", "tumble", "--out", out, "--set", "duration_s=4", "--json")
    summary = json.loads(result.stdout)
    assert summary["samples"] == 400
    assert summary["drive"] == "free body"
    assert summary["files"] == {"recording": str(out)}
    assert out.exists()


def test_raw_counts(gfimu_command, tmp_path):
    out = tmp_path / "raw.csv"
    assert gfimu_command("simulate", "rest", "--out", out, "--raw", "--set", "duration_s=2").code == 0
    counts = Recording.read(out, unit="lsb").readings
    np.testing.assert_array_equal(counts, np.round(counts))


def test_rerun_recording_beside_it(gfimu_command, tmp_path):
    out, rrd = tmp_path / "run.parquet", tmp_path / "run.rrd"
    for scenario in ("paper_run", "tumble"):
        result = gfimu_command("simulate", scenario, "--out", out, "--rrd", rrd, "--set", "duration_s=3")
        assert result.code == 0
        assert rrd.stat().st_size > 10_000


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["papr_run"], "unknown scenario 'papr_run'; valid: calibration_poses"),
        (["missing.toml"], "missing.toml: no such file"),
        (["paper_run", "--set", "sensor.rang_g=8"], "unknown key 'rang_g'"),
        (["paper_run", "--set", "sample_rate_hz=fast"], "must be a finite number"),
    ],
)
def test_mistakes_end_with_one_line_and_code_2(gfimu_command, tmp_path, arguments, message):
    out = tmp_path / "run.csv"
    result = gfimu_command("simulate", *arguments, "--out", out)
    assert result.code == 2
    assert message in result.stderr
    assert result.stderr.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_an_unknown_file_format_is_refused(gfimu_command, tmp_path):
    result = gfimu_command("simulate", "rest", "--out", tmp_path / "run.xlsx")
    assert result.code == 2
    assert "use .csv or .parquet" in result.stderr
    assert not list(tmp_path.iterdir())
