"""Whatever goes wrong ends in one line on standard error; nothing half-written stays; text is never markup."""

from __future__ import annotations

import errno
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest

import gfimu
import gfimu.commands.score
from gfimu import GfimuError, WriteError
from gfimu.base.files.atomic_file import atomic_path, write_text
from gfimu.commands.shell import output

PROGRAM = [sys.executable, "-c", "from gfimu.commands.shell.program import main; main()"]


def one_line(result, *words):
    assert result.stderr.count("\n") == 1, result.stderr
    assert result.stderr.startswith("gfimu: ")
    assert "Traceback" not in result.stderr
    assert all(word in result.stderr for word in words), result.stderr


@pytest.fixture
def broken(monkeypatch, tmp_path):
    """`gfimu score` with a bug in it."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))

    def fail(*_, **__):
        raise ZeroDivisionError("first line\nsecond [line]")

    monkeypatch.setattr(gfimu.commands.score, "as_array", fail)
    monkeypatch.delenv("GFIMU_DEBUG", raising=False)


def test_an_unforeseen_error_is_one_line_and_a_file_to_attach(gfimu_command, broken):
    result = gfimu_command("score", "cube12")
    assert result.code == 1
    one_line(result, "unexpected ZeroDivisionError", "first line second [line]", "--debug")
    (file,) = Path(tempfile.gettempdir()).glob("gfimu-error-*.txt")
    assert str(file) in result.stderr
    attached = file.read_text()
    assert "arguments: ['score', 'cube12']" in attached
    assert 'raise ZeroDivisionError("first line' in attached


@pytest.mark.parametrize("arguments", [("--debug", "score", "cube12"), ("score", "cube12", "--debug")])
def test_debug_shows_where_it_came_from(gfimu_command, broken, arguments):
    result = gfimu_command(*arguments)
    assert result.code == 1
    assert "Traceback" in result.stderr
    assert 'raise ZeroDivisionError("first line' in result.stderr


def test_debug_by_the_environment(gfimu_command, broken, monkeypatch):
    monkeypatch.setenv("GFIMU_DEBUG", "1")
    assert "Traceback" in gfimu_command("score", "cube12").stderr
    monkeypatch.setenv("GFIMU_DEBUG", "0")
    one_line(gfimu_command("score", "cube12"))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("scroe",), ["No such command 'scroe'", "gfimu --help"]),
        (("score", "--nosuch"), ["--nosuch", "gfimu score --help"]),
        (("simulate", "rest"), ["--out", "gfimu simulate --help"]),
        (("simulate", "rest", "--out", "x.csv", "--seed", "[red]"), ["--seed"]),
    ],
)
def test_a_wrong_call_is_one_line_and_code_2(gfimu_command, arguments, words):
    result = gfimu_command(*arguments)
    assert result.code == 2
    one_line(result, *words)


def test_ctrl_c_is_one_line(gfimu_command, monkeypatch):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(gfimu.commands.score, "as_array", interrupt)
    result = gfimu_command("score", "cube12")
    assert (result.code, result.stderr) == (130, "gfimu: interrupted\n")


def test_no_argument_shows_the_help(gfimu_command):
    result = gfimu_command()
    assert result.code == 2
    assert "Usage: gfimu" in result.stdout


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
@pytest.mark.parametrize("form", [(), ("--json",)])
def test_a_full_disk_behind_standard_output(form):
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [*PROGRAM, "score", "cube12", *form], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert done.returncode == 2
    assert done.stderr.startswith("gfimu: standard output: No space left on device")
    assert done.stderr.count("\n") == 1


@pytest.fixture
def full_disk():
    """A limit of the operating system on the size of files, which stops a write as a full disk does."""
    resource = pytest.importorskip("resource")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (3000, hard))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


WRITERS = [
    ("simulate", "rest", "--set", "duration_s=3", "--out", "made.csv"),
    ("simulate", "rest", "--set", "duration_s=3", "--out", "made.parquet"),
    ("convert", "in.csv", "made.csv"),
    ("estimate", "in.csv", "--out", "made.parquet"),
    ("view", "in.csv", "--out", "made.rrd"),
    ("noise", "in.csv", "--stretch", "all", "--picture", "made.png"),
    ("firmware", "build", "selfcheck", "--out", "made"),
]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A short recording."""
    file = tmp_path_factory.mktemp("recorded") / "in.csv"
    gfimu.simulate("rest", changes=["duration_s=3"], out=file)
    # Both compile what the tests below must not compile under a limit.
    gfimu.estimate(file)
    gfimu.noise(file, stretch="all")
    return file


@pytest.mark.parametrize("arguments", WRITERS, ids=lambda words: f"{words[0]} {Path(words[-1]).suffix}")
def test_a_full_disk_leaves_nothing_behind(gfimu_command, tmp_path, monkeypatch, recorded, request, arguments):
    if arguments[0] == "firmware":
        pytest.importorskip("ziglang")
        monkeypatch.setattr("firmware_bridge.lpc1768.build._zig", _linked)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "in.csv").write_bytes(recorded.read_bytes())
    if arguments[0] == "noise":
        import matplotlib.pyplot  # noqa: F401, ICN001  its font cache is written on the first import
    request.getfixturevalue("full_disk")
    result = gfimu_command(*arguments)
    assert result.code == 1, result
    one_line(result, "made", "File too large", "free space")
    assert [file.name for file in tmp_path.rglob("*") if file.is_file()] == ["in.csv"]


def _linked(*arguments, cwd):
    """Stand in for the compiler: the committed image."""
    from firmware_bridge import image_path

    if "-o" not in arguments:
        return "0.16"
    Path(arguments[arguments.index("-o") + 1]).symlink_to(image_path("selfcheck"))
    return ""


def test_an_atomic_write_that_fails_keeps_what_was_there(tmp_path, monkeypatch):
    file = tmp_path / "kept.txt"
    file.write_text("kept")

    def full(*_, **__):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Path, "write_text", full)
    with pytest.raises(WriteError, match=r"kept\.txt: not written: No space left on device") as caught:
        write_text(file, "new")
    assert isinstance(caught.value, GfimuError)
    assert isinstance(caught.value, OSError)
    assert caught.value.errno == errno.ENOSPC
    assert file.read_text() == "kept"
    assert list(tmp_path.iterdir()) == [file]


def test_a_check_that_fails_is_code_1(gfimu_command, monkeypatch):
    pytest.importorskip("firmware_bridge.loop.selftest")
    from firmware_bridge.loop.selftest import SelfTestReport, SelfTestRow

    report = SelfTestReport((SelfTestRow("chips", False, "[nothing]"),))
    monkeypatch.setattr("firmware_bridge.loop.selftest.run_selftest", lambda: report)
    result = gfimu_command("firmware", "selftest")
    assert (result.code, result.stderr) == (1, "")
    assert "[nothing]" in result.stdout


@pytest.mark.skipif(sys.platform == "win32", reason="no such file names")
def test_a_terminal_without_greek_and_a_name_that_is_no_text(tmp_path):
    name = os.fsdecode(b"caf\xe9.toml")
    (tmp_path / name).write_text(gfimu.AccelerometerArray.load("cube12").to_toml())
    environment = {**os.environ, "PYTHONIOENCODING": "ascii:strict"}
    done = subprocess.run([*PROGRAM, "score", name], cwd=tmp_path, env=environment, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stderr == b""
    done = subprocess.run(
        [*PROGRAM, "convert", name, name], cwd=tmp_path, env=environment, capture_output=True, check=False
    )
    assert done.returncode == 2
    assert done.stderr.count(b"\n") == 1


def test_an_error_of_the_system_names_its_file(gfimu_command, monkeypatch):
    def unreadable(*_, **__):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), "some/file")

    monkeypatch.setattr(gfimu.commands.score, "as_array", unreadable)
    result = gfimu_command("score")
    assert (result.code, result.stderr) == (2, "gfimu: some/file: Permission denied\n")


def test_no_folder_is_made_for_a_file(tmp_path):
    with pytest.raises(gfimu.InputError, match="there is no folder"), atomic_path(tmp_path / "typo" / "file.txt"):
        pass
    with pytest.raises(gfimu.InputError, match="is a directory"):
        write_text(tmp_path, "text")
    assert list(tmp_path.iterdir()) == []


TRICKY = "[red]x[/red].csv"


def test_a_name_with_brackets_is_printed_as_it_is(gfimu_command, tmp_path, monkeypatch, recorded):
    monkeypatch.chdir(tmp_path)
    Path(TRICKY).parent.mkdir(exist_ok=True)
    Path(TRICKY).write_bytes(recorded.read_bytes())
    result = gfimu_command("convert", TRICKY, "[bold]y.csv")
    assert result.code == 0, result.stderr
    assert TRICKY in result.stdout
    assert "[bold]y.csv" in result.stdout
    one_line(gfimu_command("convert", "[/nothing].csv", "y.csv"), "[/nothing].csv: no such file")


def test_text_of_files_with_brackets_is_printed_as_it_is(gfimu_command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    cube = gfimu.AccelerometerArray.load("cube12").to_toml()
    Path("array.toml").write_text(cube.replace('name = "cube12"', 'name = "[blink]z[/nope]"'))
    result = gfimu_command("score", "array.toml")
    assert result.code == 0, result.stderr
    assert "[blink]z[/nope]" in result.stdout.replace("\n", "")
    Path("s.toml").write_text(
        'name = "a[/b]"\ndescription = "[/red] :boom:"\narray = "cube12"\nduration_s = 1.0\n[motion]\nkind = "rest"\n'
    )
    result = gfimu_command("simulate", "s.toml", "--out", "run.csv")
    assert result.code == 0, result.stderr
    assert "a[/b]" in result.stdout
    assert "[/red] :boom:" in result.stdout


def test_a_progress_bar_takes_no_markup(capsys, monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TTY_COMPATIBLE", "1")
    with output.progress("[/red] going", total=1.0) as done:
        done(0.5, "[/x] on")
    output.print_text("[/red]")
    output.print_table("[/t]", ["[/h]"], [["[/c]"], [np.float64(1.5)]], note="[/n]")
    printed = capsys.readouterr().out
    assert all(text in printed for text in ("[/red]", "[/t]", "[/h]", "[/c]", "[/n]", "1.5"))


@pytest.mark.parametrize(
    ("arguments", "kind", "message"),
    [
        (("score", "nope"), "InputError", "unknown array 'nope'"),
        (("inspect", "nothing.csv"), "InputError", "nothing.csv: no such file"),
        (("scor",), "UsageError", "No such command 'scor'"),
        (("score", "one_chip", "--speed-rad-s", "fast"), "BadParameter", "Invalid value for '--speed-rad-s'"),
    ],
)
def test_for_machines_an_error_is_an_object_too(gfimu_command, arguments, kind, message):
    result = gfimu_command(*arguments, "--json")
    assert result.code == 2
    error = json.loads(result.stdout)["error"]
    assert (error["kind"], error["exit_code"]) == (kind, 2)
    assert message in error["message"]
    assert result.stderr == f"gfimu: {error['message']}\n"
    assert gfimu_command(*arguments).stdout == ""
