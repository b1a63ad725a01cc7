"""Ctrl-C and SIGTERM on real processes: one line, the shell's exit code, no traceback, nothing half-written."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import gfimu
from gfimu.recording import Recording

pytestmark = pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="no such signals here")

TAKES_CTRL_C = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); "
"""A background job of a shell ignores SIGINT; a process of these tests does not."""

PROGRAM = TAKES_CTRL_C + "from gfimu.commands.shell.program import main; main()"

BEGUN = (
    TAKES_CTRL_C
    + """
import sys, time
from gfimu.commands.shell import output
usual, output._LINE_S = output.progress, 1e6
import contextlib
@contextlib.contextmanager
def progress(*words, **more):
    print("begun", file=sys.stderr, flush=True)
    with usual(*words, **more) as done:
        yield done
output.progress = progress
from gfimu.commands.shell.program import main
main()
"""
)
"""The program, with a word on standard error where the work begins."""

PLAN = """
repeats = 200
batch = 1
[factors]
scenario = ["paper_run"]
method = ["integrate"]
duration_s = [6.0]
"""

CALLS = {
    "estimate": "long.parquet --method smoother --array cube12 --out made.parquet",
    "simulate": "paper_run --set duration_s=20000 --set sample_rate_hz=1000 --max-memory 30GB --out made.parquet",
    "noise": "long.parquet --stretch all --kalibr made.yaml",
    "optimize": "--chips 12 --restarts 5000 --objective fault --out made.toml",
    "calibrate": "array poses.parquet --motion long.parquet --out made.json",
    "tolerance": "cube12 --units 50000 --workers 2 --picture made.png",
    "drift": "--bias-mg 1 --monte-carlo 5000 --duration 30",
    "design": "tacho_scale gravity --twin cube12_turntable --evaluations 100000 --out made.toml",
    "campaign": "plan.toml --out made --workers 2",
}
"""Long calls of commands, by name."""


@pytest.fixture(scope="module")
def here(tmp_path_factory):
    """A folder with a long recording, poses and a plan."""
    folder = tmp_path_factory.mktemp("stopped")
    run = gfimu.simulate("paper_run", seed=1)
    n = 100
    t = np.arange(n * len(run.t_s)) / 100.0
    cube = gfimu.AccelerometerArray.load("cube12")
    Recording(t, np.tile(run.readings, (n, 1)), run.channels).carrying(cube).write(folder / "long.parquet")
    gfimu.simulate("calibration_poses", out=folder / "poses.parquet")
    (folder / "plan.toml").write_text(PLAN)
    return folder


def stopped(folder, words, number, *, after=1.0, group=True):
    """Start a call, send a signal some time after its work began; return exit code, output and error."""
    process = subprocess.Popen(
        [sys.executable, "-c", BEGUN, *words],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert process.stderr.readline() == "begun\n"
    time.sleep(after)
    assert process.poll() is None, process.communicate()
    if group:  # as a terminal does, workers included
        os.killpg(process.pid, number)
    else:
        process.send_signal(number)
    try:
        out, error = process.communicate(timeout=60)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        raise
    return process.returncode, out, error


def whole(folder):
    """Refuse half-written files."""
    assert not list(folder.rglob(".gfimu-*"))
    assert not list(folder.glob("made.*"))


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_that_a_library_of_c_swallows_is_sent_again(number):
    script = TAKES_CTRL_C + (
        "import ctypes, time\n"
        "from gfimu.commands.shell.stop_signals import stop_signals\n"
        f"callback = ctypes.CFUNCTYPE(None)(lambda: signal.raise_signal({int(number)}))\n"
        "with stop_signals() as stop:\n"
        "    try:\n"
        "        callback()\n"
        "        time.sleep(10)\n"
        "        print('went on')\n"
        "    except KeyboardInterrupt:\n"
        "        print(stop.code)\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == (f"{128 + number}\n", "")


@pytest.mark.parametrize("error", [SystemError("error return"), ImportError("initialization failed")])
def test_ctrl_c_while_compiled_code_runs_or_starts_is_the_cause_of_its_error(error):
    from gfimu.commands.shell.stop_signals import Stop

    stop = Stop()
    assert not stop.is_cause_of(error)
    with pytest.raises(KeyboardInterrupt):
        stop(signal.SIGINT, None)
    assert stop.is_cause_of(error)
    assert not stop.is_cause_of(OSError("disk full"))
    assert not stop.is_cause_of(SystemExit(2))


@pytest.mark.parametrize("name", CALLS)
def test_ctrl_c(here, name):
    code, out, error = stopped(here, [name, *CALLS[name].split()], signal.SIGINT)
    assert (code, out, error) == (130, "", "gfimu: interrupted\n")
    whole(here)


@pytest.mark.parametrize("name", ["estimate", "tolerance", "campaign", "drift"])
def test_sigterm(here, name):
    code, out, error = stopped(here, [name, *CALLS[name].split()], signal.SIGTERM, group=False)
    assert (code, out, error) == (143, "", "gfimu: terminated\n")
    whole(here)


def test_ctrl_c_for_machines(here):
    code, out, error = stopped(here, ["drift", *CALLS["drift"].split(), "--json"], signal.SIGINT)
    fault = {"kind": "Interrupted", "message": "interrupted", "exit_code": 130}
    assert (code, json.loads(out), error) == (130, {"error": fault}, "gfimu: interrupted\n")


def test_a_campaign_goes_on_where_it_was_ended(here, gfimu_command):
    stopped(here, ["campaign", "plan.toml", "--out", "more", "--workers", "1"], signal.SIGINT, after=8.0)
    found = json.loads(gfimu_command("campaign", "status", here / "more", "--json").stdout)
    assert 0 <= found["done"] < found["cases"]
    assert found["failures"] == {}


def test_ctrl_c_ends_a_stream_of_samples(here):
    process = subprocess.Popen(
        [sys.executable, "-c", PROGRAM, "live", "--array", "cube12", "--rate", "100"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    names = [f"a{chip}{axis}_m_s2" for chip in range(1, 5) for axis in range(1, 4)]
    process.stdin.write(",".join(["t_s", *names]) + "\n")
    for k in range(400):
        process.stdin.write(f"{k / 100}," + ",".join(["0.0", "0.0", "9.8"] * 4) + "\n")
    process.stdin.flush()
    assert json.loads(process.stdout.readline())["t_s"] == 0.0
    process.send_signal(signal.SIGINT)
    out, error = process.communicate(timeout=60)
    assert (process.returncode, error) == (130, "gfimu: interrupted\n")
    assert all(json.loads(line) for line in out.splitlines())


def test_ctrl_c_ends_a_recording_and_the_board_behind_it_in_order(tmp_path):
    pytest.importorskip("unicorn")
    usual = {
        "stdout": subprocess.PIPE,
        "stderr": subprocess.PIPE,
        "text": True,
        "cwd": tmp_path,
        "start_new_session": True,
    }
    served = ["firmware", "run", "--scenario", "rest", "--port", "pty", "--duration", "300", "--json"]
    board = subprocess.Popen([sys.executable, "-c", PROGRAM, *served], **usual)
    port = board.stderr.readline().split()[2].rstrip(";")
    words = ["record", "--port", port, "--out", "run.csv", "--array", "cube12", "--json"]
    recorder = subprocess.Popen([sys.executable, "-c", PROGRAM, *words], **usual)
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and (not (tmp_path / "run.csv").exists() or len(_lines(tmp_path)) < 100):
        time.sleep(0.2)
    os.killpg(recorder.pid, signal.SIGINT)
    out, error = recorder.communicate(timeout=60)
    assert recorder.returncode == 0, error
    assert json.loads(out)["stream"]["samples"] >= 50
    assert len(Recording.read(tmp_path / "run.csv")) >= 50
    os.killpg(board.pid, signal.SIGINT)
    out, error = board.communicate(timeout=60)
    assert board.returncode == 0, error
    assert json.loads(out)["sent"] > 0
    assert "Traceback" not in error


def _lines(folder):
    return (folder / "run.csv").read_text().splitlines()
