"""`gfimu demo` and `gfimu view`: the whole job, what it leaves behind, and what they refuse."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from gfimu import Estimate
from gfimu.recording import Recording


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    """One run of the demo: its folder and its JSON."""
    out = tmp_path_factory.mktemp("demo") / "made"
    program = "from gfimu.commands.shell.program import main; main()"
    command = [sys.executable, "-c", program, "demo", "--json", "--out", str(out)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return out, json.loads(done.stdout), done.stderr


def result(report, what):
    return next(row for row in report["results"] if row["what"].startswith(what))


def test_the_geometry_is_the_papers(demo):
    geometry = result(demo[1], "geometry")
    assert geometry["condition_number"] == pytest.approx(2**0.5, abs=1e-12)
    assert geometry["gdop"] == pytest.approx(1.125**0.5, abs=1e-12)
    assert geometry["omega_squared_leakage"] == pytest.approx(0.0, abs=1e-12)


def test_estimates_are_as_good_as_the_noise_allows(demo):
    # 0.0287 m/s² on x and y, 0.0421 on z, over √8 · 0.05 m: 0.203 rad/s² about z; 3000 samples know it to 1.3 %,
    # gain errors add a little while the table speeds up.
    assert result(demo[1], "angular acceleration")["rmse_rad_s2"] == pytest.approx(0.203, rel=0.1)
    rate = result(demo[1], "angular rate")
    assert rate["rmse_rad_s"] < 3 * rate["expected_std_at_end_rad_s"]
    assert rate["rmse_raw_rad_s"] > 10 * rate["rmse_rad_s"]


def test_the_drift_is_within_what_was_expected(demo):
    for row in demo[1]["results"]:
        if row["what"].startswith("position drift"):
            assert 0 < row["error_m"] < 3 * row["expected_m"]


def test_calibration_takes_the_drift_off(demo):
    seen = result(demo[1], "calibrated from 18 poses")
    assert seen["alpha_before_deg_s2"] > 50
    assert seen["alpha_after_deg_s2"] < 5
    rate = result(demo[1], "calibrated: angular rate")
    assert rate["rmse_after_rad_s"] < 0.05 * rate["rmse_before_rad_s"]
    drift = result(demo[1], "calibrated: position drift")
    assert drift["drift_after_m"] < 0.5 * drift["drift_before_m"]


def test_the_files_it_names_are_there_and_can_be_read(demo):
    out, report, _ = demo
    recording = Recording.read(out / "run.parquet")
    assert len(recording) == 3000
    assert len(Estimate.read(out / "estimate.parquet")) == 3000
    for path in report["files"].values():
        assert Path(path).is_file()
    verified = subprocess.run(
        [sys.executable, "-m", "rerun", "rrd", "verify", str(out / "run.rrd")], capture_output=True, check=False
    )
    assert verified.returncode == 0


def test_the_hidden_effects_are_found_with_their_size(demo):
    """Within four standard deviations, which chance leaves once in 16 000 times."""
    for what in ("hidden tilt", "hidden offset"):
        found = result(demo[1], what)
        assert found["verdict"] == "explained"
        assert found["found"] == pytest.approx(found["hidden"], abs=4 * found["std"])


def test_a_pipe_has_no_progress(demo):
    assert demo[2] == ""


def test_a_folder_that_cannot_be_made_is_bad_input(gfimu_command, tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("")
    done = gfimu_command("demo", "--out", blocked / "below")
    assert done.code == 2
    assert "choose a folder" in done.stderr
    assert "Traceback" not in done.stderr


def test_view_makes_a_picture_of_a_recording(gfimu_command, demo, tmp_path):
    out = tmp_path / "picture.rrd"
    done = gfimu_command("view", demo[0] / "run.parquet", "--out", out)
    assert done.code == 0, done.stderr
    assert out.read_bytes()[:3] == b"RRF"


def test_view_without_a_display_says_what_to_do(gfimu_command, demo, monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    done = gfimu_command("view", demo[0] / "run.rrd")
    assert done.code == 1
    assert "rerun --web-viewer" in done.stderr


@pytest.mark.parametrize(("name", "content"), [("run.rrd", b"junk"), ("run.csv", b""), ("run.csv", b"\x00\xff\x01")])
def test_view_refuses_what_it_cannot_show(gfimu_command, tmp_path, name, content):
    file = tmp_path / name
    file.write_bytes(content)
    done = gfimu_command("view", file)
    assert done.code == 2
    assert str(file) in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == [file]
