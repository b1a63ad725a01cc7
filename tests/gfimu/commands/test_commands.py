"""The functions under the commands: paths or objects in, the result out; and what type checkers see of them."""

from __future__ import annotations

import importlib
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import gfimu
from gfimu import InputError


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A short recording on the table, as an object and as a file."""
    file = tmp_path_factory.mktemp("made") / "run.parquet"
    recording = gfimu.simulate("paper_run", out=file, seed=3, changes=["duration_s=4"])
    return recording, file


def test_simulate_returns_what_it_writes(made, tmp_path):
    recording, file = made
    np.testing.assert_array_equal(gfimu.Recording.read(file).readings, recording.readings)
    raw = gfimu.simulate("rest", changes=["duration_s=1"], raw=True, rrd=tmp_path / "raw.rrd")
    assert raw.unit == "lsb"
    assert (tmp_path / "raw.rrd").read_bytes()[:4] == b"RRF2"


def test_estimate_takes_paths_and_objects(made, tmp_path):
    recording, file = made
    cube = gfimu.AccelerometerArray.load("cube12")
    expected = gfimu.estimate(recording, cube)
    for found in (
        gfimu.estimate(file),
        gfimu.estimate(str(file), "cube12", out=tmp_path / "e.csv", rrd=tmp_path / "e.rrd"),
        gfimu.estimate(recording),
    ):
        np.testing.assert_array_equal(found.omega, expected.omega)
    np.testing.assert_allclose(gfimu.Estimate.read(tmp_path / "e.csv").omega, expected.omega)
    assert gfimu.estimate(file, position=True).position is not None
    rested = gfimu.estimate(file, rest_bias=True)
    assert "rest_bias_m_s2" in rested.metadata


def test_a_calibration_is_applied_to_an_object_as_to_a_file(tmp_path):
    poses = gfimu.simulate("calibration_poses")
    unit = gfimu.calibrate("array", poses, out=tmp_path / "cal.json")
    np.testing.assert_allclose(
        gfimu.estimate(poses, calibration=unit).p, gfimu.estimate(poses, calibration=tmp_path / "cal.json").p
    )


def test_convert_noise_and_view(made, tmp_path):
    _, file = made
    assert len(gfimu.convert(file, tmp_path / "run.csv")) == len(gfimu.convert(tmp_path / "run.csv"))
    found = gfimu.noise(file, stretch="all", kalibr=tmp_path / "imu.yaml")
    assert set(found.models) == set(gfimu.AccelerometerArray.load("cube12").channels)
    assert (tmp_path / "imu.yaml").is_file()
    assert gfimu.noise(made[0], stretch="all").to_dict()["rate_hz"] == pytest.approx(100)
    assert gfimu.view(file, out=tmp_path / "look.rrd").read_bytes()[:4] == b"RRF2"


def test_score_and_optimize(tmp_path):
    (cube,) = gfimu.score("cube12")
    assert cube.condition_number == pytest.approx(2**0.5)
    assert len(gfimu.score()) > 5
    fast = gfimu.score("cube12", speed_rad_s=2.0, spin_axis="x")[0]
    np.testing.assert_array_equal(fast.omega_rad_s, [2.0, 0.0, 0.0])
    np.testing.assert_array_equal(gfimu.score("cube12", omega_rad_s=[1, 2, 3])[0].omega_rad_s, [1, 2, 3])
    best = gfimu.optimize(chips=4, restarts=2, seed=5, out=tmp_path / "best.toml")
    assert gfimu.AccelerometerArray.load(tmp_path / "best.toml").name == best.array.name == "best"
    again = gfimu.optimize(4, rng=np.random.default_rng(5), restarts=2)
    assert again.score.gdop == best.score.gdop


def test_drift_with_a_monte_carlo():
    found = gfimu.drift("cube12", duration=0.3, bias_mg=35.0, monte_carlo=20)
    assert found.sample is not None
    assert found.to_dict()["monte_carlo"]["runs"] == 20
    assert gfimu.drift(gfimu.AccelerometerArray.load("cube12"), noise_ug=290.0).sample is None


def test_live_reads_lines(made):
    recording, _ = made
    rows = np.column_stack([recording.t_s, recording.readings])[:50].tolist()
    header = ",".join(["t_s", *(f"{name}_m_s2" for name in recording.channels)])
    lines = [header, *(",".join(map(repr, row)) for row in rows)]
    found = [json.loads(line) for line in gfimu.live("cube12", 100.0, source=lines)]
    np.testing.assert_allclose([line["t_s"] for line in found], recording.t_s[:50])


def test_wrong_arguments_are_named():
    with pytest.raises(InputError, match="seed -1"):
        gfimu.simulate("rest", seed=-1)
    with pytest.raises(InputError, match="give chips"):
        gfimu.optimize()
    with pytest.raises(InputError, match="does not carry its array"):
        gfimu.estimate(gfimu.Recording(np.arange(3.0), np.zeros((3, 1)), ("a11",)))
    with pytest.raises(TypeError, match="nonsense"):
        gfimu.convert("run.csv", nonsense=1)


SNIPPET = """
import gfimu

reveal_type(gfimu.simulate)
reveal_type(gfimu.Recording.read("run.csv"))
reveal_type(gfimu.estimate("run.csv").omega)
reveal_type(gfimu.diagnose("run.csv", "cube12_turntable", out="d"))
reveal_type(gfimu.firmware.run(duration=1.0).recording)
reveal_type(gfimu.noise)
reveal_type(gfimu.drift().budget)
gfimu.nonsense
gfimu.estimate("run.csv", methd="filter")
"""

NOTES = [
    "scenarios.Scenario | str | pathlib",
    "gfimu.recording.recording.Recording",
    "ndarray",
    "gfimu.diagnosis.verdict.verdict.Diagnosis",
    "gfimu.recording.recording.Recording",
    "RecordingNoise",
    "gfimu.budget.drift.budget.DriftBudget",
]


def test_type_checkers_see_real_types(tmp_path, project_root):
    """What a user's mypy and editor see: no `Any` behind the names that load on first use, and misspelt ones."""
    (tmp_path / "user.py").write_text(SNIPPET)
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--config-file", "", "--ignore-missing-imports", "--follow-imports", "silent",
         "--cache-dir", str(project_root / ".mypy_cache" / "user"), str(tmp_path / "user.py")],
        cwd=project_root, capture_output=True, text=True, check=False,
    )  # fmt: skip
    notes = [line.partition("Revealed type is ")[2] for line in done.stdout.splitlines() if "Revealed" in line]
    assert len(notes) == len(NOTES), done.stdout
    for note, part in zip(notes, NOTES, strict=True):
        assert part in note, done.stdout
        assert note != '"Any"'
    errors = [line for line in done.stdout.splitlines() if "error:" in line and "user.py" in line]
    assert len(errors) == 2, done.stdout
    assert 'has no attribute "nonsense"' in errors[0]
    assert 'Unexpected keyword argument "methd"' in errors[1]


@pytest.mark.parametrize("package", ["gfimu", "sim", "firmware_bridge"])
def test_packages_say_that_they_are_typed(project_root, package):
    assert Path(project_root / package / "py.typed").is_file()


def test_design_takes_a_twin_or_its_name(tmp_path):
    from sim.twin import Twin

    quick = {"max_rate": 8.0, "duration": 20.0, "evaluations": 1, "upright": True}
    effects = ["gravity", "tacho_scale"]
    by_name = gfimu.design("cube12_turntable", effects, out=tmp_path / "next.toml", **quick)
    by_twin = gfimu.design(Twin.load("cube12_turntable"), effects, **quick)
    assert by_twin.to_toml() == by_name.to_toml() == (tmp_path / "next.toml").read_text()
    with pytest.raises(InputError, match="name effects"):
        gfimu.design("cube12_turntable")


def test_diagnose_takes_paths_and_objects(made, monkeypatch):
    from sim.twin import Twin

    recording, file = made
    calls = []

    def explain(recordings, model, *, held_out, names, report, force):
        calls.append((len(recordings), model.array.name, len(held_out), names))

    monkeypatch.setattr(importlib.import_module("gfimu.diagnosis.diagnose"), "diagnose", explain)
    gfimu.diagnose(file, "cube12_turntable")
    gfimu.diagnose([recording, str(file)], Twin.load("cube12_turntable"), held_out=replace(recording))
    gfimu.diagnose((file, file), "cube12_turntable", names=["one", "other"])
    assert calls == [
        (1, "cube12", 0, ["run.parquet"]),
        (2, "cube12", 1, ["run 1", "run.parquet"]),
        (2, "cube12", 0, ["one", "other"]),
    ]
