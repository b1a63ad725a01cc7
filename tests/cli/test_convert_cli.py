"""`gfimu convert`: a plain csv without a map file, rows left out, a calibration for other programs."""

import json

import mujoco
import numpy as np
import pytest

from gfimu import Calibration
from gfimu.recording import Recording


@pytest.fixture
def log(tmp_path):
    """A plain csv with one row written twice and one corrupt value."""
    rows = [f"{10 * k},{0.1 * (k % 5):.3f},0.0,1.0" for k in range(200)]
    rows[50] = "500,1e19,0.0,1.0"
    rows.insert(100, rows[99])
    path = tmp_path / "log.csv"
    path.write_text("ms,ax,ay,az\n" + "\n".join(rows) + "\n")
    return path


MAP = [
    word
    for key in ("time.column=ms", "time.unit=ms", "unit=g", "channels.a11=ax", "channels.a12=ay", "channels.a13=az")
    for word in ("--map-set", key)
]


def test_a_plain_csv_is_read_by_options_alone(gfimu_command, log, tmp_path):
    out = tmp_path / "run.csv"
    result = gfimu_command("convert", log, out, *MAP, "--drop", "corrupt,duplicates", "--json")
    assert result.code == 0, result.stderr
    figures = json.loads(result.stdout)
    assert (figures["samples"], figures["dropped_rows_corrupt"], figures["dropped_rows_duplicates"]) == (199, 1, 1)
    assert "left out 1 rows with a value that can be no measurement" in result.stderr
    assert "left out 1 rows whose time does not increase (it repeats another row's)" in result.stderr
    assert Recording.read(out).readings[0] == pytest.approx([0.0, 0.0, 9.80665])
    table = gfimu_command("convert", log, out, *MAP, "--drop", "corrupt")
    assert "rows left out as corrupt" in table.stdout


def test_a_mistake_in_an_option_lists_the_keys(gfimu_command, log, tmp_path):
    before = sorted(tmp_path.iterdir())
    result = gfimu_command("convert", log, tmp_path / "run.csv", *MAP, "--map-set", "tim.unit=s")
    assert (result.code, result.stderr.count("\n")) == (2, 1)
    assert "`tim`" in result.stderr
    assert "skip_rows" in result.stderr
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize("name", ["inspect", "convert", "estimate", "noise", "check", "calibrate", "view", "join"])
def test_an_odd_file_never_ends_in_a_traceback(gfimu_command, tmp_path, name):
    """Values of 1e19, bursts of NaN, rows written twice: an answer, or one line that says what to do."""
    rows = [f"{k / 100},{0.01 * (k % 7)},0.0,{9.8 + 0.01 * (k % 3)}" for k in range(600)]
    rows[50] = "0.5,1e19,-1e19,inf"
    rows[100:140] = [f"{k / 100},nan,nan,nan" for k in range(100, 140)]
    for path, doubled in ((tmp_path / "odd.csv", False), (tmp_path / "twice.csv", True)):
        both = [row for row in rows for _ in range(1 + doubled)]
        path.write_text("t_s,a11_m_s2,a12_m_s2,a13_m_s2\n" + "\n".join(both) + "\n")
        (tmp_path / "tacho.csv").write_text("t_s,tacho_rad_s\n" + "".join(f"{k / 50},{k % 9}\n" for k in range(300)))
        more = {
            "convert": ["o.parquet"],
            "estimate": ["--array", "one_adxl345", "--axis", "z", "--out", "o.csv"],
            "check": ["--twin", "cube12_turntable"],
            "view": ["--array", "one_adxl345", "--out", "o.rrd"],
            "join": ["tacho.csv", "--out", "o.csv"],
        }.get(name, [])
        words = [tmp_path / word if "." in word else word for word in more]
        before = ["calibrate", "multi-position"] if name == "calibrate" else [name]
        after = [*words, *(["--out", tmp_path / "c.json"] if name == "calibrate" else [])]
        result = gfimu_command(*before, path, *after)
        assert result.code in (0, 2), result.stderr
        assert "Traceback" not in result.stderr
        errors = [line for line in result.stderr.splitlines() if not line.startswith("gfimu: warning")]
        assert len(errors) == (result.code == 2), result.stderr
        if doubled and name not in ("inspect", "check"):  # the twin of the check has four chips
            assert "--drop duplicates,unordered" in result.stderr


def test_a_calibration_is_written_for_others(gfimu_command, tmp_path):
    free = ("M_xx", "M_yx", "M_yy", "M_zx", "M_zy", "M_zz", "b_x", "b_y", "b_z")
    names = tuple(f"a1_{name}" for name in free)
    values = np.array([26.0 * (name[-1] == name[-2] and "_M_" in name) + ("_b_" in name) for name in names])
    channels = ("a11", "a12", "a13")
    Calibration("multi-position", "lsb", channels, "x_axis", 9.81, names, values, np.eye(9)).save(tmp_path / "cal.json")
    for form, mark in (("kalibr", "imu0:"), ("ros", "SM:")):
        out = tmp_path / f"{form}.yaml"
        result = gfimu_command("convert", tmp_path / "cal.json", out, "--to", form, "--lsb-m-s2", "0.0383")
        assert result.code == 0, result.stderr
        assert f"wrote calibration: {out}" in result.stdout.replace("\n", "")
        assert mark in out.read_text()
    missing = gfimu_command("convert", tmp_path / "cal.json", tmp_path / "x.yaml")
    assert (missing.code, missing.stderr.count("\n")) == (2, 1)
    assert "--to" in missing.stderr
    same = gfimu_command("convert", tmp_path / "cal.json", tmp_path / "cal.json", "--to", "ros")
    assert same.code == 2
    asked = gfimu_command("convert", tmp_path / "cal.json", out, "--to", "ros", "--lsb-m-s2", "0.0383", "--json")
    assert json.loads(asked.stdout)["files"] == {"calibration": str(out)}


def test_an_array_becomes_a_mujoco_model(gfimu_command, tmp_path, project_root):
    array = tmp_path / "mine.toml"
    array.write_bytes((project_root / "models" / "arrays" / "corners8.toml").read_bytes())
    result = gfimu_command("convert", array, tmp_path / "mine.xml", "--to", "motor_turntable", "--json")
    assert result.code == 0, result.stderr
    assert json.loads(result.stdout)["channels"] == 24
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "mine.xml"))
    assert [model.sensor(i).name for i in range(8)] == [f"a{chip}" for chip in range(1, 9)]
    assert model.actuator(0).name == "motor"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["cube12", "x.xml", "--to", "shelf"], "unknown rig 'shelf'; valid: free_cube, motor_turntable, turntable"),
        (["cal.json", "x.xml"], "x.xml: a MuJoCo model is made of an array; give its name or .toml file"),
        (["cube13", "x.xml"], "cube13"),
    ],
)
def test_what_becomes_no_model_is_one_line(gfimu_command, tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cal.json").write_text("{}")
    result = gfimu_command("convert", *arguments)
    assert result.code == 2
    assert message in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "x.xml").exists()
