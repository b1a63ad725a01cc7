"""On a terminal: progress, colour, width. In a pipe: neither, and silence when the reader leaves."""

from __future__ import annotations

import contextlib
import dataclasses
import os
import re
import select
import subprocess
import sys
import time

import numpy as np
import pytest

import gfimu
from gfimu import load_map
from gfimu.base import markdown
from gfimu.commands import print_table

pty = pytest.importorskip("pty")
fcntl = pytest.importorskip("fcntl")
termios = pytest.importorskip("termios")

PROGRAM = [sys.executable, "-c", "from gfimu.commands.shell.program import main; main()"]
LONG = ("drift", "--bias-mg", "10", "--duration", "20", "--monte-carlo", "60")
CODE = re.compile(rb"\x1b\[")


def on_terminal(*words, columns=80, **environment):
    """Run the program with standard output and error on a pseudo-terminal; return exit code and what it shows."""
    master, slave = pty.openpty()
    termios.tcsetwinsize(slave, (40, columns))
    kept = {key: value for key, value in os.environ.items() if key not in {"COLUMNS", "NO_COLOR", "FORCE_COLOR"}}
    process = subprocess.Popen(
        [*PROGRAM, *words], stdout=slave, stderr=slave, stdin=slave, env={**kept, "TERM": "xterm", **environment}
    )
    os.close(slave)
    shown = b""
    while True:
        if select.select([master], [], [], 0.1)[0]:
            try:
                piece = os.read(master, 65536)
            except OSError:
                break
            if not piece:
                break
            shown += piece
        elif process.poll() is not None:
            break
    os.close(master)
    return process.wait(), shown


def in_pipe(*words, **environment):
    return subprocess.run(
        [*PROGRAM, *words], capture_output=True, env={**os.environ, **environment}, check=False, timeout=300
    )


def test_a_terminal_shows_progress_and_clears_it():
    code, shown = on_terminal(*LONG)
    assert code == 0
    assert b"Monte Carlo" in shown
    assert "━".encode() in shown
    assert CODE.search(shown)
    assert b"\x1b[2K" in shown  # the bar is cleared at the end


def test_a_pipe_shows_neither_progress_nor_colour():
    done = in_pipe(*LONG)
    assert done.returncode == 0
    assert all(line.startswith(b"gfimu: drift") for line in done.stderr.splitlines())  # of a slow machine, every 10 s
    assert not CODE.search(done.stdout + done.stderr)
    assert b"Monte Carlo," in done.stdout  # the row of the table


def test_json_on_a_terminal_is_json_beside_the_progress():
    _, shown = on_terminal(*LONG, "--json")
    text = re.sub(rb"\x1b\[[0-9;?]*[A-Za-z]", b"", shown).decode()
    assert '"relative_sampling_error"' in text


def test_no_color_is_honoured():
    code, shown = on_terminal("score", "cube12", NO_COLOR="1")
    assert code == 0
    assert not re.search(rb"\x1b\[[0-9;]*3[0-9]m", shown)


@pytest.mark.parametrize("columns", [40, 80])
@pytest.mark.parametrize(
    "words",
    [
        ("score", "cube12", "p3_three_plus_one"),
        ("list", "effects"),
        ("drift", "--bias-mg", "10"),
    ],
    ids=lambda words: words[0],
)
def test_a_table_fits_the_terminal(columns, words):
    code, shown = on_terminal(*words, columns=columns)
    assert code == 0
    text = re.sub(rb"\x1b\[[0-9;?]*[A-Za-z]", b"", shown).decode()
    rows = [line for line in text.replace("\r", "").splitlines() if line.startswith(("│", "┃", "┏", "└", "┡"))]
    assert rows or columns == 40
    assert max(map(len, rows), default=0) <= columns
    assert "…" not in "".join(rows)  # folded, not cut


def test_a_wide_table_on_a_narrow_terminal_breaks_no_number():
    code, shown = on_terminal("score", "cube12", columns=40)
    assert code == 0
    text = re.sub(rb"\x1b\[[0-9;?]*[A-Za-z]", b"", shown).decode().replace("\r", "")
    assert "array: cube12\n  axes: 12\n  κ(J): 1.4142\n" in text


def test_no_word_of_a_table_is_broken_where_another_column_can_wrap(capsys, monkeypatch):
    """Seven columns for 80 characters: the words of the last one go to several lines, file name and rates to none."""
    monkeypatch.setenv("COLUMNS", "80")
    header = ("run", "length", "rate", "fastest", "acceleration", "turns", "forwards / backwards / rest")
    row = ("clean.parquet", "59.99 s", "100 Hz", "12 rad/s", "25.8 rad/s²", "22", "51 / 32 / 16 %")
    print_table("Recordings", header, [row])
    shown = capsys.readouterr().out
    assert max(map(len, shown.splitlines())) <= 80
    for word in " ".join([*header, *row]).split():
        assert word in shown, word


@pytest.mark.parametrize("words", [("list", "effects"), ("--help",), ("show", "adxl355"), ("schema", "diagnose")])
def test_a_reader_that_leaves_ends_the_program_in_silence(words):
    read, write = os.pipe()
    process = subprocess.Popen([*PROGRAM, *words], stdout=write, stderr=subprocess.PIPE)
    os.close(write)
    os.close(read)
    assert process.communicate(timeout=60)[1] == b""
    assert process.returncode in {0, 141}


@pytest.mark.parametrize(
    "environment",
    [{"PYTHONIOENCODING": "ascii"}, {"LC_ALL": "C", "LANG": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}],
)
@pytest.mark.parametrize(
    "words", [("score", "cube12"), ("score", "Ω"), ("estimate", "--help"), ("--help",), ("score", "cube12", "--json")]
)
def test_a_plain_encoding_is_no_error(words, environment):
    done = in_pipe(*words, **environment)
    assert done.returncode == (2 if "Ω" in words else 0)
    assert b"UnicodeEncodeError" not in done.stderr
    if "--help" not in words:  # help is written as UTF-8 where the encoding can't hold it
        (done.stdout + done.stderr).decode("ascii")


def test_a_command_without_work_shows_no_bar_in_a_pipe_and_loads_no_rich():
    code = """
import sys
from gfimu.commands.shell.output import progress
with progress("working", total=1.0) as done:
    done(0.5)
assert not [name for name in sys.modules if name.startswith("rich")]
"""
    subprocess.run([sys.executable, "-c", code], stderr=subprocess.PIPE, check=True)


def test_long_work_in_a_pipe_says_at_times_how_far_it_is():
    code = """
import time
from gfimu.commands.shell import output
output._LINE_S = 0.2
with output.progress("working", total=2.0) as done:
    done(0.5, "on the first half")
    time.sleep(0.7)
with output.progress("looking") as done:
    time.sleep(0.3)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    lines = done.stderr.splitlines()
    assert done.stdout == ""
    assert lines[0].startswith("gfimu: working: 25 %, ")
    assert lines[0].endswith(" s: on the first half")
    assert lines[-1] == "gfimu: looking: 0 s"
    assert 3 <= len(lines) <= 5


def test_progress_names_what_is_done():
    began = time.monotonic()
    with contextlib.suppress(subprocess.TimeoutExpired):
        code, shown = on_terminal("optimize", "--chips", "4", "--restarts", "2")
        assert code == 0
        assert b"searching arrays" in shown
    assert time.monotonic() - began < 120


EVIL = "e\x1b[31mv\x1b]0;i\x07\x9b2J\u202el\u2066<script>x</script>[red]q[/red][link=http://x]\r\n$x_1"
SHOWN = r"e\u001b[31mv\u001b]0;i\u0007\u009b2J\u202el\u2066<script>x</script>[red]q[/red][link=http://x]"
STEERS = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u200b-\u200f\u2028-\u202e\u2066-\u2069]")
PRINTING = [
    "score evil.toml",
    "show evil.toml",
    "drift --array evil.toml --bias-mg 1",
    "inspect evil.csv",
    "inspect evil.csv --json",
    "estimate run.csv --array evil.toml --out e.csv --json",
    "noise evil\x1b[31m\u202e.csv",
    "score evil\x1b[31m\u202e\nx.toml",
    "score \x1b[31m\u202e",
    "score --\x1b[31m\u202e",
    "\x1b[31m\u202e",
]


@pytest.fixture
def evil(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    array = dataclasses.replace(gfimu.AccelerometerArray.load("cube12"), name=EVIL, description=EVIL)
    (tmp_path / "evil.toml").write_text(array.to_toml())
    gfimu.simulate("rest", seed=1, changes=["duration_s=3"], out="run.csv")
    names = ["time [s]", *(f"{EVIL.replace(chr(7), '')} acc {axis} [m/s²]".replace("\r\n", "") for axis in "XYZ")]
    rows = "".join(f"{k / 100},{np.sin(k)},{np.cos(k)},9.81\n" for k in range(400))
    (tmp_path / "evil.csv").write_text(",".join(names) + "\n" + rows)
    (tmp_path / "evil\x1b[31m\u202e.csv").write_text("t_s,a\x1b[31m11_m_s2\n0,1\n")
    return array


@pytest.mark.parametrize("words", PRINTING)
def test_names_do_not_steer_the_terminal(gfimu_command, evil, words):
    result = gfimu_command(*words.split(" "))
    assert not STEERS.search(result.stdout + result.stderr)
    assert result.code in {0, 2}
    assert r"\u202e" in re.sub(r"[\s│]", "", result.stdout + result.stderr)


def test_a_terminal_shows_names_escaped(evil):
    code, shown = on_terminal("score", "evil.toml", columns=240)
    assert code == 0
    assert SHOWN.encode() in re.sub(rb"\x1b\[[0-9;]*m", b"", shown)


def test_names_do_not_steer_pages_and_pictures(evil):
    for text in (evil._repr_html_(), gfimu.score(evil)._repr_html_()):
        assert "&lt;script&gt;" in text
        assert "<script" not in text
        assert not STEERS.search(text)
    assert markdown(EVIL + "![](http://x)").text.as_arrow_array()[0].as_py().count(r"\[") == 5
    gfimu.convert("evil.toml", "evil.xml")
    assert gfimu.score("evil.xml")[0].null_space_rank == 6
    found = gfimu.inspect("evil.csv", out="map.toml")
    assert load_map("map.toml") == found.column_map
