"""Commands on a recording that carries its array: no --array, wherever the array's file is."""

import importlib
import json
import subprocess
import sys

import numpy as np
import pytest

from gfimu import AccelerometerArray, GfimuError, Recording
from gfimu.recording import open_run
from sim.simulation import simulate

SCENARIO = """
array = "parts_box/own.toml"
sample_rate_hz = 100.0
[[motion.segment]]
kind = "hold"
duration_s = 4.0
[[motion.segment]]
kind = "ramp"
to_rad_s = 5.0
duration_s = 2.0
[[motion.segment]]
kind = "hold"
duration_s = 2.0
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A recording simulated with an array and a part of the user's own, whose files are gone since."""
    folder = tmp_path_factory.mktemp("own")
    box = folder / "parts_box"
    box.mkdir()
    shipped = AccelerometerArray.load("cube12").to_toml().replace("cube12", "garage cube").replace("0.05", "0.06")
    (box / "own.toml").write_text(shipped.replace('"adxl345"', '"chip.toml"'), encoding="utf-8")
    part = "lsb_m_s2 = 0.02\nfull_range_m_s2 = 300.0\nrange_g = [16, 30]\nnoise_lsb_rms_100_hz = [1.0, 1.0, 1.0]\n"
    (box / "chip.toml").write_text(part + "offset_std_m_s2 = [0.1, 0.1, 0.1]\n", encoding="utf-8")
    (folder / "own_run.toml").write_text(SCENARIO, encoding="utf-8")
    out = folder / "run.csv"
    simulate(str(folder / "own_run.toml"), out=out)
    for file in box.iterdir():
        file.unlink()
    return out


def test_a_simulation_carries_the_array_and_its_part(run):
    recording, array = open_run(run)
    assert (array.name, array.chips[0].part, list(array.part_files)) == ("garage cube", "chip.toml", ["chip.toml"])
    assert array.positions[0, 0] == 0.06
    assert recording.metadata["lsb_m_s2"] == 0.02


@pytest.mark.parametrize(
    "arguments",
    [
        ("estimate", "RUN", "--method", "filter", "--out", "OUT/e.parquet"),
        ("view", "RUN", "--out", "OUT/r.rrd"),
        ("noise", "RUN"),
        ("calibrate", "array", "RUN", "--out", "OUT/c.json"),
        ("convert", "RUN", "OUT/again.parquet"),
    ],
    ids=lambda arguments: arguments[0],
)
def test_commands_need_no_array(run, tmp_path, monkeypatch, gfimu_command, arguments):
    monkeypatch.chdir(tmp_path)
    result = gfimu_command(*(part.replace("RUN", str(run)).replace("OUT", str(tmp_path)) for part in arguments))
    if arguments[0] == "calibrate":  # a spin is no set of poses; what matters is that the array was found
        assert "array" not in result.stderr.split(":")[-1].split(";")[0]
    else:
        assert result.code == 0, result.stderr


def test_a_converted_recording_carries_the_array(run, tmp_path, gfimu_command):
    target = tmp_path / "again.parquet"
    assert gfimu_command("convert", run, target).code == 0
    assert open_run(target)[1].to_toml() == open_run(run)[1].to_toml()
    assert gfimu_command("convert", run, target, "--array", "cube12").code == 0
    assert open_run(target)[1].name == "cube12"
    assert Recording.read(target).metadata["part"] == "adxl345"
    assert "parts_toml" not in Recording.read(target).metadata


def test_array_given_overrides(run, tmp_path, gfimu_command):
    result = gfimu_command("estimate", run, "--array", "cube12", "--out", tmp_path / "e.csv", "--json")
    assert result.code == 0, result.stderr
    assert json.loads(result.stdout)["array"] == "cube12"


def test_a_damaged_array_is_one_line(run, tmp_path, gfimu_command):
    text = run.read_text(encoding="utf-8").replace("[[chip]]", "[[chip]", 1)
    damaged = tmp_path / "damaged.csv"
    damaged.write_text(text, encoding="utf-8")
    for command in (("estimate", damaged, "--out", tmp_path / "e.csv"), ("convert", damaged, tmp_path / "c.csv")):
        result = gfimu_command(*command)
        assert (result.code, result.stderr.count("\n")) == (2, 1)
        assert "array_toml is damaged" in result.stderr
        assert "--array" in result.stderr
    assert gfimu_command("estimate", damaged, "--array", "cube12", "--out", tmp_path / "e.csv").code == 0


def live(text, *options):
    return subprocess.run(
        [sys.executable, "-m", "gfimu", "live", "--rate", "100", *options],
        input=text, capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip


def test_live_takes_the_array_from_the_head_of_the_stream(run):
    text = run.read_text(encoding="utf-8")
    by_head = live(text)
    assert by_head.returncode == 0, by_head.stderr
    lines = [json.loads(line) for line in by_head.stdout.splitlines()]
    assert len(lines) == len(Recording.read(run))
    assert lines[-1]["omega_rad_s"][2] == pytest.approx(5.0, abs=0.5)
    without = live("".join(line for line in text.splitlines(keepends=True) if not line.startswith("#")))
    assert (without.returncode, without.stderr.count("\n")) == (2, 1)
    assert "give --array" in without.stderr


@pytest.fixture
def no_search(monkeypatch):
    """Replace the diagnosis by an error, as only what is said before it matters."""

    def stop(*_, **__):
        raise GfimuError("stopped")

    monkeypatch.setattr(importlib.import_module("gfimu.diagnosis.diagnose"), "prepare", stop)


@pytest.mark.usefixtures("no_search")
def test_diagnose_uses_the_twins_array_and_says_so(run, tmp_path, gfimu_command):
    arguments = ("--twin", "cube12_turntable", "--out", tmp_path / "d")
    result = gfimu_command("diagnose", run, *arguments)
    note, error = result.stderr.splitlines()
    assert note == (
        "gfimu: warning: run.csv: recorded with array 'garage cube', but the twin's 'cube12' is used; "
        "they differ: positions by up to 17.3 mm"
    )
    assert error == "gfimu: stopped"
    own = Recording.from_arrays(np.arange(20) / 100, np.zeros((20, 12)), AccelerometerArray.load("cube12"))
    own.write(tmp_path / "own.csv")
    assert gfimu_command("diagnose", tmp_path / "own.csv", *arguments).stderr == "gfimu: stopped\n"


def test_a_twin_finds_its_part_file_beside_it_and_passes_it_on(tmp_path, monkeypatch):
    from sim.twin import Twin

    place = tmp_path / "twin"
    place.mkdir()
    (place / "chip.toml").write_text(
        "lsb_m_s2 = 0.02\nfull_range_m_s2 = 300.0\nrange_g = [16, 30]\nnoise_lsb_rms_100_hz = [1.0, 1.0, 1.0]\n",
        encoding="utf-8",
    )
    (place / "twin.toml").write_text('array = "cube12"\n[sensor]\npart = "chip.toml"\n', encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    twin = Twin.load(place / "twin.toml")
    assert twin.expected_noise(100.0).quantum == 0.02
    assert list(twin.array.part_files) == ["chip.toml"]  # what write_result puts beside the extended twin
