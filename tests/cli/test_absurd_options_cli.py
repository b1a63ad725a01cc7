"""Options out of all proportion, and options that a command would ignore, are one line and exit code 2."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

import gfimu

ABSURD = [
    ("optimize --chips 100000", "at most 200 chips"),
    ("optimize --chips 4 --restarts 1000000000", "100000 restarts"),
    ("drift --duration 1e9 --bias-mg 1", "time is"),
    ("drift --duration 1e308 --bias-mg 1e308", "bias"),
    ("drift --monte-carlo 1000000000 --bias-mg 1", "take too long"),
    ("drift --gravity inf --bias-mg 1", "gravity"),
    ("score cube12 --speed-rad-s 1e308", "--speed-rad-s"),
    ("score one_chip --axis z --rate 1e12", "samples"),
    ("score one_chip --axis z --bias-std-m-s2 1e29", "bias_std_m_s2"),
    ("simulate rest --out x.csv --set duration_s=1e9", "samples"),
    ("simulate hand --out x.csv --set duration_s=1e29", "samples"),
    ("simulate hand --out x.csv --set motion.pace_s=1e-9", "movements"),
    ("simulate paper_run --out x.csv --set motion.segment=[{kind='ramp',to_rad_s=1.0,duration_s=1e-29}]", "a piece of"),
    ("simulate rest --out x.csv --set gravity_m_s2=-1" + "0" * 400, "gravity_m_s2"),
    ("design bias gravity --twin cube12_turntable --duration 1e9", "duration"),
    ("live --array cube12 --rate 1e308 --from run.csv", "--rate"),
    ("live --array cube12 --rate 1e-308 --from run.csv", "--rate"),
    ("live --array cube12 --rate 100 --bias-std-m-s2 1e29 --from run.csv", "bias_std"),
    ("calibrate six-position run.csv --out c.json --min-rest 1e29", "shortest rest"),
    ("join run.csv tacho.csv --array cube12 --out j.csv --most-rate-error 1e29", "rate error"),
    ("estimate run.csv --array cube12 --out e.csv --axis z --point-std-m 1e29", "point_std_m"),
    (
        "simulate hand --out x.csv --set duration_s=1e308",
        "duration_s = 1e+308 must be a finite number, zero or between 1e-60 and 1e+30",
    ),
    (
        "estimate run.csv --array cube12 --out e.csv --axis z --axis-point 0 1e308 0",
        "--axis-point 0.0 1e+308 0.0: must be",
    ),
    ("drift --gravity 0 --bias-mg 1", "gravity"),
    ("drift --gravity -9.8 --bias-mg 1", "gravity"),
    ("show " + "n" * 300 + ".toml", "File name too long"),
    ("convert run.csv x.csv --drop caf\udce9", "caf\\udce9"),
]

WITHOUT_EFFECT = [
    ("calibrate array run.csv --out c.json --parameters 10", "--parameters"),
    ("calibrate six-position run.csv --out c.json --parameters 10", "10 parameters"),
    ("calibrate six-position run.csv --out c.json --turn-on-std 1", "--update"),
    ("calibrate array run.csv --out c.json --bias-walk 0.1", "--update"),
    ("estimate run.csv --array cube12 --out e.csv --axis-point 1 0 0", "--axis"),
    ("estimate run.csv --array cube12 --out e.csv --hub free", "--axis"),
    ("score cube12 --hub free", "--axis"),
    ("noise run.csv --axis-point 1 0 0", "--axis"),
    ("view run.csv --array cube12 --out v.rrd --hub free", "--axis"),
]


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder with a recording at rest and a tachometer."""
    monkeypatch.chdir(tmp_path)
    gfimu.simulate("rest", seed=1, changes=["duration_s=3"], out="run.csv")
    (tmp_path / "tacho.csv").write_text("t_s,tacho_rad_s\n" + "".join(f"{0.1 * k},{k % 7}\n" for k in range(30)))
    return tmp_path


@pytest.mark.parametrize(("call", "word"), ABSURD + WITHOUT_EFFECT, ids=lambda text: text[:60])
def test_one_line_and_nothing_written(gfimu_command, here, call, word):
    before = sorted(file.name for file in here.iterdir())
    result = gfimu_command(*call.split())
    assert result.code == 2, result
    assert result.stderr.count("\n") == 1, result.stderr
    assert word in result.stderr
    assert result.stdout == ""
    assert sorted(file.name for file in here.iterdir()) == before


@pytest.mark.skipif(sys.platform != "linux", reason="devices of Linux")
@pytest.mark.parametrize("source", ["/dev/zero", "pipe", "folder", "n" * 5000, "circle"])
@pytest.mark.parametrize(
    "command", ["estimate", "convert", "inspect", "noise", "view", "calibrate six-position", "live"]
)
def test_what_is_no_file_is_refused_at_once(gfimu_command, tmp_path, monkeypatch, source, command):
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe")
    os.mkdir("folder")  # noqa: PTH102
    os.symlink("circle", "circle")  # noqa: PTH211
    more = {"estimate": ["--out", "x.csv"], "convert": ["x.csv"], "view": ["--out", "x.rrd"]}.get(command, [])
    more = ["--out", "x.json"] if command.startswith("calibrate") else more
    words = ["live", "--from", source] if command == "live" else [*command.split(), source, *more]
    result = gfimu_command(*words)
    assert result.code == 2, result
    assert result.stderr.count("\n") == 1, result.stderr
    assert len(result.stderr) < 3000


def test_a_large_mjcf_is_refused_before_it_is_compiled(gfimu_command, tmp_path):
    inner = "<body><geom size='0.1'/><site name='s'/></body>"
    for count in ("100000000", "9" * 30):
        many = f"<replicate count='{count}' offset='1 0 0'>{inner}</replicate>"
        (tmp_path / "many.xml").write_text(f"<mujoco><worldbody>{many}</worldbody></mujoco>")
        (tmp_path / "around.xml").write_text("<mujoco><include file='many.xml'/></mujoco>")
        for name in ("many.xml", "around.xml"):
            result = gfimu_command("score", tmp_path / name)
            assert result.code == 2
            assert "more than 50000 elements" in result.stderr


@pytest.mark.parametrize(
    "content",
    [
        "<asset><texture name='t' builtin='flat' width='100000' height='100000'/></asset>",
        "<asset><texture name='t' type='2d' file='/dev/zero'/><mesh name='m' file='../elsewhere.stl'/></asset>",
        "<size memory='100G' nkey='100000000' nuserdata='1000000000' nuser_site='500000000'/>",
        "<size njmax='100000000' nconmax='100000000'/>",
    ],
    ids=["texture", "files", "size", "contacts"],
)
def test_meshes_and_pictures_of_an_mjcf_are_not_read(gfimu_command, tmp_path, content):
    sites = "".join(f"<site name='a{k}' pos='{k} 0 0'/>" for k in range(3))
    (tmp_path / "model.xml").write_text(
        f"<mujoco>{content}<worldbody><body><geom size='1'/>{sites}</body></worldbody></mujoco>"
    )
    assert "array 'model' (rank 1 of 6, 3 channels) can't see" in gfimu_command("score", tmp_path / "model.xml").stderr


@pytest.mark.parametrize("name", ["../other/part.xml", "/dev/zero", "pipe.xml"])
@pytest.mark.parametrize("taken", ["<include file='{}'/>", "<asset><model name='m' file='{}'/></asset>"])
def test_an_mjcf_takes_in_files_of_its_own_folder_only(gfimu_command, tmp_path, name, taken):
    for folder in ("mine", "other"):
        (tmp_path / folder).mkdir()
    (tmp_path / "other/part.xml").write_text("<mujoco><worldbody><site name='a1'/></worldbody></mujoco>")
    os.mkfifo(tmp_path / "mine/pipe.xml")
    (tmp_path / "mine/model.xml").write_text(f"<mujoco>{taken.format(name)}</mujoco>")
    result = gfimu_command("score", tmp_path / "mine/model.xml")
    assert result.code == 2
    assert "lies in another folder" in result.stderr or "is no ordinary file" in result.stderr


def test_a_short_campaign_of_mutated_inputs(project_root, tmp_path):
    """All readers, some inputs of each; the long one is `python -m tests.fuzz --count 100000`."""
    command = [sys.executable, "-m", "tests.fuzz", "--count", "150", "--seed", "7", "--keep", str(tmp_path / "failed")]
    done = subprocess.run(command, cwd=project_root, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "150 inputs, 0 kinds of failures" in done.stdout
