"""Bad input ends with one line that says what is wrong, exit code 2, no traceback and no output file."""

import contextlib
import shutil
import subprocess
import sys

import numpy as np
import pytest

from gfimu import AccelerometerArray, Recording
from tests.fuzz import commands as bad

_BY_LOT = 6

CUBE = AccelerometerArray.load("cube12")
HEADER = "t_s," + ",".join(f"{channel}_m_s2" for channel in CUBE.channels)


def row(t, *first):
    return ",".join(map(str, (t, *first, *[0.5] * (12 - len(first)))))


def table(*rows, header=HEADER):
    return "\n".join((header, *rows)) + "\n"


GOOD = table(*(row(k / 100) for k in range(5)))

BAD_RUNS = {
    "missing column": (table("0,1", "1,1", header="t_s,a11_m_s2"), ["a12_m_s2", "missing"]),
    "missing time": (GOOD.replace("t_s", "time"), ["t_s", "missing"]),
    "wrong unit": (GOOD.replace("a22_m_s2", "a22_ft_s2"), ["a22_ft_s2", "a22_m_s2, a22_g, a22_mg, a22_lsb"]),
    "wrong unit of the tacho": (table(row(0) + ",1", header=f"{HEADER},tacho_hz"), ["tacho_hz", "tacho_rad_s"]),
    "time backwards": (table(row(0), row(0.02), row(0.01)), ["line 4", "does not increase"]),
    "time missing": (table(row(0), row("nan"), row(0.02)), ["line 3", "t_s is missing"]),
    "text in a number": (table(row(0), row(0.01, "off")), ["line 3", "a11_m_s2", "'off'"]),
    "huge values": (table(row(0), *(row(k, *[1e30] * 12) for k in (1, 2))), ["line 3", "a11_m_s2", "1e+30", "unit"]),
    "infinite values": (table(row(0), *(row(k, *["inf"] * 12) for k in (1, 2))), ["line 3", "a11_m_s2", "inf"]),
    "cut off": (GOOD + "0.06,1,2\n", ["line 7", "3 columns"]),
    "column twice": (table(row(0) + ",1", header=f"{HEADER},a11_m_s2"), ["a11_m_s2", "twice"]),
    "channel twice": (table(row(0) + ",1", header=f"{HEADER},a11_g"), ["a11_m_s2", "a11_g", "keep one"]),
    "empty": ("", ["empty file"]),
    "header only": (HEADER + "\n", ["no samples"]),
    "one sample": (table(row(0)), ["fewer than two samples"]),
    "all readings missing": (table(*(row(k, *[""] * 12) for k in range(3))), ["no sample has enough channels"]),
    "binary junk": (bytes(np.random.default_rng(0).integers(0, 256, 5000, dtype=np.uint8)), ["binary data"]),
    "parquet cut off": (b"PAR1" + bytes(100), ["damaged Parquet"]),
    "gzip that is no stream": (b"\x1f\x8b" + bytes(100), ["binary data"]),
}


def assert_refused(result, *words):
    assert result.code == 2, result
    assert result.stderr.count("\n") == 1
    assert result.stderr.startswith("gfimu: ")
    assert "Traceback" not in result.stderr + result.stdout
    for word in words:
        assert word in result.stderr, result.stderr
    assert result.stdout == ""


@pytest.mark.parametrize(("content", "words"), BAD_RUNS.values(), ids=BAD_RUNS)
def test_bad_recording(gfimu_command, tmp_path, content, words):
    run = tmp_path / "run.csv"
    run.write_bytes(content if isinstance(content, bytes) else content.encode())
    result = gfimu_command("estimate", run, "--array", "cube12", "--out", tmp_path / "estimate.parquet")
    assert_refused(result, *words)
    assert [file.name for file in tmp_path.iterdir()] == ["run.csv"]


GOOD_VARIANTS = {
    "as it is": GOOD,
    "line ends of Windows": GOOD.replace("\n", "\r\n"),
    "byte order mark": "\ufeff" + GOOD,
    "a reading missing": table(*(row(k / 100, "" if k == 2 else 1) for k in range(5))),
    "a reading NaN": table(*(row(k / 100, "NaN" if k == 2 else 1) for k in range(5))),
    "unknown column": table(*(row(k / 100) + ",x" for k in range(5)), header=f"{HEADER},remark"),
    "columns in another order": table(
        *(f"{row(k)[2:]},{k / 100}" for k in range(5)), header=f"{HEADER.removeprefix('t_s,')},t_s"
    ),
}


@pytest.mark.parametrize("content", GOOD_VARIANTS.values(), ids=GOOD_VARIANTS)
def test_odd_but_good_recording(gfimu_command, tmp_path, content):
    run = tmp_path / "run.csv"
    run.write_bytes(content.encode())
    result = gfimu_command("estimate", run, "--array", "cube12", "--out", tmp_path / "estimate.csv")
    assert result.code == 0, result.stderr
    assert len((tmp_path / "estimate.csv").read_text().splitlines()) >= 6


CHIP = "[[chip]]\nposition_m = [0.1, 0, 0]\naxes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n"
BAD_ARRAYS = {
    "no chip": ("name = 'x'\n", ["no [[chip]]"]),
    "not TOML": ("[[chip\n", ["not valid TOML"]),
    "unknown key": ("colour = 'red'\n" + CHIP, ["unknown key 'colour'"]),
    "unknown chip key": (CHIP + "mass_kg = 1\n", ["[[chip]] 1", "unknown key 'mass_kg'"]),
    "no position": ("[[chip]]\naxes = [[1, 0, 0]]\n", ["position_m", "missing"]),
    "text for a position": (CHIP.replace("[0.1, 0, 0]", "'here'"), ["position_m = 'here'", "list of 3 finite numbers"]),
    "axis not of length one": (CHIP.replace("[1, 0, 0]", "[2, 0, 0]"), ["unit vectors"]),
    "position not finite": (CHIP.replace("0.1", "nan"), ["finite"]),
    "same name twice": ((CHIP + "name = 'a1'\n") * 2, ["share a name"]),
    "rank below six": (CHIP, ["can't see angular acceleration", "rank 3 of 6"]),
    "unknown part": (CHIP + "part = 'abc1'\n", ["unknown part 'abc1'", "adxl345"]),
}


@pytest.mark.parametrize(("content", "words"), BAD_ARRAYS.values(), ids=BAD_ARRAYS)
def test_bad_array_file(gfimu_command, tmp_path, content, words):
    (tmp_path / "run.csv").write_text(GOOD)
    (tmp_path / "array.toml").write_text(content)
    if "part" in words[0]:  # the geometry has to be sound for the part to matter
        (tmp_path / "array.toml").write_text(CUBE.to_toml().replace("adxl345", "abc1"))
    out = tmp_path / "estimate.csv"
    result = gfimu_command("estimate", tmp_path / "run.csv", "--array", tmp_path / "array.toml", "--out", out)
    assert_refused(result, *words)
    assert not out.exists()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--array", "cube13"], ["unknown array 'cube13'", "cube12, cube12_as_built"]),
        (["--array", "nowhere/cube.toml"], ["nowhere/cube.toml", "no such file"]),
        (["--array", "mimu4444"], ["m11_m_s2", "missing"]),
        ([], ["does not name its array", "--array"]),
        (["--array", "cube12", "--method", "magic"], ["unknown method 'magic'", "integrate"]),
        (["--array", "cube12", "--form", "magic"], ["unknown form 'magic'", "joint"]),
        (["--array", "cube12", "--out", "estimate.xls"], [".xls", "use .csv or .parquet"]),
    ],
)
def test_bad_option(gfimu_command, tmp_path, monkeypatch, options, words):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "run.csv").write_text(GOOD)
    result = gfimu_command("estimate", "run.csv", "--out", "estimate.parquet", *options)
    assert_refused(result, *words)
    assert [file.name for file in tmp_path.iterdir()] == ["run.csv"]


def test_mjcf_without_sites(gfimu_command, tmp_path):
    (tmp_path / "run.csv").write_text(GOOD)
    model = tmp_path / "bare.xml"
    model.write_text("<mujoco><worldbody><body><geom size='0.1'/></body></worldbody></mujoco>")
    out = tmp_path / "estimate.csv"
    result = gfimu_command("estimate", tmp_path / "run.csv", "--array", model, "--out", out)
    assert_refused(result, "bare.xml", "no named site", "add one site per sensing axis")
    assert_refused(gfimu_command("score", model), "bare.xml", "no named site")
    assert not out.exists()


@pytest.mark.parametrize(
    ("scenario", "words"),
    [
        ("papre_run", ["unknown scenario 'papre_run'", "paper_run"]),
        ("missing/run.toml", ["missing/run.toml", "no such file"]),
        ("unknown_key.toml", ["unknown_key.toml", "sample_rate"]),
        ("unknown_motion.toml", ["unknown_motion.toml", "'dance'"]),
    ],
)
def test_bad_scenario(gfimu_command, tmp_path, monkeypatch, scenario, words):
    monkeypatch.chdir(tmp_path)
    good = 'name = "x"\narray = "cube12"\nsample_rate_hz = 100.0\nduration_s = 1.0\n[motion]\nkind = "rest"\n'
    (tmp_path / "unknown_key.toml").write_text(good.replace("sample_rate_hz", "sample_rate"))
    (tmp_path / "unknown_motion.toml").write_text(good.replace("rest", "dance"))
    before = sorted(tmp_path.iterdir())
    assert_refused(gfimu_command("simulate", scenario, "--out", "run.csv"), *words)
    assert sorted(tmp_path.iterdir()) == before


def test_missing_run_and_unwritable_folder(gfimu_command, tmp_path):
    result = gfimu_command("estimate", tmp_path / "no.csv", "--array", "cube12", "--out", tmp_path / "e.csv")
    assert_refused(result, "no.csv", "no such file")
    (tmp_path / "run.csv").write_text(GOOD)
    (tmp_path / "file").write_text("")
    out = tmp_path / "file" / "e.csv"
    result = gfimu_command("estimate", tmp_path / "run.csv", "--array", "cube12", "--out", out)
    assert_refused(result, str(out))


def test_failed_run_leaves_the_old_output_alone(gfimu_command, tmp_path):
    (tmp_path / "run.csv").write_text(table(row(0), row(0)))
    out = tmp_path / "estimate.csv"
    out.write_text("kept")
    assert_refused(gfimu_command("estimate", tmp_path / "run.csv", "--array", "cube12", "--out", out), "line 3")
    assert out.read_text() == "kept"


@pytest.mark.parametrize(("content", "words"), list(BAD_RUNS.values())[7:14], ids=list(BAD_RUNS)[7:14])
def test_convert_refuses_the_same(gfimu_command, tmp_path, content, words):
    run = tmp_path / "run.csv"
    run.write_bytes(content if isinstance(content, bytes) else content.encode())
    assert_refused(gfimu_command("convert", run, tmp_path / "out.parquet"), *words)
    assert [file.name for file in tmp_path.iterdir()] == ["run.csv"]


def test_the_installed_program_ends_with_code_two(tmp_path):
    Recording.from_arrays(np.arange(3.0), np.zeros((3, 12)), CUBE).write(tmp_path / "run.parquet")
    command = [
        sys.executable,
        "-c",
        "from gfimu.commands.shell.program import main; main()",
        "estimate",
        str(tmp_path / "run.parquet"),
    ]
    finished = subprocess.run(
        [*command, "--array", "cube13", "--out", str(tmp_path / "e.csv")], capture_output=True, text=True, check=False
    )
    assert finished.returncode == 2
    assert finished.stdout == ""
    assert finished.stderr.startswith("gfimu: unknown array 'cube13'; valid: ")
    assert finished.stderr.count("\n") == 1


def test_corrupt_values_are_one_line_and_no_end(gfimu_command, tmp_path):
    rows = [row(k / 100, "1e19" if k == 3 else "inf" if k == 4 else 1.0) for k in range(20)]
    (tmp_path / "run.csv").write_text(table(*rows))
    result = gfimu_command("estimate", tmp_path / "run.csv", "--array", "cube12", "--out", tmp_path / "e.csv", "--json")
    assert result.code == 0
    assert result.stderr == (
        f"gfimu: warning: {tmp_path / 'run.csv'}: left out 2 corrupt values (a11 2), the first at line 5, "
        "column a11_m_s2: 1e+19\n"
    )


@pytest.mark.parametrize("command", [("optimize", "--chips", "2"), ("tolerance", "wheel_pair")])
def test_where_no_axis_can_be_given_none_is_proposed(gfimu_command, command):
    result = gfimu_command(*command)
    assert result.code == 2
    assert "rank 5 of 6" in result.stderr
    assert "--axis" not in result.stderr


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("inputs")
    with contextlib.chdir(folder):
        bad.make_inputs(folder)
    return folder


def test_every_command_is_tried():
    assert set(bad.CALLS) == set(bad.commands())


@pytest.mark.parametrize("words", [words for words, call in bad.CALLS.items() if call])
def test_some_bad_inputs_of_a_command(inputs, tmp_path, monkeypatch, words):
    """A few of each command by lot; all of them: ``python -m tests.fuzz --commands``."""
    shutil.copytree(inputs, tmp_path / "here", symlinks=True)
    monkeypatch.chdir(tmp_path / "here")
    every = list(bad.variants(words, bad.commands()[words]))
    for number in np.random.default_rng(len(every)).permutation(len(every))[:_BY_LOT]:
        label, call = every[number]
        assert not bad.complaint(*bad.run(call)), (label, call)


@pytest.mark.parametrize("file", bad.CONTENTS)
def test_some_bad_contents_of_a_file(inputs, tmp_path, monkeypatch, file):
    shutil.copytree(inputs, tmp_path / "here", symlinks=True)
    monkeypatch.chdir(tmp_path / "here")
    every = list(bad.content_variants(file))
    for number in np.random.default_rng(len(every)).permutation(len(every))[:_BY_LOT]:
        label, content = every[number]
        (tmp_path / "here" / file).write_text(content, encoding="utf-8")
        assert not bad.complaint(*bad.run(bad.CONTENTS[file].split())), label
