"""`gfimu diagnose`: what it leaves behind, hard input that still gets a verdict, bad input that gets one line."""

from __future__ import annotations

import json
import re
import signal
import time
from dataclasses import replace

import numpy as np
import pytest

from gfimu import AccelerometerArray, Recording
from gfimu.base import find_model
from gfimu.diagnosis import check_time
from sim import SplineSpin
from sim.effects import make_effect
from sim.scenarios import Scenario
from sim.simulation import simulate
from sim.trials import Measurement, measure, random_profile
from sim.twin import Twin

TWIN = "cube12_turntable"
FILES = {"verdict.json", "twin.toml", "report.html", "diagnosis.rrd"}
SETTING = Measurement(duration=16.0)


@pytest.fixture(scope="module")
def ordinary() -> Recording:
    """A run of a world with nothing wrong in it."""
    return measure(np.random.default_rng(5), Twin.load(TWIN), (), SETTING)


@pytest.fixture(scope="module")
def eccentric(tmp_path_factory):
    """A run of calibrated sensors on a cube 3 mm and −2 mm off the axis, simulated in MuJoCo; 20 s of it."""
    path = tmp_path_factory.mktemp("runs") / "eccentric.parquet"
    scenario = Scenario.load("eccentric_mount", changes=["sensor.errors=false"])
    recording = simulate(scenario, seed=3)
    recording.slice(0, 2000).write(path)
    return path


@pytest.fixture
def plain_report(monkeypatch):
    """Call it and the reports from then on are a word: the report has tests of its own, and drawing takes seconds."""

    def spare() -> None:
        monkeypatch.setattr(
            "gfimu.diagnosis.report.page.write_report", lambda path, diagnosis, rig: path.write_text("report")
        )

    return spare


def test_a_hidden_cause_is_found_told_and_written(gfimu_command, eccentric, tmp_path, plain_report):
    out = tmp_path / "made"
    done = gfimu_command("diagnose", eccentric, "--twin", TWIN, "--out", out)
    assert done.code == 0, done.stderr
    assert "Found what the simulation leaves out: the whole array is off the table's axis." in " ".join(
        done.stdout.split()
    )
    assert "eccentricity" in done.stdout
    assert "before" in done.stdout
    assert {file.name for file in out.iterdir()} == FILES
    for name in FILES:
        assert name in done.stdout.replace("\n", "")
    verdict = json.loads((out / "verdict.json").read_text())
    assert verdict["verdict"] == "explained"
    (cause,) = verdict["causes"]
    assert cause["effect"] == "eccentricity"
    for key, true in (("x_m", 0.003), ("y_m", -0.002)):
        found = cause["parameters"][key]
        assert found["value"] == pytest.approx(true, abs=4 * found["std"])
    residual = verdict["residual"]
    assert set(residual["before_by_channel"]) == set(AccelerometerArray.load("cube12").channels)
    assert residual["rms_after"] < 1.05 * residual["noise_floor"] < residual["rms_before"]

    # The extended twin loads back and simulates; with it the same data hold nothing more.
    plain_report()
    again = gfimu_command("diagnose", eccentric, "--twin", out / "twin.toml", "--out", tmp_path / "again", "--json")
    assert again.code == 0, again.stderr
    report = json.loads(again.stdout)
    assert report["verdict"] == "nothing_found"
    assert report["causes"] == []
    assert set(report["files"]) == {"verdict", "extended twin", "report", "rerun recording"}
    assert gfimu_command("simulate", out / "twin.toml", "--out", tmp_path / "again.parquet").code == 0


@pytest.mark.study
def test_an_uncalibrated_unit_is_told_to_be_calibrated_and_then_only_the_rig_is_left(
    gfimu_command, tmp_path, plain_report
):
    run, poses, cal = tmp_path / "run.parquet", tmp_path / "poses.parquet", tmp_path / "cal.json"
    simulate(Scenario.load("eccentric_mount"), seed=3).slice(0, 2400).write(run)
    simulate(Scenario.load("calibration_poses"), seed=3).write(poses)
    raw = gfimu_command("diagnose", run, "--twin", TWIN, "--out", tmp_path / "raw")
    assert raw.code == 0, raw.stderr
    assert "If the unit is not calibrated, do that first" in " ".join(raw.stdout.split())
    assert "If the unit is not calibrated, do that first" in (tmp_path / "raw" / "report.html").read_text()
    plain_report()
    made = gfimu_command("calibrate", "twelve-position", poses, "--array", "cube12", "--out", cal)
    assert made.code == 0, made.stderr
    done = gfimu_command("diagnose", run, "--twin", TWIN, "--calibration", cal, "--out", tmp_path / "cal", "--json")
    assert done.code == 0, done.stderr
    verdict = json.loads(done.stdout)
    (cause,) = verdict["causes"]
    assert cause["effect"] == "eccentricity"
    for key, true in (("x_m", 0.003), ("y_m", -0.002)):
        assert cause["parameters"][key]["value"] == pytest.approx(true, abs=4 * cause["parameters"][key]["std"])


def test_a_calibration_of_another_unit_is_refused(gfimu_command, ordinary, tmp_path):
    ordinary.write(tmp_path / "run.parquet")
    (tmp_path / "cal.json").write_text("{}")
    out = tmp_path / "out"
    done = gfimu_command(
        *("diagnose", tmp_path / "run.parquet", "--twin", TWIN, "--calibration", tmp_path / "cal.json", "--out", out)
    )
    assert done.code == 2
    assert "cal.json" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert not out.exists()


def test_fitted_positions_of_a_calibration_are_the_twins(gfimu_command, ordinary, tmp_path, plain_report):
    plain_report()
    run, cal, out = tmp_path / "run.parquet", tmp_path / "cal.json", tmp_path / "out"
    ordinary.write(run)
    for scenario in ("calibration_poses", "tumble"):
        simulate(Scenario.load(scenario, changes=["sensor.errors=false"]), seed=3).write(
            tmp_path / f"{scenario}.parquet"
        )
    files = (tmp_path / "calibration_poses.parquet", "--motion", tmp_path / "tumble.parquet")
    assert gfimu_command("calibrate", "array", *files, "--array", "cube12", "--out", cal).code == 0
    done = gfimu_command("diagnose", run, "--twin", TWIN, "--calibration", cal, "--out", out)
    assert done.code == 0, done.stderr
    fitted, drawn = (Twin.load(name).array.chip_positions for name in (out / "twin.toml", TWIN))
    assert 0 < np.abs(fitted - drawn).max() < 0.01


def test_an_array_file_moves_with_the_twin(gfimu_command, ordinary, tmp_path, plain_report):
    plain_report()
    text = AccelerometerArray.load("cube12").to_toml().replace('"cube12"', '"mine"')
    (tmp_path / "mine.toml").write_text(text.replace('"adxl345"', '"my_part.toml"', 1))
    (tmp_path / "my_part.toml").write_text(find_model("parts", "adxl345").read_text())
    (tmp_path / "twin.toml").write_text('array = "mine.toml"\n')
    ordinary.write(tmp_path / "run.parquet")
    out = tmp_path / "out"
    done = gfimu_command("diagnose", tmp_path / "run.parquet", "--twin", tmp_path / "twin.toml", "--out", out, "--json")
    assert done.code == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["verdict"] == "nothing_found"
    assert Twin.load(out / "twin.toml").array.name == "mine"
    assert {str(file) for file in out.iterdir()} == set(found["files"].values())
    assert found["files"]["array"] == str(out / "array.toml")
    assert found["files"]["part my_part"] == str(out / "my_part.toml")


def rest() -> Recording:
    still = SplineSpin.through(np.arange(-2.0, 20.0, 0.01), np.zeros(2200))
    return measure(np.random.default_rng(6), Twin.load(TWIN), (), SETTING, motion=still)


def dead_channel(recording: Recording, value: float) -> Recording:
    readings = recording.readings.copy()
    readings[:, 4] = value
    return replace(recording, readings=readings)


def slow_tacho(recording: Recording) -> Recording:
    tacho = recording.reference["tacho_rad_s"].copy()
    tacho[np.arange(len(tacho)) % 2 != 0] = np.nan
    return replace(recording, reference={**recording.reference, "tacho_rad_s": tacho})


def lost_frames(recording: Recording) -> Recording:
    kept = np.delete(np.arange(len(recording)), np.random.default_rng(1).choice(np.arange(1, 1500), 30, replace=False))
    reference = {key: value[kept] for key, value in recording.reference.items()}
    return replace(recording, t_s=recording.t_s[kept], readings=recording.readings[kept], reference=reference)


def clipped(recording: Recording) -> Recording:
    motion = random_profile(np.random.default_rng(17), SETTING.duration, top_rate=25.0)  # up to 27 m/s²
    effect = make_effect("saturation", {"limit_m_s2": 12.0})
    return measure(np.random.default_rng(8), Twin.load(TWIN), (effect,), SETTING, motion=motion)


HARD = {
    "no rotation": (lambda recording: rest(), "nothing_found", set()),
    "a channel that reads zero": (lambda recording: dead_channel(recording, 0.0), "explained", {"stuck_channel"}),
    "tachometer at half the rate": (slow_tacho, "nothing_found", set()),
    "lost frames": (lost_frames, "explained", {"dropped_frames"}),
    "saturated": (clipped, "explained", {"saturation"}),
    "axes swapped": (
        lambda recording: replace(recording, readings=recording.readings[:, [1, 0, *range(2, 12)]]),
        "explained",
        {"axis_swap"},
    ),
}


@pytest.mark.parametrize(("change", "verdict", "causes"), HARD.values(), ids=HARD)
def test_hard_input_gets_a_verdict(gfimu_command, ordinary, tmp_path, plain_report, change, verdict, causes):
    plain_report()
    change(ordinary).write(tmp_path / "run.parquet")
    done = gfimu_command("diagnose", tmp_path / "run.parquet", "--twin", TWIN, "--out", tmp_path / "out", "--json")
    assert done.code == 0, done.stderr
    found = json.loads(done.stdout)
    assert (found["verdict"], {cause["effect"] for cause in found["causes"]}) == (verdict, causes), found["sentences"]
    assert {file.name for file in (tmp_path / "out").iterdir()} == FILES


def signalling(number):
    """A search during which the program gets a signal; with none it takes longer than any limit."""

    def understood(self, models=None):
        if number is None:
            time.sleep(0.2)
            check_time()
        signal.raise_signal(number)

    return understood


@pytest.mark.parametrize(
    ("number", "by", "code"),
    [(None, "time limit", 0), (signal.SIGINT, "Ctrl-C", 130), (signal.SIGTERM, "SIGTERM", 143)],
)
@pytest.mark.parametrize("for_machines", [True, False])
def test_what_is_known_is_written_and_printed_when_it_is_ended(
    gfimu_command, ordinary, tmp_path, plain_report, monkeypatch, number, by, code, for_machines
):
    plain_report()
    monkeypatch.setattr("gfimu.diagnosis.steps.Steps.understood", signalling(number))
    ordinary.write(tmp_path / "run.parquet")
    options = ["--time-limit", "0.1"] if number is None else []
    out = tmp_path / "made"
    words = ["diagnose", tmp_path / "run.parquet", "--twin", TWIN, "--out", out, *options]
    done = gfimu_command(*words, *(["--json"] if for_machines else []))
    assert done.code == code, done.stderr
    assert done.stderr == f"gfimu: ended by {by} (search); the result is what was known\n"
    assert {file.name for file in out.iterdir()} == FILES
    written = json.loads((out / "verdict.json").read_text())
    assert written["verdict"] == "unknown"
    assert (written["interrupted"]["by"], written["interrupted"]["done"]) == (by, ["samples"])
    if for_machines:
        assert json.loads(done.stdout)["interrupted"] == written["interrupted"]
    else:
        assert f"No verdict: the search was interrupted ({by})" in " ".join(done.stdout.split())
        assert "prediction error, rms" in done.stdout


def test_a_dead_channel_is_named_in_the_report(gfimu_command, ordinary, tmp_path):
    dead_channel(ordinary, np.nan).write(tmp_path / "run.parquet")
    done = gfimu_command("diagnose", tmp_path / "run.parquet", "--twin", TWIN, "--out", tmp_path / "out")
    assert done.code == 0, done.stderr
    assert "Nothing is wrong with the simulation" in done.stdout
    assert "Left out for want of a usable sample: a22." in " ".join(done.stdout.split())
    assert "a22" in re.sub(r"<svg.*?</svg>", "", (tmp_path / "out" / "report.html").read_text(), flags=re.DOTALL)


def renamed(recording: Recording) -> Recording:
    return replace(recording, channels=tuple(name.replace("a", "m") for name in recording.channels))


BAD = {
    "too short": (lambda recording: recording.slice(0, 150), ["too short", "record at least"]),
    "no drive column": (lambda recording: replace(recording, reference={}), ["tacho_rad_s is missing", "drive source"]),
    "drive column empty": (
        lambda recording: replace(recording, reference={"tacho_rad_s": np.full(len(recording), np.nan)}),
        ["tacho_rad_s", "fewer than 20 values"],
    ),
    "another drive there": (
        lambda recording: replace(recording, reference={"command_rad_s": recording.reference["tacho_rad_s"]}),
        ["set source = 'command'"],
    ),
    "no reading at all": (
        lambda recording: replace(recording, readings=np.full_like(recording.readings, np.nan)),
        ["no channel has a value"],
    ),
    "wrong array": (renamed, ["a11_m_s2", "missing", "name the array"]),
}


@pytest.mark.parametrize(("change", "words"), BAD.values(), ids=BAD)
def test_bad_recording(gfimu_command, ordinary, tmp_path, change, words):
    change(ordinary).write(tmp_path / "run.parquet")
    done = gfimu_command("diagnose", tmp_path / "run.parquet", "--twin", TWIN, "--out", tmp_path / "out")
    assert done.code == 2
    assert done.stdout == ""
    assert done.stderr.startswith("gfimu: ")
    assert done.stderr.count("\n") == 1
    for word in ["run.parquet", *words]:
        assert word in done.stderr
    assert [file.name for file in tmp_path.iterdir()] == ["run.parquet"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--twin", "cube13", "--out", "out"], ["unknown twin 'cube13'", TWIN]),
        (["--twin", "none/twin.toml", "--out", "out"], ["none/twin.toml", "no such file"]),
        (["--twin", TWIN, "--out", "run.parquet"], ["run.parquet", "choose a folder"]),
        (["--twin", TWIN, "--out", "out", "--time-limit", "0"], ["time limit is 0 s", "above zero"]),
        (["--twin", TWIN, "--out", "out", "--held-out", "gone.csv"], ["gone.csv", "no such file"]),
    ],
)
def test_bad_option(gfimu_command, ordinary, tmp_path, monkeypatch, options, words):
    monkeypatch.chdir(tmp_path)
    ordinary.write("run.parquet")
    done = gfimu_command("diagnose", "run.parquet", *options)
    assert done.code == 2
    assert done.stdout == ""
    for word in words:
        assert word in done.stderr
    assert [file.name for file in tmp_path.iterdir()] == ["run.parquet"]
